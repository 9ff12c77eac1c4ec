"""Every mistake of the catalogue is named by what it was, and by nothing else."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from mistaken import NOISE, changed, described, moved, rows_of, set_ups, simulated, step_plan
from usual import CHAIN, DIAGONALS, VOLUME

import stepdiag as sd
from stepdiag.mistakes.catalogue import CATALOGUE

STEPS = 6
Make = Callable[[str], sd.Measurement]


@cache
def run_of(head: str) -> sd.Measurement:
    return simulated(described(head, steps=STEPS), seed=4)


def scaled(names: str, factor: float, line: str | None = None) -> Make:
    def make(head: str) -> sd.Measurement:
        run = run_of(head)
        factors = np.ones(len(run))
        factors[rows_of(run, line)] = factor
        return changed(run, {name: run.channels[name] * factors for name in names.split()})

    return make


def exchanged(a: str, b: str, line: str | None = None, sign: float = 1.0) -> Make:
    def make(head: str) -> sd.Measurement:
        run = run_of(head)
        first, second, rows = run.channels[a].copy(), run.channels[b].copy(), rows_of(run, line)
        first[rows], second[rows] = run.channels[b][rows], sign * run.channels[a][rows]
        return changed(run, {a: first, b: second})

    return make


def rows_moved(source: Callable[[sd.Measurement], np.ndarray]) -> Make:
    return lambda head: moved(run_of(head), source(run_of(head)))


def lines_exchanged(a: str, b: str) -> Make:
    def source(run: sd.Measurement) -> np.ndarray:
        rows = np.arange(len(run))
        rows[rows_of(run, a)], rows[rows_of(run, b)] = rows_of(run, b), rows_of(run, a)
        return rows

    return rows_moved(source)


def of_line(line: str, new: Callable[[np.ndarray], np.ndarray]) -> Make:
    def source(run: sd.Measurement) -> np.ndarray:
        rows = np.arange(len(run))
        rows[rows_of(run, line)] = new(rows_of(run, line))
        return rows

    return rows_moved(source)


def really(plan: sd.Plan | None = None, head: sd.Head | None = None, chain: str = CHAIN) -> Make:
    """Another plan, head or chain than the scenario has."""
    return lambda name: simulated(described(name, steps=STEPS), seed=4, plan=plan, head=head, chain=chain)


BEAMS = described("multi_beam", steps=STEPS).known.head.beam_offsets
RIGHT_ANGLE = np.array([[0.0, -1.0], [1.0, 0.0]])
PLACES = np.arange(3 * STEPS + 1)
TWICE = np.where(PLACES > 7, PLACES - 1, PLACES)

CASES: list[tuple[str, str, Make, str]] = [
    ("sign", "ideal", scaled("alpha", -1.0), "alpha has the wrong sign on all lines"),
    ("sign", "psd", scaled("spot_x", -1.0), "spot_x has the wrong sign on all lines"),
    ("sign", "psd", scaled("spot_y", -1.0, "npp"), "spot_y has the wrong sign on line npp"),
    ("sign", "multi_beam", scaled("d1 d2 d3", -1.0), "d1, d2 and d3 have the wrong sign on all lines"),
    ("exchanged", "ideal", exchanged("alpha", "beta"), "alpha and beta are exchanged on all lines"),
    ("exchanged", "multi_beam", exchanged("d1", "d2"), "d1 and d2 are exchanged on all lines"),
    ("turned", "ideal", scaled("alpha beta", -1.0), "the head is turned by 180° about its beam (upside down)"),
    ("turned", "psd", exchanged("spot_x", "spot_y", "pnp", -1.0), "turned by 90° about its beam on line pnp"),
    (
        "turned",
        "multi_beam",
        really(head=sd.Head("multi_beam", beam_offsets=BEAMS @ RIGHT_ANGLE.T)),
        "the head is turned by 90° about its beam on all lines",
    ),
    (
        "mirrored",
        "multi_beam",
        really(head=sd.Head("multi_beam", beam_offsets=BEAMS * [1.0, -1.0])),
        "the y coordinates in beam_offsets_mm have the wrong sign",
    ),
    ("factor", "ideal", scaled("alpha beta", 2.0), "alpha and beta are too large by a factor of 2 on all lines"),
    ("factor", "ideal", scaled("alpha beta", 1000.0), "alpha and beta are too large by a factor of 1000"),
    ("factor", "psd", scaled("spot_x", 2.0), "spot_x is too large by a factor of 2 on all lines"),
    ("factor", "ideal", scaled("distance", 2.0), "distance is too large by a factor of 2 on all lines"),
    ("factor", "psd", scaled("distance", 1e-3), "distance is too small by a factor of 1000 on all lines: in m"),
    ("lines exchanged", "ideal", lines_exchanged("ppp", "npp"), "lines ppp and npp are exchanged"),
    ("lines exchanged", "ideal", lines_exchanged("p00", "0p0"), "lines p00 and 0p0 are exchanged"),
    ("reversed", "ideal", of_line("npp", lambda rows: rows[::-1]), "line npp is reversed: its points stand from"),
    (
        "reversed",
        "psd",
        really(step_plan(STEPS, lines=["ppp", "npp", "pnp", "ppn"])),
        "line nnp is reversed: it was measured as ppn",
    ),
    ("order", "multi_beam", really(step_plan(STEPS, order="ZXY")), "the step order is ZXY, not XYZ"),
    ("chain", "ideal", really(chain="[w Y' b X Z t]"), "its axes in the order Y X Z from workpiece to tool, not X Y Z"),
    ("shifted", "ideal", of_line("pnp", lambda rows: rows[TWICE]),
     "line pnp: a point was read twice before point 8"),
    ("shifted", "psd", of_line("ppp", lambda rows: np.append(np.delete(rows, 9), -1)),
     "line ppp: a point was skipped before point 9"),
    ("volume", "ideal", really(step_plan(STEPS, volume=(810.0, 600.0, 500.0))), "x_mm = 810"),
    ("psd distance", "psd", really(head=sd.Head("psd", psd_distance=300.0)), "psd_distance_mm is about 299, not 100"),
    ("near factor", "ideal", lambda head: scale_lines_scaled(run_of(head)), "distance on the scale lines has a factor"),
]  # fmt: skip


def scale_lines_scaled(run: sd.Measurement) -> sd.Measurement:
    factors = np.where([line.count("0") == 2 for line in run.line], 1.000271, 1.0)
    return changed(run, {"distance": run.channels["distance"] * factors})


@pytest.mark.slow
@pytest.mark.parametrize(("entry", "head", "make", "words"), CASES, ids=[f"{c[0]}-{c[1]}-{c[3][:40]}" for c in CASES])
def test_mistake_is_named(entry: str, head: str, make: Make, words: str) -> None:
    scenario = described(head, steps=STEPS)
    found = sd.find_mistakes(scenario, make(head))
    assert any(one.entry == entry and words in one.text for one in found), found
    assert all(one.fit in ("accepted", "doubtful") for one in found)


def test_every_entry_has_a_test() -> None:
    assert {case[0] for case in CASES} | {"other head", "axes reversed"} == {mistake.name for mistake in CATALOGUE}


def test_head_of_another_line_is_named() -> None:
    text = """
[head.left]
layout = "psd"
psd_distance_mm = 100.0
[head.right]
layout = "psd"
psd_distance_mm = 400.0
[line]
"""
    lines = [*DIAGONALS, "p00", "0p0", "00p"]
    heads = dict.fromkeys(lines, "left") | {"pnp": "right", "nnp": "right"}
    scenario = described(text + "".join(f'{line} = {{head = "{name}"}}\n' for line, name in heads.items()), steps=STEPS)
    known = scenario.known
    actual = dict(known.heads) | {"npp": known.heads["pnp"]}
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=4, intervals=STEPS))
    run = sd.simulate(
        machine, known.plan, actual, misalignment=set_ups("psd", lines, seed=4), noise=sd.Noise(seed=4, **NOISE)
    )
    (found,) = sd.find_mistakes(scenario, run)
    assert found.text == "line npp was measured by the head right"
    assert found.edit == 'in [line.npp] head = "right"'
