"""The instrument of a twin: it reads the head of a virtual machine, as an IDS3010 or an adapter that sends lines."""

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.acquisition.reading_plan import channels_of_axes, described_plan, digest_of
from stepdiag.instruments.ids3010 import ALIGNING, AXES, IDLE, RUNNING
from stepdiag.instruments.instrument import columns_of_signals
from stepdiag.scenario.description import Scenario, simulation_options
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.units import MICROMETRE, MICRORADIAN

PICOMETRES = 1e9  # in a millimetre
BEST_CONTRAST = 800.0  # per mille
CONTRAST_ANGLE = 304e-6  # rad, at which 1/e of it is left
BASELINE = 40  # per mille
# The numbers of the real instrument are not public; clients get the texts from errorNumberToString.
NO_BEAM = 9001
NOT_MEASURING = 9002
WRONG_AXIS = 9003
TEXTS = {
    0: "Ok",
    NO_BEAM: "the beam was interrupted",
    NOT_MEASURING: "the measurement is not running",
    WRONG_AXIS: "there is no such axis",
}


@dataclass(frozen=True)
class TwinBehaviour:
    """Deviations from exact readings, to test clients."""

    settling: float = 0.0  # s; oscillations after a move decay to 1/e in a fifth of this time
    # Of every value, in addition to the scenario's noise of each point; of tilts as many urad.
    sampling_noise_um: float = 0.0
    latch: bool = True  # an interrupted beam stays lost until the measurement is started again
    lost: frozenset[tuple[int, int]] = frozenset()  # (visit, point) where all beams are interrupted
    interrupt: bool = False  # moving the head to another line interrupts all beams, as in reality

    def __post_init__(self) -> None:
        for name, value in (("settling", self.settling), ("sampling_noise_um", self.sampling_noise_um)):
            if not (math.isfinite(value) and value >= 0.0):
                raise InvalidArgument(f"{name}: expected a finite number of at least 0, got {value!r}")


class TwinInstrument:
    """State and readings, for several threads.

    The scenario's noise changes with every move, not with every value. In a visit it is that of the same row of a
    simulated run; a repeated visit has new noise."""

    def __init__(self, scenario: Scenario, behaviour: TwinBehaviour | None = None, *, lines: bool = False) -> None:
        """lines: it gives all channels of the head, else those of an IDS3010. Raises InvalidArgument for a head that
        three axes cannot read."""
        known = scenario.known
        self._channels = list(known.signals) if lines else channels_of_axes(known)
        self.columns = columns_of_signals(self._channels)
        self._scenario = scenario
        self._behaviour = behaviour or TwinBehaviour()
        self._visits = list(visits_of(known))
        self._digest = digest_of(self._channels, described_plan(known))
        counts = [len(visit.points) for visit in self._visits]
        self._first_rows = [sum(counts[:number]) for number in range(len(counts))]
        self._rows = sum(counts)
        self._machine = scenario.machine()
        self._heads = of_run(scenario.actual_heads())
        self._readouts: dict[int, _core.VirtualReadout] = {}
        self._lock = threading.RLock()
        self._random = np.random.default_rng(scenario.truth.noise.seed)
        self._begun = [0] * len(self._visits)
        self._visit: int | None = None
        self._set_up = 1
        self._position = np.array(self._visits[0].positions[0])
        self._approach = "+++"
        self._row, self._setup_row = 0, 0
        self._index = 0  # in the visit
        self._moved_at = -math.inf
        self._before: list[float | None] = [None] * len(self._channels)
        self._exact: list[float | None] | None = None  # mm; None after a change
        self.mode = RUNNING
        self._interrupted = [False] * AXES
        self._reference = [0] * AXES
        self._is_dark = False
        self._turned: dict[int, npt.NDArray[np.float64]] = {}  # by set-up: laser and reflector, rad
        self.visit_begun = threading.Event()  # for the thread that moves it
        self.moves_itself = False  # through the points of a visit (Twin, play)

    # --- the machine ---

    def move_to(self, position: Sequence[float], *, counts: bool = True) -> None:
        """Move the axes to these positions, mm.

        If it counts, every call is a new point; within a visit only a call that changes the position."""
        target = np.array(position, dtype=float)
        if target.shape != (3,) or not np.all(np.isfinite(target)):
            raise InvalidArgument("moveTo: expected three finite numbers")
        with self._lock:
            self._remember()
            moved = target - self._position
            if self._visit is None:
                self._approach = "".join(
                    "+" if d > 0 else "-" if d < 0 else old for d, old in zip(moved, self._approach, strict=True)
                )
            self._position = target
            counts = counts and (self._visit is None or bool(np.any(moved)))
            self._row += counts
            self._index += counts

    def set_up(self, number: int) -> None:
        """Set up head and mirror for the plan's line of this number (from 1).

        From now on the moves of the axes show from which side they approach."""
        if not 1 <= number <= self._visits[-1].set_up:
            raise InvalidArgument(f"setUp: expected 1 to {self._visits[-1].set_up}, got {number}")
        with self._lock:
            self._remember()
            self._visit = None
            self._place(number)
            self._setup_row = self._row

    def visit(self, number: int, index: int = 0, digest: str | None = None) -> None:
        """Set up for a visit of the plan, at the point of this place in it.

        The plan also gives the direction of approach and the row of the run. The axes stay where they are, unless the
        twin moves them itself."""
        if digest is not None and digest != self._digest:
            raise InvalidArgument("visit: the twin has another plan or head")
        if not 1 <= number <= len(self._visits):
            raise InvalidArgument(f"visit: expected 1 to {len(self._visits)}, got {number}")
        visit = self._visits[number - 1]
        if not 0 <= index < len(visit.points):
            raise InvalidArgument(f"visit: expected a place from 0 to {len(visit.points) - 1}, got {index}")
        with self._lock:
            self._remember()
            self._visit, self._index = number, index
            self._approach = "".join("-" if sign < 0 else "+" for sign in visit.approach)
            self._place(visit.set_up)
            if self.moves_itself:  # before the answer, after which the client reads
                self._position = np.array(visit.positions[index])
            repeated = self._begun[number - 1] * self._rows
            self._begun[number - 1] += 1
            self._row = repeated + self._first_rows[number - 1] + index
            forward = number - 1 if visit.direction == "forward" else number - 2
            self._setup_row = repeated + self._first_rows[forward]
            self.visit_begun.set()

    def turn(self, angles_urad: Sequence[float]) -> None:
        """Turn laser and mirror of this set-up: angles of the laser about the local x and y, then of the mirror, µrad,
        added to what they were misaligned by."""
        change = np.array(angles_urad, dtype=float)
        if change.shape != (4,) or not np.all(np.isfinite(change)):
            raise InvalidArgument("turn: expected four finite angles")
        with self._lock:
            self._remember()
            self._turned[self._set_up] = self._turned.get(self._set_up, np.zeros(4)) + change * MICRORADIAN
            self._readouts.pop(self._set_up, None)

    def block(self, is_dark: bool) -> None:
        """Hold something into the beams, or take it away."""
        with self._lock:
            self._is_dark, self._exact = bool(is_dark), None

    def contrast(self) -> float:
        """What comes back into a single mode of 0.8 mm waist, per mille: it falls with the angle of the mirror to the
        beam."""
        with self._lock:
            given = self._misalignment()
        angle = float(np.linalg.norm(np.asarray(given.reflector) - np.asarray(given.laser)))
        return BEST_CONTRAST * math.exp(-((angle / CONTRAST_ANGLE) ** 2))

    def align(self, is_on: bool) -> None:
        """Begin or end the mode in which an IDS3010 shows its contrast."""
        with self._lock:
            self.mode = ALIGNING if is_on else IDLE

    def _misalignment(self) -> _core.Misalignment:
        """Of this set-up, as it was turned."""
        line = next(visit.line for visit in self._visits if visit.set_up == self._set_up)
        given = self._scenario.truth.misalignment.get(line, _core.Misalignment())
        turned = self._turned.get(self._set_up)
        if turned is None:
            return given
        return _core.Misalignment(
            np.asarray(given.reflector) + turned[2:],
            np.asarray(given.laser) + turned[:2],
            given.psd_zero,
            given.distance_constant,
            given.beam_constants,
            lateral=given.lateral,
            roll=given.roll,
            gain=given.gain,
            drift=given.drift,
        )

    def state(self) -> dict[str, Any]:
        """The current state, for clients."""
        with self._lock:
            position = [float(p) for p in self._position]
            return {"visit": self._visit, "set_up": self._set_up, "position_mm": position, "approach": self._approach}

    def where(self) -> tuple[int | None, int]:
        """The visit that was begun, and the place in it."""
        with self._lock:
            return self._visit, self._index

    def row(self) -> int:
        """The row of the simulated run that it reads now."""
        with self._lock:
            return self._row

    def _place(self, set_up: int) -> None:
        if set_up != self._set_up:  # without `interrupt`, the measurement counts as started again
            self._interrupted = [self._behaviour.interrupt] * AXES
        self._set_up = set_up

    def _remember(self) -> None:
        if self._behaviour.settling > 0.0:
            self._before = self._now()
            self._moved_at = time.monotonic()
        self._exact = None

    # --- the instrument ---

    def values(self) -> list[float | None]:
        """The value of every channel, mm or rad; None without a beam."""
        with self._lock:
            return self._now()

    def positions(self) -> tuple[list[int], list[int]]:
        """Warning number and position (pm) of every axis."""
        with self._lock:
            if self.mode != RUNNING:
                return [NOT_MEASURING] * AXES, [0] * AXES
            warnings, positions = [], []
            now = self._now()
            for axis, distance in enumerate([*now, *[None] * (AXES - len(now))]):
                if distance is None:
                    self._interrupted[axis] = self._interrupted[axis] or axis < len(self._channels)
                dark = distance is None or (self._behaviour.latch and self._interrupted[axis])
                if not self._behaviour.latch:
                    self._interrupted[axis] = distance is None
                warnings.append(NO_BEAM if dark and axis < len(self._channels) else 0)
                positions.append(0 if dark or distance is None else round(distance * PICOMETRES))
            return warnings, positions

    def start(self) -> None:
        with self._lock:
            self.mode = RUNNING
            self._interrupted = [False] * AXES
            self._reference = self.positions()[1]

    def stop(self) -> None:
        with self._lock:
            self.mode = IDLE

    def reset_error(self) -> None:
        with self._lock:
            self._interrupted = [False] * AXES

    def reset_displacement(self) -> None:
        with self._lock:
            self._reference = self.positions()[1]

    def displacements(self) -> tuple[list[int], list[int]]:
        warnings, positions = self.positions()
        return warnings, [position - reference for position, reference in zip(positions, self._reference, strict=True)]

    def _now(self) -> list[float | None]:
        """Values by channel, mm or rad, None without a beam."""
        if self._exact is None:
            self._exact = self._distances()
        distances = list(self._exact)
        elapsed = time.monotonic() - self._moved_at
        if self._behaviour.settling > 0.0 and elapsed < 10.0 * self._behaviour.settling:
            decay = self._behaviour.settling / 5.0
            share = math.exp(-elapsed / decay) * math.cos(2.0 * math.pi * elapsed / decay)
            distances = [
                now if now is None or old is None else now + (old - now) * share
                for now, old in zip(distances, self._before, strict=True)
            ]
        if self._behaviour.sampling_noise_um > 0.0:
            noise = self._behaviour.sampling_noise_um * 1e-3 * self._random.standard_normal(len(distances))
            distances = [
                now if now is None else now + float(n) * (MICRORADIAN / MICROMETRE if column.is_tilt else 1.0)
                for now, n, column in zip(distances, noise, self.columns, strict=True)
            ]
        return distances

    def _distances(self) -> list[float | None]:
        if self._is_dark or self._point() in self._behaviour.lost:
            return [None] * len(self._channels)
        seconds = self._scenario.known.keys.plan.seconds_per_reading or 0.0
        elapsed = max(0, self._row - self._setup_row) * seconds
        signals = self._readout().read(self._position, self._approach, row=self._row, elapsed=elapsed)
        too_long = 1.0 + self._scenario.known.instrument.scale
        return [
            None if math.isnan(value) else float(value) * (too_long if channel.startswith("d") else 1.0)
            for value, channel in zip(signals, self._channels, strict=False)
        ]

    def _point(self) -> tuple[int, int] | None:
        if self._visit is None:
            return None
        points = self._visits[self._visit - 1].points
        return (self._visit, int(points[self._index])) if self._index < len(points) else None

    def _readout(self) -> _core.VirtualReadout:
        if self._set_up not in self._readouts:
            scenario = self._scenario
            line = next(visit.line for visit in self._visits if visit.set_up == self._set_up)
            own = self._misalignment() if self._set_up in self._turned else None
            self._readouts[self._set_up] = _core.VirtualReadout(
                self._machine,
                scenario.known.plan,
                self._heads,
                line,
                simulation_options(scenario, {} if own is None else {line: own}),
            )
        return self._readouts[self._set_up]
