"""Which export is for which controller: one table for the command, the application and docs/your-controller.md."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from stepdiag.io.outputs import (
    COM_TABLE,
    COMP_FILE,
    COMP_LINES,
    ETALON_TABLE,
    FIRMWARE_COMMAND,
    GRID,
    HAL_LINES,
    HEIDENHAIN_NOTES,
    ISG_TABLE,
    KINEMATICS_TABLE,
    POSITION_ERROR,
    SINUMERIK_TABLE,
    SQUARENESS_TABLE,
    FileKind,
)

LINUXCNC: Final = "in LinuxCNC 2.9"
MANUAL: Final = "written from the manual, not tried on a controller"
SOURCE: Final = "written from the firmware's source, not tried on a machine"
BY_FORMULA: Final = "by formula"


@dataclass(frozen=True)
class ControllerFormat:
    """A format of `export`: what it is, for whom, and how it was tested.

    `options`: besides those of all formats. `file`: its kind; of a folder the files by name instead, `mark` the one
    that shows that stepdiag made it."""

    what: str
    maker: str  # as in `export --to MAKER`; empty: anybody
    controllers: str
    tested: str
    options: tuple[str, ...] = ()
    file: FileKind | None = None
    folder: Mapping[str, FileKind] = field(default_factory=dict)
    mark: str = ""


_AXIS_TABLES: Final = ("approach", "at", "rows", "tables")
_TABLES_OF_HEIDENHAIN: Final = {f"{axis}.com": COM_TABLE for axis in "xyz"}
FORMATS: Final[Mapping[str, ControllerFormat]] = {
    "linuxcnc-kins": ControllerFormat(
        "kinematics module stepdiagkins: all 21 errors",
        "linuxcnc",
        "LinuxCNC",
        LINUXCNC,
        ("approach",),
        KINEMATICS_TABLE,
    ),
    "linuxcnc-comp": ControllerFormat(
        "COMP_FILE of each joint: positioning along three lines, reversal",
        "linuxcnc",
        "LinuxCNC",
        LINUXCNC,
        ("coordinates", "ini", "at", "rows"),
        folder={"compensation.ini": COMP_LINES} | {f"joint{n}.comp": COMP_FILE for n in range(9)},
        mark="compensation.ini",
    ),
    "matrix": ControllerFormat(
        "matrixkins: the best 3x3 matrix", "linuxcnc", "LinuxCNC 2.10", LINUXCNC, ("approach",), HAL_LINES
    ),
    "calibxyzkins": ControllerFormat(
        "calibxyzkins: the best linear and quadratic terms",
        "linuxcnc",
        "LinuxCNC with calibxyzkins (GTEC-UDC)",
        LINUXCNC,
        ("approach",),
        HAL_LINES,
    ),
    "siemens-cec": ControllerFormat(
        "sag and angularity tables: each axis by each axis, both directions",
        "siemens",
        "SINUMERIK 840D sl, 828D; 802D sl with --tables 2",
        MANUAL,
        (*_AXIS_TABLES, "axis_names"),
        SINUMERIK_TABLE,
    ),
    "siemens-enc-comp": ControllerFormat(
        "leadscrew tables: positioning of each axis",
        "siemens",
        "SINUMERIK 840D sl, 828D, 808D, 802D sl",
        MANUAL,
        (*_AXIS_TABLES, "axis_names"),
        SINUMERIK_TABLE,
    ),
    "heidenhain-kinematics": ControllerFormat(
        "KinematicsComp: all 21 errors",
        "heidenhain",
        "iTNC 530 HSCI with KinematicsComp",
        MANUAL,
        ("approach", "rows", "fixed"),
        folder=_TABLES_OF_HEIDENHAIN | {"kinematics.tab": COM_TABLE, "compensation.txt": HEIDENHAIN_NOTES},
        mark="compensation.txt",
    ),
    "heidenhain-com": ControllerFormat(
        "axis tables: each axis by each axis",
        "heidenhain",
        "MANUALplus 620, TNC with tables .COM and .CMA",
        MANUAL,
        _AXIS_TABLES,
        folder=_TABLES_OF_HEIDENHAIN | {"config.cma": COM_TABLE, "compensation.txt": HEIDENHAIN_NOTES},
        mark="compensation.txt",
    ),
    "isg": ControllerFormat(
        "volumetric compensation, ISG CSV: all 21 errors",
        "beckhoff",
        "TwinCAT CNC, ISG-CNC",
        MANUAL,
        ("approach", "rows", "squareness"),
        ISG_TABLE,
    ),
    "etalon": ControllerFormat(
        "volumetric compensation, Etalon Exchange Format: all 21 errors",
        "beckhoff",
        "TwinCAT CNC, ISG-CNC",
        MANUAL,
        ("approach", "rows", "squareness"),
        ETALON_TABLE,
    ),
    "rrf": ControllerFormat(
        "M556: squareness", "rrf", "RepRapFirmware (Duet)", SOURCE, ("approach",), FIRMWARE_COMMAND
    ),
    "marlin": ControllerFormat("M852: squareness", "marlin", "Marlin", SOURCE, ("approach",), FIRMWARE_COMMAND),
    "klipper": ControllerFormat("SET_SKEW: squareness", "klipper", "Klipper", SOURCE, ("approach",), FIRMWARE_COMMAND),
    "csv-grid": ControllerFormat(
        "error vectors on a grid",
        "",
        "whatever reads CSV",
        BY_FORMULA,
        ("approach", "nodes", "step", "orientation"),
        GRID,
    ),
    "squareness": ControllerFormat(
        "the three squareness angles, in two conventions of sign",
        "",
        "whatever takes three angles (Renishaw CARTO)",
        BY_FORMULA,
        (),
        SQUARENESS_TABLE,
    ),
    "position-error": ControllerFormat(
        "rows of position and error of one axis by one axis",
        "",
        "tables that are typed in: pitch, straightness, sag",
        BY_FORMULA,
        ("approach", "axis", "depends_on", "at", "rows"),
        POSITION_ERROR,
    ),
}
# Names by which people ask, beside those of the formats.
ALSO: Final = {"twincat": "beckhoff", "duet": "rrf", "reprapfirmware": "rrf"}
MAKERS: Final = tuple(dict.fromkeys([*(one.maker for one in FORMATS.values() if one.maker), *ALSO]))


def of_maker(maker: str) -> Iterator[tuple[str, ControllerFormat]]:
    """The formats for a maker's controllers, and then those for anybody."""
    own = ALSO.get(maker, maker)
    yield from ((name, one) for name, one in FORMATS.items() if one.maker == own)
    yield from ((name, one) for name, one in FORMATS.items() if not one.maker)
