"""An acquisition that is watched: what it publishes, and what it does that watchers want."""

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acquiring import fast, scenario

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import Acquired, acquire, raw_path
from stepdiag.acquisition.control import ask_for
from stepdiag.acquisition.live_state import MESSAGES, LiveFile, LiveState, control_path, live_path, read_live
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.raw_records import Again, Remark
from stepdiag.acquisition.settle_trigger import SettleTrigger
from stepdiag.acquisition.triggers import KeyTrigger, Trigger
from stepdiag.cli.at_machine.operators import Watched
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import Scenario, simulate_scenario
from stepdiag.twin.instrument import TwinBehaviour
from stepdiag.twin.server import Twin

SECONDS = 20.0


class Watching:
    """An acquisition in a thread, and what a page does with it."""

    def __init__(self, output: Path) -> None:
        self.live, self.control = live_path(raw_path(output)), control_path(raw_path(output))
        self.result: Acquired | None = None
        self.error: BaseException | None = None

    def until(self, **wanted: Any) -> dict[str, Any]:
        """Waits for a state; callables are asked."""
        deadline = time.monotonic() + SECONDS
        while time.monotonic() < deadline:
            state = read_live(self.live)
            if state is not None and all(
                value(state[key]) if callable(value) else state[key] == value for key, value in wanted.items()
            ):
                return state
            assert self.error is None, self.error
            time.sleep(0.005)
        raise AssertionError(f"expected {wanted}, got {read_live(self.live)}")

    def ask(self, control: Any, text: str = "") -> None:
        ask_for(self.control, control, text)

    def confirm(self, number: int) -> dict[str, Any]:
        """Answers the question of this number."""
        state = self.until(asked=number, doing="asks", values=len)
        self.ask("confirm", str(number))
        self.until(stored=state["stored"] + 1)  # the machine does not move before
        return state


@contextmanager
def watched(described: Scenario, twin: Twin, output: Path, trigger: Trigger, **options: Any) -> Iterator[Watching]:
    watching = Watching(output)

    def run() -> None:
        try:
            watching.result = acquire(
                described,
                twin.source,
                output,
                trigger=trigger,
                options=fast(),
                operator=Watched(),
                watched=True,
                **options,
            )
        except BaseException as error:  # for the test's own thread
            watching.error = error

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield watching
    finally:
        with_end = live_path(raw_path(output)).exists() and thread.is_alive()
        if with_end and watching.result is None:
            ask_for(watching.control, "stop")
        thread.join(SECONDS)


def test_page_answers_and_sees_every_point(tmp_path: Path) -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 2')
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page:
        positions = described.known.plan.points("ppp")
        for number, position in enumerate(positions, start=1):
            twin.instrument.move_to(position)
            state = page.confirm(number)
            assert state["question"].startswith(f"read visit 1 (line ppp, run 0, forward), point {number - 1} at")
            assert (state["point"], state["points"], state["answers"]) == (number - 1, 7, ["confirm"])
            assert state["values"].keys() == {"d1_pm", "d2_pm", "d3_pm"}
        end = page.until(doing="ended")
    assert page.result is not None
    assert page.result.complete
    assert (end["readings"], end["planned"], end["lost"]) == (7, 7, 0)
    simulated = simulate_scenario(described).channels["d1"]
    assert np.allclose(read_measurement(tmp_path / "run.csv").channels["d1"], simulated, rtol=0.0, atol=1e-9)


def test_distance_lives_while_nothing_is_read(tmp_path: Path) -> None:
    """The machine moves, nobody has confirmed anything: the page shows where the mirror is, from nominal."""
    described = scenario(plan='lines = ["ppp"]\nsteps = 2')
    points = described.known.plan.points("ppp")
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page:
        twin.instrument.move_to(points[0])
        page.confirm(1)
        page.until(asked=2)
        twin.instrument.move_to(points[1])
        state = page.until(from_nominal_um=lambda value: value is not None and abs(value) < 100.0)
        assert state["readings"] == 1
        twin.instrument.move_to(points[1] + np.array([1.0, 0.0, 0.0]))
        page.until(from_nominal_um=lambda value: value is not None and 600.0 < value < 1000.0)


def test_lost_point_is_read_once_more(tmp_path: Path) -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 2')
    points = described.known.plan.points("ppp")
    behaviour = TwinBehaviour(latch=False, lost=frozenset({(1, 1)}))
    with (
        Twin(described, behaviour=behaviour) as twin,
        watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page,
    ):
        twin.instrument.move_to(points[0])
        page.confirm(1)
        twin.instrument.move_to(points[1])
        page.until(asked=2)
        page.confirm(2)
        page.until(asked=3, lost=1)
        twin.instrument._behaviour = TwinBehaviour(latch=False)
        page.ask("repeat_point")
        page.until(asked=4)
        twin.instrument.move_to(points[1], counts=False)
        page.confirm(4)
        page.until(asked=5, lost=0, readings=2)
    assert isinstance(page.error, KeyboardInterrupt)
    readings = read_raw(tmp_path / "run.raw.jsonl").readings()
    assert not readings[1, 1].is_lost
    assert len(read_measurement(tmp_path / "run.csv")) == 2


def test_line_is_read_once_more_and_remarks_are_kept(tmp_path: Path) -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 1')
    points = described.known.plan.points("ppp")
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page:
        for number in (1, 2):
            twin.instrument.move_to(points[number - 1])
            page.confirm(number)
        page.until(asked=3)
        page.ask("remark", "somebody opened the door")
        page.ask("repeat_line")
        page.until(asked=4, point=0)
        for number, point in enumerate(points, start=4):
            twin.instrument.move_to(point)
            page.confirm(number)
    assert page.result is not None
    assert page.result.complete
    records = read_raw(tmp_path / "run.raw.jsonl").records
    assert [(one.visit, one.point, one.text) for one in records if isinstance(one, Remark)] == [
        (1, 2, "somebody opened the door")
    ]
    assert [one.visit for one in records if isinstance(one, Again)] == [1]


def test_pause_reads_nothing_until_it_goes_on(tmp_path: Path) -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 1')
    points = described.known.plan.points("ppp")
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", SettleTrigger()) as page:
        twin.instrument.move_to(points[0])
        page.confirm(1)
        page.until(readings=1)
        page.ask("pause")
        page.until(doing="paused")
        twin.instrument.move_to(points[1])
        time.sleep(0.3)
        assert page.until(doing="paused")["readings"] == 1
        page.ask("go_on")
        page.until(readings=2)
        page.ask("repeat_point")  # the mirror stands there
        page.until(stored=3, readings=2)
        for readings, point in ((3, points[2]), (4, points[3])):
            twin.instrument.move_to(point)
            page.until(readings=readings)
    assert page.result is not None
    assert page.result.complete
    simulated = simulate_scenario(described).channels["d1"]
    assert np.allclose(read_measurement(tmp_path / "run.csv").channels["d1"], simulated, rtol=0.0, atol=1e-9)


def test_answer_to_an_earlier_question_does_not_count(tmp_path: Path) -> None:
    """Two pages watch: both press the button."""
    described = scenario(plan='lines = ["ppp"]\nsteps = 1')
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page:
        twin.instrument.move_to(described.known.plan.points("ppp")[0])
        page.confirm(1)
        page.ask("confirm", "1")
        page.until(asked=2)
        page.ask("confirm", "1")
        time.sleep(0.3)
        assert page.until(doing="asks")["readings"] == 1


def test_words_that_are_not_known_change_nothing(tmp_path: Path) -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 1')
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page:
        page.until(asked=1)
        with page.control.open("ab") as file:
            file.write(b'{"control": "explode"}\n[]\n\xff\n{"control": ["stop"]}\n"stop"\n' + b"[" * 5000 + b"\n")
        time.sleep(0.2)
        twin.instrument.move_to(described.known.plan.points("ppp")[0])
        page.confirm(1)
        page.until(readings=1)
    with pytest.raises(InvalidArgument, match="expected one of confirm, pause"):
        ask_for(page.control, "explode")  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match="no acquisition is running"):
        ask_for(tmp_path / ".other.control.jsonl", "stop")


def test_state_is_read_whole_while_it_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / ".run.live.json"
    ended = threading.Event()

    def publish() -> None:
        with LiveFile(path) as file:
            state = LiveState()
            while not ended.is_set():
                state.readings += 1
                state.question = "?" * (state.readings % 900)
                file.publish(state)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        while read_live(path) is None:
            time.sleep(0.001)
        seen = 0
        for _ in range(2000):
            found = read_live(path)
            if found is not None:
                assert len(found["question"]) == found["readings"] % 900
                assert found["readings"] >= seen
                seen = found["readings"]
        assert seen > 0
    finally:
        ended.set()
        thread.join()
    assert path.stat().st_size == 2**14


def test_state_does_not_grow() -> None:
    state = LiveState()
    for _ in range(100):
        state.tell("x" * 1000)
    assert len(state.messages) == MESSAGES
    assert len(json.dumps(state.messages)) < 5000
    assert state.messages[-1][0] == 100


def test_what_comes_with_an_answer_is_done_too(tmp_path: Path) -> None:
    """Yes and stop in one look: the point is read, then it stops."""
    described = scenario(plan='lines = ["ppp"]\nsteps = 1')
    with Twin(described) as twin, watched(described, twin, tmp_path / "run.csv", KeyTrigger()) as page:
        twin.instrument.move_to(described.known.plan.points("ppp")[0])
        page.until(asked=1, values=len)
        with page.control.open("ab") as file:
            file.write(b'{"control": "confirm"}\n{"control": "remark", "text": "late"}\n{"control": "stop"}\n')
        page.until(doing="ended", readings=1, failure="stopped")
    assert isinstance(page.error, KeyboardInterrupt)
    assert any(isinstance(one, Remark) for one in read_raw(tmp_path / "run.raw.jsonl").records)
