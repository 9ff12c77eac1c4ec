"""The command compare: its report, its files, and mistakes in a line."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from calibrations import calibrate, parts_of
from json_objects import printed
from systems import with_slashes

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.parameters import FUNCTIONS


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    calibrate(1, method="enhanced").dated("2026-01-02T03:04:05Z").write("a.csv")
    parts = parts_of(calibrate(2, full_covariance=True))
    parts["functions"]["EXX"][1][3] += 5e-3
    sd.Calibration(**parts).write("b.nc")
    return tmp_path


def test_command_tells_methods_dates_and_marks_what_is_significant(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", "a.csv", "b.nc"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "A: a.csv: enhanced, 2026-01-02T03:04:05Z, temperature not recorded"
    assert said[1].startswith("B: b.nc: adjustment, 2026-11-21T")
    assert {line.split()[0] for line in said if line.endswith("significant")} == {"EXX"}
    assert any("Bonferroni" in line for line in said)
    assert any("as if A and B were independent" in line for line in said)
    table = said[said.index("differences by parameter") :]
    assert sum(line[2:5] in FUNCTIONS for line in table) == 18


def test_command_with_a_small_limit_marks_nothing(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "a.csv", "b.nc", "--limit", "1e-300"]) == 0
    assert "significant: 0 of 21 parameters" in capsys.readouterr().out


def test_differences_are_written(here: Path) -> None:
    assert main(["compare", "a.csv", "b.nc", "-o", "differences.csv"]) == 0
    assert main(["compare", "a.csv", "b.nc", "-o", "differences.nc"]) == 0
    comparison = sd.compare(sd.read_calibration("a.csv"), sd.read_calibration("b.nc"))
    lines = Path("differences.csv").read_text().splitlines()
    assert "# date_a=2026-01-02T03:04:05Z" in lines
    rows = [line.split(",") for line in lines if not line.startswith("#")]
    assert rows[0][:4] == ["parameter", "position_mm", "difference", "unit"]
    with xr.open_dataset("differences.nc") as table:
        for difference in comparison.differences:
            name = difference.parameter
            mine = [row for row in rows if row[0] == name]
            scale = {"um": 1e-3, "urad": 1e-6}[mine[0][3]]
            # The power of ten is moved exactly in the text, and then multiplied here.
            np.testing.assert_allclose([float(row[2]) * scale for row in mine], difference.value, rtol=1e-15)
            np.testing.assert_array_equal(np.atleast_1d(table[f"{name}_difference"]), difference.value)
            np.testing.assert_array_equal(np.atleast_1d(table[f"{name}_difference_u"]), difference.standard_uncertainty)
            assert (
                table[f"{name}_difference"].attrs["significant"] == str(comparison.is_significant(difference)).lower()
            )
        assert table.attrs["method_a"] == "enhanced"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.csv"], "Missing argument 'B'"),
        (["a.csv", "absent.nc"], "absent.nc: cannot be read"),
        (["a.csv", "other.csv"], "a.csv, other.csv: the chains differ"),
        (["a.csv", "b.nc", "-o", "b.nc"], "b.nc: is also an input"),
        (["a.csv", "b.nc", "-o", "no/such.csv"], "no/such.csv: cannot be written"),
        (["a.csv", "b.nc", "--limit", "2"], "--limit: expected a probability between 0 and 1, got 2"),
        (["map.csv", "map.csv"], "map.csv, map.csv: expected one calibration at least, got two error maps"),
    ],
)
def test_mistakes_of_a_comparison_are_told_in_a_line(
    here: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("map.csv").write_text("parameter,position_mm,value,unit,standard_uncertainty\nEXX,0,0,um,\n")
    sd.Calibration(**(parts_of(calibrate(1)) | {"chain": "[w b X Y Z t]"})).write("other.csv")
    before = {path.name: path.read_bytes() for path in here.iterdir()}
    assert main(["compare", *arguments]) == 2
    said = with_slashes(capsys.readouterr().err)
    assert message in said
    assert said.count("\n") == 1
    assert {path.name: path.read_bytes() for path in here.iterdir()} == before


def test_volume_before_and_after_stands_before_the_parameters(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "a.csv", "b.nc"]) == 0
    said = capsys.readouterr().out.splitlines()
    change = sd.volume_change(sd.compare(sd.read_calibration("a.csv"), sd.read_calibration("b.nc")))
    (largest,) = (line.split() for line in said if line.startswith("  largest "))
    assert largest[1:4] == [
        f"{value * 1e3:.4g}" for value in (change.largest.a, change.largest.b, change.largest.change)
    ]
    assert "no verdict: no covariance of A (write it as .nc)" in said
    first = said[said.index(next(line for line in said if "by one difference alone" in line)) + 1].split()
    assert first == [
        "EXX",
        f"{change.effects[0].largest * 1e3:.4g}",
        f"{change.effects[0].rms * 1e3:.4g}",
        "µm",
        "significant",
    ]


def test_calibration_is_compared_with_the_truth(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = sd.random_error_map((80.0, 60.0, 50.0), seed=3, intervals=5)
    truth.write("truth.csv")
    calibrate(1, full_covariance=True).write("c.nc")
    assert main(["compare", "c.nc", "truth.csv"]) == 0
    said = capsys.readouterr().out.splitlines()
    agreement = sd.compare(sd.read_calibration("c.nc"), truth).agreement
    assert agreement is not None
    assert said[1] == "B: truth.csv: error map, date not known"
    assert any(
        line.startswith(f"agreement with the error map: {agreement.beyond_two} of 87 values beyond 2 u")
        for line in said
    )
    assert any(line.startswith(f"chi-square: {agreement.chi_square:.4g} with 87 degrees of freedom") for line in said)
    found = printed("comparison", capsys, "compare", "truth.csv", "c.nc")
    assert found["agreement"]["chi_square"] == pytest.approx(agreement.chi_square, rel=1e-12)
    assert found["volume"]["largest"]["verdict"] is None
    assert found["volume"]["no_verdict_because"] == "one of the two is an error map"
    assert found["a"]["method"] == "error map"
