"""How head and mirror were set up, as an adjustment found it: one row a set-up, one column an unknown."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final, Protocol

from stepdiag.presentation.blocks import Block, NoteBlock, TableBlock
from stepdiag.setup_quantities import SETUP_QUANTITIES, component_name, report_unit

# Above this share of its prior uncertainty an unknown is as good as unread.
NOTHING_LEARNT: Final = 0.9


class SetupFound(Protocol):
    """An unknown of a set-up: of an adjustment (`SetupEstimate`), or as a file has it."""

    @property
    def run(self) -> int: ...
    @property
    def line(self) -> str: ...
    @property
    def quantity(self) -> str: ...
    @property
    def component(self) -> int: ...
    @property
    def value(self) -> float | None: ...
    @property
    def standard_uncertainty(self) -> float: ...
    @property
    def prior(self) -> float: ...


def setup_blocks(
    estimates: Sequence[SetupFound], lines: Sequence[str], title: str, *, values: bool = True
) -> Iterator[Block]:
    """`setup_table` as blocks; nothing where there is nothing to show."""
    rows, notes = setup_table(estimates, lines, values=values)
    if rows:
        heading, *others = map(tuple, rows)
        yield TableBlock(tuple(others), heading, title)
    elif notes:
        yield NoteBlock(f"{title}:")
    yield from (NoteBlock(note, indented=True) for note in notes)


def setup_table(
    estimates: Sequence[SetupFound], lines: Sequence[str], *, values: bool = True
) -> tuple[list[list[str]], list[str]]:
    """A table of what was found, as 12.34(56): the uncertainty of the last digits in brackets; without `values` the
    standard uncertainties alone. Its rows: names, units, then by run, and in it in the order of `lines`. Beside it,
    notes on unknowns of which next to nothing was learnt."""
    unknowns = sorted((e for e in estimates if e.prior > 0.0), key=lambda e: (e.run, lines.index(e.line)))
    learnt = [e for e in unknowns if _is_learnt(e)]
    found = {(e.quantity, e.component) for e in learnt if e.value is not None}
    columns = sorted(found, key=lambda column: (list(SETUP_QUANTITIES).index(column[0]), column[1]))
    rows = _table(learnt, columns, _value if values else _uncertainty) if columns else []
    prior: dict[str, list[SetupFound]] = {}
    for estimate in unknowns:
        if not _is_learnt(estimate):
            prior.setdefault(estimate.quantity, []).append(estimate)
    notes = []
    for quantity, known in prior.items():
        unit, native = report_unit(quantity)
        everywhere = len(known) == sum(e.quantity == quantity for e in unknowns)
        places = "every line" if everywhere else ", ".join(dict.fromkeys(e.line for e in known))
        widths = ", ".join(dict.fromkeys(f"{e.prior / native:g}" for e in known))
        name = quantity.replace("_", " ")
        notes.append(f"{name}: the readings add almost nothing to the prior ({widths} {unit}) on {places}")
    return rows, notes


def _is_learnt(estimate: SetupFound) -> bool:
    return estimate.value is None or estimate.standard_uncertainty < NOTHING_LEARNT * estimate.prior


def concise(value: float, uncertainty: float) -> str:
    """A value with the uncertainty of its last digits: 12.34(56)."""
    if not math.isfinite(uncertainty) or uncertainty <= 0.0:
        return f"{value:.4g}"
    digits = 1 - math.floor(math.log10(float(f"{uncertainty:.1e}")))  # two of the rounded uncertainty
    shown = max(0, digits)
    last = round(round(uncertainty, digits) * 10**shown)
    return f"{round(value, digits) + 0.0:.{shown}f}({last})"


def _value(estimate: SetupFound) -> str:
    native = report_unit(estimate.quantity).native
    if estimate.value is None:
        return "-"
    return concise(estimate.value / native, estimate.standard_uncertainty / native)


def _uncertainty(estimate: SetupFound) -> str:
    if estimate.value is None:
        return "-"
    size = estimate.standard_uncertainty / report_unit(estimate.quantity).native
    return f"{size:#.3g}" if size < 100.0 else f"{size:.0f}"


def _table(
    estimates: Iterable[SetupFound], columns: Sequence[tuple[str, int]], write: Callable[[SetupFound], str]
) -> list[list[str]]:
    rows: dict[tuple[int, str], dict[tuple[str, int], str]] = {}
    for estimate in estimates:
        row = rows.setdefault((estimate.run, estimate.line), {})
        row[estimate.quantity, estimate.component] = write(estimate)
    several_runs = len({run for run, _ in rows}) > 1
    heading = ["", *(_heading(quantity, component) for quantity, component in columns)]
    units = ["", *(report_unit(quantity).name for quantity, _ in columns)]
    body = [
        [f"{line} run {run}" if several_runs else line, *(row.get(column, "") for column in columns)]
        for (run, line), row in rows.items()
    ]
    return [heading, units, *body]


def _heading(quantity: str, component: int) -> str:
    return f"{SETUP_QUANTITIES[quantity].symbol} {component_name(quantity, component)}".rstrip()
