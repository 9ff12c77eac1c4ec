"""The error of the tool in the volume, against a brute-force evaluation of the exact pose."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from calibrations import PLAN, TOOL, VOLUME, calibrate, parts_of, simulate
from refusal import refused
from usual import ALL_CHAINS, CHAIN

import stepdiag as sd
from stepdiag import _core
from stepdiag.parameters import FUNCTIONS, SQUARENESSES
from stepdiag.presentation.blocks import text_of
from stepdiag.presentation.volume import volume_blocks

TWO_AXES = """
[volume]
x_mm = 400.0
y_mm = 300.0
z_mm = 250.0
[machine]
chain = "[w X' b Y Z t]"
[machine.random]
seed = 3
[plan]
lines = ["pp0", "np0"]
steps = 10
scale_lines = ["p00", "0p0"]
[head]
layout = "ideal"
[noise]
distance_um = 0.1
tilt_urad = 1.0
"""
# Both evaluate one pose; what is left is rounding of positions of up to 1 m.
EXACT = 1e-9


def machine(chain: str = CHAIN, seed: int = 3, tool: npt.ArrayLike = (10.0, -20.0, 40.0)) -> sd.Machine:
    return sd.Machine(chain, sd.random_error_map(VOLUME, seed=seed, intervals=7), tool)


def all_points(found: sd.results.VolumeErrors) -> npt.NDArray[np.float64]:
    return np.stack(np.meshgrid(*found.grid, indexing="ij"), axis=-1).reshape(-1, 3)


def whole() -> npt.NDArray[np.float64]:
    return np.array([np.zeros(3), VOLUME])


def without(errors: sd.ErrorMap, names: tuple[str, ...]) -> sd.ErrorMap:
    functions = {name: table for name, table in errors.functions.items() if name not in names}
    return sd.ErrorMap(functions, {name: angle for name, angle in errors.squareness.items() if name not in names})


@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_largest_error_and_ranges_are_those_of_all_grid_points(chain: str) -> None:
    tool = machine(chain)
    found = sd.volume(tool, box=whole())
    points = all_points(found)
    errors = tool.error(points)
    size = np.linalg.norm(errors, axis=1)
    assert found.largest == pytest.approx(size.max(), abs=EXACT)
    there = int(np.argmin(np.abs(points - found.largest_at).sum(axis=1)))
    assert size[there] == pytest.approx(size.max(), abs=EXACT)
    np.testing.assert_allclose(found.largest_components, errors[there], atol=EXACT)
    for k, axis in enumerate("XYZ"):
        assert found.ranges[axis].value == pytest.approx(np.ptp(errors[:, k]), abs=EXACT)
    tilts = sd.errors_at(tool, points).tilt
    for k, axis in enumerate("ABC"):
        # Tilts are below 1 mrad; both are computed from the same matrices.
        assert found.tilts[axis].value == pytest.approx(np.abs(tilts[:, k]).max(), abs=1e-15)
        assert found.tilt_ranges[axis].value == pytest.approx(np.ptp(tilts[:, k]), abs=1e-15)


def test_rms_is_the_mean_over_the_box_whatever_the_nodes() -> None:
    box = [[1.0, 2.0, 3.0], [70.0, 50.0, 44.0]]
    found = sd.volume(machine(), box=box, grid=60)
    middles = [np.linspace(low, high, 121)[1::2] for low, high in zip(*box, strict=True)]
    points = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, 3)
    mean = np.mean(np.sum(machine().error(points) ** 2, axis=1))
    # The midpoint rule on other points. Both rules are off by second derivatives of |e|^2, h^2/12 and -h^2/24 times;
    # harmonics of up to five half waves over the axis make (5 pi/60)^2/12, 0.6 %, of a part of the whole.
    assert found.rms == pytest.approx(np.sqrt(mean), rel=3e-3)


def test_tilts_are_rotation_vectors_of_the_exact_pose() -> None:
    points = np.random.default_rng(1).uniform(0.0, 50.0, (200, 3))
    rotation, _ = machine().pose(points)
    found = sd.errors_at(machine(), points)
    for vector, matrix in zip(found.tilt, rotation, strict=True):
        angle = float(np.linalg.norm(vector))
        cross = np.cross(np.eye(3), vector / angle)
        rodrigues = np.eye(3) + np.sin(angle) * cross + 2.0 * np.sin(0.5 * angle) ** 2 * cross @ cross
        np.testing.assert_allclose(np.minimum(np.abs(rodrigues - matrix), np.abs(rodrigues.T - matrix)), 0, atol=1e-15)


def test_errors_at_points_are_those_of_the_machine_also_outside_of_the_tables() -> None:
    points = np.random.default_rng(1).uniform(-20.0, 120.0, (1000, 3))
    np.testing.assert_allclose(sd.errors_at(machine(), points).error, machine().error(points), atol=EXACT)


def test_uncertainties_at_points_are_those_of_error_at_point() -> None:
    calibration = calibrate(1, full_covariance=True)
    points = np.random.default_rng(1).uniform(0.0, 50.0, (20, 3))
    found = sd.errors_at(calibration, points, tool=(5.0, 6.0, 7.0))
    for k, point in enumerate(points):
        expected = sd._core.error_at_point(calibration, point, tool=(5.0, 6.0, 7.0)).standard_uncertainty
        assert found.error_uncertainty is not None
        assert found.tilt_uncertainty is not None
        # Sums of the same products in another order.
        np.testing.assert_allclose(found.error_uncertainty[k], expected[:3], rtol=1e-9)
        np.testing.assert_allclose(found.tilt_uncertainty[k], expected[3:], rtol=1e-9)


def test_ranking_sets_parameters_and_axes_to_zero() -> None:
    tool = machine()
    found = sd.volume(tool, box=whole())
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
    found = sd.volume(calibration)
    np.testing.assert_array_equal(found.tool, TOOL)
    np.testing.assert_array_equal(found.box, whole())
    own = sd.Machine(calibration.chain, calibration.to_error_map(), TOOL)
    assert found.largest == pytest.approx(np.linalg.norm(own.error(all_points(found)), axis=1).max(), abs=EXACT)
    assert found.fit == calibration.fit


def test_diagonals_are_those_of_the_calibration() -> None:
    calibration = calibrate(1)
    found = sd.volume(calibration)
    for name, diagonal in sd.methods.diagonal_errors(calibration).items():
        # One is exact, the other of first order: they differ by rotations times errors, 1e-4 * 0.05 mm.
        assert found.diagonals[name].value == pytest.approx(diagonal.range, abs=1e-5)


def test_other_directions_of_approach_are_those_of_the_machine() -> None:
    calibration = sd.methods.evaluate(simulate(1, repeats=2, backward=True), PLAN, sd.Head(), CHAIN, TOOL)
    parts = parts_of(calibration)
    nodes = {name: position for name, (position, _, _) in calibration.functions.items()}
    parts["reversal"] = {
        name: (position, 5e-3 * scale * np.cos(position / 9.0), np.full_like(position, 1e-4))
        for k, (name, position) in enumerate(nodes.items())
        for scale in [(1.0 if name[1] in "XYZ" else 2e-3) * (1 + k % 3)]
    }
    parts["undetermined_reversal_constants"] = []
    parts["reversal_negative_uncertainty"] = {name: np.full_like(position, 1e-4) for name, position in nodes.items()}
    both = sd.Calibration(**parts)
    found = sd.volume(both)
    own = sd.Machine(both.chain, both.to_error_map(), TOOL)
    assert len(found.other_approaches) == 7
    for approach, largest in found.other_approaches.items():
        size = np.linalg.norm(own.error(all_points(found), approach), axis=1)
        assert largest == pytest.approx(size.max(), abs=EXACT)
    worst = max(found.other_approaches.values())
    assert any(f"largest error is {1e3 * worst:.4g} µm" in row for row in text_of(volume_blocks(found)))
    assert sd.volume(calibrate(1)).other_approaches == {}
    parts["undetermined_reversal_constants"] = ["EXX"]
    partly = sd.volume(sd.Calibration(**parts))
    assert partly.other_approaches == {}
    assert any("not known, as not all reversal errors are" in row for row in text_of(volume_blocks(partly)))


def test_box_ends_and_nodes_are_in_the_grid() -> None:
    found = sd.volume(calibrate(1), box=[[1.0, 2.0, 3.0], [70.0, 50.0, 44.0]], grid=4)
    assert found.grid[0][[0, -1]].tolist() == [1.0, 70.0]
    nodes = calibrate(1).functions["EXX"][0]
    assert set(nodes[(nodes > 1.0) & (nodes < 70.0)].tolist()) <= set(found.grid[0].tolist())
    assert {24.0, 47.0} <= set(np.round(found.grid[0], 9).tolist())


def test_of_very_many_nodes_some_are_computed_and_it_is_said() -> None:
    nodes = np.linspace(0.0, 80.0, 1001)
    many = sd.Machine(CHAIN, sd.ErrorMap({"EXX": (nodes, 1e-4 * nodes)}), TOOL)
    found = sd.volume(many, box=whole(), ranking=False)
    assert not found.every_node
    assert found.shape == (201, 2, 2)
    assert set(found.grid[0].tolist()) <= set(nodes.tolist())
    assert found.grid[0][[0, -1]].tolist() == [0.0, 80.0]
    assert found.largest == pytest.approx(8e-3, rel=1e-9)
    assert "the tables have more than 201 nodes an axis: 201 of them, evenly" in list(text_of(volume_blocks(found)))
    few = sd.volume(many, box=[[10, 0, 0], [20, 60, 50]], ranking=False)
    assert few.every_node
    assert few.shape[0] == 126


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"box": [[0, 0, 0], [81, 60, 50]]}, "box: expected positions of X in the calibrated volume, 0 to 80 mm"),
        ({"box": [[0, 0, 0], [0, 60, 50]]}, "box: expected a lowest position of X below the highest"),
        ({"box": [0, 0, 0]}, "box: expected the lowest and highest positions"),
        ({"tool": [0, 0]}, "tool: expected three finite lengths"),
        ({"grid": 1}, "grid: expected 2 to 1001 positions"),
        ({"limit": 0.0}, "`limit`: expected a length above 0 mm"),
        ({"samples": 10}, "samples: expected at least 1000"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments: dict[str, Any], message: str) -> None:
    refused(sd.volume, calibrate(1), **arguments, names=message)


def test_machine_needs_a_box() -> None:
    refused(sd.volume, machine(), names="box: expected the lowest and highest positions")


def test_grid_points_are_all_combinations() -> None:
    points = sd.methods.volume_grid([[0, 0, 0], [1, 2, 3]], (2, 3, 4))
    assert points.shape == (24, 3)
    assert points[-1].tolist() == [1.0, 2.0, 3.0]
    assert points[1].tolist() == [0.0, 0.0, 1.0]


# --- intervals and verdicts ------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def certain() -> sd.Calibration:
    return calibrate(1, full_covariance=True)


def test_draws_are_the_exact_figures_of_drawn_tables(certain: sd.Calibration) -> None:
    found = sd.volume(certain, ranking=False)
    values = _core.VolumeDraws(certain, *found.grid).values[: len(_core.VolumeDraws.names())]
    figures = [
        found.largest,
        found.rms,
        *(found.ranges[a].value for a in "XYZ"),
        *(found.tilts[a].value for a in "ABC"),
    ]
    figures += [*(found.tilt_ranges[a].value for a in "ABC"), *(d.value for d in found.diagonals.values())]
    # Draws are of first order: they leave out rotations times rotations times lengths, 1e-4 * 1e-4 * 100 mm.
    np.testing.assert_allclose(values, figures, atol=2e-6)


def test_draws_do_not_depend_on_how_they_are_divided(certain: sd.Calibration) -> None:
    grid = sd.volume(certain, ranking=False).grid
    draws = _core.VolumeDraws(certain, *grid, seed=3)
    whole = draws.draw(0, 500)
    np.testing.assert_array_equal(np.concatenate([draws.draw(0, 77), draws.draw(77, 423)]), whole)


def test_draws_scatter_as_tables_drawn_with_numpy(certain: sd.Calibration) -> None:
    grid = sd.volume(certain, ranking=False).grid
    drawn = _core.VolumeDraws(certain, *grid).draw(0, 4000)[:, :2]
    values, vectors = np.linalg.eigh(certain.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    random, parts = np.random.default_rng(1), parts_of(certain)
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 3)
    largest = []
    for _ in range(1000):
        noise, at, functions, angles = root @ random.standard_normal(len(root)), 0, {}, {}
        for name in FUNCTIONS:
            position, value, _ = parts["functions"][name]
            functions[name] = (position, value + noise[at : at + len(position)])
            at += len(position)
        for name in SQUARENESSES:
            angles[name] = parts["squareness"][name][0] + noise[at]
            at += 1
        own = sd.Machine(CHAIN, sd.ErrorMap(functions, angles), TOOL)
        largest.append(np.linalg.norm(own.error(points), axis=1).max())
    # Four standard deviations of a mean and of a standard deviation of 1000 draws.
    assert np.mean(largest) == pytest.approx(drawn[:, 0].mean(), abs=4.0 * np.std(largest) / np.sqrt(1000))
    assert np.std(largest) == pytest.approx(drawn[:, 0].std(), rel=4.0 / np.sqrt(2000))


def test_verdict_follows_the_one_sided_bounds(certain: sd.Calibration) -> None:
    bounds = sd.volume(certain, ranking=False).bounds
    assert bounds is not None
    low, high = bounds
    expected = {low * 0.999: "not within", low * 1.001: "undecided", high * 0.999: "undecided", high: "within"}
    for limit, verdict in expected.items():
        assert sd.volume(certain, ranking=False, limit=limit).verdict == verdict


def test_what_lies_between_the_nodes_widens_interval_and_bounds(certain: sd.Calibration) -> None:
    narrow = sd.volume(certain, ranking=False, between_nodes=0.0)
    wide = sd.volume(certain, ranking=False, between_nodes=1.0)
    assert narrow.largest_interval is not None
    assert wide.largest_interval is not None
    assert narrow.bounds is not None
    assert wide.bounds is not None
    # One place alone would be raised by 1.645 times the parabola's largest, sqrt(15/8) of its root mean square.
    assert wide.bounds[1] > narrow.largest + 1.644854 * np.sqrt(15.0 / 8.0)
    assert wide.largest_interval[1] > wide.bounds[1]
    assert wide.bounds[0] < narrow.bounds[0]
    assert wide.rms_interval == narrow.rms_interval


def bounds_of_places(errors: npt.NDArray[np.float64], u: npt.NDArray[np.float64], runs: int) -> npt.NDArray[np.float64]:
    """95 % bounds of the largest error by runs with noise, (runs, 2), mm. errors: of X, at the nodes of X from home."""
    nodes, ends = np.linspace(0.0, VOLUME[0], len(errors)), np.array([0.0, 50.0])
    zeros = {name: np.zeros(len(errors) if name[2] == "X" else 2) for name in FUNCTIONS}
    at = sum(len(zeros[name]) for name in FUNCTIONS[: FUNCTIONS.index("EXX")])
    covariance = np.zeros((sum(map(len, zeros.values())) + 3,) * 2)
    covariance[at : at + len(u), at : at + len(u)] = np.diag(u**2)
    random, bounds = np.random.default_rng(1), []
    for seed in range(runs):
        values = zeros | {"EXX": errors + u * random.standard_normal(len(u))}
        functions = {
            name: (nodes if name[2] == "X" else ends, value, u if name == "EXX" else 0.0 * value)
            for name, value in values.items()
        }
        calibration = sd.Calibration(
            method="adjustment",
            chain=CHAIN,
            volume=(VOLUME[0], 50.0, 50.0),
            tool=(0.0, 0.0, 0.0),
            functions=functions,
            squareness=dict.fromkeys(SQUARENESSES, (0.0, 0.0)),
            covariance=covariance,
        )
        found = sd.volume(calibration, between_nodes=0.0, ranking=False, samples=1000, seed=seed)
        assert found.bounds is not None
        bounds.append(found.bounds)
    return np.array(bounds)


RUNS = 300
# 5 % and three binomial standard deviations of 300 runs: a sound rule at exactly 5 % fails once in 700 seeds.
ALLOWED = 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / RUNS)


def test_among_equal_places_not_within_is_wrong_in_five_percent_at_most() -> None:
    errors = np.append(0.0, np.full(8, 10e-3))
    bounds = bounds_of_places(errors, np.append(0.0, np.full(8, 0.5e-3)), RUNS)
    assert np.mean(bounds[:, 0] > 10e-3) <= ALLOWED
    assert np.mean(bounds[:, 1] < 10e-3) <= ALLOWED


def test_a_place_that_is_less_certain_than_the_largest_found_counts() -> None:
    """Within is wrong if the place at 10 um is found below the one at 9 um, which says little of it."""
    bounds = bounds_of_places(np.array([0.0, 9e-3, 10e-3]), np.array([0.0, 0.1e-3, 1e-3]), RUNS)
    assert np.mean(bounds[:, 1] < 10e-3) <= ALLOWED
    assert np.mean(bounds[:, 0] > 10e-3) <= ALLOWED


def test_where_noise_dominates_not_within_is_wrong_in_five_percent_at_most() -> None:
    errors = np.append(0.0, 1e-3 * (-1.0) ** np.arange(8))
    bounds = bounds_of_places(errors, np.append(0.0, np.full(8, 2e-3)), RUNS)
    assert np.mean(bounds[:, 0] > 1e-3) <= ALLOWED
    assert np.mean(bounds[:, 1] < 1e-3) <= ALLOWED


def test_one_place_has_the_bounds_of_a_normal_distribution() -> None:
    bounds = bounds_of_places(np.array([0.0, 0.01]), np.array([0.0, 1e-4]), 1)[0]
    # 10 um and noise of u = 0.1 um: the second normal number of the seed, as the first is of the node at home.
    found = 0.01 + 1e-4 * np.random.default_rng(1).standard_normal(2)[1]
    assert bounds[1] == pytest.approx(found + 1.644854e-4, abs=1e-9)
    # The lower one has the mean of 1000 squares: noise of 2 u/sqrt(1000), and second order, u^2/L, of 1 % of u.
    assert bounds[0] == pytest.approx(found - 1.644854e-4, abs=0.25e-4)


def test_limit_inside_the_interval_of_a_verdict_is_explained(certain: sd.Calibration) -> None:
    found = sd.volume(certain, ranking=False)
    assert found.bounds is not None
    assert found.largest_interval is not None
    limit = 0.5 * (found.bounds[1] + found.largest_interval[1])
    near, far = (sd.volume(certain, ranking=False, limit=factor * limit) for factor in (1.0, 2.0))
    assert (near.verdict, far.verdict) == ("within", "within")
    assert near.interval_note
    assert any(near.interval_note in row for row in text_of(volume_blocks(near)))
    assert not far.interval_note
    assert not found.interval_note


def test_between_nodes_is_what_the_calibration_carries_unless_it_is_told(certain: sd.Calibration) -> None:
    stated = sd.volume(certain.with_between_nodes(1.0), ranking=False)
    told = sd.volume(certain, ranking=False, between_nodes=1.0)
    assert (stated.between_nodes, stated.between_nodes_estimated) == (1.0, False)
    assert stated.largest_interval == told.largest_interval
    assert sd.volume(certain.with_between_nodes(1.0), ranking=False, between_nodes=0.5).between_nodes == 0.5
    none_at_all = sd.volume(certain.with_between_nodes(0.0), ranking=False)
    assert (none_at_all.between_nodes, none_at_all.between_nodes_estimated) == (0.0, False)
    assert sd.volume(certain, ranking=False).between_nodes_estimated


@pytest.mark.parametrize("name", ["c.csv", "c.nc"])
def test_files_carry_what_was_stated_of_between_the_nodes(name: str, tmp_path: Path) -> None:
    stated = 0.7e-3 / 3.0  # of many digits
    calibrate(1).write(tmp_path / name, between_nodes=stated)
    assert sd.read_calibration(tmp_path / name).between_nodes == stated
    calibrate(1).write(tmp_path / name)
    assert sd.read_calibration(tmp_path / name).between_nodes is None
    for wrong in (-1.0, float("nan")):
        refused(
            calibrate(1).with_between_nodes, wrong, names="between_nodes_mm: expected a finite number of at least 0"
        )


def test_file_with_a_bad_statement_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "c.csv"
    calibrate(1).write(file, between_nodes=1e-3)
    file.write_text(file.read_text().replace("# between_nodes_mm=0.001", "# between_nodes_mm=-1"))
    refused(sd.read_calibration, file, names='between_nodes_mm: expected a number of at least 0, got "-1"')


def test_between_nodes_of_a_parabola_is_its_mean_distance_from_its_chords() -> None:
    """f = q p^2/2 is q t (h - t)/2 from its chord: q h^2/sqrt(120) on average."""
    nodes, q = np.linspace(0.0, 80.0, 9), 1e-4
    parts = parts_of(calibrate(1))
    known = np.zeros(9)
    functions = dict.fromkeys(FUNCTIONS, (nodes, known, known))
    functions["EXX"] = (nodes, 0.5 * q * nodes**2, known)
    squareness = dict.fromkeys(SQUARENESSES, (0.0, 0.0))
    found = sd.volume(sd.Calibration(**(parts | {"functions": functions, "squareness": squareness})))
    # The largest error is along X alone. Second differences of numbers of size 1 mm are rounded to 1e-16 mm.
    assert found.between_nodes == pytest.approx(q * 10.0**2 / np.sqrt(120.0), rel=1e-9)
    assert found.between_nodes_estimated


def test_without_covariance_there_are_values_and_no_verdict() -> None:
    found = sd.volume(calibrate(1), limit=1.0)
    assert found.largest > 0.0
    assert found.largest_interval is None
    assert all(figure.interval is None for figure in found.ranges.values())
    assert found.verdict is None
    assert "no covariance" in found.no_verdict_because


def test_rejected_fit_has_no_verdict(certain: sd.Calibration) -> None:
    found = sd.volume(certain.judged("rejected"), limit=1.0)
    assert found.verdict is None
    assert "rejected" in found.no_verdict_because


def test_undetermined_parameters_leave_what_does_not_need_them() -> None:
    parts = parts_of(calibrate(1, full_covariance=True))
    del parts["functions"]["EXX"]
    del parts["covariance"]
    found = sd.volume(sd.Calibration(**parts), limit=1.0)
    assert found.missing == {"X": ("EXX",)}
    assert np.isnan([found.largest, found.rms, found.ranges["X"].value, found.diagonals["ppp"].value]).all()
    assert found.ranges["Y"].value > 0.0
    assert found.tilts["A"].value > 0.0
    assert found.ranking == ()
    assert found.verdict is None
    assert found.no_verdict_because == "not determined: EXX"


def test_box_inside_has_no_larger_error_than_the_volume(certain: sd.Calibration) -> None:
    inside = sd.volume(certain, box=[[10, 10, 10], [40, 40, 40]], ranking=False)
    whole_volume = sd.volume(certain, ranking=False)
    assert inside.largest < whole_volume.largest
    assert inside.largest_interval is not None


# --- machines of two axes --------------------------------------------------------------------------------------------
def test_plane_of_two_axes_where_the_third_was_not_measured(tmp_path: Path) -> None:
    """Its figures are those of the machine that was simulated, along X and Y with Z at home."""
    path = tmp_path / "two.toml"
    path.write_text(TWO_AXES)
    scenario = sd.read_scenario(path)
    calibration = sd.evaluate(scenario, sd.simulate(scenario), full_covariance=True)
    found = sd.volume(calibration, samples=1000)
    assert math.isnan(found.largest)
    plane = found.plane
    assert plane is not None
    assert (plane.axes, plane.unmeasured) == ("XY", "Z")
    nodes = [np.linspace(0.0, edge, 11) for edge in (400.0, 300.0)]
    points = np.array([[x, y, 0.0] for x in nodes[0] for y in nodes[1]])
    truth = scenario.machine().error(points)[:, :2]
    lengths = np.linalg.norm(truth, axis=1)
    assert plane.largest_uncertainty is not None
    assert abs(plane.largest - lengths.max()) < 3.0 * plane.largest_uncertainty
    assert abs(plane.rms - np.sqrt(np.mean(lengths**2))) < 3.0 * plane.largest_uncertainty
    text = "\n".join(text_of(volume_blocks(found)))
    assert "plane: X and Y; Z was not measured, and stands at home" in text
    assert "largest error in the plane" in text


def test_volume_of_three_axes_has_no_plane() -> None:
    assert sd.volume(calibrate(1), samples=1000, ranking=False).plane is None
