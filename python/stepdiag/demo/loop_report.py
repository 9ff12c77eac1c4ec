"""Report of the closed loop: a table of errors before and after, and explanations."""

import math
from collections.abc import Iterator

import numpy as np

from stepdiag._core import read_measurement
from stepdiag.demo.loop_cases import (
    DISTANCE_NOISE,
    EXPANSION,
    RADIUS,
    SCREW_AMPLITUDE,
    SCREW_PITCH,
    TILT_NOISE,
    WARMING,
    finer,
)
from stepdiag.demo.loop_job import compensator_of
from stepdiag.demo.loop_outcome import LoopOutcome, whole_grid
from stepdiag.demo.loop_points import Agreement, FloatArray, Sizes, Warmth, errors_at
from stepdiag.demo.paper_report import alias_of
from stepdiag.io.csv_text import csv_text
from stepdiag.units import MICRO

UM = 1e3  # of a mm
WORDS = {"nodes": "nodes of the plan", "random": "random points"}


def report_lines(outcomes: list[LoopOutcome], repeated: dict[str, Agreement] | None, controller: str) -> Iterator[str]:
    steps = outcomes[0].scenario.known.plan.steps
    nodes, count = (len(outcomes[0].points[kind].targets) for kind in ("nodes", "random"))
    yield f"The closed loop, moved by {controller}: {steps} steps an axis, the truth {finer(steps)} times finer"
    yield from error_table(outcomes)
    yield f"({nodes} nodes and {count} random points, gone to before and after; the error is the whole vector's length)"
    yield ""
    yield from node_note(outcomes)
    for outcome in outcomes:
        if outcome.case.screw:
            yield ""
            yield from screw_note(outcome)
        if outcome.case.noise:
            yield ""
            yield from noise_note(outcome, repeated)
        if outcome.warmth is not None:
            yield ""
            yield from warm_note(outcome, outcome.warmth)
    yield ""
    yield from recheck_table(outcomes)


def error_table(outcomes: list[LoopOutcome]) -> Iterator[str]:
    yield f"{'':<9}{'':<20}{'before, µm':>18}{'after, µm':>20}{'largest is':>14}"
    yield f"{'case':<9}{'points':<20}{'largest':>10}{'rms':>8}{'largest':>12}{'rms':>8}{'smaller by':>14}"
    for outcome in outcomes:
        for kind, points in outcome.points.items():
            before, after = Sizes.of(points.before), Sizes.of(points.after)
            yield (
                f"{outcome.case.name:<9}{WORDS[kind]:<20}{before.largest * UM:>10.4g}{before.rms * UM:>8.3g}"
                f"{after.largest * UM:>12.3g}{after.rms * UM:>8.2g}{before.largest / after.largest:>14,.0f}"
            )


def node_note(outcomes: list[LoopOutcome]) -> Iterator[str]:
    yield "The calibration knows the errors where it measured: with the axes at nodes. Compensated axes stand beside"
    yield "them, by the error itself, where the finer truth has another slope than the calibration."
    for outcome in outcomes:
        if not outcome.case.noise:
            count = (outcome.scenario.known.plan.steps + 1) ** 3
            before, after = whole_grid(outcome)
            yield (
                f"{outcome.case.name}: largest error at any of the {count:,} nodes, calculated: "
                f"{before * UM:.4g} µm before, {after * UM:.3g} µm after: {before / after:,.0f} times smaller"
            )
    yield "Between nodes the remaining error is the truth's departure from straight lines: more steps resolve it."


def screw_note(outcome: LoopOutcome) -> Iterator[str]:
    """Remaining screw error: its pitch is not resolved by the nodes."""
    yield f"A screw error of {SCREW_PITCH:g} mm pitch and {SCREW_AMPLITUDE * UM:g} µm on all axes stays between nodes:"
    yield f"{'':<6}{'step':>10}{'seen as':>22}{'left at nodes':>16}{'left between':>16}"
    for axis, name in enumerate("XYZ"):
        plan = outcome.scenario.known.plan
        step = plan.volume[axis] / plan.steps
        nodes, fine = plan.nodes(name), np.linspace(0.0, plan.volume[axis], 20001)
        at, between = (float(np.max(np.abs(left_along(outcome, axis, p)[:, axis]))) for p in (nodes, fine))
        yield f"E{name}{name:<4}{step:7.3g} mm{alias_of(step):>22}{at * UM:>13.2g} µm{between * UM:>13.2g} µm"
    slope, beside = 2.0 * math.pi * SCREW_AMPLITUDE / SCREW_PITCH, Sizes.of(outcome.points["nodes"].before).largest
    yield f"Its slope is {slope * UM:.2g} µm/mm, and compensated axes stand up to {beside:.2g} mm beside a node:"
    yield f"{slope * beside * UM:.2g} µm can be left even at nodes."
    yield "Steps of at most a quarter of the pitch would resolve it."


def left_along(outcome: LoopOutcome, axis: int, positions: FloatArray) -> FloatArray:
    """Error remaining along an axis with the others at home, calculated, (n, 3), mm."""
    targets = np.zeros((len(positions), 3))
    targets[:, axis] = positions
    return errors_at(outcome.machine, compensator_of(outcome.table, outcome.scenario).command(targets), targets)


def noise_note(outcome: LoopOutcome, repeated: dict[str, Agreement] | None) -> Iterator[str]:
    yield (
        f"Noise: {DISTANCE_NOISE * UM:g} µm of each of three beams, {RADIUS:.4g} mm from their middle, which is "
        f"{TILT_NOISE * MICRO:g} µrad of tilt"
    )
    yield f"{'':<44}{'remaining':>13}{'stated':>10}{'chi-square':>13}{'in 95 %':>10}"
    yield f"{'':<44}{'rms, µm':>13}{'rms, µm':>10}{'per freedom':>13}{'regions':>10}"
    rows = [(f"this run, {WORDS[kind]}", found) for kind, found in outcome.agreement.items()]
    rows += [(f"repetitions, {WORDS[kind]}", found) for kind, found in (repeated or {}).items()]
    for text, found in rows:
        yield (
            f"{text:<44}{found.found_rms * UM:>13.3g}{found.stated_rms * UM:>10.3g}"
            f"{found.mean_chi_square:>13.3g}{found.covered * 100:>8.1f} %"
        )
    yield "Stated: the calibration's own covariance of its error vector at the point. Of one run all points share one"
    yield "calibration and go wrong together, so its share may be far from 95 %; that of many runs may not."


def warm_note(outcome: LoopOutcome, warmth: Warmth) -> Iterator[str]:
    """What the temperatures of the scales do, if the controller is told them or not."""
    run = read_measurement(outcome.table.with_name("run.csv")).channels["temperature"]
    in_use = ", ".join(f"{one:g}" for one in warmth.temperature)
    yield f"Scales of {EXPANSION:g} µm/(m·K), measured while they warmed up from {run[0]:.4g} to {run[-1]:.4g} °C"
    found = "not known" if outcome.calibration.expansion is None else f"{outcome.calibration.expansion[0] * 1e6:.5g}"
    yield f"({WARMING:g} K/h; the calibration found {found} µm/(m·K)), in use at {in_use} °C:"
    yield f"{'':<44}{'largest, µm':>13}{'rms, µm':>10}"
    for kind, points in outcome.points.items():
        rows = {
            "before": points.before,
            "after, without temperatures": points.cold,
            "after, with temperatures": points.after,
        }
        for text, errors in rows.items():
            if errors is not None:
                sizes = Sizes.of(errors)
                yield f"{f'{WORDS[kind]}, {text}':<48}{sizes.largest * UM:>9.3g}{sizes.rms * UM:>10.3g}"


def recheck_table(outcomes: list[LoopOutcome]) -> Iterator[str]:
    yield "The second calibration, of the compensated machine by the same program. It tilts as before: tilts are taken"
    yield f"{'from the readings, translations asked for':<41}{'before':>21}{'after':>22}"
    yield f"{'':<40}{'µm':>12}{'µrad':>10}{'µm':>12}{'µrad':>10}"
    for outcome in outcomes:
        cells = "".join(
            f"{found.length * UM:>12.3g}{found.squareness * MICRO:>10.2g}" for found in (outcome.first, outcome.second)
        )
        yield f"{outcome.case.name:<9}{'largest length, squareness':<31}{cells}"
    if any(outcome.warmth is not None for outcome in outcomes):
        yield "warm: before is referred to 20 °C, after is as found at the temperatures in use"


def point_table(outcomes: list[LoopOutcome]) -> str:
    """All points as CSV, errors in µm."""
    parts = [f"{when}_{axis}_um" for when in ("before", "after") for axis in "xyz"]
    rows = []
    for outcome in outcomes:
        for kind, points in outcome.points.items():
            for target, before, after in zip(points.targets, points.before, points.after, strict=True):
                rows.append([outcome.case.name, kind, *map(float, (*target, *(before * UM), *(after * UM)))])
    return csv_text(["case", "points", "x_mm", "y_mm", "z_mm", *parts], rows)
