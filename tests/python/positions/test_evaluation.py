"""Figures of ISO 230-2 from repeated readings: published readings, brute force, and readings drawn from known truth."""

import csv
import itertools
import math
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from places import DATA
from refusal import refused

import stepdiag as sd
from stepdiag.positions.figures import FIGURES

PUBLISHED_READINGS = DATA / "positions"
Readings = dict[tuple[float, str, int], float]


def by_the_formulas(file: Path) -> dict[str, mp.mpf]:
    """The figures by the formulas of the standard, term by term with 40 digits, from the texts in the file."""
    rows = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    x: dict[tuple[str, str], list[mp.mpf]] = {}
    with mp.workdps(40):
        for row in csv.DictReader(rows):
            value = mp.mpf(row["position_mm"]) - mp.mpf(row["target_mm"])
            x.setdefault((row["target_mm"], row["direction"]), []).append(value)
        mean = {key: mp.fsum(values) / len(values) for key, values in x.items()}
        s = {k: mp.sqrt(mp.fsum((v - mean[k]) ** 2 for v in values) / (len(values) - 1)) for k, values in x.items()}
        targets = sorted({target for target, _ in x})
        reversal = {t: mean[t, "+"] - mean[t, "-"] for t in targets}
        middle = [(mean[t, "+"] + mean[t, "-"]) / 2 for t in targets]
        figures = {
            "B": max(abs(b) for b in reversal.values()),
            "B_mean": mp.fsum(reversal.values()) / len(targets),
            "M": max(middle) - min(middle),
            "R": max(
                max(2 * s[t, "+"] + 2 * s[t, "-"] + abs(reversal[t]), 4 * s[t, "+"], 4 * s[t, "-"]) for t in targets
            ),
        }
        for suffix, directions in (("", "+-"), ("_up", "+"), ("_down", "-")):
            keys = [key for key in x if key[1] in directions]
            figures[f"E{suffix}"] = max(mean[k] for k in keys) - min(mean[k] for k in keys)
            figures[f"A{suffix}"] = max(mean[k] + 2 * s[k] for k in keys) - min(mean[k] - 2 * s[k] for k in keys)
            if suffix:
                figures[f"R{suffix}"] = max(4 * s[k] for k in keys)
    return figures


# In µm, to the digits that they are published with, from the readings and not from the reports that print them.
PUBLISHED = {
    "stepper_stage": {"B": 0.0122, "M": 0.0277, "E": 0.0368, "R": 0.0688, "A": 0.0888},
    "target_axis": {"B": 33.58, "M": 93.65, "E": 122.85, "R": 55.16, "A": 135.26},
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_figures_of_published_readings_are_those_of_the_formulas(name: str) -> None:
    result = sd.positions.evaluate_positions(sd.positions.read_positions(PUBLISHED_READINGS / f"{name}.csv"))
    expected = by_the_formulas(PUBLISHED_READINGS / f"{name}.csv")
    assert result.figures.keys() == expected.keys() == FIGURES.keys()
    for figure, value in result.figures.items():
        # Positions of up to 20 mm have rounding of 4e-15 mm each.
        assert value.value == pytest.approx(float(expected[figure]), abs=5e-14), figure
    for figure, micrometres in PUBLISHED[name].items():
        half_a_digit = 0.5 * 10.0 ** -len(str(micrometres).split(".")[1])
        assert result.figures[figure].value * 1e3 == pytest.approx(micrometres, abs=half_a_digit)


def test_places_are_those_of_the_extremes() -> None:
    figures = sd.positions.evaluate_positions(
        sd.positions.read_positions(PUBLISHED_READINGS / "target_axis.csv")
    ).figures
    assert figures["B"].at == figures["R"].at == (0.0,)
    assert figures["E"].at == figures["M"].at == figures["A"].at == (-10.0, 0.0)
    assert figures["E_up"].at == (-10.0, -20.0)
    assert figures["B_mean"].at == ()


def readings_of(values: Readings) -> sd.positions.PositionReadings:
    return sd.positions.PositionReadings(tuple(sorted({target for target, _, _ in values})), values)


def random_readings(seed: int, targets: int = 6, cycles: int = 5) -> Readings:
    random = np.random.default_rng(seed)
    keys = itertools.product(np.linspace(0.0, 500.0, targets).tolist(), "+-", range(1, cycles + 1))
    return {key: float(random.normal(0.0, 1e-3)) for key in keys}


@pytest.mark.parametrize("seed", range(20))
def test_figures_are_bound_by_each_other(seed: int) -> None:
    """Relations that follow from the definitions, whatever the readings."""
    f = {
        name: figure.value
        for name, figure in sd.positions.evaluate_positions(readings_of(random_readings(seed))).figures.items()
    }
    assert max(f["E_up"], f["E_down"]) <= f["E"] <= max(f["E_up"], f["E_down"]) + f["B"]
    assert f["M"] <= f["E"] <= f["M"] + f["B"] + 1e-15
    assert max(f["R_up"], f["R_down"]) <= f["R"] <= (f["R_up"] + f["R_down"]) / 2 + max(f["B"], f["R"] / 2)
    assert max(f["A_up"], f["A_down"], f["E"], f["R"]) <= f["A"] + 1e-15
    assert abs(f["B_mean"]) <= f["B"]


def test_order_of_readings_and_a_shift_of_all_change_nothing() -> None:
    readings = random_readings(3)
    one = sd.positions.evaluate_positions(readings_of(readings))
    shifted = {key: value + 0.125 for key, value in reversed(readings.items())}
    other = sd.positions.evaluate_positions(readings_of(shifted))
    for name, figure in one.figures.items():
        # Deviations near 0.125 have rounding of 1.4e-17.
        assert other.figures[name].value == pytest.approx(figure.value, abs=1e-15)
        assert other.figures[name].at == figure.at


def test_lost_readings_change_the_count_of_their_target_alone() -> None:
    readings = random_readings(4)
    del readings[100.0, "+", 2], readings[100.0, "+", 5]
    result = sd.positions.evaluate_positions(readings_of(readings))
    (scatter,) = (s for s in result.up if s.target == 100.0)
    kept = [readings[100.0, "+", cycle] for cycle in (1, 3, 4)]
    assert (scatter.count, scatter.mean) == (3, pytest.approx(np.mean(kept), rel=1e-14))
    assert scatter.deviation == pytest.approx(np.std(kept, ddof=1), rel=1e-13)
    assert result.fewest_readings == 3
    assert {s.count for s in (*result.up, *result.down) if s is not scatter} == {5}


def test_target_of_one_reading_is_left_out_and_named() -> None:
    readings = random_readings(5)
    for cycle in range(2, 6):
        del readings[200.0, "-", cycle]
    readings[200.0, "-", 1] = 1.0  # would be the largest by far
    result = sd.positions.evaluate_positions(readings_of(readings))
    assert result.left_out == ((200.0, "-", 1),)
    assert 200.0 not in result.reversal
    assert result.figures["E"].value < 0.01
    assert 200.0 in [s.target for s in result.up]


def test_readings_of_one_direction_have_its_figures_alone() -> None:
    readings = {key: value for key, value in random_readings(6).items() if key[1] == "-"}
    result = sd.positions.evaluate_positions(readings_of(readings))
    assert list(result.figures) == ["A_down", "E_down", "R_down"]
    both = sd.positions.evaluate_positions(readings_of(random_readings(6)))
    assert {name: both.figures[name] for name in result.figures} == dict(result.figures)


def test_one_cycle_is_refused() -> None:
    readings = {key: value for key, value in random_readings(7).items() if key[2] == 1}
    expected = "expected two or more cycles at two or more targets in one direction"
    refused(sd.positions.evaluate_positions, readings_of(readings), names=expected)


@pytest.mark.parametrize("cycles", [5, 20])
def test_uncertainties_are_the_scatter_of_repeated_tests(cycles: int) -> None:
    """A machine whose extremes are 50 standard deviations from all else, tested 1000 times."""
    targets = [0.0, 100.0, 200.0, 300.0]
    up, down = np.array([0.0, 1.0, 3.0, -2.0]) * 0.05, np.array([0.01, 0.95, 2.8, -2.5]) * 0.05
    scatter_up, scatter_down = np.array([1.0, 1.1, 2.0, 1.3]) * 1e-3, np.array([1.0, 1.0, 1.8, 1.2]) * 1e-3
    random = np.random.default_rng(8)
    found: dict[str, list[float]] = {}
    stated: dict[str, list[float]] = {}
    for _ in range(1000):
        values: Readings = {}
        for k, target in enumerate(targets):
            for cycle in range(cycles):
                values[target, "+", cycle] = up[k] + scatter_up[k] * random.standard_normal()
                values[target, "-", cycle] = down[k] + scatter_down[k] * random.standard_normal()
        for name, figure in sd.positions.evaluate_positions(readings_of(values)).figures.items():
            found.setdefault(name, []).append(figure.value)
            assert figure.standard_uncertainty is not None
            stated.setdefault(name, []).append(figure.standard_uncertainty**2)
    for name in ("A", "A_up", "A_down", "E", "E_up", "E_down", "M", "B", "B_mean"):
        # A sample deviation of 1000 is known to 2.2 %. u(s) of GUM E.4.3 is 4 % high for 5 readings.
        ratio = math.sqrt(float(np.mean(stated[name]))) / float(np.std(found[name], ddof=1))
        assert ratio == pytest.approx(1.0, abs=0.09 if name[0] != "A" else 0.12), name


@pytest.mark.parametrize("targets", [(), (0.0,), (1.0, 0.0), (0.0, 0.0)])
def test_targets_that_do_not_ascend_are_refused(targets: tuple[float, ...]) -> None:
    refused(sd.positions.PositionReadings, targets, {}, names="targets: expected two or more different ones, ascending")


@pytest.mark.parametrize(
    ("key", "value"),
    [((5.0, "+", 1), 0.0), ((0.0, "*", 1), 0.0), ((0.0, "+", 1), math.nan), ((0.0, "+", 1), math.inf)],
)
def test_deviations_that_are_none_are_refused(key: tuple[float, str, int], value: float) -> None:
    refused(sd.positions.PositionReadings, (0.0, 1.0), {key: value}, names="deviations: expected a finite deviation")
