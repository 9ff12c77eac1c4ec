"""The heads that come with the package: their files, what their beams meet, and their signals by 40 digits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from places import SHIPPED_HEADS
from reference import Vector
from reference_optics import (
    MP,
    Number,
    Plane,
    ciddor,
    half_path,
    read_description,
    spot,
    tilted_mirror,
)

Errors = Mapping[str, tuple[tuple[float, float, float], tuple[float, float, float]]]
TRUE_AIR = {"temperature": 21.3, "pressure": 99000.0, "relative_humidity": 0.0}  # dry: known to 1e-14, see below
ASSUMED_AIR = {"temperature": 20.0, "pressure": 101325.0, "relative_humidity": 0.0}


@dataclass(frozen=True)
class Shipped:
    """A head's file, its interferometers in order, the beam of its spot, and what the beams meet."""

    file: str
    interferometers: list[str]
    routes: dict[str, str]
    laser: str | None = None
    signals: list[str] = field(default_factory=list)


OVER_THE_WINDOW = "window -z, window +z, mirror, window +z, window -z"
SHIPPED = [
    Shipped(
        "three_beams",
        ["centre", "right", "above"],
        {name: f"{OVER_THE_WINDOW}, {name}" for name in ("centre", "right", "above")},
        signals=["d1", "d2", "d3"],
    ),
    Shipped(
        "beam_and_psd",
        ["interferometer"],
        {
            "interferometer": f"{OVER_THE_WINDOW}, interferometer",
            # The cube is turned half round its z: what the mirror sends back leaves over its own -x face, at head +x.
            "laser": f"splitter -z, splitter split, splitter +z, {OVER_THE_WINDOW}, "
            "splitter +z, splitter split reflected, splitter -x, psd",
        },
        "laser",
        ["distance", "spot_x", "spot_y"],
    ),
]


class Reference:
    """A head's signals by 40 digits: raw ones reduced by what the nominal head reads of an aligned mirror."""

    def __init__(self, shipped: Shipped, errors: Errors, standoff: float) -> None:
        path = SHIPPED_HEADS / f"{shipped.file}.toml"
        self.shipped = shipped
        self.head = read_description(path, shipped.routes, errors)
        self.nominal = read_description(path, shipped.routes)
        aligned = tilted_mirror(standoff)
        self.constants = {
            beam: half_path(self.nominal, beam, self.index(beam, ASSUMED_AIR), aligned) - standoff
            for beam in shipped.interferometers
        }
        if shipped.laser:
            self.zero = spot(self.nominal, shipped.laser, self.index(shipped.laser, ASSUMED_AIR), aligned)
            grown = (self.slopes(standoff + 1000.0) - self.slopes(standoff)) / 2000
            (a, b), (c, d) = grown
            self.axes = np.array([[d, -b], [-c, a]]) / (a * d - b * c)

    def index(self, beam: str, air: Mapping[str, float]) -> Number:
        return ciddor(self.head.components[beam].numbers["wavelength"], *air.values())

    def slopes(self, distance: float) -> np.ndarray:
        """Of the nominal raw spot by (-beta, alpha)."""
        laser = self.shipped.laser
        assert laser
        index, h = self.index(laser, ASSUMED_AIR), MP.mpf("1e-12")  # (1e-12)^2 is below every digit that counts

        def at(alpha: Number, beta: Number) -> Vector:
            return spot(self.nominal, laser, index, tilted_mirror(distance, alpha, beta))

        return np.column_stack([at(0, -h) - at(0, h), at(h, 0) - at(-h, 0)]) / (2 * h)

    def signals(self, mirror: Plane) -> list[Number]:
        values = []
        for beam in self.shipped.interferometers:
            true, assumed = self.index(beam, TRUE_AIR), self.index(beam, ASSUMED_AIR)
            values.append(half_path(self.head, beam, true, mirror) * true / assumed - self.constants[beam])
        if laser := self.shipped.laser:
            values.extend(self.axes @ (spot(self.head, laser, self.index(laser, TRUE_AIR), mirror) - self.zero))
        return values
