"""What `stepdiag plan` tells: the table of plans, which one to take, and all of them as a file."""

from collections.abc import Iterator, Sequence
from typing import Final

from stepdiag.io.csv_text import csv_text
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units
from stepdiag.planning.plan_by_time import Choice, Controlled, Family, Outcome, choose, complete, front
from stepdiag.report.fault_control import name, told_apart
from stepdiag.report.text_columns import text_columns

# Heads of columns with the numbers of lines, by Candidate.counts.
LINES: Final = {"body diagonal": "body", "face diagonal": "face", "single-axis line": "single", "scale line": "scale"}
FAR: Final = 2.0  # times the time that there is: how far the table goes on


def plan_rows(found: Sequence[Outcome], choice: Choice, minutes: float, family: Family = "length") -> Iterator[str]:
    """The table, what is taken marked, and a line where the time ends; much slower plans are only counted."""
    everything = front(found, family)
    shown = [choice.taken, choice.next_better, choice.fastest]
    longest = max([FAR * minutes, *(o.minutes for o in shown if o is not None)])
    plans = [o for o in everything if o.minutes <= longest] or everything[:1]
    lines = [name for name in LINES if any(o.candidate.counts[name] for o in plans)]
    returns = ["returns"] if any(o.candidate.check_points for o in plans) else []
    rows = [
        ["minutes", *(LINES[name] for name in lines), "steps", "spacing", "repeats", *returns, *KINDS],
        ["", *("" for _ in lines), "", "mm", "", *("after" for _ in returns), *(REPORT_UNIT[kind] for kind in KINDS)],
    ]
    for o in plans:
        c = o.candidate
        time = f"{'* ' if o is choice.taken else ''}{o.minutes:.1f}"
        counts = [f"{c.counts[name] or '-'}" for name in lines]
        cells = [_cell(kind, o) for kind in KINDS]
        every = [f"{c.check_points or '-'}" for _ in returns]
        rows.append([time, *counts, f"{c.steps}", f"{o.spacing:.3g}", f"{c.repeats}", *every, *cells])
    table = list(text_columns(rows, left=()))
    in_time = sum(o.minutes <= minutes for o in plans)
    if in_time < len(plans):
        table.insert(2 + in_time, f"  -- {minutes:g} minutes: the available time --")
    yield from table
    if len(plans) < len(everything):
        yield f"  and {len(everything) - len(plans)} that take longer, up to {everything[-1].minutes:.0f} minutes"


def _cell(kind: Kind, one: Outcome) -> str:
    return f"{in_report_units(kind, one.largest[kind]):.3g}" if kind in one.largest else "-"


def advice(found: Sequence[Outcome], minutes: float, spacing: float, family: Family = "length") -> Iterator[str]:
    """Which plan to take, in words, and what more time would give."""
    choice = choose(found, minutes, spacing, family)
    taken = choice.taken
    if not complete(found):
        yield "none of these plans determines any parameter as a whole"
        return
    if taken is None:
        quickest = front(found, family)[0]
        yield f"no plan fits {minutes:g} minutes; the fastest takes {quickest.minutes:.1f}: {_named(quickest)}"
        return
    if not choice.spacing_kept:
        needed = f"; the fastest takes {choice.fastest.minutes:.1f}" if choice.fastest else ""
        yield f"no plan with nodes at most {spacing:.3g} mm apart fits {minutes:g} minutes{needed}"
    yield f"take: {_named(taken)}, in {taken.minutes:.1f} minutes: {_said(taken)}"
    better = choice.next_better
    if better is not None:
        yield f"next better with nodes as near: {_named(better)}, in {better.minutes:.1f} minutes: {_said(better)}"


def fault_advice(taken: Controlled, telling: Controlled | None) -> Iterator[str]:
    """Whether faults of the readings are told apart in the plan to take, and which plan would."""
    yield f"faults told apart in the plan to take: {_told(taken)}"
    if telling is None:
        yield "no plan of as many steps that is as certain tells all faults apart"
    elif telling is not taken:
        more = telling.plan.minutes - taken.plan.minutes
        yield (
            f"all faults told apart: {_named(telling.plan)}, in {telling.plan.minutes:.1f} minutes ({more:+.1f}): "
            f"{_told(telling)}"
        )


def _told(one: Controlled) -> str:
    return "; ".join(f"{name(c)} {told_apart(c)}" for c in one.faults) or "none"


def _named(one: Outcome) -> str:
    c = one.candidate
    times = {1: "once", 2: "twice"}.get(c.repeats, f"{c.repeats} times")
    returns = f", returning to check points after every {c.check_points} steps" if c.check_points else ""
    return f"{c.description}, {c.steps} steps ({one.spacing:.3g} mm), {times}{returns}"


def _said(one: Outcome) -> str:
    parts = [f"{kind} {_cell(kind, one)} {REPORT_UNIT[kind]}" for kind in KINDS if kind in one.largest]
    return "u at most " + ", ".join(parts)


def left_out_rows(found: Sequence[Outcome]) -> Iterator[str]:
    """Why plans are not in the table though no other beats them: each reason once."""
    most = max((len(o.determined) for o in found), default=0)
    reasons: dict[str, list[Outcome]] = {}
    for o in found:
        if o.trouble:
            reasons.setdefault(o.trouble, []).append(o)
        elif len(o.determined) < most:
            everything = frozenset().union(*(other.determined for other in complete(found)))
            missing = ", ".join(sorted(everything - o.determined))
            reasons.setdefault(f"does not determine {missing}", []).append(o)
    for reason, plans in reasons.items():
        descriptions = list(dict.fromkeys(o.candidate.description for o in plans))
        steps = sorted({o.candidate.steps for o in plans})
        yield f"left out: {' / '.join(descriptions)}; {', '.join(map(str, steps))} steps: {reason}"


def plan_csv(found: Sequence[Outcome]) -> str:
    """All plans as a file, also those that others beat; what is not determined is an empty field."""
    kept = {id(o) for o in front(found)}
    columns = (
        "minutes,lines,scale_lines,steps,spacing_mm,repeats,check_points,mirror_width_mm,mirror_height_mm,parameters_determined,"
        "u_positioning_um,u_straightness_um,u_angle_urad,u_squareness_urad,on_front"
    )
    rows = []
    for o in sorted(found, key=lambda o: o.seconds):
        c = o.candidate
        cells = [in_report_units(kind, o.largest[kind]) if kind in o.largest else None for kind in KINDS]
        plan = [
            o.minutes,
            " ".join(c.lines),
            " ".join(c.scale_lines),
            c.steps,
            o.spacing,
            c.repeats,
            c.check_points,
            *o.mirror,
        ]
        rows.append([*plan, len(o.determined), *cells, int(id(o) in kept)])
    return csv_text(columns.split(","), rows)
