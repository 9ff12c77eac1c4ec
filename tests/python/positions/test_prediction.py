"""Figures predicted from a calibration: closed forms, the exact pose, and what C++ derives for body diagonals."""

from typing import Any

import numpy as np
import pytest
from calibrations import TOOL, VOLUME, calibrate, simulate
from refusal import refused
from usual import CHAIN, small_plan

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS

ENDS = {axis: np.array([0.0, edge]) for axis, edge in zip("XYZ", VOLUME, strict=True)}
NOTHING = (0.0, 0.0, 0.0)
SECOND_ORDER = 2e-7  # mm: a length of 80 mm turned by 60 µrad is shorter by 1.4e-7 mm


def synthetic(
    functions: dict[str, tuple[float, ...]],
    squareness: dict[str, float] | None = None,
    reversal: dict[str, tuple[float, ...]] | None = None,
    **more: Any,
) -> sd.Calibration:
    """A calibration with these values at equidistant nodes, and with all other functions 0."""

    def table(name: str, values: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.linspace(0.0, ENDS[name[2]][1], len(values)), np.array(values), np.full(len(values), 1e-5)

    flat = dict.fromkeys(FUNCTIONS, (0.0, 0.0))
    parts = {"method": "by hand", "chain": CHAIN, "volume": VOLUME, "tool": NOTHING} | more
    return sd.Calibration(
        functions={name: table(name, values) for name, values in (flat | functions).items()},
        squareness={name: ((squareness or {}).get(name, 0.0), 1e-7) for name in ("C0Y", "B0Z", "A0Z")},
        reversal={name: table(name, values) for name, values in (reversal or {}).items()},
        **parts,
    )


def values_of(line: sd.positions.PredictedPositions) -> dict[str, float]:
    return {name: figure.value for name, figure in line.figures.items()}


# --- closed forms ----------------------------------------------------------------------------------------------------
def test_axis_has_the_range_of_its_positioning_error() -> None:
    calibration = synthetic({"EXX": (0.0, 4e-3, -1e-3, 2e-3, 1e-3)})
    line = sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "X"))
    np.testing.assert_allclose(line.up, [0.0, 4e-3, -1e-3, 2e-3, 1e-3], atol=1e-14)
    assert line.figures["E_up"].value == pytest.approx(5e-3, abs=1e-14)
    assert line.figures["E_up"].at == (20.0, 40.0)
    assert list(line.figures) == ["E_up"]
    assert any("no reversal tables" in reason for reason in line.reasons)


def test_yaw_adds_its_lever_off_the_axis() -> None:
    """X carries the workpiece: at y, ECX of the table moves the tool relative to it by -y ECX along X."""
    calibration = synthetic({"ECX": (0.0, 20e-6)})
    for y in (0.0, 25.0, 60.0):
        line = sd.positions.predict_positions(
            calibration, *sd.positions.axis_line(calibration, "X", (0.0, y, 0.0)), points=2
        )
        assert line.up[-1] == pytest.approx(-y * 20e-6, abs=SECOND_ORDER)
    tool = sd.positions.predict_positions(
        calibration, *sd.positions.axis_line(calibration, "X"), points=2, tool=(0.0, 100.0, 0.0)
    )
    assert tool.up[-1] == pytest.approx(-100.0 * 20e-6, abs=SECOND_ORDER)


def test_squareness_lengthens_one_diagonal_and_shortens_the_other() -> None:
    """d · e of C0Y: the functional point at y is off by -C0Y y along X."""
    calibration = synthetic({}, {"C0Y": 50e-6})
    x, y, _ = VOLUME
    expected = 50e-6 * x * y / np.hypot(x, y)
    for name, sign in (("pp0", -1.0), ("np0", 1.0)):
        line = sd.positions.predict_positions(calibration, *sd.positions.diagonal_line(calibration, name), points=5)
        np.testing.assert_allclose(line.up, sign * expected * np.linspace(0.0, 1.0, 5), atol=SECOND_ORDER)
    for axis in "XYZ":
        line = sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, axis))
        np.testing.assert_allclose(line.up, 0.0, atol=SECOND_ORDER)


def directional(**tables: tuple[float, ...]) -> sd.Calibration:
    none = dict.fromkeys(FUNCTIONS, (0.0, 0.0))
    return synthetic({"EXX": (0.0, 3e-3, 1e-3)}, reversal=none | tables)


def test_constant_reversal_is_b_and_changes_no_range_of_one_direction() -> None:
    calibration = directional(EXX=(2e-3, 2e-3, 2e-3))
    line = sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "X"))
    expected = {"B": 2e-3, "B_mean": 2e-3, "E_up": 3e-3, "E_down": 3e-3, "M": 3e-3, "E": 5e-3}
    assert values_of(line) == pytest.approx(expected, abs=1e-14)
    # Standard uncertainty of a table value alone: 10 nm.
    assert line.figures["B"].standard_uncertainty == pytest.approx(1e-5, rel=1e-12)
    np.testing.assert_allclose(line.reversal, 2e-3, atol=1e-14)


def test_reversal_along_a_line_that_falls_is_of_the_other_sign() -> None:
    """Along n00, up is approached in - direction of X: x↑ - x↓ = -(minus - plus) d."""
    calibration = directional(EXX=(2e-3, 2e-3, 2e-3))
    rising = sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "X"))
    falling = sd.positions.predict_positions(calibration, *reversed(sd.positions.axis_line(calibration, "X")))
    np.testing.assert_allclose(falling.reversal, 2e-3, atol=1e-14)
    assert values_of(falling) == pytest.approx(values_of(rising), abs=1e-14)
    assert falling.figures["E_up"].interval is None


def test_figures_of_simulated_repeated_readings_are_those_predicted() -> None:
    """A machine without scatter, read by hand at the targets in both directions, and evaluated as readings."""
    random = np.random.default_rng(3)
    functions = {name: (0.0, *(random.normal(0.0, 5e-3 if name[1] in "XYZ" else 1e-5, 3))) for name in FUNCTIONS}
    reversal = {name: tuple(random.normal(0.0, 1e-3 if name[1] in "XYZ" else 3e-6, 4)) for name in FUNCTIONS}
    calibration = synthetic(functions, {"C0Y": 2e-5, "A0Z": -3e-5}, reversal, tool=TOOL)
    machine = sd.Machine(CHAIN, calibration.to_error_map(), TOOL)
    start, end = np.array([70.0, 10.0, 5.0]), np.array([15.0, 55.0, 5.0])
    line = sd.positions.predict_positions(calibration, tuple(start), tuple(end), points=7)
    deviations = {}
    zero = start + np.array(TOOL) + machine.error(start[None], "-++")[0]
    length, d = np.linalg.norm(end - start), (end - start) / np.linalg.norm(end - start)
    for share in np.arange(7) / 6.0:
        commanded = start + share * (end - start)
        for direction, approach in (("+", "-++"), ("-", "+-+")):
            actual = commanded + np.array(TOOL) + machine.error(commanded[None], approach)[0]
            for cycle in (1, 2):
                deviations[float(share * length), direction, cycle] = float((actual - zero) @ d - share * length)
    readings = sd.positions.PositionReadings(tuple(sorted({key[0] for key in deviations})), deviations)
    measured = {name: figure.value for name, figure in sd.positions.evaluate_positions(readings).figures.items()}
    predicted = values_of(line)
    assert predicted.keys() == {"E", "E_up", "E_down", "M", "B", "B_mean"}
    for name, value in predicted.items():
        assert value == pytest.approx(measured[name], abs=1e-12), name  # rounding of 100 mm


# --- what C++ derives -------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def calibration() -> sd.Calibration:
    return calibrate(1, full_covariance=True)


@pytest.fixture(scope="module")
def of_both_directions() -> sd.Calibration:
    run = simulate(1, repeats=2, backward=True)
    return sd.methods.evaluate(run, small_plan(), sd.Head(), CHAIN, TOOL, full_covariance=True)


@pytest.mark.parametrize("name", ["ppp", "npp", "pnp", "nnp"])
def test_body_diagonals_are_those_of_diagonal_errors(calibration: sd.Calibration, name: str) -> None:
    line = sd.positions.predict_positions(calibration, *sd.positions.diagonal_line(calibration, name))
    derived = sd.methods.diagonal_errors(calibration)[name]
    np.testing.assert_allclose(line.target, derived.travel, rtol=1e-14)
    # First order there, the exact pose here: 60 µrad of 60 µm.
    np.testing.assert_allclose(line.up, derived.value, atol=2e-5)
    np.testing.assert_allclose(line.up_standard_uncertainty, derived.standard_uncertainty, rtol=1e-9, atol=1e-15)
    accuracy = sd._core.volumetric_accuracy(calibration)
    k = accuracy.names.index(f"E_D {name}")
    figure = line.figures["E_up"]
    assert figure.value == pytest.approx(derived.range, abs=2e-5)
    assert figure.interval is not None
    # Quantiles of 10,000 draws are known to 2.7 % of u, on both sides; four of them and the second order.
    tolerance = 4.0 * np.sqrt(2.0) * 0.027 * accuracy.standard_uncertainty[k] + 2e-5
    np.testing.assert_allclose(figure.interval, accuracy.interval[k], rtol=0.0, atol=tolerance)
    assert figure.standard_uncertainty == pytest.approx(accuracy.standard_uncertainty[k], rel=0.05)


def test_values_are_those_of_the_exact_pose(calibration: sd.Calibration) -> None:
    start, end = (5.0, 50.0, 10.0), (75.0, 20.0, 45.0)
    line = sd.positions.predict_positions(calibration, start, end, points=9, tool=(0.0, 0.0, -120.0))
    machine = sd.Machine(CHAIN, calibration.to_error_map(), (0.0, 0.0, -120.0))
    share = np.linspace(0.0, 1.0, 9)[:, None]
    error = machine.error(np.array(start) + share * (np.array(end) - np.array(start)))
    direction = (np.array(end) - np.array(start)) / np.linalg.norm(np.array(end) - np.array(start))
    np.testing.assert_allclose(line.up, (error - error[0]) @ direction, atol=1e-13)  # rounding of 100 mm


@pytest.mark.slow
def test_interval_covers_the_true_range(calibration: sd.Calibration) -> None:
    """The calibration taken as the truth, and 600 calibrations drawn about it with its covariance."""
    truth = (
        sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "Y", (0.0, 0.0, 50.0)))
        .figures["E_up"]
        .value
    )
    assert calibration.covariance is not None
    labels = calibration.covariance_labels
    variances, vectors = np.linalg.eigh(calibration.covariance)
    random = np.random.default_rng(9)
    covered = 0
    for _ in range(600):
        noise = vectors @ (np.sqrt(variances.clip(0.0)) * random.standard_normal(len(labels)))
        functions = {
            name: (position, value + noise[[k for k, label in enumerate(labels) if label[0] == name]], u)
            for name, (position, value, u) in calibration.functions.items()
        }
        squareness = {
            name: (value + noise[[label[0] for label in labels].index(name)], u)
            for name, (value, u) in calibration.squareness.items()
        }
        drawn = sd.Calibration("drawn", CHAIN, VOLUME, TOOL, functions, squareness, covariance=calibration.covariance)
        found = (
            sd.positions.predict_positions(drawn, *sd.positions.axis_line(drawn, "Y", (0.0, 0.0, 50.0)))
            .figures["E_up"]
            .interval
        )
        assert found is not None
        covered += found[0] <= truth <= found[1]
    # Binomial, 600 of 0.95: 570 with a standard deviation of 5.3; four of them.
    assert 549 <= covered <= 591


def test_calibrations_of_a_known_machine_predict_its_ranges() -> None:
    """Runs with noise of a machine, whose true range follows from its exact pose."""
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=3, intervals=5), TOOL)
    covered = 0
    for seed in range(40):
        found = calibrate(seed, full_covariance=True)
        for start, end in (
            sd.positions.axis_line(found, "X", (0.0, 60.0, 50.0)),
            sd.positions.diagonal_line(found, "pnp"),
        ):
            points = np.array(start) + np.linspace(0.0, 1.0, 6)[:, None] * (np.array(end) - np.array(start))
            direction = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
            truth = np.ptp(machine.error(points) @ direction)
            interval = sd.positions.predict_positions(found, start, end).figures["E_up"].interval
            assert interval is not None
            covered += interval[0] <= truth <= interval[1]
    # Binomial, 80 of 0.95: 76 with a standard deviation of 2; four of them. Priors of the set-up may make it more.
    assert covered >= 68


def test_backlash_of_a_known_machine_is_the_b_that_is_predicted() -> None:
    """EXX is 2 µm less in - direction, and ECX 20 µrad: at y = 60 mm, B = 2 µm - 60 mm times 20 µrad and the tool's."""
    errors = sd.random_error_map(VOLUME, seed=3, intervals=5)
    shifts = {"EXX": -2e-3, "ECX": -20e-6}
    negative = {name: (p, v + shifts[name]) for name, (p, v) in errors.functions.items() if name in shifts}
    machine = sd.Machine(CHAIN, sd.ErrorMap(errors.functions, errors.squareness, negative_functions=negative), TOOL)
    noise = sd.Noise(distance=1e-4, tilt=1e-6, seed=1)
    run = sd.simulate(machine, small_plan(), sd.Head(), noise=noise, repeats=2, backward=True)
    found = sd.methods.evaluate(run, small_plan(), sd.Head(), CHAIN, TOOL)
    for y in (0.0, 60.0):
        line = sd.positions.predict_positions(found, *sd.positions.axis_line(found, "X", (0.0, y, 0.0)))
        truth = 2e-3 - (y + TOOL[1]) * 20e-6
        deviations = (line.reversal - truth) / line.reversal_standard_uncertainty
        assert np.max(np.abs(deviations)) < 4.0  # six values, at most 4 u
        assert line.figures["B"].value == np.max(np.abs(line.reversal))


# --- what is not known ------------------------------------------------------------------------------------------------
def test_missing_scale_is_named_and_nothing_is_predicted_from_it() -> None:
    calibration = synthetic({}, undetermined_slopes=["EXX"])
    along_x = sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "X"))
    assert not along_x.figures
    assert np.isnan(along_x.up).all()
    assert along_x.reasons[0] == "not predicted: slope of EXX not determined"
    assert "E_up" in sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "Y")).figures


def test_missing_function_counts_where_it_acts_alone() -> None:
    whole = synthetic({})
    functions = {name: table for name, table in whole.functions.items() if name not in ("EXY", "ECX")}
    part = sd.Calibration("by hand", CHAIN, VOLUME, NOTHING, functions, whole.squareness)
    assert (
        "E_up" in sd.positions.predict_positions(part, *sd.positions.axis_line(part, "X")).figures
    )  # no lever for ECX, EXY stays
    off_axis = sd.positions.predict_positions(part, *sd.positions.axis_line(part, "X", (0.0, 60.0, 0.0)))
    assert off_axis.reasons[0] == "not predicted: ECX not determined"
    # ECX turns the line pp0 through home about its start, and changes no length on it; np0 does not go through home.
    for name, missing in (("pp0", "EXY"), ("np0", "ECX, EXY")):
        diagonal = sd.positions.predict_positions(part, *sd.positions.diagonal_line(part, name))
        assert diagonal.reasons[0] == f"not predicted: {missing} not determined"


def test_unknown_constants_of_reversal_leave_b_open_but_not_the_range_of_a_direction(
    of_both_directions: sd.Calibration,
) -> None:
    """This run leaves the reversal of straightnesses open but for a constant: it acts on diagonals, not on axes."""
    along_x = sd.positions.predict_positions(of_both_directions, *sd.positions.axis_line(of_both_directions, "X"))
    assert {"B", "M", "E", "E_down"} <= along_x.figures.keys()
    diagonal = sd.positions.predict_positions(
        of_both_directions, *sd.positions.diagonal_line(of_both_directions, "ppp")
    )
    assert list(diagonal.figures) == ["E_up", "E_down"]
    assert any("EYX, EZX" in reason and "known but for a constant" in reason for reason in diagonal.reasons)


def test_unknown_constant_of_a_rotation_leaves_the_direction_open_in_which_it_acts() -> None:
    """EAY acts along d in the plane YZ by its lever z, which changes along the line; - tables are those that fall."""
    none = dict.fromkeys(FUNCTIONS, (0.0, 0.0))
    calibration = synthetic({}, reversal=none, undetermined_reversal_constants=["EAY"])
    start, end = sd.positions.diagonal_line(calibration, "0pp")
    rising, falling = (sd.positions.predict_positions(calibration, *ends) for ends in ((start, end), (end, start)))
    assert (list(rising.figures), list(falling.figures)) == (["E_up"], ["E_down"])
    assert rising.reasons[0].startswith("B, M, E↓ and the bidirectional E are not predicted: the reversal error of EAY")
    assert falling.reasons[0].startswith("B, M, E↑ and the bidirectional E are not predicted")
    # At one place of Y and Z the lever is the same all along X.
    assert "B" in sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "X")).figures


def test_reversal_is_uncertain_as_its_table_says(of_both_directions: sd.Calibration) -> None:
    line = sd.positions.predict_positions(
        of_both_directions, *sd.positions.axis_line(of_both_directions, "X", (0.0, 0.0, 0.0))
    )
    position, value, u = of_both_directions.reversal["EXX"]
    lever = TOOL[1]  # of ECX, and TOOL[2] of EBX
    yaw, pitch = of_both_directions.reversal["ECX"], of_both_directions.reversal["EBX"]
    np.testing.assert_allclose(line.target, position)
    expected = value - lever * yaw[1] + TOOL[2] * pitch[1]
    np.testing.assert_allclose(line.reversal, expected, atol=SECOND_ORDER)
    independent = np.sqrt(u**2 + (lever * yaw[2]) ** 2 + (TOOL[2] * pitch[2]) ** 2)
    np.testing.assert_allclose(line.reversal_standard_uncertainty, independent, rtol=1e-9)


def test_calibration_without_covariance_has_values_and_no_interval() -> None:
    line = sd.positions.predict_positions(synthetic({}), NOTHING, VOLUME)
    assert line.figures["E_up"].interval is None
    assert np.isnan(line.up_standard_uncertainty).all()
    assert any("no covariance" in reason for reason in line.reasons)


@pytest.mark.parametrize(
    ("start", "end", "points", "message"),
    [
        (NOTHING, (90.0, 0.0, 0.0), 5, "expected points in the volume of 80 x 60 x 50 mm, got 90, 0, 0"),
        ((0.0, -1.0, 0.0), VOLUME, 5, "expected points in the volume"),
        ((np.nan, 0.0, 0.0), VOLUME, 5, "expected points in the volume"),
        (VOLUME, VOLUME, 5, "expected a line between two different points"),
        (NOTHING, VOLUME, 1, "`points`: expected two or more, got 1"),
    ],
)
def test_lines_that_are_none_are_refused(start: Any, end: Any, points: int, message: str) -> None:
    refused(sd.positions.predict_positions, synthetic({}), start, end, points=points, names=message)


def test_names_of_lines_that_are_none_are_refused() -> None:
    calibration = synthetic({})
    refused(sd.positions.axis_line, calibration, "x", names="`axis`: expected X, Y or Z, got 'x'")
    for name in ("p00", "pp", "ppx"):
        refused(sd.positions.diagonal_line, calibration, name, names="`diagonal`: expected a body or face diagonal")
