"""Small traced heads whose readings have closed forms; what several files of tests share. mm, rad."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

import stepdiag as sd

OFFSETS = [(0.0, 0.0), (20.0, 0.0), (0.0, 20.0)]
APERTURE = 18.0  # of each beam of three_beams
WINDOW = {"width": 80.0, "height": 80.0, "thickness": 5.0, "material": 1.5, "position": (10.0, 10.0, 30.0)}

Pair = tuple[float, float]
PoseErrors = dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]]


def window(**changes: Any) -> sd.optics.HeadBody:
    return sd.optics.HeadBody.plate("window", **(WINDOW | changes))


def three_beams(
    *bodies: sd.optics.HeadBody,
    offsets: list[Pair] = OFFSETS,
    standoff: float = 100.0,
    pose_errors: PoseErrors | None = None,
    mirror: Pair | None = None,
    **interferometer: Any,
) -> sd.Head:
    """Layout a: parallel beams from the reference plane, and bodies before them."""
    settings = {"aperture": APERTURE} | interferometer
    beams = [
        sd.optics.HeadBeam.interferometer(f"beam {i}", position=(u, v, 0.0), **settings)
        for i, (u, v) in enumerate(offsets, start=1)
    ]
    design = sd.optics.HeadDesign("three beams", "multi_beam", list(bodies), beams)
    return sd.Head.from_design(design, standoff=standoff, pose_errors=pose_errors or {}, mirror=mirror)


@dataclass(frozen=True)
class SpotHead:
    """Numbers of a layout b whose axes are the head's: laser, cube and position sensing device around x = 30."""

    laser: float = -5.0  # z
    centre: float = 20.0  # z of the cube
    edge: float = 20.0
    gap: float = 8.0  # from the cube to the device
    index: float = 1.5

    @property
    def psd_distance(self) -> float:
        """In air of index 1: what the unfolded way back is longer than the mirror's distance, glass counted as t/n."""
        return -(self.centre + self.edge / 2) + self.edge / self.index + self.gap

    @property
    def lever(self) -> float:
        """From the splitting face to the device."""
        return self.edge / 2 + self.gap

    def head(
        self,
        *bodies: sd.optics.HeadBody,
        pose_errors: PoseErrors | None = None,
        material: str | float | None = None,
        **options: Any,
    ) -> sd.Head:
        x = 30.0
        cube = sd.optics.HeadBody.cube_splitter(
            "cube", edge=self.edge, material=material or self.index, position=(x, 0.0, self.centre)
        )
        beams = [
            sd.optics.HeadBeam.interferometer("distance", aperture=18.0),
            sd.optics.HeadBeam.spot("laser", sensor="psd", position=(x, 0.0, self.laser)),
        ]
        # The cube sends the returning light to -x: sensor x = head z, which unfolds to head x; sensor y = head y.
        device = sd.optics.SpotSensor.lateral_effect(
            "psd", position=(x - self.lever, 0.0, self.centre), rotation=(0.0, -pi / 2, 0.0)
        )
        design = sd.optics.HeadDesign("spot head", "psd", [cube, *bodies], beams, [device])
        return sd.Head.from_design(design, pose_errors=pose_errors or {}, **options)


def read(head: sd.Head, **mirror: Any) -> np.ndarray:
    """The signals in order; NaN for a lost one."""
    signals = sd.optics.read_signals(head, **mirror)
    return np.array([np.nan if signals[name] is None else signals[name] for name in head.signals], dtype=float)


def spot_of(head: sd.Head, **mirror: Any) -> np.ndarray:
    return read(head, **mirror)[1:]


def definition(distance: float, tilt: Pair, offset: Pair = (0.0, 0.0)) -> float:
    """The conventions' half round trip of a beam from (u, v) to a mirror through (0, 0, distance) and back."""
    alpha, beta = tilt
    length = distance - beta * offset[0] + alpha * offset[1]
    return length / (1 - alpha**2 - beta**2)
