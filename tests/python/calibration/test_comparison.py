"""Two calibrations side by side: what differs, by how much, and whether chance explains it."""

import math
from typing import Any

import numpy as np
import pytest
from calibrations import TOOL, VOLUME, calibrate, parts_of
from refusal import refused
from usual import CHAIN, DIAGONALS

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS

NODES = np.linspace(0.0, 80.0, 6)


def synthetic(functions: dict[str, Any], squareness: dict[str, Any] | None = None, **more: Any) -> sd.Calibration:
    parts = {"method": "by hand", "chain": CHAIN, "volume": VOLUME, "tool": TOOL} | more
    return sd.Calibration(functions=functions, squareness=squareness or {}, **parts)


def noisy(seed: int, u: float = 1e-4) -> sd.Calibration:
    """All functions and squarenesses 0 but for independent noise of the standard uncertainty that is stated."""
    random = np.random.default_rng(seed)
    functions = {}
    for name in FUNCTIONS:
        uncertainty = np.full(6, u)
        uncertainty[0] = 0.0
        functions[name] = (NODES, uncertainty * random.standard_normal(6), uncertainty)
    return synthetic(functions, {"C0Y": (u * random.standard_normal(), u)})


def difference_of(comparison: sd.results.Comparison, parameter: str) -> sd.results.Difference:
    return next(difference for difference in comparison.differences if difference.parameter == parameter)


def significant(comparison: sd.results.Comparison) -> list[str]:
    return [d.parameter for d in comparison.differences if comparison.is_significant(d)]


# --- what differs ----------------------------------------------------------------------------------------------------
def test_difference_is_b_minus_a_at_every_node_with_both_uncertainties() -> None:
    a, b = calibrate(1), calibrate(2)
    comparison = sd.compare(a, b)
    assert [d.parameter for d in comparison.differences] == [*FUNCTIONS, "C0Y", "B0Z", "A0Z"]
    for difference in comparison.differences:
        name = difference.parameter
        if name in FUNCTIONS:
            np.testing.assert_array_equal(difference.position, a.functions[name][0])
            np.testing.assert_array_equal(difference.value, b.functions[name][1] - a.functions[name][1])
            both = np.hypot(a.functions[name][2], b.functions[name][2])
            np.testing.assert_allclose(difference.standard_uncertainty, both, rtol=1e-15)
        else:
            assert difference.value.tolist() == [b.squareness[name][0] - a.squareness[name][0]]
            assert np.isnan(difference.position).all()


def test_calibration_does_not_differ_from_itself() -> None:
    comparison = sd.compare(calibrate(1), calibrate(1))
    assert all(np.all(d.value == 0.0) for d in comparison.differences)
    assert significant(comparison) == []
    assert {comparison.probability(d) for d in comparison.differences} == {1.0}


def test_two_runs_of_one_machine_do_not_differ_significantly() -> None:
    assert significant(sd.compare(calibrate(1), calibrate(2))) == []


def test_collision_is_found_where_it_was() -> None:
    """EXX changes by 5 µm at 48 mm, where its uncertainty is below 1 µm; nothing else does."""
    a, b = calibrate(1), calibrate(2)
    parts = parts_of(b)
    parts["functions"]["EXX"][1][3] += 5e-3
    comparison = sd.compare(a, sd.Calibration(**parts))
    assert significant(comparison) == ["EXX"]
    found = difference_of(comparison, "EXX")
    assert found.position[found.largest] == 48.0
    assert found.most_significant == found.largest
    assert found.value[found.largest] == pytest.approx(5e-3, abs=2e-3)


def test_zeros_of_the_frame_are_not_tested() -> None:
    comparison = sd.compare(noisy(1), noisy(2))
    assert comparison.count == 18 * 5 + 1
    moved = parts_of(noisy(2))
    moved["functions"]["EXX"][1][0] = 1e-3  # certain, and different
    comparison = sd.compare(noisy(1), sd.Calibration(**moved))
    assert comparison.count == 18 * 5 + 2
    assert significant(comparison) == ["EXX"]
    assert difference_of(comparison, "EXX").normalised[0] == math.inf


# --- significance ----------------------------------------------------------------------------------------------------
def test_probability_is_that_of_the_normal_distribution_times_the_values_compared() -> None:
    a, b = synthetic({}, {"C0Y": (0.0, 3e-6)}), synthetic({}, {"C0Y": (15e-6, 4e-6)})
    comparison = sd.compare(a, b)
    (difference,) = comparison.differences
    assert difference.normalised.tolist() == [pytest.approx(3.0)]
    assert comparison.probability(difference) == pytest.approx(0.0026998, rel=1e-4)  # two-sided, 3 sigma
    assert comparison.threshold == pytest.approx(1.959964, abs=1e-6)
    two = [synthetic({}, dict.fromkeys(("C0Y", "B0Z"), c.squareness["C0Y"])) for c in (a, b)]
    comparison = sd.compare(two[0], two[1])
    assert comparison.probability(comparison.differences[0]) == pytest.approx(2 * 0.0026998, rel=1e-4)
    assert comparison.threshold == pytest.approx(2.241403, abs=1e-6)  # of 0.05/2


def test_one_comparison_in_twenty_of_equal_machines_raises_an_alarm() -> None:
    alarms = sum(bool(significant(sd.compare(noisy(k), noisy(10_000 + k)))) for k in range(400))
    # Binomial, 400 of 0.049: 19.5 with a standard deviation of 4.3; five of them to either side are no coincidence.
    assert 1 <= alarms <= 41


def test_limit_moves_the_threshold() -> None:
    a, b = synthetic({}, {"C0Y": (0.0, 3e-6)}), synthetic({}, {"C0Y": (12.5e-6, 4e-6)})  # 2.5 u: 0.0124
    assert significant(sd.compare(a, b, limit=0.05)) == ["C0Y"]
    assert significant(sd.compare(a, b, limit=0.01)) == []


def test_unknown_uncertainty_leaves_significance_open() -> None:
    a = synthetic({"EXX": ([0.0, 80.0], [0.0, 0.0], [np.nan, np.nan])}, {"C0Y": (0.0, 1e-6)})
    b = synthetic({"EXX": ([0.0, 80.0], [0.0, 1.0], [0.0, 1e-3])}, {"C0Y": (0.0, 1e-6)})
    comparison = sd.compare(a, b)
    assert comparison.count == 1
    assert comparison.probability(difference_of(comparison, "EXX")) is None
    assert not comparison.is_significant(difference_of(comparison, "EXX"))
    assert difference_of(comparison, "EXX").largest == 1


# --- tables that do not match ----------------------------------------------------------------------------------------
def test_longer_table_is_interpolated_at_the_nodes_of_the_shorter() -> None:
    a = synthetic({"EXX": ([0.0, 20.0, 80.0], [0.0, 1.0, 1.0], [0.0, 0.3, 0.3])})
    b = synthetic({"EXX": ([0.0, 10.0, 40.0, 80.0], [0.0, 1.0, 4.0, 8.0], [0.0, 0.1, 0.7, 0.4])})
    for one, other, sign in ((a, b, 1.0), (b, a, -1.0)):
        (difference,) = sd.compare(one, other).differences
        assert difference.position.tolist() == [0.0, 20.0, 80.0]
        np.testing.assert_allclose(difference.value, [0.0, sign * 1.0, sign * 7.0], rtol=1e-14)
        np.testing.assert_allclose(difference.standard_uncertainty, np.hypot([0.0, 0.3, 0.3], [0.0, 0.3, 0.4]))
        assert difference.interpolated == ("B" if sign > 0 else "A")


def test_only_the_common_range_is_compared() -> None:
    a = synthetic({"EXX": ([0.0, 20.0, 40.0], [0.0, 1.0, 2.0], [0.0, 0.1, 0.1])})
    b = synthetic({"EXX": ([10.0, 20.0, 40.0, 80.0], [0.5, 1.0, 2.0, 4.0], [0.1] * 4)})
    (difference,) = sd.compare(a, b).differences
    assert difference.position.tolist() == [20.0, 40.0]
    apart = synthetic({"EXX": ([50.0, 80.0], [1.0, 2.0], [0.1, 0.1])}, {"C0Y": (0.0, 1e-6)})
    comparison = sd.compare(synthetic(a.functions, {"C0Y": (0.0, 1e-6)}), apart)
    assert [d.parameter for d in comparison.differences] == ["C0Y"]
    assert any("EXX" in note for note in comparison.notes)


def test_rounded_positions_are_the_same_nodes() -> None:
    a = synthetic({"EXX": (NODES, NODES * 1e-6, np.full(6, 1e-4))})
    b = synthetic({"EXX": (NODES + 1e-10, NODES * 1e-6, np.full(6, 1e-4))})
    (difference,) = sd.compare(a, b).differences
    assert len(difference.position) == 6
    assert difference.interpolated == ""


def test_shapes_are_compared_where_a_slope_is_open() -> None:
    shape = np.array([0.0, 1e-3, 3e-3, 2e-3, 1e-3, 0.0])
    known = synthetic({"EXX": (NODES, shape + 1e-4 * NODES, np.full(6, 1e-4))})
    open_slope = synthetic({"EXX": (NODES, shape, np.full(6, 1e-4))}, undetermined_slopes=["EXX"])
    for a, b in ((known, open_slope), (open_slope, known)):
        (difference,) = sd.compare(a, b).differences
        assert difference.shape_only
        # Rounding of sums of some 1e-2 mm.
        np.testing.assert_allclose(difference.value, np.zeros(6), atol=1e-17)
        assert difference.standard_uncertainty[-1] == 0.0


def test_uncertainty_of_a_shape_counts_the_covariance() -> None:
    known = calibrate(1, full_covariance=True)
    open_plan = sd.Plan(VOLUME, DIAGONALS, 5)
    shape = calibrate(2, plan=open_plan, full_covariance=True)
    assert "EXX" in shape.undetermined_slopes
    difference = difference_of(sd.compare(known, shape), "EXX")
    variance = np.zeros(6)
    for calibration in (known, shape):
        covariance, labels = calibration.covariance, calibration.covariance_labels
        assert covariance is not None
        rows = np.array([labels.index(("EXX", p)) for p in difference.position])
        to_shape = np.eye(6)
        to_shape[:, -1] -= difference.position / difference.position[-1]
        variance += np.diag(to_shape @ covariance[np.ix_(rows, rows)] @ to_shape.T)
    # Sums of the same terms in another order; at the end, rounding of what is 0.
    np.testing.assert_allclose(
        difference.standard_uncertainty, np.sqrt(np.maximum(variance, 0.0)), rtol=1e-6, atol=1e-10
    )


def test_reversal_errors_are_compared_too() -> None:
    function = {"EXX": (NODES, np.zeros(6), np.full(6, 1e-4))}
    a = synthetic(function, reversal={"EXX": (NODES, np.full(6, 1e-3), np.full(6, 1e-4))})
    b = synthetic(function, reversal={"EXX": (NODES, np.full(6, 4e-3), np.full(6, 1e-4))})
    comparison = sd.compare(a, b)
    assert significant(comparison) == ["EXX_reversal"]
    known, constant_open = (parts_of(c) for c in (a, b))
    constant_open["undetermined_reversal_constants"] = ["EXX"]
    comparison = sd.compare(sd.Calibration(**known), sd.Calibration(**constant_open))
    assert difference_of(comparison, "EXX_reversal").shape_only
    assert np.all(difference_of(comparison, "EXX_reversal").value == 0.0)


def test_what_only_one_knows_is_listed() -> None:
    a, b = noisy(1), noisy(2)
    fewer = parts_of(b)
    del fewer["functions"]["ECZ"], fewer["functions"]["EXX"], fewer["squareness"]["C0Y"]
    comparison = sd.compare(a, sd.Calibration(**fewer))
    assert comparison.only_in_a == ("EXX", "ECZ", "C0Y")
    assert comparison.only_in_b == ()
    assert sd.compare(sd.Calibration(**fewer), a).only_in_b == ("EXX", "ECZ", "C0Y")


# --- what has no meaning ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("other", "names"),
    [
        ({"chain": "[w b X Y Z t]"}, "the chains differ"),
        ({"volume": (80.0, 60.0, 51.0)}, "the volumes differ, 80 60 50 and 80 60 51 mm"),
        ({"tool": (0.0, 0.0, 0.0), "method": "conventional"}, "the tool offsets differ"),
        ({"functions": {}, "squareness": {}}, "no parameter in common"),
    ],
)
def test_comparison_without_a_meaning_is_refused(other: dict[str, Any], names: str) -> None:
    refused(sd.compare, noisy(1), sd.Calibration(**(parts_of(noisy(2)) | other)), names=names)


def test_another_tool_is_noted() -> None:
    other = sd.Calibration(**(parts_of(noisy(2)) | {"tool": (0.0, 0.0, 0.0)}))
    notes = sd.compare(noisy(1), other).notes
    assert notes == (
        "the tool offsets differ, 1 -2 30 and 0 0 0 mm; the tables belong to the axes and not to the tool, so they are "
        "compared all the same",
    )


@pytest.mark.parametrize("limit", [0.0, 1.0, -1.0, math.nan])
def test_limit_is_a_probability(limit: float) -> None:
    refused(sd.compare, noisy(1), noisy(2), limit=limit, names="limit")
