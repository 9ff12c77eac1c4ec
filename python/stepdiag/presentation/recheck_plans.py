"""What `stepdiag plan --recheck` says: the table of plans, the one to take and what it shows, and all as a file."""

import math
from collections.abc import Iterator, Sequence

from stepdiag.io.csv_text import csv_text
from stepdiag.planning.recheck_plans import BEYOND, POWER, Power, choose, front
from stepdiag.presentation.plan_by_time import LINES
from stepdiag.presentation.text_columns import text_columns
from stepdiag.rechecking.recheck import CHANGE_UNITS
from stepdiag.units import MICROMETRE


def recheck_plan_rows(found: Sequence[Power], minutes: float, limit: float, alpha: float) -> Iterator[str]:
    """The plans that no faster one equals, the one to take marked, with a line where the time ends."""
    taken = choose(found, minutes, limit)
    plans = front(found, limit)
    if taken is not None and taken not in plans:
        plans = sorted([*plans, taken], key=lambda one: one.seconds)
    yield f"smallest changes that a recheck shows with {100 * POWER:g} % probability (false alarms {100 * alpha:g} %),"
    yield f"of each kind the worst parameter; unseen: changes that may move the tool by {limit / MICROMETRE:.3g} µm:"
    rows = [
        ["minutes", "lines", "steps", "repeats", *CHANGE_UNITS, "unseen", "hidden"],
        ["", "", "", "", *(unit for unit, _ in CHANGE_UNITS.values()), "terms", "µm"],
    ]
    for one in plans:
        c = one.candidate
        marked = f"{'* ' if one is taken else ''}{one.minutes:.1f}"
        changes = [_change(kind, one.worst(kind)) for kind in CHANGE_UNITS]
        unseen = f"{len(one.unseen(limit)) or '-'}"
        hidden = f"{one.hidden / MICROMETRE:.1f}"
        lines = ", ".join(f"{n} {LINES[name]}" for name, n in c.counts.items() if n)
        rows.append([marked, lines, f"{c.steps}", f"{c.repeats}", *changes, unseen, hidden])
    table = list(text_columns(rows, left=(1,)))
    in_time = sum(one.minutes <= minutes for one in plans)
    if in_time < len(plans):
        table.insert(2 + in_time, f"  -- {minutes:g} minutes: the available time --")
    yield from table
    yield f"-: none, or more than {BEYOND:g} times the prior of [change]"
    yield "hidden: how far changes that the readings do not determine may move the tool, together (k = 2)"


def recheck_advice(found: Sequence[Power], minutes: float, limit: float) -> Iterator[str]:
    """Which plan to take, and the smallest change of each term that it shows."""
    taken = choose(found, minutes, limit)
    if taken is None:
        quickest = next(one for one in found if not one.trouble)
        yield f"no plan fits {minutes:g} minutes; the fastest takes {quickest.minutes:.1f}"
        return
    c = taken.candidate
    times = {1: "once", 2: "twice"}.get(c.repeats, f"{c.repeats} times")
    lines = " ".join((*c.lines, *c.scale_lines))
    yield f"take: {c.description} ({lines}), {c.steps} steps, {times}, in {taken.minutes:.1f} minutes; it shows"
    rows = [("parameter", "change", "", "which moves the tool by", "")]
    for term, smallest, move in zip(taken.terms, taken.smallest, taken.moves, strict=True):
        name = f"{term.parameter} ({term.kind})"
        if smallest >= BEYOND * term.prior:
            rows.append((name, "-", "", "", ""))
            continue
        rows.append((name, _change(term.kind, smallest), CHANGE_UNITS[term.kind][0], f"{move / MICROMETRE:.2f}", "µm"))
    yield from text_columns(rows, left=(0, 2, 4))
    unseen = taken.unseen(limit)
    if unseen:
        named = ", ".join(f"{term.parameter} ({term.kind})" for term in unseen)
        yield f"changes that may move the tool by {limit / MICROMETRE:.3g} µm unseen: {named}"
    else:
        yield f"any one change that moves the tool by {limit / MICROMETRE:.3g} µm is seen"


def recheck_plan_csv(found: Sequence[Power], limit: float) -> str:
    """All plans as a file; what is not seen is an empty field."""
    columns = ["minutes", "lines", "scale_lines", "steps", "repeats"]
    columns += ["scale_um_per_m", "bow_um", "slope_urad", "squareness_urad", "unseen_terms", "hidden_um"]
    rows = []
    for one in found:
        c = one.candidate
        changes = [
            one.worst(kind) / scale if math.isfinite(one.worst(kind)) else None
            for kind, (_, scale) in CHANGE_UNITS.items()
        ]
        seen = [None, None] if one.trouble else [len(one.unseen(limit)), one.hidden / MICROMETRE]
        rows.append([one.minutes, " ".join(c.lines), " ".join(c.scale_lines), c.steps, c.repeats, *changes, *seen])
    return csv_text(columns, rows)


def _change(kind: str, value: float) -> str:
    return f"{value / CHANGE_UNITS[kind][1]:.3g}" if math.isfinite(value) else "-"
