"""The second calibration: evaluates the run of a compensated machine.

Three axes cannot compensate tilts. The compensated machine still tilts, but its tilts no longer
move the functional point. Therefore it is no longer a chain of axes with tilts, and no calibration
with free angles fits its readings. The tilts are taken from the readings instead, and only
translations are evaluated: the distance of the functional point from its commanded position.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, Head, KnownExpansion, Measurement
from stepdiag.calibration.evaluations import adjust
from stepdiag.parameters import kind_of
from stepdiag.scenario.known import Known

ITERATIONS = 5  # of t = alpha^2 + beta^2, each of which gains a factor of t, about 1e-7


@dataclass(frozen=True)
class Translations:
    """A calibration of translations, and its largest values."""

    calibration: Calibration
    length: float  # mm, of positioning errors and straightnesses
    squareness: float  # rad


def translations(known: Known, run: Measurement, expansion: KnownExpansion | None = None) -> Translations:
    """Evaluate the translations of a run with three or more beams.

    They are referred to the reference temperature by the expansion, or as found."""
    place = along_beam(known, run)
    sound = np.isfinite(place)
    channels: dict[str, Any] = {
        name: run.channels[name][sound] for name in run.channels if name.startswith("temperature")
    }
    reduced = Measurement(
        [line for line, good in zip(run.line, sound, strict=True) if good],
        [int(point) for point in run.point[sound]],
        run.position[sound],
        channels | {"distance": place[sound]},
    )
    head = Head("ideal", standoff=known.head.standoff)
    found = adjust(reduced, known.plan, head, known.chain, known.tool, rotations=False, expansion=expansion).calibration
    lengths = [
        float(np.max(np.abs(values)))
        for name, (_, values, _) in found.functions.items()
        if kind_of(name) in ("positioning", "straightness")
    ]
    return Translations(found, max(lengths), max(abs(angle) for angle, _ in found.squareness.values()))


def along_beam(known: Known, run: Measurement) -> npt.NDArray[np.float64]:
    """Position of the functional point along the beam, (n,), mm, from distances and their tilts.

    Beam i reads (L - beta u_i + alpha v_i)/(1 - t), t = alpha^2 + beta^2, and L = z + beta x -
    alpha y of the functional point (x, y, z) in the sensor frame (docs/method.md), of which x and y
    are the commanded ones."""
    offsets = known.head.beam_offsets
    distances = np.stack([run.channels[name] for name in known.signals], axis=1)
    design = np.column_stack([np.ones(len(offsets)), -offsets[:, 0], offsets[:, 1]])
    scaled = np.linalg.lstsq(design, distances.T, rcond=None)[0]
    t = np.zeros(len(distances))
    for _ in range(ITERATIONS):
        length, beta, alpha = scaled * (1.0 - t)
        t = alpha**2 + beta**2
    lateral = np.empty((len(distances), 2))
    lines = np.array(run.line)
    for line in set(run.line):
        rows = lines == line
        lateral[rows] = (run.position[rows] - known.plan.points(line)[0]) @ known.plan.frame(line)[:, :2]
    return np.asarray(length - beta * lateral[:, 0] + alpha * lateral[:, 1])
