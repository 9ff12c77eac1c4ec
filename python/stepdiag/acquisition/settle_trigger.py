"""A trigger for programs that only dwell: reads when the mirror comes to rest at the next point."""

import time
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NoReturn

from stepdiag.acquisition.settling import Reading, Settling, spread
from stepdiag.acquisition.triggers import Context, Missed, Seldom, Stopped, keeps, of_start, place_text, point_text
from stepdiag.instruments.instrument import ReadColumn, Row, change_of_distance
from stepdiag.scenario.order_of_run import Visit

# mm. A rest is the next point if it is within this share of the plan's shortest step of it. It is
# the last point if it is within BACK of it and the mirror was more than AWAY from it meanwhile. The
# distance cannot resolve steps below SMALLEST.
STEP_SHARE: Final = 0.25
AWAY: Final = 0.1
BACK: Final = 0.05
SMALLEST: Final = 0.01
STAYS: Final = 60.0  # s at rest at the last point, after which the operator is told
MISSED: Final = 3  # points in a row, after which the acquisition stops


class SettleTrigger:
    """Reads when the mirror comes to rest at the next point, judged by the change of the distance.

    The operator starts the first reading of every set-up. After that a mirror at rest one step
    further is at the next point. A mirror that left the last point and is at rest there again
    (programs do so to take up backlash) is read there once more. A visit that begins at the last
    point of the visit before is read there at once."""

    def __init__(self) -> None:
        self._context: Context | None = None
        self._set_up = 0
        self._last: Row | None = None  # the last point read in this set-up
        self._before: tuple[Row | None, float] = (None, 0.0)  # the one before it, and its nominal distance
        self._is_asked = False  # the operator has just asked for a reading
        self._last_nominal = 0.0
        self._nominal = 0.0  # distance at the point being read
        self._rest: Row | None = None  # rest position; None if the operator asked before the rest
        self._is_newest = False  # it is also the newest reading, which was not lost
        self._complaints = Seldom(1)  # of many looks in a second
        self._missed = 0  # in a row

    def start(self, context: Context) -> None:
        self._context = context

    def begin(self, visit: Visit, index: int, text: str) -> None:
        operator = of_start(self._context).operator
        operator.tell(text)
        if visit.set_up != self._set_up:
            operator.confirm(
                f"set-up {visit.set_up}, line {visit.line}: aligned, and at rest at {place_text(visit, index)}? "
                "Confirm, then start the machine"
            )
            self._last, self._is_asked = None, True
        self._set_up = visit.set_up

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        self._rest = None
        if self._last is None and not self._is_asked:  # no reading to start from
            operator = of_start(self._context).operator
            operator.confirm(f"no reading to go on from: at rest at {point_text(visit, index)}?")
        self._is_asked = False
        is_next = self._last is None or self._await(self._last, visit, index, nominal)
        self._nominal = nominal[index] if is_next else self._last_nominal
        return is_next

    def _await(self, last: Row, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        step = nominal[index] - self._last_nominal
        if abs(step) < SMALLEST:
            if index > 0:
                operator = of_start(self._context).operator
                operator.confirm(f"the distance does not change in this step: read {point_text(visit, index)}")
            else:
                self._rest = last
            return True
        later = [distance - self._last_nominal for distance in nominal[index + 1 :]]
        return self._watch(last, visit, index, step, later, STEP_SHARE * _shortest(nominal, step))

    def _watch(
        self, last: Row, visit: Visit, index: int, step: float, later: Sequence[float], tolerance: float
    ) -> bool:
        """step, later: from the last reading to this point and to those after it, mm of distance."""
        context = of_start(self._context)
        began = time.monotonic()
        deadline = began + context.wait_timeout
        is_told = False  # that it stays where it is
        window: deque[Row] = deque(maxlen=context.settling.count)
        was_away = False
        while time.monotonic() < deadline:
            window.append(context.read().values)
            moved = context.change(window[-1], last)
            if moved is None:
                self._complain("no beam: cannot tell where the mirror rests")
                window.clear()
            elif at_rest(window, context.columns, context.settling):
                self._rest = window[-1]
                if abs(moved - step) <= tolerance:
                    return True
                if abs(moved) <= BACK and was_away and self._is_newest:
                    return False
                # At a point beyond this one, which it has passed.
                if any(abs(moved - beyond) <= tolerance and beyond / step > 1.0 for beyond in later):
                    self._pass_over(visit, index)
                if abs(moved) > max(tolerance, BACK):
                    self._complain(
                        f"the mirror rests {moved:+.4f} mm from the last point, but it is {step:+.4f} mm from there "
                        f"to {point_text(visit, index)}"
                    )
                elif not is_told and not was_away and time.monotonic() - began > STAYS:
                    is_told = True
                    wanted = point_text(visit, index)
                    context.operator.tell(f"the mirror stays at the last point since {STAYS:g} s; waiting for {wanted}")
            was_away = was_away or (moved is not None and abs(moved) > AWAY)
            paused = context.idle()
            deadline += paused
            began += paused
            time.sleep(max(context.settling.interval, 0.001))
        raise Stopped(f"{point_text(visit, index)}: the mirror did not arrive within {context.wait_timeout:g} s")

    def _complain(self, text: str) -> None:
        self._complaints.tell(of_start(self._context).operator, text)

    def _pass_over(self, visit: Visit, index: int) -> NoReturn:
        self._missed += 1
        self._is_newest = False
        text = "missed: the mirror rests at a later point"
        if self._missed < MISSED:
            raise Missed(text)
        raise Stopped(
            f"{point_text(visit, index)}: {text}, the third in a row: the program's dwell is too short, or the "
            "machine was moved on; bring it to this point, and go on by `resume` (or `restart_line`)"
        )

    def doubt(self, reading: Reading) -> str | None:
        """Report a mirror that moved on before its reading was complete (dwell too short)."""
        moved = None if self._rest is None else of_start(self._context).change(reading.mean, self._rest)
        if moved is None or abs(moved) <= BACK:
            return None
        return f"the mirror moved on by {abs(moved):.4f} mm while it was read"

    def repeats(self, text: str) -> bool:
        return keeps(self._context, text)

    def stored(self, visit: Visit, index: int, row: Row) -> None:
        columns = of_start(self._context).columns
        self._is_newest = change_of_distance(columns, row, row) is not None
        if self._is_newest:  # else the step starts earlier
            self._before = (self._last, self._last_nominal)
            self._last, self._last_nominal, self._missed = row, self._nominal, 0

    def go_back(self, *, whole_line: bool) -> None:
        """A point that is lost is waited for as before. Before one that was read stands the one before it."""
        if whole_line:
            self._last, self._set_up, self._before = None, 0, (None, 0.0)
        elif self._is_newest:
            self._last, self._last_nominal = self._before
            self._before = (None, 0.0)
        self._is_newest = False

    def failed(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


def at_rest(window: Sequence[Row], columns: Sequence[ReadColumn], settling: Settling) -> bool:
    """Whether the values agree in every column that has one in all of them, a distance among these."""
    if len(window) < settling.count:
        return False
    whole = [
        (column, [value for value in values if value is not None])
        for column, values in zip(columns, zip(*window, strict=True), strict=True)
        if None not in values
    ]
    return any(column.is_distance for column, _ in whole) and all(
        spread(values) <= settling.limit(column) for column, values in whole
    )


def _shortest(nominal: Sequence[float], step: float) -> float:
    """The shortest step of a visit that the distance can resolve, or `step` if there is none."""
    steps = [abs(b - a) for a, b in pairwise(nominal)]
    return min([abs(step), *(length for length in steps if length >= SMALLEST)])
