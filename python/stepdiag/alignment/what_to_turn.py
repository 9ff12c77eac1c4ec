"""What to turn: the angles of laser and mirror by the exact model of the head, from readings at a few places.

The machine is taken to be without errors but for what `ROUGH` states, which is in the uncertainties. The model is that
of the evaluations (VirtualReadout), its derivatives are differences.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag.acquisition.placement import sides
from stepdiag.alignment.limits import choice_of, limits_of
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit
from stepdiag.setup_quantities import SETUP_QUANTITIES
from stepdiag.units import MICROMETRE, MICRORADIAN, native

FloatArray = npt.NDArray[np.float64]

# Standard deviations of a machine's errors between two places.
ROUGH: Final = 2.0 * MICROMETRE  # of the distance, however near
ROUGH_BY_LENGTH: Final = 50e-6  # of the distance, by the way between them
ROUGH_TILT: Final = 30.0 * MICRORADIAN
UNKNOWN: Final = 50e-3  # rad, of each angle before anything is read
FREE_LENGTH: Final = 1e3  # mm, of a constant that is not known
FIXED_BEAM: Final = 1e-6  # mm, of the beams' constants where the evaluation takes them for 0
FIXED_SPOT: Final = 0.1  # mm, of the spot's zero
STEP: Final = 1e-6  # rad or mm, of derivatives
STEPS: Final = 8  # Gauss-Newton
SEEN: Final = 5e-3  # rad; an angle with a larger standard uncertainty is not known
NO_MOVE: Final = 0.5  # mm on the mirror
MILLI: Final = 1e-3


@dataclass(frozen=True)
class Turn:
    """Of the laser or the mirror: how far it is out of true, rad, seen from the head to the right and up (of an upright
    beam: towards X+ and Y+), with standard uncertainties; the largest angle that it may have."""

    what: str
    right: float
    up: float
    u: float  # the larger of both
    limit: float
    names: tuple[tuple[str, str], tuple[str, str]]  # what turning to the right and up is called, and the other ways

    @property
    def size(self) -> float:
        return float(np.hypot(self.right, self.up))

    @property
    def is_seen(self) -> bool:
        return self.u < SEEN

    @property
    def is_ready(self) -> bool:
        return self.is_seen and self.size <= self.limit

    @property
    def words(self) -> str:
        if not self.is_seen:
            return f"{self.what}: these readings do not show it"
        if self.is_ready:
            within = f"{self.size / MILLI:.2f} ± {2.0 * self.u / MILLI:.2f} mrad"
            return f"{self.what}: {within}, within {self.limit / MILLI:.2g} mrad"
        ways = []
        for off, (one, other) in zip((self.right, self.up), self.names, strict=True):
            if abs(off) > 0.1 * self.limit:
                ways.append(f"{abs(off) / MILLI:.2f} mrad {other if off > 0.0 else one}")
        return f"{self.what}: turn it {' and '.join(ways)}"


@dataclass(frozen=True)
class AlignmentFit:
    """What was found. laser, reflector: (2,) angles about local x and y, rad, as a scenario's misalignment has them."""

    laser: FloatArray
    reflector: FloatArray
    turns: tuple[Turn, Turn]  # of laser and mirror
    largest_on_mirror: tuple[float, float]  # mm, how far from the mirror's centre the beam comes on the line
    mirror: tuple[float, float] | None  # mm, its width and height where they are stated

    @property
    def is_ready(self) -> bool:
        """Of both: what the readings do not show is not ready."""
        return all(turn.is_ready for turn in self.turns)

    @property
    def is_all_that_is_seen(self) -> bool:
        """Whether nothing that the readings show is left to be turned."""
        return all(turn.is_ready or not turn.is_seen for turn in self.turns)

    @property
    def fits_mirror(self) -> bool:
        return self.mirror is None or all(
            2.0 * off <= edge for off, edge in zip(self.largest_on_mirror, self.mirror, strict=True)
        )

    @property
    def mirror_words(self) -> str:
        x, y = self.largest_on_mirror
        if max(x, y) < NO_MOVE:
            return "the beam stays where it is on the mirror"
        if self.mirror is None:
            return f"the mirror needs {2.0 * x:.0f} × {2.0 * y:.0f} mm, and the beam's diameter"
        width, height = self.mirror
        room = f"{width:.0f} × {height:.0f} mm"
        if self.fits_mirror:
            return f"on the whole line the beam stays within ±{x:.1f} and ±{y:.1f} mm of the mirror's centre ({room})"
        return f"the beam leaves the mirror ({room}): it comes to ±{x:.1f} and ±{y:.1f} mm of its centre"


def what_to_turn(
    known: Known, visit: Visit, places: FloatArray, readings: Sequence[Sequence[float | None]]
) -> AlignmentFit:
    """places: (n, 3) positions of the axes, mm; readings: at each the head's channels in their order, mm and rad, None
    or NaN where lost; the first ones may stand alone, as an IDS3010 gives no tilts. Raises InvalidArgument."""
    model = _Model(known, visit, np.asarray(places, dtype=float), len(readings[0]))
    values = np.array([[np.nan if one is None else one for one in row] for row in readings], dtype=float)
    unknown = np.zeros(model.size)
    used = np.isfinite(values).ravel()
    weight = 1.0 / model.sigma.ravel()[used]
    prior = 1.0 / model.prior
    for _ in range(STEPS):
        now = model.readings(unknown)
        derivative = np.column_stack(
            [(model.readings(unknown + STEP * one) - now).ravel() / STEP for one in np.eye(model.size)]
        )
        misfit = (values - now).ravel()
        rows = np.vstack([derivative[used] * weight[:, None], np.diag(prior)])
        right = np.concatenate([misfit[used] * weight, -unknown * prior])
        change, *_ = np.linalg.lstsq(rows, right, rcond=None)
        unknown = unknown + change
        if np.max(np.abs(change[:4])) < 1e-9:
            break
    covariance = np.linalg.inv(rows.T @ rows)
    return _fit(known, visit, model, unknown, covariance)


class _Model:
    """Unknown: reflector a, b, laser a, b, a constant of all distances, then that of each beam, or the spot's zero."""

    def __init__(self, known: Known, visit: Visit, places: FloatArray, channels: int) -> None:
        self._known, self._visit, self._places = known, visit, places
        head = known.heads[visit.line]
        self._names = list(known.signals)[:channels]
        self._machine = _core.Machine(known.chain, _core.ErrorMap(), known.tool)
        self._heads = of_run(known.heads)
        beams = len([name for name in self._names if name.startswith("d")])
        self._more = {"multi_beam": beams, "psd": 2}.get(head.layout, 0)
        self.size = 5 + self._more
        apart = np.linalg.norm(places - places[0], axis=1)
        noise = known.uncertainty
        rough = np.hypot(ROUGH, ROUGH_BY_LENGTH * apart)
        path = head.standoff + head.psd_distance + float(apart.max())
        by_kind = {
            "d": np.hypot(rough, noise.distance),
            "a": np.full(len(places), np.hypot(ROUGH_TILT, noise.tilt)),
            "s": np.full(len(places), np.hypot(2.0 * path * ROUGH_TILT, noise.spot)),
        }
        self.sigma = np.column_stack([by_kind["a" if name in ("alpha", "beta") else name[0]] for name in self._names])
        known_to = {"multi_beam": _known_to(known, visit, "beam_constants"), "psd": _known_to(known, visit, "psd_zero")}
        self.prior = np.array([UNKNOWN] * 4 + [FREE_LENGTH] + [known_to.get(head.layout, 0.0)] * self._more)

    def readings(self, unknown: FloatArray) -> FloatArray:
        is_psd = self._known.head.layout == "psd"
        zero, constants = (unknown[5:7], []) if is_psd else ((0.0, 0.0), list(unknown[5:]))
        misalignment = _core.Misalignment(unknown[:2], unknown[2:4], zero, unknown[4], constants)
        options = _core.SimulationOptions(misalignment={self._visit.line: misalignment})
        readout = _core.VirtualReadout(self._machine, self._known.plan, self._heads, self._visit.line, options)
        return np.array([readout.read(place)[: len(self._names)] for place in self._places])


def _known_to(known: Known, visit: Visit, quantity: str) -> float:
    """Standard uncertainty with which the evaluation takes a constant of beams or of the spot for 0, mm."""
    choice = choice_of(known, visit, quantity)
    if choice == "free":
        return FREE_LENGTH
    if choice is None or choice == "fixed":
        return FIXED_BEAM if quantity == "beam_constants" else FIXED_SPOT
    return float(native(SETUP_QUANTITIES[quantity].key, choice))


def _fit(known: Known, visit: Visit, model: _Model, unknown: FloatArray, covariance: FloatArray) -> AlignmentFit:
    frame, limits = np.asarray(known.plan.frame(visit.line)), limits_of(known, visit)
    reflector, laser = unknown[:2], unknown[2:4]
    turns = tuple(
        _turn(what, angles, covariance[at : at + 2, at : at + 2], limit, frame)
        for what, angles, at, limit in (
            ("laser", laser, 2, limits.laser),
            ("mirror", reflector, 0, limits.reflector),
        )
    )
    return AlignmentFit(laser, reflector, (turns[0], turns[1]), _on_mirror(known, visit, laser), _stated(known, visit))


def _stated(known: Known, visit: Visit) -> tuple[float, float] | None:
    mirror = known.heads[visit.line].mirror
    return None if mirror is None else (float(mirror[0]), float(mirror[1]))


def _turn(what: str, angles: FloatArray, covariance: FloatArray, limit: float, frame: FloatArray) -> Turn:
    """Exp(a, b, 0) z is (b, -a, 1): so far is a direction out of its own, along the local x and y."""
    (right, *right_names), (up, *up_names) = sides(frame)
    across = np.array([angles[1], -angles[0]])
    sign = 1.0 if what == "laser" else -1.0  # the mirror's face looks back along the beam
    basis = np.array([right, up]) @ frame[:, :2]
    turned = sign * basis @ across
    own = np.array([[0.0, 1.0], [-1.0, 0.0]])
    u = np.sqrt(np.diag(basis @ own @ covariance @ own.T @ basis.T).max())
    names = ((right_names[0], right_names[1]), (up_names[0], up_names[1]))
    return Turn(what, float(turned[0]), float(turned[1]), float(u), limit, names)


def _on_mirror(known: Known, visit: Visit, laser: FloatArray) -> tuple[float, float]:
    """How far from the functional point the beam meets the mirror, along its width and height, on the whole line."""
    frame = np.asarray(known.plan.frame(visit.line))
    positions = np.asarray(visit.positions)
    start = known.plan.points(visit.line, visit.run)[0]
    way = (positions - start) @ frame
    length = known.heads[visit.line].standoff + way[:, 2]
    off = np.column_stack([length * laser[1] - way[:, 0], -length * laser[0] - way[:, 1]])
    x, y = np.abs(off).max(axis=0)
    return float(x), float(y)
