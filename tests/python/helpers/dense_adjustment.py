"""The exact adjustment by dense matrices: slow, and plainly right. What it determines, with which value and variance,
what controls a reading: all from one singular value decomposition of the column-scaled Jacobian. mm, rad, s.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import reference
from dense_model import SQUARENESS, Array, DenseModel, Setup, Stations, Table, Unknown, rounding
from scipy.optimize import brentq
from scipy.stats import chi2

import stepdiag as sd

Prior = Literal["free", "fixed"] | float
RANK_THRESHOLD = 1e-9  # of the largest singular value: exact null vectors stand at 1e-15, what is seen above 1e-7
FREE = {"lateral": 1000.0, "roll": 1.0, "gain": 1.0}  # mm, rad, 1: they act by tilts, which are 0 on a perfect machine
HELD = 1e8  # 1/rad or 1/mm: how tightly an unknown is held that no reading sees
NOTHING = 1e-6  # standard uncertainties of readings, a unit of an unknown: such a column is made of roundings
FACTOR = 1.959963984540054  # an interval of 95 %, by the standard uncertainty
UNITS = {"distance": 1e-4, "tilt": 1e-6, "spot": 1e-3}  # default uncertainties of readings


@dataclass(frozen=True)
class Knowledge:
    """What is known beside the readings; keys of `setup`: a quantity, or (line, quantity)."""

    setup: Mapping[str | tuple[str, str], Prior] = field(default_factory=dict)
    uncertainty: Mapping[str, float] = field(default_factory=lambda: UNITS)
    smoothness: Mapping[str, float] = field(default_factory=dict)  # function -> deviation of second differences
    one_setup_per_line: bool = False
    reversal: bool = True
    rotations: bool = True  # False: the machine has no angular errors

    def given(self, line: str, quantity: str, is_scale: bool) -> Prior | None:
        """Scale lines are aligned by themselves: what is said of the angles of all lines is not said of theirs."""
        of_all = not is_scale or quantity not in ("reflector", "laser")
        return self.setup.get((line, quantity), self.setup.get(quantity) if of_all else None)


def default(scenario: reference.Scenario, knowledge: Knowledge, line: str, quantity: str) -> Prior:
    is_scale = line in scenario.scale_lines
    if quantity == "laser" and scenario.layout == "multi_beam" and not is_scale:
        return "free" if deviation(scenario, knowledge, line, "beam_constants") == 0 else 2e-3
    if is_scale and quantity == "laser":
        return 500e-6
    return {"lateral": 1.0, "roll": 0.02, "gain": 0.01, "drift": 5e-3 / 3600}.get(quantity, "free")


def deviation(scenario: reference.Scenario, knowledge: Knowledge, line: str, quantity: str) -> float:
    """Of a set-up unknown of a line: 0 fixed, inf free."""
    prior = knowledge.given(line, quantity, line in scenario.scale_lines)
    if prior is None:
        prior = default(scenario, knowledge, line, quantity)
    if isinstance(prior, str):
        return 0.0 if prior == "fixed" else FREE.get(quantity, np.inf)
    return prior


def knowledge_says_nothing(knowledge: Knowledge, line: str, quantity: str) -> bool:
    return knowledge.given(line, quantity, False) is None


class DenseAdjustment:
    """`rank_at`: the unknowns at which rank is decided; roll and gain show where tilts are not 0 only."""

    def __init__(
        self,
        run: sd.Measurement,
        scenario: reference.Scenario,
        knowledge: Knowledge | None = None,
        rank_at: Mapping[Unknown, float] | None = None,
    ) -> None:
        self.run, self.scenario, self.knowledge = run, scenario, knowledge or Knowledge()
        self.channels = [name for name in run.channels if name not in ("time", "temperature")]
        reversal = self.knowledge.reversal and "backward" in run.direction
        self.model = DenseModel(scenario, self.stations(), self.channels, reversal)
        self.read = np.array([run.channels[name] for name in self.channels])
        self.u = np.array([self.uncertainty(name) for name in self.channels])
        self.used = np.isfinite(self.read)
        self.priors = np.array([self.prior(unknown) for unknown in self.model.unknowns])
        self.active = np.flatnonzero(self.priors > 0)
        self.unknowns: list[Unknown] = [self.model.unknowns[i] for i in self.active]
        self.place = {unknown: i for i, unknown in enumerate(self.unknowns)}
        self.knowledge_rows = np.vstack([self.prior_rows(), self.smoothness_rows()])
        self.rank_at = np.array([(rank_at or {}).get(unknown, 0.0) for unknown in self.model.unknowns])
        self.decide_rank()

    # --- what the readings and the unknowns are ---

    def stations(self) -> Stations:
        run, first = self.run, self.first_runs()
        setups = [first[line, int(r)] for line, r in zip(run.line, run.run, strict=True)]
        time = np.array(run.channels.get("time", np.zeros(len(run))))
        start = {s: min(t for t, other in zip(time, setups, strict=True) if other == s) for s in set(setups)}
        since = time - np.array([start[s] for s in setups])
        senses = [
            reference.approach_of(line, direction == "backward")
            for line, direction in zip(run.line, run.direction, strict=True)
        ]
        return Stations(list(run.line), np.asarray(run.position), setups, np.array(senses), since)

    def first_runs(self) -> dict[tuple[str, int], tuple[int, str]]:
        """(line, run) -> set-up: backward runs keep that of the run before them."""
        visits = {(line, int(r)): d for line, r, d in zip(self.run.line, self.run.run, self.run.direction, strict=True)}
        found: dict[tuple[str, int], tuple[int, str]] = {}
        latest: dict[str, tuple[int, str]] = {}
        for line, run in sorted(visits):
            keep = self.knowledge.one_setup_per_line or visits[line, run] == "backward"
            if not (keep and line in latest):
                latest[line] = (run, line)
            found[line, run] = latest[line]
        return found

    def uncertainty(self, channel: str) -> Array:
        kind = {"alpha": "tilt", "beta": "tilt", "spot_x": "spot", "spot_y": "spot"}.get(channel, "distance")
        default = np.full(len(self.run), self.knowledge.uncertainty[kind])
        given = self.run.standard_uncertainty.get(channel, default)
        return np.where(np.isfinite(given), given, default)

    def is_scale(self, line: str) -> bool:
        return line in self.scenario.scale_lines

    def prior(self, unknown: Unknown) -> float:
        if isinstance(unknown, Table):
            is_rotation = unknown.name not in SQUARENESS and unknown.name[1] in "ABC"
            return 0.0 if is_rotation and not self.knowledge.rotations else np.inf
        line, quantity = unknown.line, unknown.quantity
        if quantity == "psd_zero" and self.scenario.layout != "psd":
            return 0.0
        if quantity == "cosine":
            return self.cosine_prior(line)
        if quantity == "drift" and knowledge_says_nothing(self.knowledge, line, quantity) and not self.has_times(line):
            return 0.0
        if self.is_scale(line) and quantity == "laser" and self.mirror_is_free(line):
            return 0.0  # what it does is a cosine error
        if self.is_scale(line) and not self.tilts_tell(line):
            if quantity == "reflector":
                return self.mirror_of_untold(line)
            if quantity in ("laser", "psd_zero"):
                return 0.0  # what the laser's angle does is a cosine error
            if quantity in ("roll", "gain") and not self.has_tilts(line):
                return 0.0
        return deviation(self.scenario, self.knowledge, line, quantity)

    def rows_of(self, line: str) -> Array:
        return np.array([other == line for other in self.run.line])

    def has_times(self, line: str) -> bool:
        time = np.asarray(self.run.channels.get("time", np.full(len(self.run), np.nan)))
        return bool(np.all(np.isfinite(time[self.rows_of(line)])))

    def has_tilts(self, line: str) -> bool:
        tilts = [np.asarray(self.run.channels[name]) for name in self.channels if name != "distance"]
        return any(np.any(np.isfinite(tilt[self.rows_of(line)])) for tilt in tilts)

    def tilts_tell(self, line: str) -> bool:
        beams = deviation(self.scenario, self.knowledge, line, "beam_constants")
        return self.has_tilts(line) and not (self.scenario.layout == "multi_beam" and beams > 0)

    def mirror_is_free(self, line: str) -> bool:
        return bool(np.isinf(deviation(self.scenario, self.knowledge, line, "reflector")))

    def cosine_prior(self, line: str) -> float:
        """By travel: 95 % of what the squares of unknown angles do to a distance, by the normal distribution's factor.

        With D the angle between mirror and laser and l that of the laser, a distance reads D^2 - D l - l^2/2 too much
        in each direction across the line, once D^2 is corrected -D l - l^2/2. A laser that turns alone: 3/2 l^2."""

        def prior(quantity: str) -> float:
            return deviation(self.scenario, self.knowledge, line, quantity)

        def one_sided(variance: float, directions: int) -> float:
            return variance / 2 * float(chi2.ppf(0.95, directions)) / FACTOR if directions else 0.0

        laser, mirror, usual = prior("laser"), prior("reflector"), 2e-3
        if self.is_scale(line) and not self.tilts_tell(line):
            mirror = self.mirror_of_untold(line)
            form = np.array([[1.0, -0.5], [-0.5, -0.5]]) * np.outer((mirror, laser), (mirror, laser))
            low, high = np.linalg.eigvalsh(form)
            parts = [2 * abs(x) for x in (low, high) if abs(x) > 1e-9 * max(abs(low), abs(high))]
            if not parts:
                return 0.0

            def outside(q: float) -> float:
                return sum(x * np.exp(-q / x) for x in parts) / sum(parts) - 0.05

            return float(brentq(outside, 0.0, 4 * max(parts), xtol=1e-12 * max(parts))) / FACTOR
        if not self.tilts_tell(line):
            return one_sided(3 * (usual if np.isinf(laser) else laser) ** 2, 2)
        if self.is_scale(line) and np.isinf(mirror):
            by_first_order = (self.tilt(line) * laser) ** 2
            return float(np.sqrt(one_sided(laser**2, 2) ** 2 + by_first_order + min(by_first_order / 2, laser**4)))
        if np.isinf(laser) and np.isinf(mirror):
            laser = mirror = usual
        # A tilt has told their difference: what is left is in both.
        left = laser if np.isinf(mirror) else mirror if np.isinf(laser) else 0.0
        if not left and laser and mirror:
            left = laser * mirror / float(np.hypot(laser, mirror))
        return one_sided(left**2, line.count("0"))

    def mirror_of_untold(self, line: str) -> float:
        """Of a scale line where nothing tells the mirror's angle against the beam."""
        given = self.knowledge.given(line, "reflector", True)
        return {None: 500e-6, "free": 2e-3, "fixed": 0.0}.get(given, given)  # type: ignore[arg-type, return-value]

    def tilt(self, line: str) -> float:
        """Of the mirror against the beam, at the line's first point or the last, to 50 urad; 0: both are lost."""

        def place(row: int) -> tuple[int, str]:  # of several runs the first one's, forward
            return int(self.run.run[row]), "" if self.run.direction[row] == "forward" else "backward"

        rows = sorted(np.flatnonzero(self.rows_of(line)), key=place)
        first, last = (end(rows, key=lambda row: self.run.point[row]) for end in (min, max))
        found = [t for t in (self.tilt_of(first, last), self.tilt_of(last, first)) if np.isfinite(t)]
        if not found:
            return 0.0
        return 50e-6 * round(float(min(found) if max(found) - min(found) > 500e-6 else found[0]) / 50e-6)

    def tilt_of(self, row: int, other: int) -> float:
        read = self.run.channels
        if self.scenario.layout == "ideal":
            return float(np.hypot(read["alpha"][row], read["beta"][row]))
        if self.scenario.layout == "psd":
            x, y, path = (read[name][row] - read[name][other] for name in ("spot_x", "spot_y", "distance"))
            return float(np.hypot(x, y) / abs(2 * path)) if path else np.nan
        beams = np.array([read[f"d{i + 1}"][row] for i in range(len(self.scenario.beam_offsets))])
        if not np.all(np.isfinite(beams)):
            return np.nan
        offsets = np.column_stack([np.ones(len(beams)), self.scenario.beam_offsets])
        return float(np.hypot(*np.linalg.lstsq(offsets, beams, rcond=None)[0][1:]))

    # --- what is known beside the readings, as rows of the scaled problem with 0 on the right ---

    def prior_rows(self) -> Array:
        known = [i for i, j in enumerate(self.active) if np.isfinite(self.priors[j])]
        rows = np.zeros((len(known), len(self.active)))
        for k, i in enumerate(known):
            rows[k, i] = 1 / self.priors[self.active[i]]
        return rows

    def smoothness_rows(self) -> Array:
        rows = []
        for name, deviation in self.knowledge.smoothness.items():
            for k in range(1, self.scenario.steps):
                row = np.zeros(len(self.active))
                for node, weight in ((k - 1, 1.0), (k, -2.0), (k + 1, 1.0)):
                    if (at := self.place.get(Table(name, node))) is not None:
                        row[at] = weight / deviation
                rows.append(row)
        return np.array(rows).reshape(-1, len(self.active))

    # --- rank, solution, variances ---

    def whitened(self, x: Array) -> tuple[Array, Array]:
        """Jacobian and residuals of used readings and of what is known, each divided by its uncertainty."""
        values = self.model(x)
        residual = ((self.read - values) / self.u)[self.used]
        jacobian = (self.model.jacobian(x) / self.u[:, :, None])[self.used][:, self.active]
        known = self.knowledge_rows
        return np.vstack([jacobian, known]), np.concatenate([residual, -known @ x[self.active]])

    def decide_rank(self) -> None:
        """At an errorless, aligned machine: elsewhere the second order hides what is not determined."""
        matrix, _ = self.whitened(self.rank_at)
        length = np.linalg.norm(matrix, axis=0)
        matrix = np.where(length > NOTHING, matrix, 0.0)
        self.scale = np.where(length > NOTHING, length, HELD)
        self.seen = length > NOTHING
        _, values, right = np.linalg.svd(matrix / self.scale)
        relative = values / values[0]
        self.rank = int(np.sum(relative > RANK_THRESHOLD))
        self.null = right[self.rank :]
        rest = relative[self.rank] if self.rank < len(values) else 0.0
        self.gap = (float(relative[self.rank - 1]), float(rest))

    def solve(self) -> DenseAdjustment:
        """Gauss-Newton from zero until steps no longer shrink; nothing goes along what is not determined."""
        self.x = np.zeros(len(self.model.unknowns))
        before = np.inf
        for _ in range(60):
            left, values, right, right_side = self.decompose()
            inverse = np.where(values > 1e-12 * values[0], 1 / np.maximum(values, 1e-300), 0.0)
            step = right.T @ (inverse * (left.T @ right_side))
            self.x[self.active] += step / self.scale
            effect = float(np.max(np.abs(step)))
            if effect < 1e-4 and effect > 0.9 * before:
                break
            before = effect
        self.finish()
        return self

    def decompose(self) -> tuple[Array, Array, Array, Array]:
        """Of the scaled problem, and of rows that hold what is not determined at 0."""
        matrix, right_side = self.whitened(self.x)
        held = self.null * self.scale  # of a vector of unknowns: its part along each null vector, scaled
        whole = np.vstack([matrix, held])
        rest = np.concatenate([right_side, -held @ self.x[self.active]])
        left, values, right = np.linalg.svd(whole / self.scale, full_matrices=False)
        return left, values, right, rest

    def finish(self) -> None:
        left, values, right, right_side = self.decompose()
        self.half = (right.T / values) / self.scale[:, None]  # a column for each principal axis
        self.covariance = self.half @ self.half.T
        matrix, _ = self.whitened(self.x)
        length = np.linalg.norm(matrix, axis=0)
        shown = np.linalg.svd(matrix / np.where(length > NOTHING, length, 1.0), compute_uv=False)
        self.condition = float(shown[0] / shown[self.rank - 1])
        readings, rows = int(np.sum(self.used)), len(right_side) - len(self.null)
        self.square_sum = float(right_side[:rows] @ right_side[:rows])
        self.degrees_of_freedom = rows - self.rank
        self.chi_square_probability = float(chi2.sf(self.square_sum, self.degrees_of_freedom))
        self.redundancy = np.full(self.read.shape, np.nan)
        self.redundancy[self.used] = 1 - np.sum(left[:readings] ** 2, axis=1)
        self.residuals = np.full(self.read.shape, np.nan)
        self.residuals[self.used] = right_side[:readings] * self.u[self.used]

    # --- how far apart rounding leaves two adjustments of one run ---

    @property
    def rounding(self) -> float:
        """The norm of what two models' readings differ by, in standard uncertainties. By Cauchy and Schwarz, no value
        and no residual moves by more of its own."""
        size = np.array([2 * rounding(name) for name in self.channels])
        return float(np.linalg.norm((size[:, None] / self.u)[self.used]))

    def change_of_uncertainties(self, step: float) -> float:
        """The largest of standard uncertainties (relative) and redundancies where the solution moves by `step` of its
        uncertainty along every principal axis. With signs at random, the mean square is that of the worst movement of
        this length."""
        moved = copy.copy(self)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], self.half.shape[1])
        moved.x = self.x.copy()
        moved.x[self.active] += self.half @ (step * signs)
        moved.finish()
        ratio = np.sqrt(np.diag(moved.covariance) / np.diag(self.covariance))
        redundancy = np.abs(moved.redundancy - self.redundancy)[self.used]
        return float(max(np.max(np.abs(ratio - 1)), np.max(redundancy)))

    # --- what can be asked of it ---

    def determines(self, weights: Mapping[Unknown, float]) -> bool:
        """Whether a sum of unknowns is the same for all solutions: no null vector has a part in it."""
        w = self.vector(weights) / self.scale
        return bool(np.linalg.norm(self.null @ w) <= 1e-6 * np.linalg.norm(w)) if np.any(w) else True

    def vector(self, weights: Mapping[Unknown, float]) -> Array:
        w = np.zeros(len(self.active))
        for unknown, weight in weights.items():
            if unknown in self.place:
                w[self.place[unknown]] += weight
        return w

    def value(self, weights: Mapping[Unknown, float]) -> float:
        return float(self.vector(weights) @ self.x[self.active])

    def standard_uncertainty(self, weights: Mapping[Unknown, float]) -> float:
        w = self.vector(weights)
        return float(np.sqrt(w @ self.covariance @ w))

    def node(self, name: str, k: int, *, shape: bool = False, reversal: bool = False) -> dict[Unknown, float]:
        """The unknowns that make up a function's value at a node; shape: less the line to its end."""
        weights: dict[Unknown, float] = {Table(name, k, reversal): 1.0}
        if shape:
            last = self.scenario.steps
            end: Unknown = Table(name, last, reversal)
            weights[end] = weights.get(end, 0.0) - k / last
        return weights

    def function_is_determined(self, name: str, *, shape: bool = False) -> bool:
        return all(self.determines(self.node(name, k, shape=shape)) for k in range(1, self.scenario.steps + 1))

    def squareness_is_determined(self, name: str) -> bool:
        assert name in SQUARENESS
        return self.determines({Table(name): 1.0})

    def setup(self, run: int, line: str, quantity: str, component: int = 0) -> dict[Unknown, float]:
        return {Setup(run, line, quantity, component): 1.0}
