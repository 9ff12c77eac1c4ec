"""The 21 error parameters of a three-axis machine (ISO 230-1) by name: their kinds, and the units of each."""

from typing import Final, Literal

from stepdiag.units import REPORT_UNITS, report_value

AXES: Final = "XYZ"
FUNCTIONS: Final = tuple(f"E{component}{axis}" for axis in AXES for component in "XYZABC")
SQUARENESSES: Final = ("C0Y", "B0Z", "A0Z")
# By the second letter of a function.
COMPONENT_MEANING: Final = {
    "X": "displacement along X",
    "Y": "displacement along Y",
    "Z": "displacement along Z",
    "A": "rotation about X",
    "B": "rotation about Y",
    "C": "rotation about Z",
}

Kind = Literal["positioning", "straightness", "angle", "squareness"]
KINDS: Final[tuple[Kind, ...]] = ("positioning", "straightness", "angle", "squareness")

NATIVE_UNIT: Final[dict[Kind, str]] = {"positioning": "mm", "straightness": "mm", "angle": "rad", "squareness": "rad"}
REPORT_UNIT: Final[dict[Kind, str]] = {kind: REPORT_UNITS[unit][0] for kind, unit in NATIVE_UNIT.items()}


def kind_of(parameter: str) -> Kind:
    """The kind of a parameter by its name, EXX ... ECZ or C0Y, B0Z, A0Z."""
    if parameter[0] != "E":
        return "squareness"
    if parameter[1] in "ABC":
        return "angle"
    return "positioning" if parameter[1] == parameter[2] else "straightness"


def units_of(parameter: str) -> str:
    """The native unit of a parameter."""
    return NATIVE_UNIT[kind_of(parameter)]


def in_report_units(kind: Kind, value: float) -> float:
    """Convert a value from native units (mm, rad) to those of reports (µm, µrad)."""
    return report_value(NATIVE_UNIT[kind], value)[0]
