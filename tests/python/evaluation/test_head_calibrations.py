"""Calibrations with traced heads: as good as by the closed definitions; what noise and displaced parts do to them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_heads import SpotHead, three_beams, window
from truth import MICROMETRE, MICRORADIAN, NANOMETRE, NANORADIAN, Setup, worst
from usual import DIAGONALS, SCALE_LINES

import stepdiag as sd

SEEDS = [1, 2, 3]
STEPS = 50
EVERY_LINE = [*DIAGONALS, *SCALE_LINES]
REFLECTOR = sd.Misalignment(reflector=(100e-6, 300e-6))

# What the linear evaluation leaves of the second order: as in test_truth_evaluation.py. Spots weigh the points of a
# line otherwise than tilts do, by their levers, and leave up to 6 nrad.
CLEAN = (15 * NANOMETRE, 10 * NANORADIAN)
TURNED = (150 * NANOMETRE, 50 * NANORADIAN)


# The air that a head is calibrated in. In vacuum 25 mm of glass are 4e-6 m less of lever, a 3e-5 of tilts at 100 mm.
LABORATORY = sd.Environment.from_air()


def simulate(setup: Setup, truth: sd.ErrorMap, misalignment: sd.Misalignment | None = None) -> sd.Measurement:
    machine = sd.Machine(sd.Chain(setup.chain), truth, setup.tool)
    by_line = dict.fromkeys(setup.lines, misalignment) if misalignment else {}
    return sd.simulate(machine, setup.plan, setup.head, misalignment=by_line, environment=LABORATORY)


def shipped(name: str, **options: object) -> sd.Head:
    return sd.Head.from_design(sd.optics.shipped_head(name), **options)


def defined_like(head: sd.Head) -> sd.Head:
    """The closed definition of a traced head's readings, with its calibration."""
    if head.layout == "psd":
        return sd.Head("psd", psd_distance=head.calibration.psd_distance)
    return sd.Head("multi_beam", beam_offsets=head.calibration.beam_offsets)


def largest_change(a: sd.Calibration, b: sd.Calibration) -> tuple[float, float]:
    """In positions (mm) and angles (rad), squarenesses left out: they follow."""
    changes = {name: np.max(np.abs(value - b.functions[name][1])) for name, (_, value, _) in a.functions.items()}
    return (
        max(change for name, change in changes.items() if name[1] in "XYZ"),
        max(change for name, change in changes.items() if name[1] in "ABC"),
    )


@pytest.mark.parametrize("name", ["three_beams", "beam_and_psd"])
@pytest.mark.parametrize(
    ("misalignment", "limit"),
    [(None, CLEAN), (REFLECTOR, TURNED)],
    ids=["aligned", "reflector turned"],
)
@pytest.mark.parametrize("seed", SEEDS)
def test_shipped_heads_calibrate_as_well_as_their_definitions(
    seed: int,
    name: str,
    misalignment: sd.Misalignment | None,
    limit: tuple[float, float],
) -> None:
    head = shipped(name)
    found = []
    for used in (head, defined_like(head)):
        setup = Setup(steps=STEPS, head=used)
        truth = setup.errors(seed)
        found.append(setup.evaluate(simulate(setup, truth, misalignment)))
        error = worst(found[-1], truth)
        assert error.position <= limit[0]
        assert error.angle <= limit[1]
    position, angle = largest_change(*found)
    # The window: t phi^2 (1 - 1/n) = 3e-7 mm at 450 urad. In tilts the third order of 30 mm of glass, 6e-12 rad at
    # 100 mm.
    assert position <= 3e-7
    assert angle <= 5e-12


def test_heads_by_line_give_what_one_head_gives() -> None:
    """The paper has four base units. Four of the same kind are as good as one that is carried about."""
    head = shipped("three_beams")
    setup = Setup(steps=20, head=head)
    truth = setup.errors(4)
    machine = sd.Machine(sd.Chain(setup.chain), truth, setup.tool)
    run = setup.simulate(truth, REFLECTOR)
    same = {line: shipped("three_beams") for line in EVERY_LINE}
    misalignment = dict.fromkeys(DIAGONALS, REFLECTOR)
    by_line = sd.simulate(machine, setup.plan, same, misalignment=misalignment)
    for name, values in run.channels.items():
        assert np.array_equal(values, by_line.channels[name])
    one, four = (
        sd.methods.evaluate(run, setup.plan, used, setup.chain, setup.tool, method="enhanced") for used in (head, same)
    )
    for name, columns in one.functions.items():
        assert np.array_equal(columns[1], four.functions[name][1])


def test_heads_of_different_kinds_on_different_lines_agree() -> None:
    setup = Setup(steps=20)
    truth = setup.errors(4)
    machine = sd.Machine(sd.Chain(setup.chain), truth, setup.tool)
    different = {
        "ppp": three_beams(),
        "npp": three_beams(window(thickness=8.0, material="N-SF11")),
        "pnp": three_beams(
            window(rotation=(0.02, 0.03, 0.0)),
            offsets=[(0.0, 0.0), (0.0, 20.0), (-20.0, 0.0)],
        ),
        "nnp": shipped("three_beams", standoff=200.0),
        **{line: sd.Head("multi_beam", beam_offsets=[(0.0, 0.0), (30.0, 0.0), (0.0, 30.0)]) for line in SCALE_LINES},
    }
    run = sd.simulate(machine, setup.plan, different, misalignment=dict.fromkeys(DIAGONALS, REFLECTOR))
    calibration = sd.methods.evaluate(run, setup.plan, different, setup.chain, setup.tool, method="enhanced")
    error = worst(calibration, truth)
    assert error.position <= TURNED[0]
    assert error.angle <= TURNED[1]


@pytest.mark.parametrize("name", ["three_beams", "beam_and_psd"])
def test_evaluation_sees_no_pose_errors(name: str) -> None:
    """Only a nominal calibration crosses from the simulator: the evaluation is the same bits with or without them."""
    design = sd.optics.shipped_head(name)
    parts = [part.name for part in [*design.bodies, *design.beams, *design.sensors]]
    errors = dict.fromkeys(parts, ((0.02, -0.01, 0.03), (5e-05, 8e-05, -6e-05)))
    displaced, sound = shipped(name, pose_errors=errors), shipped(name)
    for attribute in ("psd_distance", "spot_beam", "beam_offsets", "head_constants"):
        assert np.array_equal(
            getattr(displaced.calibration, attribute),
            getattr(sound.calibration, attribute),
        )
    setup = Setup(steps=12, head=displaced)
    truth = setup.errors(6)
    run = setup.simulate(truth)
    with_errors, without = (
        sd.methods.evaluate(run, setup.plan, head, setup.chain, method="enhanced") for head in (displaced, sound)
    )
    for function, columns in with_errors.functions.items():
        assert np.array_equal(columns[1], without.functions[function][1])
    # What they did is in the readings, and so in the result.
    other = Setup(steps=12, head=sound)
    assert max(largest_change(with_errors, other.evaluate(other.simulate(truth)))) > 1 * NANORADIAN


def spread_of_differences(noise: sd.Noise) -> float:
    """Standard deviation of what noise adds to (d2 - d1) / 20 mm: the mirror's tilt beta."""
    setup = Setup(steps=STEPS, head=three_beams())
    truth = setup.errors(8)
    clean, noisy = setup.simulate(truth), setup.simulate(truth, noise=noise)
    added = [noisy.channels[name] - clean.channels[name] for name in ("d1", "d2")]
    return float(np.std((added[1] - added[0]) / 20.0))


def test_noise_that_is_common_to_the_beams_does_not_disturb_the_tilts() -> None:
    """The baseline of 20 mm is good for the beams' own noise times root 2 over 20 mm, whatever they share."""
    own, common = 2e-6, 1e-3  # 2 nm and 1 um
    assert spread_of_differences(sd.Noise(distance=0.0, seed=3, common=common)) <= 2e-14  # rounding of 1 m, over 20 mm
    expected = own * math.sqrt(2) / 20.0
    for noise in (
        sd.Noise(distance=own, seed=3),
        sd.Noise(distance=own, seed=3, common=common),
    ):
        # 607 rows: a standard deviation is known to 1/sqrt(1214) = 2.9 %; four of that.
        assert spread_of_differences(noise) == pytest.approx(expected, rel=0.12)


def calibration_with(baseline: float, noise: sd.Noise) -> tuple[sd.Calibration, sd.Calibration]:
    """(with noise, without), on a head without glass."""
    offsets = [(0.0, 0.0), (baseline, 0.0), (0.0, baseline)]
    setup = Setup(steps=20, head=three_beams(offsets=offsets))
    truth = setup.errors(9)
    return setup.evaluate(setup.simulate(truth, noise=noise)), setup.evaluate(setup.simulate(truth))


def test_common_noise_is_in_the_lengths_only() -> None:
    position, angle = largest_change(*calibration_with(20.0, sd.Noise(seed=5, common=1e-4)))
    # 0.1 um a reading is 0.1 to some um in sums over 60 steps.
    assert 0.1 * MICROMETRE <= position <= 10 * MICROMETRE
    # Tilts are differences of beams, which do not know of it but for (1 - t): 0.1 um x (100 urad)^2, over 20 mm.
    assert angle <= 0.01 * NANORADIAN


@pytest.mark.parametrize("own", [2e-6, 1e-4])
def test_noise_of_each_beam_is_in_the_angles_by_the_baseline(own: float) -> None:
    """Twice the baseline, half the error: the same draws of noise."""
    angles = []
    for baseline in (20.0, 40.0):
        noisy, clean = calibration_with(baseline, sd.Noise(distance=own, seed=5))
        names = [f"E{c}{axis}" for c in "ABC" for axis in "XYZ"]
        angles.append(np.concatenate([noisy.functions[name][1] - clean.functions[name][1] for name in names]))
    # The readings' own second orders differ: noise x tilt.
    assert np.max(np.abs(angles[0] - 2 * angles[1])) <= 1e-3 * np.max(np.abs(angles[0]))
    assert np.max(np.abs(angles[0])) >= own * math.sqrt(2) / 20.0, "a random walk over the steps"


def test_constants_of_beams_tilt_a_line_and_nothing_else_in_its_readings() -> None:
    head = three_beams(window())
    setup = Setup(steps=12, head=head)
    truth = setup.errors(10)
    plain = setup.simulate(truth)
    constants = sd.Misalignment(distance_constant=3.0, beam_constants=[0.01, -0.02, 0.005])
    shifted = setup.simulate(truth, constants)
    on_lines = np.isin(plain.line, DIAGONALS)
    for name, constant in zip(("d1", "d2", "d3"), (3.01, 2.98, 3.005), strict=True):
        added = shifted.channels[name] - plain.channels[name]
        assert np.max(np.abs(added - np.where(on_lines, constant, 0.0))) <= 1e-12  # rounding of 1.2 m


def test_displaced_device_in_the_optics_is_the_zero_offset_of_the_definition() -> None:
    """3a and 3b of the paper's Figure 5: from a PSD that stands (1.5, 2) mm aside, in place of a number added."""
    numbers = SpotHead()
    # The device's x is head z, its y head y: shifted by (-1.5, -2), it reads +(1.5, 2).
    displaced = numbers.head(pose_errors={"psd": ((0.0, -2.0, -1.5), (0.0, 0.0, 0.0))})
    traced = Setup(steps=STEPS, head=displaced)
    number = sd.Head("psd", psd_distance=displaced.calibration.psd_distance)
    defined = Setup(steps=STEPS, head=number)
    truth = traced.errors(3)
    misaligned = {"reflector": (100e-6, 300e-6), "laser": (700e-6, 1000e-6)}
    by_trace = simulate(traced, truth, sd.Misalignment(**misaligned))
    by_number = simulate(defined, truth, sd.Misalignment(**misaligned, psd_zero=(1.5, 2.0)))
    on_lines = np.isin(by_trace.line, DIAGONALS)
    ideal = simulate(Setup(steps=STEPS), truth, sd.Misalignment(**misaligned))
    alpha, beta = ideal.channels["alpha"], ideal.channels["beta"]
    for name, zero, tilt in (("spot_x", 1.5, -beta), ("spot_y", 2.0, alpha)):
        # A component stands displaced on scale lines too; a number is given for the diagonals alone.
        difference = by_trace.channels[name] - by_number.channels[name] - np.where(on_lines, 0.0, zero)
        # To first order they agree: 30 mm of offset between the beams times two tilts of up to 1 mrad are left, ...
        assert np.max(np.abs(difference)) <= 1.5e-4
        # ... the spot's beam starts at u = 30 and is L - 30 beta long; and of that the third order of the cube's glass.
        assert np.max(np.abs(difference + 60.0 * beta * tilt)) <= 2e-7
    # Evaluated, the two do the same harm.
    error, number_error = (
        worst(setup.evaluate(run), truth) for setup, run in ((traced, by_trace), (defined, by_number))
    )
    assert error.angle > 5 * MICRORADIAN
    assert error.angle == pytest.approx(number_error.angle, rel=0.02)
    assert error.position == pytest.approx(number_error.position, rel=0.02)
