"""One sample of a virtual calibration, made a second time: its draws by their published counters, its readings by the
reference's closed forms. mm, rad, s.

What a sample is, and which number is which, is said in uncertainty/virtual_calibration.hpp and draws.hpp.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import reference
from philox import VIRTUAL_CALIBRATION, normal_pair, uniform_pair
from reference_optics import ciddor

import stepdiag as sd

SEQUENCE = 1 << 20
COMPONENTS = {"reflector": 2, "laser": 2, "psd_zero": 2, "lateral": 2}
SCALARS = ("distance_constant", "roll", "gain", "drift")


def number(
    seed: int, samples: np.ndarray, sequence: int, index: int, distribution: sd.montecarlo.Distribution
) -> np.ndarray:
    """Number `index` of a sequence, of its distribution."""
    normal = normal_pair(seed, VIRTUAL_CALIBRATION, samples, sequence * SEQUENCE + index // 2)[index % 2]
    u, v = uniform_pair(seed, VIRTUAL_CALIBRATION, samples, sequence * SEQUENCE + index, 1)
    return distribution.expectation + distribution.spread * standard(distribution, normal, u, v)


def standard(distribution: sd.montecarlo.Distribution, normal: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Of expectation 0 and spread 1 (JCGM 101, 6.4; quantile functions where they are closed)."""
    if distribution.kind == "rectangular":
        return 2.0 * u - 1.0
    if distribution.kind == "triangular":
        return np.where(u < 0.5, np.sqrt(2.0 * u) - 1.0, 1.0 - np.sqrt(2.0 - 2.0 * u))
    if distribution.kind == "arcsine":
        return np.sin(2.0 * np.pi * u)
    if distribution.kind == "t":  # R. W. Bailey, Mathematics of Computation 62 (1994) 779
        nu = distribution.degrees_of_freedom
        return np.sqrt(nu * (u ** (-2.0 / nu) - 1.0)) * np.cos(2.0 * np.pi * v)
    if distribution.kind == "curvilinear_trapezoid":  # 6.4.3.4, in the half width
        edge = distribution.edge / distribution.spread
        low = -1.0 - edge + 2.0 * edge * u
        return low + (-low - low) * v
    return normal


def drawn(inputs: sd.montecarlo.UncertainInputs, seed: int, samples: Sequence[int] | np.ndarray) -> np.ndarray:
    """Deviations of the inputs, (inputs, samples)."""
    at = np.asarray(samples, dtype=np.uint64)
    values = np.array([number(seed, at, 0, i, x.distribution) for i, x in enumerate(inputs.inputs)])
    for members, correlation in inputs.correlations:
        normals = [normal_pair(seed, VIRTUAL_CALIBRATION, at, m // 2)[m % 2] for m in members]
        together = np.linalg.cholesky(correlation) @ np.array(normals)
        for m, row in zip(members, together, strict=True):
            d = inputs.inputs[m].distribution
            values[m] = d.expectation + d.spread * row
    return values


@dataclass(frozen=True)
class Air:
    """Of the trace, and what readings are reduced with."""

    temperature: float = 20.0
    pressure: float = 101325.0
    humidity: float = 0.5

    def index(self, wavelength: float = 1530.0) -> float:
        return float(ciddor(wavelength, self.temperature, self.pressure, self.humidity))


class Sample:
    """Readings of one sample of a run: `values` are the deviations of the inputs, `sample` its index for the noise."""

    def __init__(
        self,
        scenario: reference.Scenario,
        table: reference.ErrorTable,
        inputs: sd.montecarlo.UncertainInputs,
        values: Sequence[float] | np.ndarray,
        *,
        air: Air | None = None,
        noise_of: tuple[int, int] | None = None,  # seed, sample; none: no noise
    ) -> None:
        self.given, self.table, self.inputs, self.air = scenario, table, inputs, air
        self.value = {(x.quantity, x.line, x.component): float(v) for x, v in zip(inputs.inputs, values, strict=True)}
        self.noise_of = noise_of
        self.scenario = self._perturbed()
        self.walked: dict[int, float] = {}

    def _of(self, quantity: str, line: str = "", component: int = 0) -> float:
        return self.value.get((quantity, line, component), 0.0)

    def _perturbed(self) -> reference.Scenario:
        """The scenario with what its set-ups and its head deviate by."""
        setups: dict[str, dict[str, Any]] = {}
        for line in [*self.given.lines, *self.given.scale_lines]:
            nominal: Mapping[str, Any] = self.given.misalignment.get(line, {})
            setup = dict(nominal)
            for name, count in COMPONENTS.items():
                pair = nominal.get(name, (0.0,) * count)
                setup[name] = tuple(pair[i] + self._of(name, line, i) for i in range(count))
            for name in SCALARS:
                setup[name] = nominal.get(name, 0.0) + self._of(name, line)
            if self.given.layout == "multi_beam":
                beams = nominal.get("beam_constants") or [0.0] * len(self.given.beam_offsets)
                setup["beam_constants"] = [b + self._of("beam_constants", line, i) for i, b in enumerate(beams)]
            setups[line] = setup
        offsets = [
            [offset + self._of("beam_offset", component=2 * i + j) for j, offset in enumerate(pair)]
            for i, pair in enumerate(self.given.beam_offsets)
        ]
        return replace(
            self.given,
            misalignment=setups,
            psd_distance=self.given.psd_distance + self._of("psd_distance"),
            beam_offsets=offsets,
        )

    def _noise(self, quantity: str, row: int, component: int = 0, channel: str = "") -> float:
        if self.noise_of is None:
            return 0.0
        seed, sample = self.noise_of
        for e, noise in enumerate(self.inputs.noise):
            if (noise.quantity, noise.component, noise.channel) == (quantity, component, channel):
                return float(number(seed, np.array([sample]), 1 + e, row, noise.distribution)[0])
        return 0.0

    def air_factor(self) -> float:
        """What distances read by the air that is not as assumed, and by the light."""
        factor = 1.0 + self._of("refractive_index")
        if self.air is not None:
            true = Air(
                self.air.temperature + self._of("temperature"),
                self.air.pressure + self._of("pressure"),
                self.air.humidity + self._of("humidity"),
            )
            factor *= true.index() / self.air.index()
        return factor

    def rows(self) -> list[dict[str, Any]]:
        s = self.scenario
        seconds = s.seconds_per_reading or 0.0
        root = float(np.sqrt(seconds))
        found: list[dict[str, Any]] = []
        machine_walk, air = np.zeros(3), self.air_factor()
        for line in [*s.lines, *s.scale_lines]:
            points = list(enumerate(reference.commanded_points(s, line)))
            visits = [(points, False), (points[::-1], True)] if s.backward else [(points, False)]
            for _ in range(s.repeats):
                first, head_walk = len(found), 0.0
                for visit, backward in visits:
                    for point, commanded in visit:
                        row = len(found)
                        if row:
                            machine_walk += [root * self._noise("machine_walk", row, c) for c in range(3)]
                        head_walk += root * self._noise("head_walk", row) if row > first else 0.0
                        moved = machine_walk + [
                            self._of("machine_drift", component=c) * row * seconds + self._noise("position", row, c)
                            for c in range(3)
                        ]
                        turned = [self._noise("orientation", row, c) for c in range(3)]
                        found.append(
                            self._read(row, line, point, commanded, backward, (row - first) * seconds, moved, turned)
                        )
                        for name in found[-1]:
                            if name == "distance" or (name[0] == "d" and name[1:].isdigit()):
                                self._finish(found[-1], name, line, point, points, air, head_walk, row)
        return found

    def _read(
        self,
        row: int,
        line: str,
        point: int,
        commanded: Any,
        backward: bool,
        elapsed: float,
        moved: np.ndarray,
        turned: Sequence[float],
    ) -> dict[str, Any]:
        s = self.scenario
        p, normal = reference.mirror_of(s, self.table, line, commanded, backward=backward)
        mirror = (p + moved, reference.turn(turned) @ normal)
        values = reference.readings(s, self.table, line, commanded, reference.DOUBLE, backward, elapsed, mirror)
        setup = s.misalignment[line]
        shared = setup["distance_constant"] + setup["drift"] * elapsed
        own = {f"d{i}": c for i, c in enumerate(setup.get("beam_constants", []), start=1)}
        self.constants = {name: shared + own.get(name, 0.0) for name in values}
        origin, sensor = reference.head_of(s, line)
        beam = sensor[:, 2]
        cosine = mirror[1] @ beam
        self.length = ((mirror[0] - origin) @ mirror[1]) / cosine
        self.tan2 = (1.0 - cosine**2) / cosine**2
        for name in list(values):
            if not (name == "distance" or name[1:].isdigit()):
                values[name] += self._noise("channel", row, channel=name)
        return {"line": line, "point": point, "position": commanded, **values}

    def _finish(
        self,
        row: dict[str, Any],
        name: str,
        line: str,
        point: int,
        points: Sequence[tuple[int, Any]],
        air: float,
        head_walk: float,
        index: int,
    ) -> None:
        """From the geometric distance to what is read."""
        along = reference.frame(line, self.scenario.volume)[:, 2]  # the travel of a distance
        travel = float(along @ np.subtract(points[point][1], points[0][1]))
        model = self._of("reading_model") * self.length * self.tan2
        constant = self.constants.get(name, 0.0)  # what electronics read too much is no path in air
        distance = ((row[name] - constant) * air + constant + model) / (1.0 + self._of("wavelength"))
        distance += self._of("scale_factor", line) * travel
        # Of a length standard along a scale line, a part of it; elsewhere of the last point.
        part = travel / float(along @ np.subtract(points[-1][1], points[0][1]))
        if line in self.scenario.scale_lines or point == len(points) - 1:
            distance += part * self._of("scale_length", line)
        noise = self._noise("channel", index, channel=name) + self._noise("common", index)
        row[name] = distance + head_walk + noise
