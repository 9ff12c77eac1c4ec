"""A mirror that comes to rest at the next point is read, and none that rests elsewhere."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from acquiring import SMALL, Listener, fast, points_of, scenario

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import acquire
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.settle_trigger import SettleTrigger
from stepdiag.acquisition.settling import Reading, Settling, take_reading
from stepdiag.acquisition.triggers import Context, Missed, Stopped
from stepdiag.instruments.instrument import ReadColumn, Sample
from stepdiag.io.data_files import read_measurement
from stepdiag.program.options import Options, space_of
from stepdiag.program.path import Align, Feed, Read, actions_of
from stepdiag.scenario.description import simulate_scenario
from stepdiag.scenario.order_of_run import Visit, visits_of
from stepdiag.twin.instrument import TwinBehaviour
from stepdiag.twin.server import Twin

MILLIMETRE = 10**9  # pm
LINE = 'lines = ["ppp"]\nsteps = 1'
BEAMS = [ReadColumn(f"d{i}", "pm") for i in (1, 2, 3)]
SETTLING = Settling(count=3, limit_um=0.1, average=2, interval=0.0)
Rows = Iterable[tuple[float | None, ...]]


def at(*distances: float | None) -> Rows:
    """Rests at these distances, mm, one after the other."""
    return [(distance,) * 3 for distance in distances for _ in range(SETTLING.count)]


class StillWaitingError(Exception):
    """The trigger has seen all there was, the last of it for long, and no point in it."""


class Followed:
    """A trigger that sees these distances, and after its first reading waits for the points of a nominal visit."""

    def __init__(self, rows: Rows, *, sign: int = 1) -> None:
        rows = list(rows)
        self.rows: Iterator[tuple[float | None, ...]] = iter([*rows, *rows[-1:] * 20])
        self.last: tuple[float | None, ...] = (0.0, 0.0, 0.0)
        self.sign = sign
        self.operator = Listener()
        self.trigger = SettleTrigger()
        self.trigger.start(Context(self.read, BEAMS, SETTLING, 60.0, sign, self.operator))
        self.visits = list(visits_of(scenario(plan=SMALL).known))

    def read(self) -> Sample:
        self.last = next(self.rows, ())
        if not self.last:
            raise StillWaitingError
        pm = tuple(None if value is None else self.sign * round(value * MILLIMETRE) for value in self.last)
        return Sample(pm, tuple("no beam" if value is None else "" for value in self.last))

    def begin(self, visit: int = 1, distance: float | None = 0.0) -> None:
        self.trigger.begin(self.visits[visit - 1], 0, "set-up")
        assert self.wait(0, visit=visit)
        self.stored(distance)

    def wait(self, index: int, nominal: Iterable[float] = (0, 1, 2, 3, 4, 5, 6), *, visit: int = 1) -> bool:
        return self.trigger.wait(self.visits[visit - 1], index, [float(d) for d in nominal])

    def stored(self, *distances: float | None) -> None:
        pm = [None if d is None else self.sign * round(d * MILLIMETRE) for d in distances]
        self.trigger.stored(self.visits[0], 0, tuple(pm * (3 // len(pm))))


@pytest.mark.parametrize("sign", [1, -1])
def test_rest_a_step_further_is_the_next_point(sign: int) -> None:
    followed = Followed(at(0.0, 0.001, 1.02), sign=sign)
    followed.begin()
    assert followed.wait(1)
    assert followed.last == (1.02, 1.02, 1.02)
    assert followed.operator.asked == [
        "set-up 1, line ppp: aligned, and at rest at point 0 at X0 Y0 Z0? Confirm, then start the machine"
    ]


def test_moving_mirror_is_not_read_on_its_way() -> None:
    moving = [(0.01 * k,) * 3 for k in range(100)]
    followed = Followed([*moving, *at(1.0)])
    followed.begin()
    assert followed.wait(1)
    assert followed.last == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("elsewhere", [0.5, 1.6, -1.0, 0.2])
def test_rest_elsewhere_is_told_and_not_read(elsewhere: float) -> None:
    followed = Followed(at(0.0, elsewhere))
    followed.begin()
    with pytest.raises(StillWaitingError):
        followed.wait(1)
    told = [text for text in followed.operator.told if "rests" in text]
    if abs(elsewhere) > 0.25:  # else it may still be on its way, or be at the last point
        assert told[0].startswith(f"the mirror rests {elsewhere:+.4f} mm from the last point, but it is +1.0000 mm")
    assert len(told) <= 1  # not many times a second


def test_mirror_at_rest_one_point_on_has_missed_one() -> None:
    followed = Followed(at(0.0, 2.01, 2.01, 3.0))  # it stays there
    followed.begin()
    with pytest.raises(Missed, match="missed: the mirror rests at a later point"):
        followed.wait(1)
    followed.stored(None)
    assert followed.wait(2)
    assert followed.last == (2.01, 2.01, 2.01)
    followed.stored(2.01)
    assert followed.wait(3)


def test_two_points_missed_at_once_are_passed_over() -> None:
    followed = Followed(at(0.0, *[3.0] * 3))
    followed.begin()
    for index in (1, 2):
        with pytest.raises(Missed):
            followed.wait(index)
        followed.stored(None)
    assert followed.wait(3)


def test_mirror_that_stays_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepdiag.acquisition.settle_trigger.STAYS", 0.0)
    followed = Followed(at(0.0, 0.0))
    followed.begin()
    with pytest.raises(StillWaitingError):
        followed.wait(1)
    assert sum("stays at the last point" in text for text in followed.operator.told) == 1


def test_third_point_missed_in_a_row_stops_and_says_how_to_go_on() -> None:
    followed = Followed(at(0.0, 2.0, 3.0, 4.0))
    followed.begin()
    for index in (1, 2):
        with pytest.raises(Missed):
            followed.wait(index)
        followed.rows = iter(at(index + 2.0))
        followed.stored(None)
    with pytest.raises(Stopped, match=r"point 3 .*the third in a row: .*dwell is too short.* go on by `resume`"):
        followed.wait(3)


def test_mirror_on_its_way_back_has_missed_nothing() -> None:
    """The way to the first point of a visit, or to a check point, leads past others."""
    followed = Followed(at(5.0, 1.0, 0.0))
    followed.begin(distance=5.0)
    followed.trigger._last_nominal = 5.0
    followed.trigger.begin(followed.visits[1], 0, "stays")
    assert followed.wait(0, visit=2)
    assert followed.last == (0.0, 0.0, 0.0)


def test_mirror_that_comes_back_after_a_missed_point_is_not_read_as_that() -> None:
    followed = Followed(at(0.0, 2.0))
    followed.begin()
    with pytest.raises(Missed):
        followed.wait(1)
    followed.stored(None)
    followed.rows = iter(at(1.5, 0.0, 2.0))
    assert followed.wait(2)
    assert followed.last == (2.0, 2.0, 2.0)


def test_run_goes_on_after_a_missed_point(tmp_path: Path) -> None:
    described = scenario(plan=LINE)
    points, raw = points_of(described), tmp_path / "run.raw.jsonl"
    operator = Listener()
    with Twin(described) as twin, ThreadPoolExecutor(1) as pool:
        running = pool.submit(
            acquire,
            described,
            twin.source,
            tmp_path / "run.csv",
            trigger=SettleTrigger(),
            options=fast(),
            operator=operator,
        )
        for index in (0, 2, 3):
            if index:
                twin.instrument.move_to(points[index][2])
            wait_for(lambda: taken(raw) > index, f"reading {index}")  # noqa: B023
        result = running.result(10)
    assert (result.readings, result.lost) == (4, 1)
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    assert np.isnan(run.channels["d1"]).tolist() == [False, True, False, False]
    assert abs(run.channels["d1"][2] - expected.channels["d1"][2]) < 1e-9
    assert any("point 1 at X80 Y0 Z0: d1, d2, d3 are lost: missed" in text for text in operator.told)


def test_mirror_that_leaves_and_comes_back_is_read_once_more() -> None:
    followed = Followed(at(0.0, -0.58, 0.002, 1.0))
    followed.begin()
    assert not followed.wait(1)
    assert followed.last == (0.002, 0.002, 0.002)
    followed.stored(0.002)
    assert followed.wait(1)


def test_mirror_that_stays_is_not_read_twice() -> None:
    followed = Followed(at(0.0, 0.03, -0.02, 0.0))
    followed.begin()
    with pytest.raises(StillWaitingError):
        followed.wait(1)


def test_visit_that_begins_where_the_last_one_ended_begins_at_once() -> None:
    followed = Followed(at(0.0, 0.6, 0.0, -1.0))
    followed.begin()
    backward = (0, -1, -2)
    followed.trigger.begin(followed.visits[1], 0, "stays")
    assert followed.wait(0, backward, visit=2)
    followed.stored(0.0)
    assert not followed.wait(1, backward, visit=2)  # it came back from the other side
    followed.stored(0.0)
    assert followed.wait(1, backward, visit=2)
    assert len(followed.operator.asked) == 1


def test_visit_that_begins_elsewhere_begins_when_the_mirror_is_there() -> None:
    followed = Followed(at(5.0, 0.3, 0.002))
    followed.begin(distance=5.0)
    followed.trigger._last_nominal = 5.0
    followed.trigger.begin(followed.visits[1], 0, "stays")
    assert followed.wait(0, visit=2)
    assert followed.last == (0.002, 0.002, 0.002)


def test_every_set_up_begins_with_the_operator() -> None:
    followed = Followed(at(0.0))
    followed.begin(1)
    followed.begin(3)
    assert [text[:8] for text in followed.operator.asked] == ["set-up 1", "set-up 2"]


def test_rest_is_told_by_the_beams_that_are_there() -> None:
    followed = Followed([(None, 1.0, None)] * 5)
    followed.begin()
    followed.stored(0.0, 0.0, None)
    assert followed.wait(1)


def test_after_a_lost_reading_the_next_rest_is_told_from_the_point_before() -> None:
    followed = Followed(at(0.0, 1.0, 2.01))
    followed.begin()
    assert followed.wait(1)
    followed.stored(None)
    assert followed.wait(2)
    assert followed.last == (2.01, 2.01, 2.01)


def test_after_a_lost_beginning_the_operator_is_asked_again() -> None:
    followed = Followed(at(0.0, 1.0))
    followed.begin(distance=None)
    assert followed.wait(1)
    followed.stored(1.0)
    assert [text.partition(":")[0] for text in followed.operator.asked[1:]] == ["no reading to go on from"]


def test_reading_of_a_mirror_that_moved_on_is_doubted() -> None:
    followed = Followed(at(0.0, 1.0))
    followed.begin()
    assert followed.wait(1)
    for last, doubt in ((1.01, None), (2.0, "the mirror moved on by 1.0000 mm while it was read")):
        rows = [*at(1.0), *at(*[last] * 4)]
        pm = [Sample(tuple(round((d or 0.0) * MILLIMETRE) for d in row), ("", "", "")) for row in rows]
        reading = take_reading(iter(pm).__next__, BEAMS, replace(SETTLING, count=4))  # not before it moves
        assert followed.trigger.doubt(reading) == doubt


def test_missing_beams_are_told() -> None:
    followed = Followed(at(None))
    followed.begin()
    with pytest.raises(StillWaitingError):
        followed.wait(1)
    assert "no beam: cannot tell where the mirror rests" in followed.operator.told


def test_step_that_no_distance_tells_is_the_operators() -> None:
    followed = Followed(at(0.0))
    followed.begin()
    assert followed.wait(1, (0, 0.001, 1, 2))
    assert followed.operator.asked[-1].startswith("the distance does not change in this step: read visit 1 ")


def wait_for(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.005)


def taken(raw: Path) -> int:
    """How many readings were taken, those that were repeated too."""
    try:
        return sum(record.record == "reading" for record in read_raw(raw).records)
    except InvalidArgument:
        return 0  # not written yet


@pytest.mark.slow
def test_run_of_a_program_that_waits_at_each_point_is_acquired(tmp_path: Path) -> None:
    described = scenario()
    points = points_of(described)
    begins = [index for index, (visit, _, _) in enumerate(points) if index == 0 or points[index - 1][0] != visit]
    raw = tmp_path / "run.raw.jsonl"

    class Beginning(Listener):
        def confirm(self, text: str) -> None:
            super().confirm(text)
            twin.instrument.move_to(points[14 * (len(self.asked) - 1)][2])

    operator = Beginning()
    with Twin(described, behaviour=TwinBehaviour(settling=0.03)) as twin, ThreadPoolExecutor(1) as pool:
        running = pool.submit(
            acquire,
            described,
            twin.source,
            tmp_path / "run.csv",
            trigger=SettleTrigger(),
            options=fast(settling=Settling(count=3, limit_um=0.1, average=2, interval=0.001)),
            operator=operator,
        )
        for index, (_, _, position) in enumerate(points):
            if index not in begins:
                twin.instrument.move_to(position)
            wait_for(lambda: taken(raw) > index, f"reading {index}")  # noqa: B023
        result = running.result(10)
    assert result.complete
    assert result.lost == 0
    assert len(operator.asked) == 2  # once a set-up
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    for name in ("d1", "d2", "d3"):
        # What still rings after it is within the limit of 0.1 um, on every axis.
        assert np.max(np.abs(run.channels[name] - expected.channels[name])) < 2e-4
    values = [record for record in read_raw(raw).records if record.record == "value"]
    assert any(record.kind == "settling" for record in values)


@pytest.mark.slow
def test_twin_that_moves_by_itself_is_followed(tmp_path: Path) -> None:
    described = scenario(plan=LINE.replace("ppp", "p00") + "\nbackward = true")
    operator = Listener()
    with Twin(described, play=0.8) as twin:  # a hundred times what a reading takes here
        result = acquire(
            described,
            twin.source,
            tmp_path / "run.csv",
            trigger=SettleTrigger(),
            options=fast(settling=Settling(count=3, average=2, interval=0.001)),
            operator=operator,
        )
    assert result.complete
    assert len(operator.asked) == 1
    expected = np.round(simulate_scenario(described).channels["d2"] * 1e9) / 1e9
    assert np.array_equal(read_measurement(tmp_path / "run.csv").channels["d2"], expected)


def test_mirror_at_rest_elsewhere_waits_for_the_point(tmp_path: Path) -> None:
    described = scenario(plan=LINE)
    seen = threading.Event()

    class Watching(Listener):
        def tell(self, text: str) -> None:
            super().tell(text)
            if "rests" in text:
                seen.set()

    operator = Watching()
    raw = tmp_path / "run.raw.jsonl"
    with Twin(described) as twin, ThreadPoolExecutor(1) as pool:
        running = pool.submit(
            acquire,
            described,
            twin.source,
            tmp_path / "run.csv",
            trigger=SettleTrigger(),
            options=fast(),
            operator=operator,
        )
        for index, (_, _, position) in enumerate(points_of(described)):
            if index == 2:
                twin.instrument.move_to([80.0, 30.0, 0.0])  # half of the way to the next
                assert seen.wait(10.0)
                assert taken(raw) == 2
            if index:
                twin.instrument.move_to(position)
            wait_for(lambda: taken(raw) > index, f"reading {index}")  # noqa: B023
        assert running.result(10).complete
    assert any("the mirror rests " in text and "point 2 at X80 Y60 Z0" in text for text in operator.told)


@pytest.mark.parametrize("more", ["\nbackward = true", "\ncheck_points = 1"])
def test_program_that_takes_up_backlash_is_followed(tmp_path: Path, more: str) -> None:
    described = scenario(plan=LINE + more)
    space = space_of(described.known, Options(dialect="iso", overrun=10.0))
    aligned = threading.Event()

    class Waiting(Listener):
        def confirm(self, text: str) -> None:
            super().confirm(text)
            assert aligned.wait(10.0)

    operator, raw, here = Waiting(), tmp_path / "run.raw.jsonl", np.zeros(3)
    with Twin(described) as twin, ThreadPoolExecutor(1) as pool:
        running = pool.submit(
            acquire,
            described,
            twin.source,
            tmp_path / "run.csv",
            trigger=SettleTrigger(),
            options=fast(settling=Settling(count=3, average=2, interval=0.001)),
            operator=operator,
        )
        for action in actions_of(list(visits_of(described.known)), space):
            if isinstance(action, Feed):
                # Where a loaded machine holds up this thread is taken for a rest. None of these is near a point:
                # the trigger takes what is within 5.6 mm, and the overrun changes the distance by 17 mm.
                for share in (0.2, 0.4, 0.6, 1.0):
                    twin.instrument.move_to(here + share * (action.position - here))
                    time.sleep(0.002)
                here = action.position
            elif isinstance(action, Align):
                aligned.set()
                wait_for(lambda: taken(raw) == 1, "the operator's reading")
            elif isinstance(action, Read):
                key = (action.visit.number, action.point)
                wait_for(lambda: key in read_raw(raw).readings(), f"reading {key}")  # noqa: B023
                time.sleep(0.05)  # its dwell
        result = running.result(10)
    assert result.complete
    assert len(operator.asked) == 1
    expected = np.round(simulate_scenario(described).channels["d1"] * 1e9) / 1e9
    assert np.array_equal(read_measurement(tmp_path / "run.csv").channels["d1"], expected)


def test_repetition_that_is_lost_leaves_the_reading_that_there_is(tmp_path: Path) -> None:
    described = scenario(plan=LINE)
    doubted: list[int] = []

    class Doubting(SettleTrigger):
        """Asks for the first point twice, and doubts what comes then."""

        def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
            doubted.append(index)
            return doubted.count(1) != 1 or index != 1

        def doubt(self, reading: Reading) -> str | None:
            return "doubted" if doubted == [0, 1] else None

    operator = Listener()
    with Twin(described) as twin:
        result = acquire(
            described, twin.source, tmp_path / "run.csv", trigger=Doubting(), options=fast(), operator=operator
        )
    assert result.complete
    assert result.lost == 0
    assert any("d1, d2, d3 are lost: doubted" in text for text in operator.told)
    records = [record for record in read_raw(tmp_path / "run.raw.jsonl").records if record.record != "session"]
    kinds = [record.record for record in records if record.record != "again" and record.point == 0]
    assert kinds.count("reading") == 1
    assert kinds.count("value") == 8
