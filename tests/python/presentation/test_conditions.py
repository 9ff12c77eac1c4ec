"""The conditions that an evaluation used are told: temperatures with their ranges and origin, coefficients, air."""

from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

WARM = """
[temperature]
expansion_um_per_m_k = 11.5
u_expansion_um_per_m_k = 1.0
u_temperature_c = 0.1
axes_c = [22.0, 23.0, 24.0]
"""


def report(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    more: str,
    columns: dict[str, tuple[float, float]],
    method: str = "adjustment",
) -> str:
    """Of a run whose columns rise from the first number to the second."""
    (tmp_path / "scenario.toml").write_text(SCENARIO + more)
    run = sd.simulate(sd.read_scenario(tmp_path / "scenario.toml"))
    channels = {name: run.channels[name] for name in run.channels if not name.startswith("temperature")}
    channels |= {name: np.linspace(*ends, len(run)) for name, ends in columns.items()}
    run = sd.Measurement(run.line, run.point.tolist(), run.position, channels, run=run.run.tolist())
    run.write(tmp_path / "run.csv")
    files = [str(tmp_path / name) for name in ("scenario.toml", "run.csv", "calibration.csv")]
    main(["evaluate", *files[:2], "-o", files[2], "-m", method])
    return capsys.readouterr().out


@pytest.mark.parametrize("method", ["adjustment", "enhanced"])
def test_temperatures_of_the_scenario_are_told_with_the_coefficients(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], method: str
) -> None:
    said = report(tmp_path, capsys, WARM, {}, method)
    assert "scales: X 22.0 °C (axes_c), Y 23.0 °C (axes_c), Z 24.0 °C (axes_c)\n" in said
    assert "expansion stated: 11.5 ± 1 µm/(m·K), each sensor ± 0.1 K\n" in said


def test_recorded_temperatures_are_told_with_their_range_and_column(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = report(tmp_path, capsys, "", {"temperature": (20.0, 20.4)})
    assert "scales: X 20.0 to 20.4 °C (column temperature_c)" in said


def test_air_that_the_instrument_compensates_for_is_told_as_not_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = report(tmp_path, capsys, "", {"air_temperature": (19.5, 21.0), "air_pressure": (99000.0, 99500.0)})
    assert "air recorded: 19.5 to 21.0 °C, 990.0 to 995.0 hPa (not used: the instrument compensates)\n" in said


def test_where_nothing_was_recorded_nothing_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = report(tmp_path, capsys, "", {})
    assert "scales:" not in said
    assert "air recorded" not in said
