"""Aligns head and mirror of one line after the other: the person turns, the readings say what and how far."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Final

import numpy as np

from stepdiag.acquisition.conductor import Conductor, Wanted
from stepdiag.acquisition.cross import cross_of
from stepdiag.acquisition.placement import placement
from stepdiag.acquisition.settling import Settling, take_reading
from stepdiag.alignment.limits import limits_of
from stepdiag.alignment.places import FloatArray, alignment_places
from stepdiag.alignment.what_to_turn import MILLI, AlignmentFit, what_to_turn
from stepdiag.instruments.instrument import Instrument, Row
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit

OVERLOAD: Final = 850.0  # per mille of contrast and baseline together, above which the signal may be too large
PLACES: Final = (
    "near the head",
    "a little aside of it",
    "aside the other way",
    "far from the head",
    "a little aside of it",
    "aside the other way",
)


class AlignmentLoop:
    """Of an instrument that is connected."""

    def __init__(
        self, known: Known, instrument: Instrument, conductor: Conductor, settling: Settling, sign: int = 1
    ) -> None:
        self._known, self._instrument, self._conductor = known, instrument, conductor
        self._settling, self._sign = settling, sign

    def run(self, visits: Iterable[Visit]) -> dict[str, AlignmentFit]:
        """The first visits of set-ups, in turn. Returns what was found last, by line."""
        self._instrument.describe()
        found = {}
        for visit in visits:
            while visit.line not in found:
                with suppress(Wanted):  # from the beginning
                    found[visit.line] = self._align(visit)
        return found

    def _align(self, visit: Visit) -> AlignmentFit:
        known, conductor, instrument = self._known, self._conductor, self._instrument
        state, columns = conductor.state, instrument.columns
        limits = limits_of(known, visit)
        head, frame = known.heads[visit.line], np.asarray(known.plan.frame(visit.line))
        conductor.at(visit, 0, 0.0)
        conductor.cross = lambda sample: cross_of(head, frame, columns, sample.values, self._sign)
        state.turns, state.is_aligned = [], False
        state.limit_urad = 1e6 * float(np.hypot(limits.laser, limits.reflector))
        instrument.use_line(visit.line)
        instrument.set_up(visit.set_up)
        conductor.tell(placement(known, visit).words)
        conductor.tell(
            f"ready when the laser is within {limits.laser / MILLI:.2g} mrad and the mirror within "
            f"{limits.reflector / MILLI:.2g} mrad"
        )
        places = alignment_places(known, visit)
        instrument.go_to(places[0])
        if instrument.has_optics_alignment:
            self._find_signal()
        while True:
            fit = what_to_turn(known, visit, places, self._readings(places, visit))
            state.turns, state.is_aligned = [turn.words for turn in fit.turns], fit.is_ready and fit.fits_mirror
            for words in (*state.turns, fit.mirror_words):
                conductor.tell(words)
            if state.is_aligned:
                conductor.tell(f"line {visit.line} is aligned")
                return fit
            if fit.is_all_that_is_seen and fit.fits_mirror:
                unseen = " and ".join(turn.what for turn in fit.turns if not turn.is_seen)
                conductor.tell(f"warning: line {visit.line}: these readings do not show the {unseen}: use the signal")
                return fit
            if not conductor.repeats(f"line {visit.line} is not aligned: turn as said, then measure again"):
                conductor.tell(f"warning: line {visit.line} stays as it is")
                return fit

    def _find_signal(self) -> None:
        """The IDS3010 shows its signal before it can measure."""
        conductor, instrument = self._conductor, self._instrument
        instrument.optics_alignment(True)
        source, conductor.source = conductor.source, instrument.signal
        try:
            conductor.confirm("turn laser and mirror until the contrast is largest, at the near and at the far place")
            signal = instrument.signal().signal
        finally:
            conductor.source = source
            instrument.optics_alignment(False)
        for name, contrast in signal.items():
            channel, _, kind = name.rpartition(" ")
            total = contrast + signal.get(f"{channel} baseline", 0.0)
            if kind == "contrast" and total > OVERLOAD:
                conductor.tell(
                    f"warning: {channel}: contrast and baseline are {total:.0f} ‰ together, above {OVERLOAD:.0f}: the "
                    "signal may be too large"
                )

    def _readings(self, places: FloatArray, visit: Visit) -> list[list[float | None]]:
        found: list[list[float | None]] = []
        for place, words in zip(places, PLACES, strict=True):
            if not self._instrument.go_to(place):
                x, y, z = (float(one) for one in place)
                self._conductor.confirm(f"machine at X{x:.3f} Y{y:.3f} Z{z:.3f} ({words})?")
            if len(found) == 0:
                self._instrument.make_ready(False, self._conductor.tell)
            self._conductor.doing("reads")
            reading = take_reading(self._conductor.read, self._instrument.columns, self._settling)
            if reading.lost:
                why = "; ".join(dict.fromkeys(reading.lost.values()))
                self._conductor.tell(f"line {visit.line}, {words}: lost: {why}")
            found.append(self._native(reading.mean))
        self._instrument.go_to(places[0])
        self._conductor.doing("waits")
        return found

    def _native(self, row: Row) -> list[float | None]:
        columns = self._instrument.columns
        return [
            None if value is None else (self._sign if column.is_distance else 1) * float(column.native(value))
            for column, value in zip(columns, row, strict=True)
        ]


def first_visits(visits: Iterable[Visit], lines: Sequence[str]) -> list[Visit]:
    """Of each set-up the first visit; of these lines, if some are named."""
    found: dict[int, Visit] = {}
    for visit in visits:
        if not lines or visit.line in lines:
            found.setdefault(visit.set_up, visit)
    return list(found.values())
