"""The two heads that come with the package, against a recomputation of the same rays with 40 digits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from reference import Scenario, Vector
from reference_optics import (
    MP,
    Description,
    Number,
    Plane,
    ciddor,
    glass_index,
    half_path,
    mirror_in_sensor_frame,
    read_description,
    spot,
    tilted_mirror,
)
from simulated_runs import table_of, with_reversal
from truth import DIAGONALS, VOLUME, Setup

import stepdiag as sd

HEADS = Path(sd.__file__).parent / "heads"
Errors = Mapping[str, tuple[tuple[float, float, float], tuple[float, float, float]]]

# The figures of the project. Coordinates of up to 1.3 m are rounded to 1e-13 mm, and unit vectors to 1e-16.
PATH = 5e-12  # mm
SPOT = 2e-11  # mm

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
        path = HEADS / f"{shipped.file}.toml"
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


def errors_of(description: Description, seed: int) -> Errors:
    """Every component out of its place by some 10 um and 100 urad in all six directions."""
    random = np.random.default_rng(seed)
    return {
        name: (tuple(random.uniform(-0.05, 0.05, 3)), tuple(random.uniform(-150e-6, 150e-6, 3)))
        for name in description.components
    }


@pytest.mark.parametrize(("steps", "backward"), [(50, False), (8, True)], ids=["forward", "backward"])
@pytest.mark.parametrize("shipped", SHIPPED, ids=lambda shipped: shipped.file)
def test_signals_of_a_whole_run_hold_against_forty_digits(shipped: Shipped, steps: int, backward: bool) -> None:
    """All 604 poses of four diagonals of 50 steps: machine, reflector, laser and every component out of true.

    And backward runs of a machine with reversal errors; a lateral offset, roll and gain in both."""
    setup = Setup(steps, scale_lines=[])
    errors = with_reversal(setup.errors(21), setup.errors(23), 18)  # 20 um, 60 urad
    pose_errors = errors_of(read_description(HEADS / f"{shipped.file}.toml", shipped.routes), 22)
    design = sd.read_head_design(HEADS / f"{shipped.file}.toml")
    head = sd.Head.from_design(design, standoff=110.0, pose_errors=dict(pose_errors))
    pairs = {
        line: {"reflector": (100e-6 * k, -150e-6 + 50e-6 * k), "laser": (200e-6, -70e-6 * k)}
        | {"lateral": (0.2 * k, -0.5), "roll": 2e-3 * k, "gain": 0.01 * k if shipped.laser else 0.0}
        for k, line in enumerate(DIAGONALS, start=1)
    }
    run = sd.simulate(
        sd.Machine(sd.Chain(setup.chain), errors, setup.tool),
        setup.plan,
        head,
        misalignment={line: sd.Misalignment(**pair) for line, pair in pairs.items()},
        environment=sd.Environment.from_air(**TRUE_AIR),
        assumed_environment=sd.Environment.from_air(**ASSUMED_AIR),
        backward=backward,
    )
    assert len(run) == 4 * (3 * steps + 1) * (2 if backward else 1)
    assert list(run.channels) == shipped.signals

    reference = Reference(shipped, pose_errors, 110.0)
    scenario = Scenario(VOLUME, setup.chain, DIAGONALS, steps, standoff=110.0, misalignment=pairs)
    table = table_of(errors)
    worst = dict.fromkeys(shipped.signals, 0.0)
    for i in range(len(run)):
        line = run.line[i]
        mirror = mirror_in_sensor_frame(scenario, table, line, run.position[i], run.direction[i] == "backward")
        for name, exact in zip(shipped.signals, reference.signals(mirror), strict=True):
            gain = 1 + MP.mpf(pairs[line]["gain"]) if name.startswith("spot") else 1
            worst[name] = max(worst[name], abs(float(run.channels[name][i] - gain * exact)))
    for name, error in worst.items():
        assert error <= (SPOT if name.startswith("spot") else PATH), worst


def test_indices_are_those_of_the_published_formulas() -> None:
    """Written twice; the second time with 40 digits."""
    for wavelength in (635.0, 1530.0):
        dry = sd.Environment.from_air(**TRUE_AIR).refractive_index(wavelength)
        # Ciddor's constants for the two reference densities are rounded to ten and six digits ...
        assert abs(dry - ciddor(wavelength, *TRUE_AIR.values())) <= 3e-14
        moist = sd.Environment.from_air(relative_humidity=0.5).refractive_index(wavelength)
        # ... of which the vapour's was made with another gas constant: 5e-6 of what the vapour does, 4e-6.
        assert abs(moist - ciddor(wavelength)) <= 5e-11
        # The glass is seen through a head: a plate's constant is thickness (n/n_air - 1).
    plate = sd.HeadBody.plate("plate", width=50, height=50, thickness=10.0, material="N-BK7", position=(10, 10, 40))
    beams = [
        sd.HeadBeam.interferometer(name, position=(x, y, 0), wavelength=633.0)
        for name, x, y in (("a", 0, 0), ("b", 20, 0), ("c", 0, 20))
    ]
    head = sd.Head.from_design(sd.HeadDesign("plate", "multi_beam", [plate], beams))
    air = sd.Environment.from_air().refractive_index(633.0)
    for constant in head.calibration.head_constants:
        assert abs((constant / 10.0 + 1) * air - glass_index("N-BK7", 633.0)) <= 1e-13  # paths rounded to 1e-13 mm


def test_indices_are_the_published_numbers() -> None:
    for conditions, index in (
        ((633.0, 20.0, 101325.0, 0.0), "1.000271800"),
        ((633.0, 50.0, 120000.0, 1.0), "1.000287924"),
        ((1700.0, 40.0, 110000.0, 1.0), "1.000270247"),
        ((1530.0, 20.0, 101325.0, 0.5), "1.000268164"),
    ):
        assert abs(ciddor(*conditions) - MP.mpf(index)) <= 1e-9  # the last digit given
    assert abs(glass_index("N-BK7", 1530.0) / ciddor(1530.0, humidity=0.0) - MP.mpf("1.500902")) <= 6e-7
    assert abs(glass_index("N-BK7", 632.8) / ciddor(632.8, humidity=0.0) - MP.mpf("1.515089")) <= 6e-7
