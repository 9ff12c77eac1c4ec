"""The report of `stepdiag head sensitivity`: the effect of each imperfection, strongest first."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from stepdiag import _core

# By quantity, otherwise by unit: amount of the imperfection in the table, and its text.
AMOUNTS: Final = {"humidity": (0.01, "%RH"), "mm": (1e-3, "µm"), "rad": (1e-6, "µrad"), "1": (1e-6, "ppm")}
AMOUNTS_OF_AIR: Final = {"K": (1.0, "K"), "Pa": (100.0, "hPa")}
NANO: Final = 1e6  # mm to nm
NANORAD: Final = 1e9
SMALLEST: Final = 1e-6  # nm and nrad; smaller effects are rounding errors


@dataclass(frozen=True)
class Row:
    """Effect of an amount of an imperfection: distance in nm, tilts in nrad."""

    component: str
    quantity: str
    amount: str
    distance: float
    alpha: float
    beta: float

    @property
    def tilt(self) -> float:
        return max(abs(self.alpha), abs(self.beta))


def sensitivity_report(head: _core.Head, distance: float, tilt: Sequence[float]) -> Iterator[str]:
    """Lines of two tables, for a mirror at this distance (mm) and tilt (rad).

    The air has 20 °C and 1013.25 hPa."""
    design = head.design
    assert design is not None
    found = _core.head_sensitivities(head, distance=distance, tilt=tilt, environment=_core.Environment.from_air())
    rows = [_row(sensitivity) for sensitivity in found]
    place = f"mirror at {distance:g} mm, tilts {tilt[0] * 1e6:g} and {tilt[1] * 1e6:g} µrad"
    yield f"{design.name}, {place}: changes of what is reduced from its readings,"
    yield "for readings by the beams' axes (chief rays), whatever the reading model of the head"
    yield ""
    yield "By their effect on the distance:"
    yield from _table(rows, lambda row: abs(row.distance))
    yield ""
    yield "By their effect on the tilts:"
    yield from _table(rows, lambda row: row.tilt)
    silent = [f"{row.component} {row.quantity}" for row in rows if max(abs(row.distance), row.tilt) < SMALLEST]
    if silent:
        yield ""
        yield f"Without effect here: {', '.join(silent)}"


def _row(sensitivity: _core.Sensitivity) -> Row:
    amounts = AMOUNTS | AMOUNTS_OF_AIR
    amount, name = amounts[sensitivity.quantity if sensitivity.quantity in amounts else sensitivity.unit]
    distance, alpha, beta = (float(value) * amount for value in sensitivity.reading)
    return Row(sensitivity.component, sensitivity.quantity, name, distance * NANO, alpha * NANORAD, beta * NANORAD)


def _table(rows: list[Row], effect: Callable[[Row], float]) -> Iterator[str]:
    width = max([18, *(len(row.component) + 2 for row in rows)])
    yield f"  {'component':<{width}}{'quantity':<14}{'per':<6}{'distance':>12}{'alpha':>12}{'beta':>12}"
    yield f"  {'':<{width}}{'':<14}{'':<6}{'nm':>12}{'nrad':>12}{'nrad':>12}"
    for row in sorted(rows, key=effect, reverse=True):
        if effect(row) >= SMALLEST:
            cells = "".join(f"{_cell(value):>12}" for value in (row.distance, row.alpha, row.beta))
            yield f"  {row.component:<{width}}{row.quantity:<14}{row.amount:<6}{cells}"


def _cell(value: float) -> str:
    return "0" if abs(value) < SMALLEST else f"{value:+.4g}"
