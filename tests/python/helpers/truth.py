"""What the tests of the evaluators share: virtual runs, and the distance of a calibration from its truth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from usual import CHAIN, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd

SQUARENESS_AXIS = {"C0Y": 1, "B0Z": 2, "A0Z": 2}

NANOMETRE, MICROMETRE = 1e-6, 1e-3  # mm
NANORADIAN, MICRORADIAN = 1e-9, 1e-6  # rad


@dataclass(frozen=True)
class Setup:
    """Everything that an evaluator is told, and how the virtual machine is."""

    steps: int = 50
    lines: list[str] = field(default_factory=lambda: DIAGONALS)
    scale_lines: list[str] = field(default_factory=lambda: SCALE_LINES)
    order: str = "XYZ"
    chain: str = CHAIN
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)
    volume: tuple[float, float, float] = VOLUME
    head: sd.Head = field(default_factory=sd.Head)

    @property
    def plan(self) -> sd.Plan:
        return sd.Plan(self.volume, self.lines, self.steps, order=self.order, scale_lines=self.scale_lines)

    def errors(self, seed: int, *, amplitude: float = 1.0, rotation: float = 60e-6) -> sd.ErrorMap:
        return sd.random_error_map(
            self.volume,
            seed=seed,
            translation=0.020 * amplitude,
            rotation=rotation * amplitude,
            squareness=60e-6 * amplitude,
            intervals=self.steps,
        )

    def simulate(
        self, errors: sd.ErrorMap, misalignment: sd.Misalignment | None = None, noise: sd.Noise | None = None
    ) -> sd.Measurement:
        machine = sd.Machine(sd.Chain(self.chain), errors, self.tool)
        by_line = dict.fromkeys(self.lines, misalignment) if misalignment else {}
        return sd.simulate(machine, self.plan, self.head, misalignment=by_line, noise=noise or sd.Noise())

    def evaluate(self, run: sd.Measurement, *, method: str = "enhanced", **options: Any) -> sd.Calibration:
        return sd.methods.evaluate(run, self.plan, self.head, sd.Chain(self.chain), self.tool, method=method, **options)


def changed(
    run: sd.Measurement,
    channels: Mapping[str, np.ndarray] | None = None,
    rows: Iterable[int] | None = None,
    **more: Any,
) -> sd.Measurement:
    """The run with other readings, or only some of its rows (in the order given)."""
    keep = np.arange(len(run)) if rows is None else np.array(list(rows))
    values = {**run.channels, **(channels or {})}
    return sd.Measurement(
        [run.line[i] for i in keep],
        np.asarray(run.point)[keep],
        np.asarray(run.position)[keep],
        {name: np.asarray(value)[keep] for name, value in values.items()},
        **more,
    )


def row_of(run: sd.Measurement, line: str, point: int) -> int:
    return next(i for i in range(len(run)) if run.line[i] == line and run.point[i] == point)


def without(run: sd.Measurement, lost: Iterable[tuple[str, int]], channels: Iterable[str] = ()) -> sd.Measurement:
    """The run with readings (line, point) lost: all channels of them, or those named."""
    values = {name: np.array(value) for name, value in run.channels.items()}
    for line, point in lost:
        for name in channels or values:
            values[name][row_of(run, line, point)] = np.nan
    return changed(run, values)


def deviations(calibration: sd.Calibration, truth: sd.ErrorMap) -> dict[str, np.ndarray]:
    """Calibration minus truth for every function and squareness that is there, at its nodes.

    Of a function whose slope is undetermined the shapes are compared: both with their ends at 0.
    """
    found = {}
    for name, (position, value, _) in calibration.functions.items():
        expected = truth.function(name, position)
        if name in calibration.undetermined_slopes:
            expected = expected - expected[-1] * position / position[-1]
        found[name] = value - expected
    for name, (angle, _) in calibration.squareness.items():
        found[name] = np.array([angle - truth.squareness.get(name, 0.0)])
    return found


@dataclass(frozen=True)
class Worst:
    """Largest absolute deviations: positions in mm, angles in rad.

    A squareness comes from lengths, so it counts as what it displaces at the end of its axis' travel.
    """

    position: float
    angle: float


def worst(calibration: sd.Calibration, truth: sd.ErrorMap) -> Worst:
    position, angle = [0.0], [0.0]
    for name, deviation in deviations(calibration, truth).items():
        largest = float(np.max(np.abs(deviation)))
        if name in SQUARENESS_AXIS:
            position.append(largest * calibration.volume[SQUARENESS_AXIS[name]])
        else:
            (position if name[1] in "XYZ" else angle).append(largest)
    return Worst(max(position), max(angle))
