"""Panels of how the largest uncertainties grow with the number of steps, and the figure of `observe`'s table."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

from stepdiag._core import InvalidArgument
from stepdiag.figures.page import SMALL, Heading, Page
from stepdiag.io.csv_text import finite_number, read_csv
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units
from stepdiag.planning.observation import Prospect, growth
from stepdiag.style import COLOUR, axis_label, own_style, series
from stepdiag.units import unit_of

WIDTH, HEIGHT = 11.0, 4.2
PANELS: Final[dict[str, tuple[Kind, Kind]]] = {
    "lengths": ("positioning", "straightness"),
    "angles": ("angle", "squareness"),
}
MARKERS: Final = "os^D"
OWN: Final[dict[str, Any]] = {"color": COLOUR["limit"], "linewidth": 0.9, "linestyle": (0, (4, 2))}
MIRROR: Final = ("mirror_width_mm", "mirror_height_mm")
# Columns of the table with the largest u of each kind.
COLUMNS: Final[dict[Kind, str]] = {kind: f"u_{kind}_{'um' if REPORT_UNIT[kind] == 'µm' else 'urad'}" for kind in KINDS}


def draw_growth(table: Sequence[Prospect], name: str = "plan") -> Figure:
    """Draw the largest standard uncertainty of each kind over the number of steps, both on logarithmic scales.

    `name`: the title. The legends have the exponents e of u ~ steps^e. Kinds that are not determined
    have no points. Raises InvalidArgument if there are none at all."""
    if not any(u > 0.0 for found in table for u in found.largest.values()):
        raise InvalidArgument("expected uncertainties for numbers of steps, got none: nothing is determined")
    with own_style():
        page = Page(Heading(f"{name}: uncertainty by the number of steps", _facts(table)), WIDTH, HEIGHT)
        draw_growth_panels(page, table)
        return page.finish()


def draw_growth_panels(page: Page, table: Sequence[Prospect], own: int | None = None, **shape: Any) -> None:
    """Two panels beside each other, lengths and angles. `own`: a number of steps to mark. `shape`: of the grid."""
    grid = page.grid(1, len(PANELS), wspace=0.2, **shape)
    for column, (title, kinds) in enumerate(PANELS.items()):
        axes = page.figure.add_subplot(grid[0, column])
        axes.set_title(title, weight="bold", pad=3.0)
        _draw(axes, table, kinds)
        if own is not None:
            axes.axvline(own, zorder=0.9, **OWN)


def read_steps(path: Path) -> list[Prospect]:
    """Read the table that `observe` writes. Raises InvalidArgument naming the file and line."""
    table = []
    for where, row in read_csv(path, ("steps", *MIRROR, *COLUMNS.values())).rows:
        steps, *mirror = (finite_number(row[column], f"{where}: {column}") for column in ("steps", *MIRROR))
        if not (steps > 0.0 and steps == int(steps)):
            raise InvalidArgument(f"{where}: steps: expected a whole number above 0, got {row['steps']!r}")
        largest = {
            kind: finite_number(row[column], f"{where}: {column}") * unit_of(column).native
            for kind, column in COLUMNS.items()
            if row[column]
        }
        table.append(Prospect(int(steps), (mirror[0], mirror[1]), largest))
    return sorted(table, key=lambda found: found.steps)


def _draw(axes: Axes, table: Sequence[Prospect], kinds: Sequence[Kind]) -> None:
    for kind in kinds:
        number, exponent = KINDS.index(kind), growth(table, kind)
        power = "" if exponent is None else f" ~ steps^{round(exponent, 2) + 0.0:.2f}"  # 0.0: -0 becomes 0
        known = [found for found in table if found.largest.get(kind, 0.0) > 0.0]
        values = [in_report_units(kind, found.largest[kind]) for found in known]
        style: dict[str, Any] = {"color": series(number)[0], "marker": MARKERS[number], "markersize": 5.0}
        axes.plot([found.steps for found in known], values, linewidth=1.2, label=f"{kind}{power}", **style)
    steps = [found.steps for found in table]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(FixedLocator(steps))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_minor_locator(NullLocator())
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel("steps of each axis")
    axes.set_ylabel(axis_label("largest u", REPORT_UNIT[kinds[0]]))
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=len(kinds), fontsize=SMALL, borderaxespad=0.0)


def _facts(table: Sequence[Prospect]) -> str:
    mirrors = [f"{found.steps} steps: {found.mirror[0]:.3g} x {found.mirror[1]:.3g} mm" for found in table]
    return f"smallest mirror for {', '.join(mirrors)}"
