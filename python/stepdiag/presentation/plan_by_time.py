"""What `stepdiag plan` says: the table of plans, which one to take, and all of them as a file."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from stepdiag.io.csv_text import csv_text
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units
from stepdiag.planning.plan_by_time import (
    Aim,
    Candidate,
    Choice,
    Family,
    Goal,
    Outcome,
    choose,
    complete,
    found_from,
    front,
    says_more,
    undistinguished,
)
from stepdiag.presentation.fault_control import distinguished, name
from stepdiag.presentation.text_columns import text_columns
from stepdiag.scenario.known import Known
from stepdiag.units import MICROMETRE, MICRORADIAN

# Heads of columns with the numbers of lines, by Candidate.counts.
LINES: Final = {"body diagonal": "body", "face diagonal": "face", "single-axis line": "single", "scale line": "scale"}
FIGURES: Final = ("volume", "pos.", "str.", "angle", "squ.", "found", "kinds")
UNITS: Final = ("µm", *(REPORT_UNIT[kind] for kind in KINDS), "µm", "")
FAR: Final = 2.0  # times the available time: how far the table goes on


def inputs_row(known: Known) -> str:
    """What is in the uncertainties: all that is stated, or noise alone."""
    if says_more(known):
        quantities = [one.quantity for one in known.uncertain.inputs]
        quantities += [one.quantity for one in known.uncertain.noise if one.quantity != "channel"]
        names = dict.fromkeys(quantity.replace("_", " ") for quantity in quantities)
        return f"uncertain: the noise of readings, set-ups as [adjustment] says, and {', '.join(names)}"
    return "uncertain: the noise of readings alone, and set-ups as [adjustment] says: [uncertainty] states nothing else"


def shown(found: Sequence[Outcome], choice: Choice, aim: Aim) -> list[Outcome]:
    """The plans of the table, fastest first: those with nodes near enough that none beats, up to twice the time; and of
    each smaller number of steps the best one in the time."""
    minutes = aim.minutes if math.isfinite(aim.minutes) or choice.taken is None else choice.taken.minutes
    others = [choice.taken, choice.next_better, choice.fastest]
    marked = [one for one in others if one is not None]
    longest = max([FAR * minutes, *(one.minutes for one in marked)])
    spacing = max([aim.spacing * (1.0 + 1e-9), *([choice.taken.spacing] if choice.taken else [])])
    near = [one for one in complete(found) if one.spacing <= spacing]
    plans = [one for one in front(near, aim.family) if one.minutes <= longest]
    for width in sorted({one.spacing for one in complete(found) if one.spacing > spacing}):
        within = [one for one in complete(found) if one.spacing == width and one.minutes <= minutes]
        plans += [min(within, key=replace(aim, minutes=minutes, goals=()).order)] if within else []
    distinct = {one.candidate: one for one in [*plans, *marked]}
    return sorted(distinct.values(), key=lambda one: (one.seconds, one.spacing))


def plan_rows(plans: Sequence[Outcome], choice: Choice, aim: Aim) -> Iterator[str]:
    """The table, what is taken marked, and a line where the time ends."""
    settings: dict[str, Callable[[Candidate], str]] = {
        "read": lambda c: c.scale_points if c.scale_lines else "-",
        "backward": lambda c: "yes" if c.backward else "no",
        "returns": lambda c: f"{c.check_points or '-'}",
    }
    settled = {
        name: said for name, said in settings.items() if len({said(o.candidate) for o in plans} - {"-", "no"}) > 0
    }
    rows = [
        ["minutes", "lines", *settled, "steps", "spacing", "runs", *FIGURES],
        ["", "", *("" for _ in settled), "", "mm", "", *UNITS],
    ]
    for o in plans:
        c = o.candidate
        chosen = choice.taken is not None and c == choice.taken.candidate
        time = f"{'* ' if chosen else ''}{o.minutes:.1f}"
        counts = "/".join(f"{count}" for count in c.counts.values())
        plan = [time, counts, *(said(c) for said in settled.values()), f"{c.steps}", f"{o.spacing:.3g}", f"{c.repeats}"]
        rows.append([*plan, _volume(o), *(_cell(kind, o) for kind in KINDS), *_faults(o)])
    table = list(text_columns(rows, left=()))
    in_time = sum(o.minutes <= aim.minutes for o in plans)
    if in_time < len(plans):
        table.insert(2 + in_time, f"  -- {aim.minutes:g} minutes: the available time --")
    yield from table


def _volume(one: Outcome) -> str:
    return f"{one.volume / MICROMETRE:.3g}" if math.isfinite(one.volume) else "-"


def _cell(kind: Kind, one: Outcome) -> str:
    return f"{in_report_units(kind, one.largest[kind]):.3g}" if kind in one.largest else "-"


def _faults(one: Outcome) -> list[str]:
    """The smallest wrong distance that is found, and how many kinds of faults are distinguished."""
    if not one.faults:
        return ["", ""]
    size = found_from(one.faults)
    kinds = len(one.faults)
    return [
        f"{size / MICROMETRE:.3g}" if math.isfinite(size) else "-",
        f"{kinds - undistinguished(one.faults)}/{kinds}",
    ]


def advice(found: Sequence[Outcome], aim: Aim) -> Iterator[str]:
    """Which plan to take, in words, and what more time would give."""
    choice = choose(found, aim)
    taken = choice.taken
    if not complete(found):
        yield "none of these plans determines any parameter as a whole"
        return
    if taken is None:
        quickest = front(found, aim.family)[0]
        yield f"no plan fits {aim.minutes:g} minutes; the fastest takes {quickest.minutes:.1f}: {_named(quickest)}"
        return
    if not choice.spacing_kept:
        in_time = f" fits {aim.minutes:g} minutes" if math.isfinite(aim.minutes) else ": steps has none"
        needed = f"; the fastest takes {choice.fastest.minutes:.1f}" if choice.fastest else ""
        yield f"no plan with nodes at most {aim.spacing:.3g} mm apart{in_time}{needed}"
    if aim.goals and not choice.reached:
        goals = " and ".join(goal.words for goal in aim.goals)
        in_time = f" within {aim.minutes:g} minutes" if math.isfinite(aim.minutes) else ""
        yield f"no plan reaches {goals}{in_time}; the nearest has"
        yield "  " + ", ".join(f"{_of_goal(goal, taken)}" for goal in aim.goals)
    yield f"{'take' if choice.reached else 'nearest'}: {_named(taken)}, in {taken.minutes:.1f} minutes: {_said(taken)}"
    better = choice.next_better
    if better is not None and not aim.goals:
        yield f"next better with nodes as near: {_named(better)}, in {better.minutes:.1f} minutes: {_said(better)}"


def _of_goal(goal: Goal, one: Outcome) -> str:
    value = one.worst(goal.of)
    return f"u of {'the volume' if goal.of == 'volume' else goal.of} " + (
        f"{value / MICROMETRE:.3g} µm" if goal.of == "volume" else f"{value / MICRORADIAN:.3g} µrad"
    )


def own_row(own: Outcome) -> str:
    """The plan that the scenario states."""
    if own.trouble:
        return f"the scenario's own plan: {own.trouble}"
    return f"the scenario's own plan: {_named(own)}, in {own.minutes:.1f} minutes: {_said(own)}"


def fault_advice(taken: Outcome, other: Outcome | None) -> Iterator[str]:
    """Whether faults of the readings are distinguished in the plan to take, and which plan would."""
    yield f"faults distinguished in the plan to take: {_kinds(taken)}"
    if other is None:
        yield "no plan of as many steps that is as certain distinguishes all faults"
    elif other is not taken:
        more = other.minutes - taken.minutes
        yield (
            f"all faults distinguished: {_named(other)}, in {other.minutes:.1f} minutes ({more:+.1f}): {_kinds(other)}"
        )


def _kinds(one: Outcome) -> str:
    return "; ".join(f"{name(c)} {distinguished(c)}" for c in one.faults or ()) or "none"


def _named(one: Outcome) -> str:
    c = one.candidate
    times = {1: "once", 2: "twice"}.get(c.repeats, f"{c.repeats} times")
    returns = f", returning to check points after every {c.check_points} steps" if c.check_points else ""
    way = ", each with its way back" if c.backward else ""
    return f"{c.description}, {c.steps} steps ({one.spacing:.3g} mm), {times}{way}{returns}"


def line_names(one: Outcome) -> str:
    """The lines of a plan, as [plan] names them."""
    c = one.candidate
    scales = f"; scale lines {', '.join(c.scale_lines)}" if c.scale_lines else ""
    return f"lines {', '.join(c.lines)}{scales}"


def _said(one: Outcome) -> str:
    parts = [f"volume {_volume(one)} µm"] if math.isfinite(one.volume) else []
    parts += [f"{kind} {_cell(kind, one)} {REPORT_UNIT[kind]}" for kind in KINDS if kind in one.largest]
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


def plan_csv(found: Sequence[Outcome], family: Family = "volume") -> str:
    """All plans as a file, also those that others beat; what is not determined, or was not asked, is an empty field."""
    kept = {id(o) for o in front(found, family)}
    columns = (
        "minutes,lines,scale_lines,steps,spacing_mm,repeats,check_points,mirror_width_mm,mirror_height_mm,parameters_determined,"
        "u_positioning_um,u_straightness_um,u_angle_urad,u_squareness_urad,on_front,scale_points,backward,u_volume_um,"
        "wrong_distance_found_um,faults_told,faults"
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
        more = [c.scale_points if c.scale_lines else "", int(c.backward), _finite(o.volume), *_fault_cells(o)]
        rows.append([*plan, len(o.determined), *cells, int(id(o) in kept), *more])
    return csv_text(columns.split(","), rows)


def _finite(length: float) -> float | None:
    return length / MICROMETRE if math.isfinite(length) else None


def _fault_cells(one: Outcome) -> list[float | int | None]:
    if not one.faults:
        return [None, None, None]
    return [_finite(found_from(one.faults)), len(one.faults) - undistinguished(one.faults), len(one.faults)]
