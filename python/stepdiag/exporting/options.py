"""Options of an export."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from stepdiag.option_field import option

Triple = tuple[float, float, float]
Approach = Literal["mean", "positive", "negative"]
AxisName = Literal["X", "Y", "Z"]
XYZ = "<X Y Z>"


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export. None: the default of the format, see `stepdiag export --help`. Lengths are in mm.

    `export` refuses options that its format does not use."""

    tool: Triple | None = option(None, "Tool offset, mm.  [default: the calibration's]", metavar=XYZ)
    origin: Triple | None = option(None, "Controller's coordinates of home, mm.  [default: 0 0 0]", metavar=XYZ)
    incomplete: bool = option(False, "Export undetermined values as 0.")
    approach: Approach | None = option(
        None,
        "Direction of approach to compensate if the tables have two (not linuxcnc-comp, squareness).  [default: mean; "
        "siemens-cec and heidenhain-com: both]",
    )
    at: Triple | None = option(
        None,
        "Point on the corrected lines, mm from home (linuxcnc-comp, position-error, siemens-*, heidenhain-com).  "
        "[default: centre of the volume; siemens-*, heidenhain-com: that or a mean over the volume]",
        metavar=XYZ,
    )
    rows: int | None = option(
        None,
        "Largest number of rows in a table (linuxcnc-comp, isg, etalon, position-error, siemens-*, heidenhain-*).  "
        "[default: 256, 5000, 5000, every node, 200, 200]",
        metavar="N",
    )
    tables: int | None = option(
        None,
        "Largest number of tables; those are chosen that leave least (siemens-cec: 8 of an 828D, 2 of an 802D sl).",
        metavar="N",
    )
    axis_names: tuple[str, str, str] | None = option(
        None,
        "Names of the machine axes X, Y, Z in the controller (siemens-*).  [default: AX1 AX2 AX3]",
        metavar="<X Y Z>",
    )
    fixed: Triple | None = option(
        None,
        "Sum of the fixed lines Trans between the tool and the axes in the machine's description, mm "
        "(heidenhain-kinematics).  [default: 0 0 0]",
        metavar=XYZ,
    )
    coordinates: str | None = option(
        None,
        "Axis of each joint, as [KINS] KINEMATICS has them; XYYZ is a gantry (linuxcnc-comp).  [default: XYZ]",
        metavar="LETTERS",
    )
    ini: Path | None = option(None, "INI file with which `coordinates` are compared (linuxcnc-comp).", metavar="FILE")
    axis: AxisName | None = option(None, "The axis that is in error (position-error).")
    depends_on: AxisName | None = option(None, "The axis on whose position it depends, or itself.")
    nodes: tuple[int, int, int] | None = option(
        None, "Points of the grid (csv-grid).  [default: 11 11 11]", metavar="<NX NY NZ>"
    )
    step: float | None = option(None, "Largest spacing of the grid, instead of --nodes (csv-grid).", metavar="MM")
    orientation: bool | None = option(None, "Also write the rotations of the tool (csv-grid).")
    squareness: Literal["straightness", "parameters"] | None = option(
        None, "Where to write squareness (isg, etalon).  [default: straightness]"
    )
    accept_rejected: bool = option(False, "Export a calibration even if its fit was rejected.")
