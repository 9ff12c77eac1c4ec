"""Where an error map breaks the frame choice, or is implausible, in words."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from stepdiag._core import ErrorMap, InvalidArgument, PlausibleLimits
from stepdiag.parameters import AXES, units_of
from stepdiag.units import MICRORADIAN, report_value

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

LARGEST_ANGLE: Final = 0.1  # rad: twenty times what is plausible


def frame_deviation_texts(errors: ErrorMap, volume: "npt.ArrayLike") -> Iterator[str]:
    """Where an error map breaks the frame choice."""
    for name, position, value in errors.frame_deviations(volume):
        shown, unit = report_value(units_of(name), value)
        place = "at home" if position == 0.0 else "at the end of travel"
        yield f"{name} is {shown:g} {unit} {place}, where the frame choice has 0; used as given"


def implausible_texts(
    errors: ErrorMap, volume: "Sequence[float] | npt.NDArray[np.float64]", limits: PlausibleLimits
) -> Iterator[str]:
    """What no machine has, by the limits for results: a sentence for each parameter that is beyond them."""
    edges = dict(zip(AXES, volume, strict=True))
    for name, (value, place) in _largest_values(errors):
        limit = limits.rotation if units_of(name) == "rad" else limits.translation
        if name[0] == "E" and name[1] == name[2]:
            limit = min(limit, limits.positioning * edges[name[2]])
        if abs(value) > limit:
            shown, unit = report_value(units_of(name), value)
            most, _ = report_value(units_of(name), limit)
            yield f"{name} is {shown:g} {unit}{place}, beyond what a machine can be ({most:g} {unit}); used as given"


def check_angles(errors: ErrorMap, where: str) -> None:
    """Raise InvalidArgument for angles that are none of a machine's: a wrong unit or a damaged number."""
    for name, (value, place) in _largest_values(errors):
        if units_of(name) == "rad" and abs(value) >= LARGEST_ANGLE:
            raise InvalidArgument(
                f"{where}: {name} is {value / MICRORADIAN:g} µrad{place}, expected less than {LARGEST_ANGLE:g} rad"
            )


def _largest_values(errors: ErrorMap) -> Iterator[tuple[str, tuple[float, str]]]:
    """Of each parameter the value that is furthest from 0, and where."""
    for name, angle in errors.squareness.items():
        yield name, (angle, "")
    for tables in (errors.functions, errors.negative_functions):
        for name, (position, value) in tables.items():
            k = int(abs(value).argmax())
            yield name, (float(value[k]), f" at {position[k]:g} mm")
