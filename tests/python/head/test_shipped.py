"""The two heads that come with the package, against a recomputation of the same rays with 40 digits."""

from __future__ import annotations

import numpy as np
import pytest
from places import SHIPPED_HEADS
from reference import Scenario
from reference_optics import (
    MP,
    Description,
    ciddor,
    glass_index,
    mirror_in_sensor_frame,
    read_description,
)
from shipped_heads import ASSUMED_AIR, SHIPPED, TRUE_AIR, Errors, Reference, Shipped
from simulated_runs import table_of, with_reversal
from truth import Setup
from usual import DIAGONALS, VOLUME

import stepdiag as sd

# The figures of the project. Coordinates of up to 1.3 m are rounded to 1e-13 mm, and unit vectors to 1e-16.
PATH = 5e-12  # mm
SPOT = 2e-11  # mm


def errors_of(description: Description, seed: int) -> Errors:
    """Every component out of its place by some 10 um and 100 urad in all six directions."""
    random = np.random.default_rng(seed)
    return {
        name: (tuple(random.uniform(-0.05, 0.05, 3)), tuple(random.uniform(-150e-6, 150e-6, 3)))
        for name in description.components
    }


@pytest.mark.slow
@pytest.mark.parametrize(("steps", "backward"), [(50, False), (8, True)], ids=["forward", "backward"])
@pytest.mark.parametrize("shipped", SHIPPED, ids=lambda shipped: shipped.file)
def test_signals_of_a_whole_run_hold_against_forty_digits(shipped: Shipped, steps: int, backward: bool) -> None:
    """All 604 poses of four diagonals of 50 steps: machine, reflector, laser and every component out of true.

    And backward runs of a machine with reversal errors; a lateral offset, roll and gain in both."""
    setup = Setup(steps, scale_lines=[])
    errors = with_reversal(setup.errors(21), setup.errors(23), 18)  # 20 um, 60 urad
    pose_errors = errors_of(read_description(SHIPPED_HEADS / f"{shipped.file}.toml", shipped.routes), 22)
    design = sd.optics.read_head_design(SHIPPED_HEADS / f"{shipped.file}.toml")
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
    plate = sd.optics.HeadBody.plate(
        "plate", width=50, height=50, thickness=10.0, material="N-BK7", position=(10, 10, 40)
    )
    beams = [
        sd.optics.HeadBeam.interferometer(name, position=(x, y, 0), wavelength=633.0)
        for name, x, y in (("a", 0, 0), ("b", 20, 0), ("c", 0, 20))
    ]
    head = sd.Head.from_design(sd.optics.HeadDesign("plate", "multi_beam", [plate], beams))
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
    for in_air, relative in ((1530.0, "1.500902"), (632.8, "1.515089")):
        vacuum = in_air * ciddor(in_air, humidity=0.0)
        assert abs(glass_index("N-BK7", vacuum) / ciddor(vacuum, humidity=0.0) - MP.mpf(relative)) <= 6e-7
