"""Angles that act by their squares, and drift: what tilts tell of them is corrected, what they do not is in the
uncertainty. Truth is known; figures for more runs are in docs/method.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from usual import CHAIN, DIAGONALS, FACES, SCALE_LINES, VOLUME

import stepdiag as sd

STEPS = 10
FACTOR = 1.959963984540054
UNCERTAINTY = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6, spot=2e-3)
PER_HOUR = 1e-3 / 3600.0  # um/h in mm/s
ASIDE = 1e-3

STANDARD = sd.Plan(VOLUME, DIAGONALS, STEPS, scale_lines=SCALE_LINES)
SIX_FACES = sd.Plan(VOLUME, FACES, STEPS)

Draw = Callable[[np.random.Generator], Mapping[str, sd.Misalignment]]


def truth(seed: int) -> sd.Machine:
    return sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=seed, intervals=STEPS))


def run_of(
    seed: int, plan: sd.Plan, misalignment: Mapping[str, sd.Misalignment], *, noise: float = 1.0, **given: Any
) -> sd.Measurement:
    deviations = sd.Noise(distance=noise * 1e-4, tilt=noise * 1e-6, spot=noise * 2e-3, seed=seed)
    head = given.pop("head", sd.Head())
    return sd.simulate(truth(seed), plan, head, misalignment=misalignment, noise=deviations, **given)


def adjusted(run: sd.Measurement, plan: sd.Plan, head: sd.Head | None = None, **told: Any) -> sd.Adjustment:
    return sd.methods.adjust(run, plan, head or sd.Head(), CHAIN, uncertainty=UNCERTAINTY, **told)


def scale_of(adjustment: sd.Adjustment, seed: int, axis: str) -> tuple[float, float]:
    """Error of the positioning error at the end of travel, and its standard uncertainty, by the travel."""
    position, value, u = adjustment.calibration.functions[f"E{axis}{axis}"]
    error = value[-1] - truth(seed).errors.function(f"E{axis}{axis}", position)[-1]
    return error / position[-1], u[-1] / position[-1]


def beyond_tilt(tilt: float, laser: float) -> float:
    """By travel: standard uncertainty of what the laser of a scale line does, tilt: the mirror's (docs/method.md)."""
    square = -np.log(0.05) / FACTOR * laser**2
    return float(np.sqrt(square**2 + (tilt * laser) ** 2 + min((tilt * laser) ** 2 / 2.0, laser**4)))


HEADS = {
    "ideal": (sd.Head(), {}),
    "psd": (sd.Head("psd", psd_distance=50.0), {}),
    "multi_beam": (
        sd.Head("multi_beam", beam_offsets=[[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]]),
        {"setup": sd.methods.SetupPriors(beam_constants="fixed")},
    ),
}


@pytest.mark.parametrize("layout", HEADS)
@pytest.mark.parametrize(
    ("laser", "mirror", "too_long"),
    [(ASIDE, 0.0, 1.5), (-ASIDE, 0.0, 1.5), (0.0, ASIDE, 1.0), (ASIDE, ASIDE, -0.5), (2 * ASIDE, 0.0, 6.0)],
)
def test_tilts_correct_the_length_of_a_scale_line(layout: str, laser: float, mirror: float, too_long: float) -> None:
    """Error-free: distances read travel (3/2 D^2 - m^2/2) too much, D = mirror - laser. D is measured, and taken for
    the mirror's: the laser stands along the axis to 500 urad. Nothing else tells the scale of X here."""
    head, told = HEADS[layout]
    plan = sd.Plan(VOLUME, DIAGONALS, STEPS, scale_lines=["p00"])
    line = {"p00": sd.Misalignment(laser=(0.0, laser), reflector=(0.0, mirror))}
    run = sd.simulate(sd.Machine(CHAIN), plan, head, misalignment=line)
    adjustment = adjusted(run, plan, head, outlier_probability=0.0, **told)
    position, value, u = adjustment.calibration.functions["EXX"]
    found = value[-1] / position[-1]
    tilt = mirror - laser
    assert found == pytest.approx(too_long * ASIDE**2 - tilt**2, abs=1e-9)
    # What is known of it: the mirror's angle times that of the laser, and the second order of the latter.
    expected = beyond_tilt(tilt, 500e-6)
    # Three beams read a distance better than one.
    assert u[-1] / position[-1] == pytest.approx(np.hypot(expected, np.sqrt(2) * 1e-4 / VOLUME[0]), rel=0.1)
    assert abs(found) <= 2.0 * u[-1] / position[-1]


def test_a_laser_aside_of_a_scale_line_costs_no_reading_and_is_within_the_uncertainty() -> None:
    for seed in range(5):
        aside = {line: sd.Misalignment(laser=(0.0, 2 * ASIDE)) for line in SCALE_LINES}
        adjustment = adjusted(run_of(seed, STANDARD, aside), STANDARD, outlier_probability=1e-4)
        assert adjustment.outliers == []
        assert adjustment.verdict.fit != "rejected"
        for axis in "XYZ":
            error, u = scale_of(adjustment, seed, axis)
            assert abs(error) <= 3.0 * u


def without_tilts_of_scale_lines(run: sd.Measurement) -> sd.Measurement:
    scale = np.isin(run.line, SCALE_LINES)
    channels = {
        name: np.where(scale & (name in ("alpha", "beta")), np.nan, value) for name, value in run.channels.items()
    }
    return sd.Measurement(run.line, run.point, run.position, channels, run=run.run, direction=run.direction)


@pytest.mark.parametrize("scale_points", ["ends", "steps"])
def test_without_tilts_the_mirror_of_a_scale_line_is_known_as_well_as_it_is_aligned(scale_points: str) -> None:
    plan = sd.Plan(VOLUME, DIAGONALS, STEPS, scale_lines=["p00"], scale_points=scale_points)
    run = without_tilts_of_scale_lines(run_of(1, plan, {}))
    noise = 1e-4 * np.sqrt(2) / VOLUME[0]
    # D^2 - D l - l^2/2 of both directions, where the mirror is 500 urad off the beam, and the laser off the axis: 95 %
    # of it is below 1.509 um/m (tests/cpp/adjustment/setup_priors_test.cpp). Else D is 0.
    for mirror, square in ((None, 1.509e-6 / FACTOR), ("fixed", beyond_tilt(0.0, 500e-6))):
        adjustment = adjusted(run, plan, setup_by_line={"p00": sd.methods.SetupPriors(reflector=mirror)})
        unknowns = {s.quantity for s in adjustment.setup if s.line == "p00"}
        assert unknowns & {"reflector", "laser", "roll", "gain"} == ({"reflector"} if mirror is None else set())
        _, u = scale_of(adjustment, 1, "X")
        # Steps find a mirror of some 200 urad, whose first order is in it, too.
        assert u == pytest.approx(np.hypot(square, noise), rel=0.1)


def test_beams_of_unknown_constants_leave_the_mirror_of_a_scale_line_to_its_prior() -> None:
    head = HEADS["multi_beam"][0]
    plan = sd.Plan(VOLUME, DIAGONALS, STEPS, scale_lines=["p00"], scale_points="steps")
    run = sd.simulate(sd.Machine(CHAIN), plan, head)
    for told, prior in ((sd.methods.SetupPriors(), 500e-6), (sd.methods.SetupPriors(reflector=300e-6), 300e-6)):
        found = adjusted(run, plan, head, setup_by_line={"p00": told})
        mirror = [s for s in found.setup if (s.line, s.quantity) == ("p00", "reflector")]
        assert [s.prior for s in mirror] == [prior, prior]
        assert all(abs(s.value or 0.0) < 1e-9 and s.standard_uncertainty > 0.9 * prior for s in mirror)
        position, value, _ = found.calibration.functions["EXX"]
        assert np.all(np.abs(value) <= 2e-11)  # the floor of the adjustment, as in test_truth.py
        assert len(position) == STEPS + 1


def test_tilts_of_aligned_scale_lines_narrow_what_they_tell_and_no_more() -> None:
    run = run_of(2, STANDARD, {})
    told, undistinguished = adjusted(run, STANDARD), adjusted(without_tilts_of_scale_lines(run), STANDARD)
    for name, (_, _, u) in told.calibration.functions.items():
        assert np.all(u <= undistinguished.calibration.functions[name][2] * (1 + 1e-9))


def scale_lasers_aside(rng: np.random.Generator) -> dict[str, sd.Misalignment]:
    return {line: sd.Misalignment(laser=rng.uniform(-ASIDE, ASIDE, 2)) for line in SCALE_LINES}


def faces_out_of_true(size: float) -> Draw:
    return lambda rng: {
        line: sd.Misalignment(laser=size * rng.normal(size=2), reflector=size * rng.normal(size=2)) for line in FACES
    }


def drifting(pace: float) -> Draw:
    def draw(rng: np.random.Generator) -> dict[str, sd.Misalignment]:
        of_machine = rng.normal(0.0, pace * PER_HOUR, 3)
        lines = [*DIAGONALS, *SCALE_LINES]
        return {line: sd.Misalignment(drift=float(STANDARD.frame(line)[:, 2] @ of_machine)) for line in lines}

    return draw


def angles_known_to(size: float) -> dict[str, Any]:
    return {"setup": sd.methods.SetupPriors(laser=size, reflector=size)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "draw", "told", "seconds"),
    [
        (STANDARD, scale_lasers_aside, {}, None),
        (SIX_FACES, faces_out_of_true(2e-3), angles_known_to(2e-3), None),
        (SIX_FACES, faces_out_of_true(3e-3), angles_known_to(3e-3), None),
        (SIX_FACES, faces_out_of_true(3e-3), {}, None),
        (STANDARD, drifting(5.0), {}, 3.0),
        (STANDARD, drifting(20.0), {"setup": sd.methods.SetupPriors(drift=20.0 * PER_HOUR)}, 3.0),
    ],
    ids=["scale lasers", "faces 2 mrad", "faces 3 mrad", "faces 3 mrad, not told", "drift 5", "drift 20, told"],
)
def test_intervals_cover_the_truth(plan: sd.Plan, draw: Draw, told: dict[str, Any], seconds: float | None) -> None:
    covered: dict[str, list[bool]] = {"slopes": [], "angles": []}
    runs = 150
    for seed in range(runs):
        run = run_of(seed, plan, draw(np.random.default_rng([14, seed])), seconds_per_reading=seconds)
        calibration = adjusted(run, plan, outlier_probability=0.0, **told).calibration
        errors = truth(seed).errors
        for name, (position, value, u) in calibration.functions.items():
            if name[1] == name[2]:
                covered["slopes"].append(abs(value[-1] - errors.function(name, position)[-1]) <= FACTOR * u[-1])
            elif name[1] in "ABC":
                covered["angles"].append(abs(value[-1] - errors.function(name, position)[-1]) <= FACTOR * u[-1])
        for name, (value, u) in calibration.squareness.items():
            covered["slopes"].append(abs(value - errors.squareness[name]) <= FACTOR * u)
    for family, found in covered.items():
        # Six to nine values a run, correlated: as if two of them were independent, four binomial deviations. Priors
        # wider than the truth make more.
        assert np.mean(found) >= 0.95 - 4.0 * np.sqrt(0.95 * 0.05 / (2 * runs)), family


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "laser", "mirror", "scale_points"),
    [
        ("ideal", 500e-6, 0.0, "ends"),
        ("ideal", 250e-6, 300e-6, "steps"),
        ("ideal", 500e-6, 2e-3, "steps"),
        ("psd", 250e-6, 300e-6, "steps"),
        ("multi_beam", 250e-6, 300e-6, "ends"),
        ("multi_beam", 250e-6, 300e-6, "steps"),
    ],
)
def test_ends_of_scale_lines_are_covered_by_the_angles_of_their_priors(
    layout: str, laser: float, mirror: float, scale_points: str
) -> None:
    """10 nm: what the angles do is nearly all of it. The mirror is off the beam by `mirror`; tilts tell it, but for
    beams of unknown constants. Rotations are small, so that priors of lateral offsets have no part in it."""
    head, steps = HEADS[layout][0], 4
    plan = sd.Plan(VOLUME, DIAGONALS, steps, scale_lines=["p00"], scale_points=scale_points)
    uncertainty = sd.methods.ReadingUncertainty(distance=1e-5, tilt=1e-6, spot=1e-3)
    known = sd.methods.SetupPriors(laser=laser, reflector=mirror if layout == "multi_beam" else None)
    aligned = sd.methods.SetupPriors(
        laser=100e-6
    )  # the measured lines; beams of unknown constants find their lasers slowly
    covered, runs = 0, 400
    for seed in range(runs):
        rng = np.random.default_rng([18, seed])
        of_laser = laser * rng.normal(size=2)
        angles = {"p00": sd.Misalignment(laser=of_laser, reflector=of_laser + mirror * rng.normal(size=2))}
        machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=seed, intervals=steps, rotation=5e-6))
        noise = sd.Noise(distance=1e-5, tilt=1e-6, spot=1e-3, seed=seed)
        run = sd.simulate(machine, plan, head, misalignment=angles, noise=noise)
        found = sd.methods.adjust(
            run,
            plan,
            head,
            CHAIN,
            uncertainty=uncertainty,
            outlier_probability=0.0,
            setup=aligned,
            setup_by_line={"p00": known},
        )
        position, value, u = found.calibration.functions["EXX"]
        covered += abs(value[-1] - machine.errors.function("EXX", position)[-1]) <= FACTOR * u[-1]
    # Four binomial deviations, 4.4 %. They tell 95 % from the 87 % of a mirror taken to be square to the beam.
    assert abs(covered / runs - 0.95) <= 4.0 * np.sqrt(0.95 * 0.05 / runs)


def test_drift_has_a_prior_where_every_reading_of_a_line_has_a_time() -> None:
    timed = run_of(3, STANDARD, {}, seconds_per_reading=3.0)
    assert {s.line for s in adjusted(timed, STANDARD).setup if s.quantity == "drift"} == {*DIAGONALS, *SCALE_LINES}
    (prior,) = {s.prior for s in adjusted(timed, STANDARD).setup if s.quantity == "drift"}
    assert prior == pytest.approx(5.0 * PER_HOUR, rel=1e-15)
    channels = dict(timed.channels)
    row = timed.line.index("npp")
    channels["time"] = np.where(np.arange(len(timed)) == row, np.nan, channels["time"])
    partly = sd.Measurement(timed.line, timed.point, timed.position, channels)
    found = {s.line for s in adjusted(partly, STANDARD).setup if s.quantity == "drift"}
    assert found == {*DIAGONALS, *SCALE_LINES} - {"npp"}


def test_drift_that_is_there_is_in_the_uncertainty_of_squarenesses() -> None:
    """A body diagonal sees a squareness by A B/length; each drifts by itself, over its own duration."""
    timed = run_of(4, STANDARD, {}, seconds_per_reading=30.0)
    plain = adjusted(timed, STANDARD, setup=sd.methods.SetupPriors(drift="fixed")).calibration.squareness
    known = adjusted(timed, STANDARD).calibration.squareness
    length, duration = float(np.linalg.norm(VOLUME)), 30.0 * 3 * STEPS
    for name, (a, b) in {"C0Y": (0, 1), "B0Z": (0, 2), "A0Z": (1, 2)}.items():
        added = np.sqrt(known[name][1] ** 2 - plain[name][1] ** 2)
        expected = 5.0 * PER_HOUR * duration * length / (2 * VOLUME[a] * VOLUME[b])
        # Positioning shares some of it: lines are longer by the drift of all.
        assert 0.7 * expected <= added <= 1.2 * expected, name


def test_angles_of_faces_are_taken_for_what_their_tilts_show_where_that_is_more_than_usual() -> None:
    """The length of a line is uncertain by the square of what its angles are taken for: 2 mrad by default."""

    def aside(size: float) -> dict[str, sd.Misalignment]:
        return {line: sd.Misalignment(laser=(size, -size), reflector=(-size, size)) for line in FACES}

    def largest(size: float, **told: Any) -> float:
        found = adjusted(run_of(1, SIX_FACES, aside(size)), SIX_FACES, **told)
        return max(u for _, u in found.calibration.squareness.values())

    # Mirror and laser are twice `size` apart in both directions, as two angles of sqrt(2) `size` are.
    stated = sd.methods.SetupPriors(laser=2e-3, reflector=2e-3)
    aligned, small, large = 1e-4, 1.2e-3, 6e-3 / np.sqrt(2)
    # Below 2 mrad both know the same, but for the first order, which a stated prior divides otherwise.
    known = largest(aligned, setup=stated)
    assert largest(small) / largest(small, setup=stated) == pytest.approx(largest(aligned) / known, rel=0.05)
    # 6 mrad in place of 2: the second order, which is nearly all of it, is nine times as large.
    assert largest(large) == pytest.approx(9.0 * known, rel=0.1)
    # What is stated counts, whatever the tilts show; the angle found, times 2 mrad, is in it.
    assert largest(large, setup=stated) < 0.5 * largest(large)


def drifting_alike(pace: float, seed: int, **told: Any) -> sd.results.Verdict:
    """The verdict on a run of which all distances drift, um/h, with set-ups as they are."""
    rng = np.random.default_rng([17, seed])
    lines = {
        line: sd.Misalignment(
            reflector=1e-3 * rng.normal(size=2) * (line in DIAGONALS),
            laser=1e-3 * rng.normal(size=2) * (line in DIAGONALS),
            drift=pace * PER_HOUR,
        )
        for line in [*DIAGONALS, *SCALE_LINES]
    }
    return adjusted(run_of(seed, STANDARD, lines, seconds_per_reading=10.0), STANDARD, **told).verdict


def test_drift_that_its_prior_does_not_explain_is_a_reason() -> None:
    verdict = drifting_alike(23.0, 3)
    (reason,) = verdict.reasons
    assert (verdict.fit, reason.finding, reason.channel) == ("doubtful", "prior_scatter", "drift")
    assert reason.limit == pytest.approx(5.0 * PER_HOUR)
    # The readings see the sum of the four diagonals alone, and drifts that are independent make such a sum where they
    # are twice as large.
    assert reason.value == pytest.approx(2.0 * 23.0 * PER_HOUR, rel=0.25)
    told = drifting_alike(23.0, 3, setup=sd.methods.SetupPriors(drift=23.0 * PER_HOUR))
    assert (told.fit, told.reasons) == ("accepted", [])


def test_set_ups_of_their_priors_are_no_reason() -> None:
    """Drift, lateral offset, roll and gain drawn from their priors: at 0.3 % one false alarm in 40 runs is rare."""
    alarms = 0
    for seed in range(40):
        rng = np.random.default_rng([16, seed])
        lines = {
            line: sd.Misalignment(
                reflector=1e-3 * rng.normal(size=2) * (line in DIAGONALS),
                lateral=rng.normal(size=2),
                roll=20e-3 * rng.normal(),
                gain=0.01 * rng.normal(),
                drift=5.0 * PER_HOUR * rng.normal(),
            )
            for line in [*DIAGONALS, *SCALE_LINES]
        }
        run = run_of(seed, STANDARD, lines, seconds_per_reading=10.0)
        alarms += any(r.finding == "prior_scatter" for r in adjusted(run, STANDARD).verdict.reasons)
    assert alarms <= 1
