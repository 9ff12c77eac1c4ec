"""Words on temperatures: referred, as found, not known; what is at stake; what a part measures."""

from __future__ import annotations

import numpy as np
import pytest
from refusal import refused

import stepdiag as sd
from stepdiag.findings.temperature import (
    temperature_mark,
    temperature_text,
    temperature_warnings,
    workpiece_rows,
)

VOLUME = (800.0, 600.0, 500.0)


def calibration(**more: object) -> sd.Calibration:
    functions = {
        name: (np.array([0.0, edge]), np.array([0.0, 0.010]), np.array([0.0, 1e-3]))
        for name, edge in zip(("EXX", "EYY"), VOLUME, strict=False)
    }
    return sd.Calibration("adjustment", "[w X' b Y Z t]", VOLUME, (0.0, 0.0, 0.0), functions, **more)


def run_at(*temperatures: float) -> sd.Measurement:
    count = len(temperatures)
    return sd.Measurement(
        ["p00"] * count,
        list(range(count)),
        np.zeros((count, 3)),
        {"distance": np.arange(count, dtype=float), "temperature": np.array(temperatures)},
    )


def test_each_state_has_its_words() -> None:
    assert temperature_text(calibration(temperature_reference=20.0)) == "positioning errors are referred to 20 °C"
    known = calibration(temperature_reference=20.0, expansion=(11.46e-6, 8e-6, 11.46e-6), fixed_point=(0.0, 0.0, 0.0))
    assert temperature_text(known).endswith("20 °C, with scales that expand by 11.46, 8, 11.46 µm/(m·K)")
    found = calibration(temperature_as_found=(23.14, 23.0, 22.8))
    assert (
        temperature_text(found) == "positioning errors are as found, with the scales of X, Y, Z at 23.1, 23.0, 22.8 °C"
    )
    assert "no temperature was recorded" in temperature_text(calibration())
    assert "9.2 µm a kelvin on 800 mm" in temperature_text(calibration())


def test_figures_have_fewer_words() -> None:
    assert temperature_mark(calibration(temperature_reference=20.0)) == "referred to 20 °C"
    assert temperature_mark(calibration(temperature_as_found=(23.14, 23.0, 22.8))) == (
        "as found at X 23.1, Y 23.0, Z 22.8 °C"
    )
    assert temperature_mark(calibration(temperature_as_found=(23.1, 23.1, 23.1))) == "as found at 23.1 °C"
    assert temperature_mark(calibration()) == "temperature not recorded"


def test_comparison_of_different_temperatures_says_so() -> None:
    one, other = calibration(temperature_reference=20.0), calibration(temperature_as_found=(23.0, 23.0, 23.0))
    notes = sd.compare(one, other).notes
    assert (
        "temperatures differ: A referred to 20 °C, B as found at 23.0 °C; so positioning differs by the scales' "
        in ("\n".join(notes))
    )
    assert not any("temperature" in note for note in sd.compare(one, one).notes)


def test_the_size_at_stake_is_that_of_steel() -> None:
    """3.2 K x 11.5 um/(m K) x 0.8 m = 29 um, the issue's own figure."""
    found = calibration(temperature_as_found=(22.0, 22.0, 22.0))
    (warning,) = temperature_warnings(found, run_at(20.0, 23.2, np.nan))
    assert "up to 3.2 K from 20 °C" in warning
    assert "up to 29 µm on 800 mm of steel" in warning
    assert temperature_warnings(found, run_at(20.05, 19.96)) == []
    assert temperature_warnings(calibration(temperature_reference=20.0), run_at(25.0)) == []
    assert temperature_warnings(calibration(), run_at(np.nan)) == []


def test_a_part_shrinks_to_what_it_measures_at_20_degrees() -> None:
    """10 um too far, and 23 um/(m K) x 4 K x 0.8 m = 73.6 um of its own."""
    rows = list(workpiece_rows(calibration(temperature_reference=20.0), 23.0, 24.0))
    assert "with the scales at 20 °C" in rows[0]
    assert rows[1] == "  along X: -63.6 µm on 800 mm (+10 by the machine, -73.6 by its own temperature)"
    assert rows[3] == "  along Z: not known, as the slope of EZZ is not determined"


@pytest.mark.parametrize("ending", ["csv", "nc"])
def test_files_keep_the_temperature(ending: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / f"calibration.{ending}"
    calibration(temperature_reference=20.0).write(path)
    assert sd.read_calibration(path).temperature_reference == 20.0
    calibration(temperature_as_found=(23.1, 23.0, 22.8)).write(path)
    assert sd.read_calibration(path).temperature_as_found.tolist() == [23.1, 23.0, 22.8]
    assert sd.read_calibration(path).temperature_reference is None
    assert sd.read_calibration(path).expansion is None


@pytest.mark.parametrize("ending", ["csv", "nc"])
def test_files_keep_the_expansion_to_the_last_bit(ending: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / f"calibration.{ending}"
    expansion, fixed_point = (1.15e-5, 0.1 / 3.0 * 1e-4, -5e-8), (0.0, -40.5, 1e3 / 3.0)
    calibration(temperature_reference=20.0, expansion=expansion, fixed_point=fixed_point).write(path)
    read = sd.read_calibration(path)
    assert tuple(read.expansion) == expansion
    assert tuple(read.fixed_point) == fixed_point
    refused(calibration, names="expansion: expected a temperature_reference", expansion=expansion)
    refused(calibration, names="expansion coefficient", temperature_reference=20.0, expansion=(11.5, 11.5, 11.5))
