"""The error of the tool in the volume, against a brute-force evaluation of the exact pose."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from calibrations import TOOL, VOLUME, calibrate
from refusal import refused
from usual import ALL_CHAINS, CHAIN

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

# Both evaluate one pose; what is left is rounding of positions of up to 1 m.
EXACT = 1e-9


def machine(chain: str = CHAIN, seed: int = 3, tool: npt.ArrayLike = (10.0, -20.0, 40.0)) -> sd.Machine:
    return sd.Machine(chain, sd.random_error_map(VOLUME, seed=seed, intervals=7), tool)


def all_points(found: sd.VolumeErrors) -> npt.NDArray[np.float64]:
    return np.stack(np.meshgrid(*found.grid, indexing="ij"), axis=-1).reshape(-1, 3)


def whole() -> npt.NDArray[np.float64]:
    return np.array([np.zeros(3), VOLUME])


def without(errors: sd.ErrorMap, names: tuple[str, ...]) -> sd.ErrorMap:
    functions = {name: table for name, table in errors.functions.items() if name not in names}
    return sd.ErrorMap(functions, {name: angle for name, angle in errors.squareness.items() if name not in names})


@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_largest_error_and_ranges_are_those_of_all_grid_points(chain: str) -> None:
    tool = machine(chain)
    found = sd.volume_errors(tool, box=whole())
    points = all_points(found)
    errors = tool.error(points)
    size = np.linalg.norm(errors, axis=1)
    assert found.largest == pytest.approx(size.max(), abs=EXACT)
    there = int(np.argmin(np.abs(points - found.largest_at).sum(axis=1)))
    assert size[there] == pytest.approx(size.max(), abs=EXACT)
    np.testing.assert_allclose(found.largest_components, errors[there], atol=EXACT)
    for k, axis in enumerate("XYZ"):
        assert found.ranges[axis].value == pytest.approx(np.ptp(errors[:, k]), abs=EXACT)
    tilts = sd.errors_at_points(tool, points).tilt
    for k, axis in enumerate("ABC"):
        # Tilts are below 1 mrad; both are computed from the same matrices.
        assert found.tilts[axis].value == pytest.approx(np.abs(tilts[:, k]).max(), abs=1e-15)
        assert found.tilt_ranges[axis].value == pytest.approx(np.ptp(tilts[:, k]), abs=1e-15)


def test_rms_is_the_mean_over_the_box_whatever_the_nodes() -> None:
    box = [[1.0, 2.0, 3.0], [70.0, 50.0, 44.0]]
    found = sd.volume_errors(machine(), box=box, grid=60)
    middles = [np.linspace(low, high, 121)[1::2] for low, high in zip(*box, strict=True)]
    points = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, 3)
    mean = np.mean(np.sum(machine().error(points) ** 2, axis=1))
    # The midpoint rule on other points. Both rules are off by second derivatives of |e|^2, h^2/12 and -h^2/24 times;
    # harmonics of up to five half waves over the axis make (5 pi/60)^2/12, 0.6 %, of a part of the whole.
    assert found.rms == pytest.approx(np.sqrt(mean), rel=3e-3)


def test_tilts_are_rotation_vectors_of_the_exact_pose() -> None:
    points = np.random.default_rng(1).uniform(0.0, 50.0, (200, 3))
    rotation, _ = machine().pose(points)
    found = sd.errors_at_points(machine(), points)
    for vector, matrix in zip(found.tilt, rotation, strict=True):
        angle = float(np.linalg.norm(vector))
        cross = np.cross(np.eye(3), vector / angle)
        rodrigues = np.eye(3) + np.sin(angle) * cross + 2.0 * np.sin(0.5 * angle) ** 2 * cross @ cross
        np.testing.assert_allclose(np.minimum(np.abs(rodrigues - matrix), np.abs(rodrigues.T - matrix)), 0, atol=1e-15)


def test_errors_at_points_are_those_of_the_machine_also_outside_of_the_tables() -> None:
    points = np.random.default_rng(1).uniform(-20.0, 120.0, (1000, 3))
    np.testing.assert_allclose(sd.errors_at_points(machine(), points).error, machine().error(points), atol=EXACT)


def test_uncertainties_at_points_are_those_of_error_at_point() -> None:
    calibration = calibrate(1, full_covariance=True)
    points = np.random.default_rng(1).uniform(0.0, 50.0, (20, 3))
    found = sd.errors_at_points(calibration, points, tool=(5.0, 6.0, 7.0))
    for k, point in enumerate(points):
        expected = sd.error_at_point(calibration, point, tool=(5.0, 6.0, 7.0)).standard_uncertainty
        assert found.error_uncertainty is not None
        assert found.tilt_uncertainty is not None
        # Sums of the same products in another order.
        np.testing.assert_allclose(found.error_uncertainty[k], expected[:3], rtol=1e-9)
        np.testing.assert_allclose(found.tilt_uncertainty[k], expected[3:], rtol=1e-9)


def test_ranking_sets_parameters_and_axes_to_zero() -> None:
    tool = machine()
    found = sd.volume_errors(tool, box=whole())
    points = all_points(found)
    names = [contribution.name for contribution in found.ranking]
    assert sorted(names) == sorted([*FUNCTIONS, *SQUARENESSES, *"XYZ"])
    for contribution in found.ranking:
        reduced = sd.Machine(tool.chain, without(tool.errors, contribution.parameters), tool.tool)
        size = np.linalg.norm(reduced.error(points), axis=1)
        assert contribution.largest == pytest.approx(size.max(), abs=EXACT)
    members = {c.name: c.parameters for c in found.ranking if len(c.name) == 1}
    assert members["X"] == ("EXX", "EYX", "EZX", "EAX", "EBX", "ECX")
    assert members["Y"][6:] == ("C0Y",)
    assert members["Z"][6:] == ("B0Z", "A0Z")


def test_calibration_gives_its_own_tool_and_volume() -> None:
    calibration = calibrate(1)
    found = sd.volume_errors(calibration)
    np.testing.assert_array_equal(found.tool, TOOL)
    np.testing.assert_array_equal(found.box, whole())
    own = sd.Machine(calibration.chain, calibration.to_error_map(), TOOL)
    assert found.largest == pytest.approx(np.linalg.norm(own.error(all_points(found)), axis=1).max(), abs=EXACT)
    assert found.fit == calibration.fit


def test_diagonals_are_those_of_the_calibration() -> None:
    calibration = calibrate(1)
    found = sd.volume_errors(calibration)
    for name, diagonal in sd.diagonal_errors(calibration).items():
        # One is exact, the other of first order: they differ by rotations times errors, 1e-4 * 0.05 mm.
        assert found.diagonals[name].value == pytest.approx(diagonal.range, abs=1e-5)


def test_box_ends_and_nodes_are_in_the_grid() -> None:
    found = sd.volume_errors(calibrate(1), box=[[1.0, 2.0, 3.0], [70.0, 50.0, 44.0]], grid=4)
    assert found.grid[0][[0, -1]].tolist() == [1.0, 70.0]
    nodes = calibrate(1).functions["EXX"][0]
    assert set(nodes[(nodes > 1.0) & (nodes < 70.0)].tolist()) <= set(found.grid[0].tolist())
    assert {24.0, 47.0} <= set(np.round(found.grid[0], 9).tolist())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"box": [[0, 0, 0], [81, 60, 50]]}, "box: expected positions of X in the calibrated volume, 0 to 80 mm"),
        ({"box": [[0, 0, 0], [0, 60, 50]]}, "box: expected a lowest position of X below the highest"),
        ({"box": [0, 0, 0]}, "box: expected the lowest and highest positions"),
        ({"tool": [0, 0]}, "tool: expected three finite lengths"),
        ({"grid": 1}, "grid: expected 2 to 1001 positions"),
        ({"limit": 0.0}, "limit: expected a positive length"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments: dict[str, Any], message: str) -> None:
    refused(sd.volume_errors, calibrate(1), **arguments, names=message)


def test_machine_needs_a_box() -> None:
    refused(sd.volume_errors, machine(), names="box: expected the lowest and highest positions")


def test_grid_points_are_all_combinations() -> None:
    points = sd.volume_grid([[0, 0, 0], [1, 2, 3]], (2, 3, 4))
    assert points.shape == (24, 3)
    assert points[-1].tolist() == [1.0, 2.0, 3.0]
    assert points[1].tolist() == [0.0, 0.0, 1.0]
