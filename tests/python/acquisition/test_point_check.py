"""A reading that is not where the plan has it is told at once, and what a machine and a set-up do is not."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from acquiring import BEAMS, IDEAL, LINES, SMALL, Listener, acquire_through, fast, points_of, scenario
from hypothesis import given, settings
from hypothesis import strategies as st

from stepdiag.acquisition.acquire import Acquired, acquire
from stepdiag.acquisition.point_check import MOST, PointCheck
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.triggers import KeyTrigger
from stepdiag.cli.at_machine.operators import Terminal
from stepdiag.instruments.instrument import columns_of_signals
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import Scenario, parse_scenario, simulate_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.server import Twin

PSD = 'layout = "psd"\npsd_distance_mm = 80.0'
HEADS = [PSD, IDEAL, BEAMS]
PLANS = [
    LINES + "\nbackward = true",
    'lines = ["ppp", "0pp"]\nsteps = 3\nrepeats = 2',
    'lines = ["ppp", "npp", "p00"]\nsteps = 40\ncheck_points = 4',
    'lines = ["pnp"]\nsteps = 100',
]
MACHINE = """
[volume]
x_mm = {x}
y_mm = {y}
z_mm = {z}
[machine]
chain = "[w X' b Y Z t]"
tool_mm = [3.0, -2.0, 140.0]
[machine.random]
seed = {seed}
translation_um = 100.0
rotation_urad = 300.0
squareness_urad = 300.0
[plan]
{plan}
[head]
{head}
[misalignment]
reflector_urad = [{a}, {b}]
laser_urad = [{b}, {c}]
lateral_mm = [1.0, -2.0]
roll_urad = 5000.0
[noise]
distance_um = 5.0
"""
MILLIRADIANS = st.floats(-5000.0, 5000.0)
EDGES = st.floats(60.0, 1500.0)


def texts(described: Scenario, change: Callable[[str, "np.ndarray"], "np.ndarray"] = lambda _, d: d) -> list[str]:
    """What is told of the simulated run, its distances of each line changed so."""
    run = simulate_scenario(described)
    check = PointCheck(described.known, columns_of_signals(described.known.signals), 1)
    channels = {name: np.array(run.channels[name]) for name in described.known.signals}
    for line in set(run.line):
        rows = [row for row, own in enumerate(run.line) if own == line]
        for name in channels:
            if name.startswith("d"):
                channels[name][rows] = change(line, channels[name][rows])
    values = iter(zip(*channels.values(), strict=True))
    found = [
        check.look(visit, index, tuple(float(value) for value in next(values)))
        for visit in visits_of(described.known)
        for index in range(len(visit.points))
    ]
    return [text for text in found if text is not None]


@settings(max_examples=40, deadline=None)
@given(
    plan=st.sampled_from(PLANS),
    head=st.sampled_from(HEADS),
    seed=st.integers(0, 1000),
    edges=st.tuples(EDGES, EDGES, EDGES),
    angles=st.tuples(MILLIRADIANS, MILLIRADIANS, MILLIRADIANS),
)
def test_bad_machine_with_a_crooked_set_up_is_not_cried_at(
    plan: str, head: str, seed: int, edges: tuple[float, float, float], angles: tuple[float, float, float]
) -> None:
    (x, y, z), (a, b, c) = edges, angles
    text = MACHINE.format(x=x, y=y, z=z, seed=seed, plan=plan, head=head, a=a, b=b, c=c)
    assert texts(parse_scenario(text)) == []


@pytest.mark.parametrize("head", HEADS, ids=["psd", "ideal", "multi_beam"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda _, d: np.concatenate([d[:3], d[2:-1]]), "did the mirror move?"),
        (lambda _, d: np.concatenate([d[:3], d[2:3], d[4:]]), "did the mirror move?"),
        (lambda _, d: np.concatenate([d[:3], d[4:], d[-1:]]), "this is the distance of point 4"),
        (lambda _, d: 2 * d[0] - d, "it is the other way round: X may move the wrong way"),
        (lambda _, d: d * 1.5, "is it this point, and this line's head?"),
        (lambda _, d: d + 7.0 * (np.arange(len(d)) >= 5), "changed by +"),
    ],
    ids=["twice", "still", "skipped", "sign", "scale", "slip"],
)
def test_mistake_is_told_at_its_point(
    head: str, change: Callable[[str, "np.ndarray"], "np.ndarray"], message: str
) -> None:
    found = texts(scenario(plan='lines = ["ppp"]\nsteps = 4', head=head), change)
    assert any(message in text for text in found), found
    assert len(found) <= MOST


def test_axis_that_moves_the_wrong_way_is_named() -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 4')
    visit = next(iter(visits_of(described.known)))
    along = described.known.plan.frame("ppp")[:, 2]
    reversed_y = visit.positions @ (along * [1, -1, 1])

    def change(_: str, d: "np.ndarray") -> "np.ndarray":
        return d - visit.positions @ along + reversed_y

    found = texts(described, change)
    assert "since point 1, where the plan has" in found[0]
    assert "Y may move the wrong way" in found[0]
    assert found[-1].endswith("; no more is said of this visit")


def test_mirror_that_stands_while_steps_are_short_is_told_when_it_shows() -> None:
    found = texts(scenario(plan='lines = ["ppp"]\nsteps = 200'), lambda _, d: np.full(len(d), d[0]))
    assert len(found) == 1
    assert "did the mirror move?" in found[0]


def test_beam_that_does_not_follow_is_named() -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 4')
    run = simulate_scenario(described)
    check = PointCheck(described.known, columns_of_signals(described.known.signals), 1)
    visit = next(iter(visits_of(described.known)))
    rows = zip(run.channels["d1"], np.full(len(run), 3.0), run.channels["d3"], strict=True)
    found = [check.look(visit, index, tuple(map(float, row))) for index, row in enumerate(rows)]
    assert found[0] is None
    assert str(found[1]).startswith("d2 changed by +0.000 mm since point 0, where the plan has +")
    assert "is this beam on the mirror" in str(found[1])


def test_slip_is_told_once_and_the_next_set_up_begins_anew() -> None:
    def change(line: str, d: "np.ndarray") -> "np.ndarray":
        return d + 5.0 * (np.arange(len(d)) >= 4) + (1000.0 if line == "npp" else 0.0)

    found = texts(scenario(plan='lines = ["ppp", "npp"]\nsteps = 4'), change)
    assert len(found) == 2
    assert all("since point 3" in text for text in found)


@dataclass
class Deciding(Listener):
    """An operator who forgets to move the mirror at one point, and is asked what to do."""

    twin: Twin | None = None
    points: list[list[float]] | None = None
    repeat: bool = True

    def confirm(self, text: str) -> None:
        super().confirm(text)
        if len(self.asked) != 4:
            self._move()

    def repeats(self, text: str) -> bool:
        super().repeats(text)
        self._move()
        return self.repeat

    def _move(self) -> None:
        assert self.twin is not None
        assert self.points is not None
        self.twin.instrument.move_to(self.points[len(self.asked) - 1])


def decided(tmp_path: Path, *, repeat: bool) -> tuple[Scenario, Acquired, Deciding]:
    described = scenario(plan=SMALL)
    with Twin(described) as twin:
        operator = Deciding(twin=twin, points=[position for _, _, position in points_of(described)], repeat=repeat)
        result = acquire(
            described, twin.source, tmp_path / "run.csv", trigger=KeyTrigger(), options=fast(), operator=operator
        )
    return described, result, operator


def test_operator_repeats_a_point_and_the_second_reading_counts(tmp_path: Path) -> None:
    described, result, operator = decided(tmp_path, repeat=True)
    assert result.complete
    (odd,) = [text for text in operator.told if "did the mirror move?" in text]
    assert odd.startswith("visit 1 (line ppp, run 0, forward), point 3 at X40 Y30 Z25: the distance changed by +0.0")
    expected = simulate_scenario(described).channels["d1"]
    assert np.array_equal(read_measurement(tmp_path / "run.csv").channels["d1"], np.round(expected * 1e9) / 1e9)
    readings = [record for record in read_raw(tmp_path / "run.raw.jsonl").records if record.record == "reading"]
    assert len(readings) == 29


def test_operator_keeps_a_point_and_the_others_are_not_blamed(tmp_path: Path) -> None:
    _, result, operator = decided(tmp_path, repeat=False)
    assert result.complete
    assert sum("did the mirror move?" in text for text in operator.told) == 1
    run = read_measurement(tmp_path / "run.csv")
    assert run.channels["d1"][3] == run.channels["d1"][2]


def test_controller_is_answered_and_the_operator_warned(tmp_path: Path) -> None:
    described, operator = scenario(plan=SMALL), Listener()
    with Twin(described) as twin:
        twin.instrument.move_to = lambda position, counts=True: None  # type: ignore[assignment, method-assign]
        result = acquire_through(described, twin, tmp_path / "run.csv", operator=operator)
    assert result.complete
    warned = [text for text in operator.told if text.startswith("warning: visit ")]
    assert len(warned) == 4 * MOST
    assert all("did the mirror move?" in text for text in warned)


@pytest.mark.parametrize(("typed", "repeats"), [("r\n", True), ("k\n", False), ("\nwhat\nR\n", True)])
def test_operator_at_the_terminal_is_asked(
    typed: str, repeats: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = typed.splitlines(keepends=True)

    class Typing:
        def isatty(self) -> bool:
            return True

        def readline(self) -> str:
            return lines.pop(0)

    monkeypatch.setattr(sys, "stdin", Typing())
    assert Terminal().repeats("point 3: odd") == repeats
    out = capsys.readouterr().out
    assert out.startswith("warning: point 3: odd\nrepeat [r], keep [k]: ")
    assert not lines


def test_nobody_at_the_terminal_keeps(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    class Piped:
        def isatty(self) -> bool:
            return False

    monkeypatch.setattr(sys, "stdin", Piped())
    assert not Terminal().repeats("point 3: odd")
    assert capsys.readouterr().out == "warning: point 3: odd\n"
