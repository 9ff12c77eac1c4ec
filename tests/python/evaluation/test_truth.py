"""What the evaluators recover of a known truth: the files made by another program, and the demo's machine."""

from __future__ import annotations

import numpy as np
import pytest
import reference_files
from places import RUNS
from truth import MICROMETRE, MICRORADIAN, NANOMETRE, NANORADIAN, Setup, changed, deviations, worst
from usual import ALL_CHAINS, DIAGONALS, ORDERS

import stepdiag as sd

SEEDS = [1, 2, 3]

# The linear evaluation leaves terms of second order. Products of the machine's angles: 60 urad x 60 urad x 1 m = 4 nm,
# a few of them. Laser misalignment: 1 - cos(1 mrad) over 1.1 m is 0.6 um, some directions amplify it.
CLEAN = (15 * NANOMETRE, 5 * NANORADIAN)
MISALIGNED = (2.5 * MICROMETRE, 50 * NANORADIAN)

REFLECTOR = sd.Misalignment(reflector=(100e-6, 300e-6))  # the paper's 1b
LASER = sd.Misalignment(laser=(700e-6, 1000e-6))  # 1c


def known_run(case: str) -> tuple[Setup, sd.Measurement, sd.ErrorMap]:
    s = reference_files.read_scenario(RUNS / case / "scenario.toml")
    head = sd.Head(s.layout, standoff=s.standoff, psd_distance=s.psd_distance, beam_offsets=s.beam_offsets)
    setup = Setup(s.steps, s.lines, s.scale_lines, s.order, s.chain, s.tool, s.volume, head)
    return setup, sd.read_measurement(RUNS / case / "measurement.csv"), sd.read_error_map(RUNS / case / "truth.csv")


@pytest.mark.parametrize(
    ("case", "limit"),
    [
        ("clean", CLEAN),
        ("misaligned", MISALIGNED),
        ("reversed_order", MISALIGNED),
        ("three_beams", MISALIGNED),  # laser angles up to 1.2 mrad
        ("faces", MISALIGNED),  # 0.6 mrad, but the scales come from the faces alone
    ],
)
def test_enhanced_recovers_the_known_truth(case: str, limit: tuple[float, float]) -> None:
    setup, run, truth = known_run(case)
    calibration = setup.evaluate(run)
    assert len(calibration.functions) == 18
    assert len(calibration.squareness) == 3
    assert calibration.undetermined_slopes == []
    error = worst(calibration, truth)
    assert error.position <= limit[0]
    assert error.angle <= limit[1]


def test_displaced_position_sensing_device_spoils_the_angles() -> None:
    """3a and 3b of the paper's Figure 5: a zero offset reads as an angle that falls with the distance."""
    setup, run, truth = known_run("displaced_psd")
    calibration = setup.evaluate(run)
    error = worst(calibration, truth)
    assert error.angle > 5 * MICRORADIAN
    assert error.position > 10 * MICROMETRE
    # With the offset taken off, the same run is recovered: nothing else was wrong with it.
    scale = np.isin(run.line, setup.scale_lines)  # they have no offset
    x = np.where(scale, run.channels["spot_x"], run.channels["spot_x"] - 1.5)
    y = np.where(scale, run.channels["spot_y"], run.channels["spot_y"] - 2.0)
    error = worst(setup.evaluate(changed(run, {"spot_x": x, "spot_y": y})), truth)
    assert error.position <= MISALIGNED[0]
    # The reflector is misaligned by 300 urad and the laser by 1 mrad: third-order products of the tilts appear.
    assert error.angle <= 2 * MISALIGNED[1]


def test_noisy_run_is_recovered_within_its_uncertainties() -> None:
    setup, run, truth = known_run("noisy")  # 0.1 um and 1 urad
    calibration = setup.evaluate(run, uncertainty=sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6))
    uncertainty = {name: u for name, (_, _, u) in calibration.functions.items()}
    uncertainty |= {name: np.array([u]) for name, (_, u) in calibration.squareness.items()}
    ratios = []
    for name, deviation in deviations(calibration, truth).items():
        known = uncertainty[name] > 0
        assert np.max(np.abs(deviation[~known]), initial=0.0) <= 1e-15
        ratios.append(deviation[known] / uncertainty[name][known])
    every = np.concatenate(ratios)
    # 900 correlated values, perhaps 100 independent ones: none beyond 4.5 standard uncertainties, and their
    # root mean square near 1. The laser's second order adds up to 1 um to uncertainties of 1.7 um.
    assert np.max(np.abs(every)) <= 4.5
    assert 0.5 <= np.sqrt(np.mean(every**2)) <= 1.5


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("misalignment", "position", "angle"),
    [
        (None, *CLEAN),
        # 300 urad x 60 urad = 18 nrad, over 1 m 18 nm, with a handful of such terms.
        (REFLECTOR, 150 * NANOMETRE, 50 * NANORADIAN),
        (LASER, *MISALIGNED),
    ],
    ids=["1a", "1b", "1c"],
)
def test_enhanced_recovers_the_demo_machine_and_conventional_does_not(
    seed: int, misalignment: sd.Misalignment | None, position: float, angle: float
) -> None:
    setup = Setup()
    truth = setup.errors(seed)
    run = setup.simulate(truth, misalignment)
    error = worst(setup.evaluate(run), truth)
    assert error.position <= position
    assert error.angle <= angle
    assert worst(setup.evaluate(run, method="conventional"), truth).position >= 10 * MICROMETRE


def test_errors_of_the_clean_case_fall_as_the_square_of_the_amplitude() -> None:
    setup = Setup()
    whole, half, quarter = (
        np.concatenate(list(deviations(setup.evaluate(setup.simulate(truth)), truth).values()))
        for truth in (setup.errors(2, amplitude=a) for a in (4.0, 2.0, 1.0))
    )
    # What is not second order is third: 240 urad relative to it, times a few.
    assert np.max(np.abs(half - whole / 4)) <= 2e-3 * np.max(np.abs(whole))
    assert np.max(np.abs(quarter - whole / 16)) <= 2e-3 * np.max(np.abs(whole))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("lines", [DIAGONALS, DIAGONALS[1:], ["ppn", "nnn", "pnp"]])
def test_conventional_is_right_where_nothing_turns(seed: int, lines: list[str]) -> None:
    setup = Setup(lines=lines)
    truth = setup.errors(seed, rotation=0.0)
    calibration = setup.evaluate(setup.simulate(truth), method="conventional")
    assert len(calibration.functions) == 9
    assert len(calibration.squareness) == 3
    assert worst(calibration, truth).position <= 15 * NANOMETRE


@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_enhanced_recovers_machines_of_every_chain(chain: str) -> None:
    setup = Setup(steps=12, chain=chain, order="ZXY", tool=(30.0, -20.0, 80.0))
    truth = setup.errors(7)
    error = worst(setup.evaluate(setup.simulate(truth)), truth)
    # Chains differ in their levers: up to twice the products of the demo's chain.
    assert error.position <= 2 * CLEAN[0]
    assert error.angle <= 2 * CLEAN[1]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("lines", [DIAGONALS, ["nnn", "pnn", "npn", "ppn"], ["ppn", "npp", "nnn", "pnp"]])
def test_enhanced_recovers_any_order_and_reversed_lines(order: str, lines: list[str]) -> None:
    setup = Setup(steps=11, order=order, lines=lines, volume=(300.0, 700.0, 450.0))
    truth = setup.errors(5)
    error = worst(setup.evaluate(setup.simulate(truth)), truth)
    # Rotations do not add as vectors: theta_a x theta_b / 2 is left, up to 5 nrad a pair of axes.
    assert error.position <= CLEAN[0]
    assert error.angle <= 2 * CLEAN[1]


@pytest.mark.parametrize("layout", ["psd", "multi_beam"])
def test_raw_layouts_are_evaluated_as_the_ideal_head(layout: str) -> None:
    """Without offset and noise the three heads say the same: their reductions are exact."""
    raw = (
        sd.Head("psd", psd_distance=50.0)
        if layout == "psd"
        else sd.Head("multi_beam", beam_offsets=[[0, 0], [20, 0], [0, 20], [-9, -9]])
    )
    truth = Setup().errors(3)
    ideal = Setup().evaluate(Setup().simulate(truth, REFLECTOR))
    setup = Setup(head=raw)
    calibration = setup.evaluate(setup.simulate(truth, REFLECTOR))
    for name, (_, value, _) in ideal.functions.items():
        # Differences of beams are rounded to 2e-13 mm over 20 mm = 1e-14 rad; 50 steps of it, with levers of 1 m.
        # Their weights differ from the ideal head's, and with them the share of each line's second-order terms.
        limit = 30 * NANOMETRE if name[1] in "XYZ" else 30 * NANORADIAN
        assert np.max(np.abs(calibration.functions[name][1] - value)) <= limit


def test_constant_of_a_line_does_not_matter() -> None:
    """An interferometer counts from wherever it stood when it was zeroed."""
    setup = Setup(steps=20)
    truth = setup.errors(4)
    run = setup.simulate(truth)
    constants = {"ppp": 3.7, "npp": -50.0, "pnp": 12.0, "nnp": 0.01, "p00": -99.0, "0p0": 1.0, "00p": 5.0}
    shifted = run.channels["distance"] + np.array([constants[line] for line in run.line])
    for method in ("enhanced", "conventional"):
        before, after = (
            setup.evaluate(run, method=method),
            setup.evaluate(changed(run, {"distance": shifted}), method=method),
        )
        for name, (_, value, _) in before.functions.items():
            # A constant of 99 mm enters with the square of the tilts only: (100 urad)^2 x 99 mm = 1 nm.
            assert np.max(np.abs(after.functions[name][1] - value)) <= 2 * NANOMETRE


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_evaluation_repeated_gives_the_same_bits(method: str) -> None:
    setup = Setup(steps=15)
    run = setup.simulate(setup.errors(6), LASER, sd.Noise(distance=1e-4, tilt=1e-6, seed=3))
    first, second = (setup.evaluate(run, method=method, full_covariance=True) for _ in range(2))
    for name, columns in first.functions.items():
        for a, b in zip(columns, second.functions[name], strict=True):
            assert np.array_equal(a, b)
    assert first.squareness == second.squareness
    assert np.array_equal(first.covariance, second.covariance)


def test_order_of_rows_does_not_matter() -> None:
    setup = Setup(steps=15)
    truth = setup.errors(6)
    run = setup.simulate(truth)
    shuffled = changed(run, rows=np.random.default_rng(1).permutation(len(run)))
    before, after = setup.evaluate(run), setup.evaluate(shuffled)
    for name, (_, value, u) in before.functions.items():
        # Sums in another order: roundings of 1 m, 45 of them.
        assert np.max(np.abs(after.functions[name][1] - value)) <= 1e-11
        assert np.allclose(after.functions[name][2], u, rtol=1e-9)


@pytest.mark.parametrize("decimals", [3, 4, 6])
def test_rounded_positions_only_find_their_points(decimals: int) -> None:
    """800/7 mm has no end of decimals: a file that rounds it names the same commanded point."""
    setup = Setup(steps=7)
    truth = setup.errors(6)
    run = setup.simulate(truth)
    rounded = sd.Measurement(run.line, run.point, np.round(run.position, decimals), run.channels)
    assert worst(setup.evaluate(rounded), truth) == worst(setup.evaluate(run), truth)
    with pytest.raises(sd.InvalidArgument, match="row"):
        setup.evaluate(sd.Measurement(run.line, run.point, run.position + 0.01, run.channels))
