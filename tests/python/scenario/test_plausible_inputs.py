"""Inputs that no workshop has: refused with what they look like, or told, and then the fit is at best doubtful."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.scenario.description import implausible_inputs, parse_scenario
from stepdiag.scenario.plausible_inputs import standard_atmosphere

NOISE = "\n[noise]\ndistance_um = 0.1\ntilt_urad = 1.0\n"
PLAIN = SCENARIO.split("[misalignment]")[0] + NOISE
SCALES = "\n[temperature]\nexpansion_um_per_m_k = 11.5\nu_expansion_um_per_m_k = 1.0\nu_temperature_c = 0.1\n"


def run_with(channels: dict[str, float | np.ndarray], text: str = PLAIN) -> tuple[sd.Scenario, sd.Measurement]:
    scenario = parse_scenario(text)
    run = sd.simulate(scenario)
    columns = {name: np.broadcast_to(values, len(run)).astype(float) for name, values in channels.items()}
    return scenario, sd.Measurement(run.line, run.point, run.position, {**run.channels, **columns}, run=run.run)


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ({"temperature": 0.0}, "0 °C in every row: the sensor says nothing"),
        ({"temperature_x": 85.0, "temperature_y": 21.0, "temperature_z": 21.0}, "temperature_x_c.*85 °C in every row"),
        ({"temperature": -127.0}, "-127 °C in every row"),
        ({"temperature": 71.6}, r"looks like °F \(22 °C\)"),
        ({"temperature": 295.15}, r"looks like K \(22 °C\)"),
        ({"temperature": 220.0}, r"looks like tenths of a degree \(22 °C\)"),
        ({"air_temperature": 70.7}, r"air_temperature_c.*looks like °F \(21.5 °C\)"),
        ({"air_pressure": 2990.0}, r"looks like inHg \(1013 hPa\)"),
        ({"air_pressure": 10_130.0}, r"looks like kPa \(1013 hPa\)"),
        ({"air_pressure": 10_130_000.0}, r"looks like Pa \(1013 hPa\)"),
        ({"air_humidity": 0.0062}, r"look like a fraction \(62 %\)"),
    ],
)
def test_a_column_that_no_workshop_has_is_refused_with_what_it_looks_like(
    channels: dict[str, float], words: str
) -> None:
    scenario, run = run_with(channels)
    with pytest.raises(sd.InvalidArgument, match=words):
        sd.methods.adjust_scenario(scenario, run)
    with pytest.raises(sd.InvalidArgument, match=words):
        sd.methods.evaluate_scenario(scenario, run, method="enhanced")


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ({"temperature": 45.0}, "temperature_c.* is 45 °C.* where 10 to 40 °C is plausible"),
        ({"temperature": 55.0}, r"looks like °F \(12.78 °C\)"),
        ({"air_pressure": 75_700.0}, r"looks like mmHg \(1009 hPa\), or is that of a place at 2400 m"),
        (
            {"temperature_x": 20.0, "temperature_y": 31.0, "temperature_z": 21.0},
            "difference of the axes' sensors.* 11 K",
        ),
    ],
)
def test_a_column_beyond_the_inner_limits_is_told_and_the_fit_is_at_best_doubtful(
    channels: dict[str, float], words: str
) -> None:
    scenario, run = run_with(channels)
    assert sd.methods.adjust_scenario(*run_with({})).verdict.fit == "accepted"
    adjustment = sd.methods.adjust_scenario(scenario, run)
    assert adjustment.verdict.fit == adjustment.calibration.fit == "doubtful"
    assert [reason.finding for reason in adjustment.verdict.reasons] == ["implausible_input"]
    assert re.search(words, adjustment.calibration.fit_reasons[0])
    linear = sd.methods.evaluate_scenario(scenario, run, method="enhanced")
    assert linear.fit in ("doubtful", "rejected")
    assert re.search(words, linear.fit_reasons[-1])


def test_one_reading_of_a_broken_sensor_is_refused_by_its_place() -> None:
    values = np.full(len(run_with({})[1]), 21.0)
    values[7] = 85.0
    scenario, run = run_with({"temperature": values})
    with pytest.raises(sd.InvalidArgument, match=rf"{run.line[7]} point {run.point[7]}: .* got 85 °C; a sensor that"):
        sd.methods.adjust_scenario(scenario, run)


def test_a_jump_of_temperature_between_neighbouring_readings_is_told() -> None:
    values = np.full(len(run_with({})[1]), 21.0)
    values[5:] += 3.0
    (sentence,) = implausible_inputs(*run_with({"temperature": values}))
    assert "the change from the reading before" in sentence
    assert "is 3 K" in sentence


@pytest.mark.parametrize(
    ("step", "words"),
    [(4.0, None), (4000.0, "times in ms"), (0.004, "from the reading before"), (0.0, "is 0 s")],
)
def test_times_in_another_unit_are_told(step: float, words: str | None) -> None:
    scenario, run = run_with({})
    scenario, run = run_with({"time": step * np.arange(len(run))})
    found = implausible_inputs(scenario, run)
    assert bool(found) == (words is not None)
    assert words is None or words in found[0]


def test_a_clock_that_goes_back_is_told() -> None:
    times = 4.0 * np.arange(len(run_with({})[1]))
    times[3:] -= 3600.0
    (sentence,) = implausible_inputs(*run_with({"time": times}))
    assert "is -3596 s" in sentence


def test_the_order_of_rows_is_not_that_of_time() -> None:
    scenario, run = run_with({"time": 4.0 * np.arange(len(run_with({})[1]))})
    rows = np.argsort([f"{line} {point}" for line, point in zip(run.line, run.point, strict=True)], kind="stable")
    mixed = sd.Measurement(
        [run.line[row] for row in rows],
        [run.point[row] for row in rows],
        run.position[rows],
        {name: values[rows] for name, values in run.channels.items()},
    )
    assert implausible_inputs(scenario, mixed) == []


@pytest.mark.parametrize(
    ("section", "words"),
    [
        (SCALES.replace("11.5", "-11.5"), r"temperature.expansion_um_per_m_k: .*looks like the wrong sign \(11.5"),
        (SCALES.replace("11.5", "0.0115"), r"looks like mm/\(m K\) \(11.5 .*low_expansion"),
        (SCALES.replace("11.5", "0.0"), "low_expansion = true"),
        (SCALES + "reference_c = 68.0\n", r"temperature.reference_c: .*looks like °F \(20 °C\)"),
        (SCALES + "axes_c = 71.6\n", r"temperature.axes_c: .*looks like °F \(22 °C\)"),
        ("\n[environment]\nrefractive_index = 1.33\n", "expected 1.00015 to 1.0004, got 1.33"),
        ("\n[environment]\ntemperature_c = 70.0\n", r"looks like °F"),
        (
            '\n[environment]\nreadings = "constant_index"\n[environment.assumed]\ntemperature_c = 70.0\n',
            "looks like °F",
        ),
    ],
)
def test_a_scenario_that_no_workshop_has_is_refused(section: str, words: str) -> None:
    with pytest.raises(sd.InvalidArgument, match=words) as refused:
        parse_scenario(PLAIN + section, "mine.toml")
    assert str(refused.value).startswith("mine.toml: ")


def test_a_wavelength_in_micrometres_is_refused() -> None:
    with pytest.raises(sd.InvalidArgument, match=r"head.wavelength_nm: .*looks like µm \(633 nm\)"):
        parse_scenario(PLAIN.replace("[head]", "[head]\nwavelength_nm = 0.633"))


def test_scales_that_hardly_expand_say_so() -> None:
    scenario = parse_scenario(PLAIN + SCALES.replace("11.5", "0.02") + "low_expansion = true\n")
    assert scenario.known.implausible == ()
    assert parse_scenario(PLAIN + SCALES.replace("11.5", "30.0")).known.implausible[0].startswith("temperature.expans")


def test_an_assumed_humidity_that_looks_like_a_fraction_is_told() -> None:
    air = '\n[environment]\nreadings = "constant_index"\n[environment.assumed]\nhumidity_percent = {}\n'
    (sentence,) = parse_scenario(PLAIN + air.format(0.62)).known.implausible
    assert "humidity_percent is 0.62 %, which looks like a fraction (62 %)" in sentence
    assert parse_scenario(PLAIN + air.format(62.0)).known.implausible == ()


def test_an_index_of_exactly_one_counts_in_vacuum_wavelengths() -> None:
    assert parse_scenario(PLAIN + "\n[environment]\nrefractive_index = 1.0\n").known.implausible == ()


def test_pressures_go_with_the_altitude() -> None:
    """ISO 2533: 845.6 hPa at 1,500 m, 756.3 at 2,400 m."""
    assert standard_atmosphere(1500.0) == pytest.approx(845.6, abs=0.1)
    assert standard_atmosphere(2400.0) == pytest.approx(756.3, abs=0.1)
    high = PLAIN + "\n[environment]\naltitude_m = {}\n"
    assert implausible_inputs(*run_with({"air_pressure": 75_700.0}, high.format(2400.0))) == []
    (sentence,) = implausible_inputs(*run_with({"air_pressure": 101_300.0}, high.format(1500.0)))
    assert "reduced to sea level" in sentence


def test_stated_limits_take_the_place_of_the_default_ones() -> None:
    cold = PLAIN + "\n[plausible.inputs]\nscale_temperature_c = {inner = [-20, 30]}\n"
    assert implausible_inputs(*run_with({"temperature": 0.0}, cold)) == []
    assert implausible_inputs(*run_with({"temperature": -15.0}, cold)) == []
    narrow = PLAIN + "\n[plausible.inputs]\nscale_temperature_c = {outer = [18, 22], inner = [19, 21]}\n"
    with pytest.raises(sd.InvalidArgument, match=r"expected 18 to 22 °C, got 22\.5 °C"):
        sd.methods.adjust_scenario(*run_with({"temperature": 22.5}, narrow))
    dry = PLAIN + "\n[plausible.inputs]\nair_humidity_percent = {inner = [0, 100]}\n"
    assert implausible_inputs(*run_with({"air_humidity": 0.0062}, dry)) == []


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ("3", "inputs.reference_c: expected {inner = .*, got 3"),
        ("{inner = [20]}", "inputs.reference_c.inner: expected two numbers"),
        ("{inner = [21, 20]}", "the lower one first"),
        ("{iner = [20, 20]}", "inputs.reference_c.iner: unknown key; did you mean inner"),
        ("{inner = [10, 20], outer = [15, 30]}", "inner: expected numbers within outer"),
    ],
)
def test_limits_that_are_none_are_refused(stated: str, words: str) -> None:
    with pytest.raises(sd.InvalidArgument, match=words):
        parse_scenario(PLAIN + f"\n[plausible.inputs]\nreference_c = {stated}\n")


def test_commands_warn_or_end_with_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    _, run = run_with({"temperature": 45.0})
    Path("s.toml").write_text(PLAIN)
    run.write("run.csv")
    assert main(["evaluate", "s.toml", "run.csv", "-o", "c.csv"]) == 0
    said = capsys.readouterr()
    assert "warning: run.csv: column temperature_c" in said.err
    assert said.out.startswith("fit: doubtful: column temperature_c")
    assert "fit=doubtful" in Path("c.csv").read_text()
    main(["check", "run.csv"])
    assert "45 °C" in capsys.readouterr().out
    main(["check", "s.toml", "run.csv"])
    assert "doubtful" in capsys.readouterr().out
    odd = PLAIN + SCALES + "reference_c = 22.0\n"
    Path("odd.toml").write_text(odd)
    Path("far.toml").write_text(odd.replace("22.0", "68.0"))
    assert main(["evaluate", "odd.toml", "run.csv", "-o", "c.csv"]) == 0
    said = capsys.readouterr()
    assert "warning: odd.toml: temperature.reference_c is 22 °C" in said.err
    assert "warning: run.csv: column temperature_c" in said.err
    for name, *others in (["check"], ["simulate", "-o", "r.csv"], ["observe", "--steps", "4"], ["nc", "-o", "p.ngc"]):
        assert main([name, "odd.toml", *others]) == 0
        said = capsys.readouterr()
        assert "temperature.reference_c is 22 °C, where 20 °C is plausible" in said.out + said.err
        assert main([name, "far.toml", *others]) == 2
        assert "looks like °F (20 °C)" in capsys.readouterr().err
