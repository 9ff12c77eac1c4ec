"""The instrument's scale and its sensors of the air in an adjustment: what is stated of them enters the uncertainties
as readings that are all longer by this part would change the values, and a known scale is corrected."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.parameters import FUNCTIONS, SQUARENESSES
from stepdiag.scenario.description import adjustment_options, parse_scenario
from stepdiag.scenario.planned_readings import with_channels
from stepdiag.uncertainty.virtual_calibrations import virtual_calibrations

LARGE = (
    SCENARIO.replace("x_mm = 80.0", "x_mm = 800.0")
    .replace("y_mm = 60.0", "y_mm = 600.0")
    .replace("z_mm = 50.0", "z_mm = 500.0")
)
STEEL = """
[temperature]
expansion_um_per_m_k = 11.5
u_expansion_um_per_m_k = 1.0
u_temperature_c = 0.1
axes_c = 23.0
"""


def instrument(**keys: float) -> str:
    return "\n[instrument]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())


def adjusted(
    text: str, run: sd.Measurement | None = None, *, full_covariance: bool = True
) -> tuple[sd.Calibration, sd.Measurement]:
    scenario = parse_scenario(text)
    run = sd.simulate(scenario) if run is None else run
    return sd.methods.adjust_scenario(scenario, run, full_covariance=full_covariance).calibration, run


def longer(run: sd.Measurement, part: float) -> sd.Measurement:
    return with_channels(run, {name: run.channels[name] * (1.0 + part) for name in run.channels if name[0] == "d"})


def values_of(calibration: sd.Calibration) -> np.ndarray:
    """In the order of the covariance."""
    tables = [calibration.functions[name][1] for name in FUNCTIONS]
    return np.concatenate([*tables, [calibration.squareness[name][0] for name in SQUARENESSES]])


def uncertainties_of(calibration: sd.Calibration) -> np.ndarray:
    tables = [calibration.functions[name][2] for name in FUNCTIONS]
    return np.concatenate([*tables, [calibration.squareness[name][1] for name in SQUARENESSES]])


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_a_stated_scale_adds_what_longer_readings_change(layout: str) -> None:
    """Against two evaluations whose distances differ by 2 ppm: the covariance gains the product of what changes."""
    more = {"ideal": "", "psd": "\npsd_distance_mm = 100.0"}.get(
        layout, "\nbeam_offsets_mm = [[10.0, 0.0], [-5.0, 8.7], [-5.0, -8.7]]"
    )
    text, u = LARGE.replace('layout = "ideal"', f'layout = "{layout}"{more}'), 0.5e-6
    alone, run = adjusted(text)
    stated, _ = adjusted(text + instrument(u_scale_ppm=0.5), run)
    changed = (
        values_of(adjusted(text, longer(run, 1e-6))[0]) - values_of(adjusted(text, longer(run, -1e-6))[0])
    ) / 2e-6
    expected = np.sqrt(uncertainties_of(alone) ** 2 + (u * changed) ** 2)
    # 1e-11 mm of rounding in a difference of 1e-3 mm.
    assert uncertainties_of(stated) == pytest.approx(expected, rel=1e-6)
    gained = stated.covariance - alone.covariance
    assert gained == pytest.approx(u**2 * np.outer(changed, changed), abs=1e-5 * np.max(np.abs(gained)))
    assert values_of(stated).tobytes() == values_of(alone).tobytes()
    assert stated.uncertainty_parts["scale"] == pytest.approx(
        np.abs(u * changed), abs=1e-6 * np.max(np.abs(u * changed))
    )


@pytest.mark.parametrize(("name", "travel"), [("EXX", 800.0), ("EYY", 600.0), ("EZZ", 500.0)])
def test_at_the_end_of_an_axis_it_is_its_length_times_the_scale(name: str, travel: float) -> None:
    """To the machine's own errors, some 20 um of the axis."""
    alone, run = adjusted(LARGE)
    stated, _ = adjusted(LARGE + instrument(u_scale_ppm=2.0), run)
    u = np.hypot(alone.functions[name][2][-1], 2e-6 * travel)
    assert stated.functions[name][2][-1] == pytest.approx(u, rel=1e-4)


def edlen_index(temperature: float, pressure: float, humidity: float, wavelength: float) -> float:
    """Birch and Downs (Metrologia 31 (1994) 315), with Magnus' formula for the vapour; °C, Pa, 1, nm."""
    s = 1e6 / wavelength**2
    dispersion = 1e-8 * (8342.54 + 2406147.0 / (130.0 - s) + 15998.0 / (38.9 - s))
    air = pressure * dispersion / 96095.43
    air *= (1.0 + 1e-8 * (0.601 - 0.00972 * temperature) * pressure) / (1.0 + 0.0036610 * temperature)
    vapour = humidity * 611.2 * np.exp(17.62 * temperature / (243.12 + temperature))
    return float(1.0 + air - vapour * (3.7345 - 0.0401 * s) * 1e-10)


AIR = {
    "u_air_temperature_c": ((1.0, 0.0, 0.0), 0.93),
    "u_air_pressure_hpa": ((0.0, 100.0, 0.0), 0.27),
    "u_air_humidity_percent": ((0.0, 0.0, 0.01), 0.0085),
}


@pytest.mark.parametrize("key", AIR)
@pytest.mark.parametrize("pressure", [1013.25, 850.0])
def test_a_sensor_of_the_air_counts_as_the_index_changes(key: str, pressure: float) -> None:
    """By one unit of each; at 850 hPa, which the run records, less for the temperature. Two formulas of the index
    differ by 1 % in their derivatives."""
    alone, run = adjusted(LARGE)
    state = (20.0, 100.0 * pressure, 0.5)
    run = with_channels(run, {"air_pressure": np.full(len(run), state[1])})
    stated, _ = adjusted(LARGE + instrument(**{key: 1.0}), run)
    step, usual = AIR[key]
    there, here = (edlen_index(*np.add(state, np.multiply(sign, step)), 1530.0) for sign in (0.5, -0.5))
    found = np.sqrt(stated.functions["EXX"][2][-1] ** 2 - alone.functions["EXX"][2][-1] ** 2) / 800.0
    assert found == pytest.approx(abs(there - here), rel=0.015)
    if pressure == 1013.25:
        assert found == pytest.approx(usual * 1e-6, rel=0.03)


def test_independent_sensors_of_the_air_add_as_squares() -> None:
    def part(**keys: float) -> float:
        return adjustment_options(parse_scenario(LARGE + instrument(**keys)).known).air_index_uncertainty

    parts = [part(u_air_temperature_c=0.3), part(u_air_pressure_hpa=0.7), part(u_air_humidity_percent=8.0)]
    every = part(u_air_temperature_c=0.3, u_air_pressure_hpa=0.7, u_air_humidity_percent=8.0)
    assert every == pytest.approx(np.linalg.norm(parts), rel=1e-12)
    assert part(u_air_temperature_c=0.0) == 0.0


def test_a_known_scale_is_corrected_in_every_method() -> None:
    """A simulated instrument that reads 50 ppm too much gives the calibration of a perfect one, to rounding."""
    quiet = LARGE.replace("distance_um = 0.1", "distance_um = 0.0")
    perfect = sd.simulate(parse_scenario(quiet))
    wrong = parse_scenario(quiet + instrument(scale_ppm=50.0))
    run = sd.simulate(wrong)
    assert run.channels["distance"] == pytest.approx(perfect.channels["distance"] * 1.00005, rel=1e-15)
    for method in ("adjustment", "enhanced"):
        expected = sd.methods.evaluate_scenario(parse_scenario(quiet), perfect, method=method)
        found = sd.methods.evaluate_scenario(wrong, run, method=method)
        assert values_of(found) == pytest.approx(values_of(expected), abs=1e-9)
        uncorrected = sd.methods.evaluate_scenario(parse_scenario(quiet), run, method=method)
        off = uncorrected.functions["EXX"][1][-1] - expected.functions["EXX"][1][-1]
        assert off == pytest.approx(50e-6 * 800.0, rel=1e-3)


def test_nothing_stated_changes_no_number() -> None:
    alone, run = adjusted(LARGE)
    zero, _ = adjusted(LARGE + instrument(scale_ppm=0.0, u_scale_ppm=0.0, u_air_temperature_c=0.0), run)
    assert alone.covariance.tobytes() == zero.covariance.tobytes()
    assert uncertainties_of(alone).tobytes() == uncertainties_of(zero).tobytes()


def test_virtual_calibrations_scatter_by_what_the_adjustment_states() -> None:
    keys = {"u_scale_ppm": 0.8, "u_air_temperature_c": 0.4, "u_air_pressure_hpa": 1.0, "u_air_humidity_percent": 9.0}

    def propagated(text: str) -> tuple[float, dict[str, np.ndarray]]:
        of = virtual_calibrations(parse_scenario(text), seed=1)
        places = [(output.name, output.position) for output in of.outputs]
        found = sd.montecarlo.propagate(of)
        return float(found.standard_uncertainty[places.index(("EXX", 800.0))]), dict(found.budget)

    alone, run = adjusted(LARGE)
    stated, _ = adjusted(LARGE + instrument(**keys), run)
    (more, budget), (less, _) = propagated(LARGE + instrument(**keys)), propagated(LARGE)
    gained = stated.functions["EXX"][2][-1] ** 2 - alone.functions["EXX"][2][-1] ** 2
    assert more**2 - less**2 == pytest.approx(gained, rel=1e-3)
    assert {"air"} <= set(budget)


def test_the_budget_adds_up_and_says_what_is_not_stated() -> None:
    stated, _ = adjusted(LARGE + STEEL + instrument(u_scale_ppm=0.5))
    parts = stated.uncertainty_parts
    end = stated.covariance_labels.index(("EXX", 800.0))
    # 0.5 ppm of 800 mm; 1 ppm/K of 800 mm and 3 K, with 11.5 ppm/K of 0.1 K.
    assert parts["scale"][end] == pytest.approx(0.4e-3, rel=1e-3)
    assert parts["temperature"][end] == pytest.approx(np.hypot(2.4e-3, 0.92e-3), rel=1e-3)
    assert "EXX at 800 mm" in stated.budget
    assert "instrument's scale 0.4 µm, temperature 2.6 µm, air not stated; between nodes" in stated.budget
    nothing, _ = adjusted(LARGE)
    assert "instrument's scale not stated, temperature not stated, air not stated" in nothing.budget
    assert nothing.uncertainty_parts == {}


def test_a_linear_method_says_that_it_counts_noise_alone() -> None:
    scenario = parse_scenario(LARGE + instrument(u_scale_ppm=0.5))
    found = sd.methods.evaluate_scenario(scenario, sd.simulate(scenario), method="enhanced")
    assert "instrument's scale not counted by this method" in found.budget


@pytest.mark.parametrize("ending", ["csv", "nc"])
def test_file_and_object_have_conditions_and_budget(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], ending: str
) -> None:
    """And the page, the report of a file, and its exports know them."""
    text = LARGE + STEEL + instrument(scale_ppm=1.5, u_scale_ppm=0.5, u_air_pressure_hpa=2.0)
    (tmp_path / "s.toml").write_text(text)
    sd.simulate(parse_scenario(text)).write(tmp_path / "run.csv")
    calibration = tmp_path / f"c.{ending}"
    main(["evaluate", str(tmp_path / "s.toml"), str(tmp_path / "run.csv"), "-o", str(calibration), "--json"])
    found = json.loads(capsys.readouterr().out)
    conditions, budget = found["conditions"], found["budget"]
    scale = conditions["scales"][0]
    assert (scale["axis"], scale["temperature"]["value"], scale["origin"]) == (
        "X",
        [23.0, 23.0],
        "column temperature_c",
    )
    assert conditions["expansion"]["coefficient"]["standard_uncertainty"] == [1.0] * 3
    assert conditions["instrument"]["scale"] == {"value": 1.5, "unit": "ppm", "standard_uncertainty": 0.5}
    assert conditions["instrument"]["u_air_temperature"]["reason"] == "not stated"
    assert conditions["air_temperature"]["reason"] == "not recorded"
    assert budget["parameter"] == "EXX"
    parts = [budget[name]["value"] for name in ("noise", "scale", "temperature", "air")]
    assert np.linalg.norm(parts) == pytest.approx(budget["standard_uncertainty"]["value"], rel=1e-9)
    assert budget["scale"]["value"] == pytest.approx(0.4, rel=1e-3)
    read = sd.read_calibration(calibration)
    assert read.conditions == found["calibration"]["conditions"]
    assert read.budget == found["calibration"]["budget"]
    said = "instrument stated: distance scale corrected by 1.5 ppm, ± 0.5 ppm; sensors of the air ± 2 hPa"
    assert said in read.conditions
    main(["report", str(calibration), "-o", str(tmp_path / "page.html")])
    page = (tmp_path / "page.html").read_text()
    assert "Conditions used" in page
    assert "distance scale corrected by 1.5 ppm" in page
    assert read.budget.removeprefix("l") in page


def test_the_index_of_recorded_air_is_told(tmp_path: Path) -> None:
    """Where it is used for the distances; by the formula of another author, to 2e-8."""
    text = (
        LARGE + '\n[environment]\nreadings = "constant_index"\ntemperature_c = 23.0\nassumed = {temperature_c = 20.0}\n'
    )
    scenario = parse_scenario(text)
    run = sd.simulate(scenario)
    run = with_channels(run, {"air_temperature": np.linspace(22.0, 24.0, len(run))})
    (row,) = [
        row for row in sd.methods.evaluate_scenario(scenario, run).conditions if row.startswith("index of that air")
    ]
    told = [float(word.rstrip(",")) for word in row.split() if word.startswith("1.000")]
    air = [edlen_index(t, 101325.0, 0.5, 1530.0) for t in (24.0, 22.0, 20.0)]
    assert told == pytest.approx(air, abs=5e-8)


def test_a_relative_uncertainty_that_is_none_is_refused() -> None:
    scenario = parse_scenario(LARGE)
    run = sd.simulate(scenario)
    known = scenario.known
    for name in ("distance_scale_uncertainty", "air_index_uncertainty"):
        for wrong in (-1e-6, 1.0, float("nan")):
            with pytest.raises(sd.InvalidArgument, match=f"adjustment {name}: expected a part of at least 0"):
                sd.methods.adjust(run, known.plan, known.head, known.chain, known.tool, **{name: wrong})
