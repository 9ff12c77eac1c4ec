"""The figure of a comparison shows every difference, its band, and what is significant; from files as from Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from calibrations import calibrate, parts_of
from ink import ink, panel, texts
from matplotlib.collections import PolyCollection

import stepdiag as sd
from stepdiag.calibration.comparison import Comparison
from stepdiag.figures.comparison import draw_comparison
from stepdiag.io.comparison_read import read_comparison
from stepdiag.presentation.comparison import write_comparison


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    parts = parts_of(calibrate(2))
    parts["functions"]["EXX"][1][3] += 5e-3
    del parts["functions"]["EZZ"]
    return sd.compare(calibrate(1), sd.Calibration(**parts))


def test_differences_bands_and_significance(comparison: Comparison) -> None:
    figure = draw_comparison(comparison)
    assert all(count > 60 for name, count in ink(figure).items() if name not in ("EZZ", "squarenesses"))
    (exx,) = [d for d in comparison.differences if d.parameter == "EXX"]
    axes = panel(figure, "EXX")
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 1e3 * exx.value, rtol=1e-15)
    (band,) = [c for c in axes.collections if isinstance(c, PolyCollection)]
    y = band.get_paths()[0].vertices
    half = 1.959963984540054 * exx.standard_uncertainty[2] * 1e3
    own = y[y[:, 0] == exx.position[2], 1]
    assert np.ptp(own) == pytest.approx(2.0 * half, rel=1e-9)  # differences of values of 1 µm lose few digits
    (mark,) = [line for line in axes.lines if line.get_gid() == "significant-EXX"]
    assert mark.get_xdata().tolist() == [exx.position[3]]
    assert [text.get_text() for text in panel(figure, "EZZ").texts] == ["only in A"]


@pytest.mark.parametrize("name", ["c.csv", "c.nc"])
def test_file_gives_the_same_differences(comparison: Comparison, name: str, tmp_path: Path) -> None:
    write_comparison(comparison, tmp_path / name)
    stored = read_comparison(tmp_path / name)
    assert stored.threshold == comparison.threshold
    assert [d.parameter for d in stored.differences] == [d.parameter for d in comparison.differences]
    for one, other in zip(stored.differences, comparison.differences, strict=True):
        for values in ("position", "value", "standard_uncertainty"):
            # CSV: µm and back
            np.testing.assert_allclose(getattr(one, values), getattr(other, values), rtol=1e-15, atol=0.0)
    figure = draw_comparison(stored)
    assert {line.get_gid() for axes in figure.axes for line in axes.lines} >= {"significant-EXX"}


@pytest.mark.parametrize("name", [None, "c.csv", "c.nc"])
def test_heading_says_for_which_temperature_both_are(name: str | None, tmp_path: Path) -> None:
    parts = parts_of(calibrate(2)) | {"date": ""}
    made = {"temperature_reference": 20.0}, {"temperature_as_found": (23.1, 23.0, 22.8)}
    drawn = sd.compare(*(sd.Calibration(**parts, **temperature) for temperature in made))
    if name is not None:
        write_comparison(drawn, tmp_path / name)
        drawn = read_comparison(tmp_path / name)
    (facts,) = [text for text in texts(draw_comparison(drawn)) if text.startswith("A: ")]
    assert facts.startswith("A: adjustment referred to 20 °C; B: adjustment as found at X 23.1, Y 23.0, Z 22.8 °C; ")


BAD = [
    ("# limit=0.05\n", "", "limit and values: expected two numbers"),
    ("# limit=0.05\n", "# limit=2\n", "limit: expected a probability between 0 and 1, got 2"),
    (
        "# format=stepdiag comparison 1\n",
        "# format=stepdiag comparison 2\n",
        'format: expected "stepdiag comparison 1"',
    ),
    (",um,", ",mm,", r"line \d+: unit: expected um for EXX, got 'mm'"),
    ("EXX,0.0,0.0", "EXX,0.0,zero", r"line \d+: difference: expected a finite number, got 'zero'"),
    ("EXX,0.0,0.0", "EXX,0.0,", r"line \d+: difference: expected a number, got an empty field"),
    ("EXX,0.0,0.0", "EXX,1e3,0.0", "EXX: expected positions that ascend"),
    ("EXX,0.0,0.0", "EXQ,0.0,0.0", r"line \d+: parameter: expected EXX ... ECZ, C0Y, B0Z or A0Z, got 'EXQ'"),
    (",difference,", ",delta,", r"line \d+: expected the column difference"),
    ("# volume_mm=", "# volume_mm=1 ", "volume_mm: expected three numbers"),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_bad_files_are_refused(comparison: Comparison, old: str, new: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    write_comparison(comparison, file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(sd.InvalidArgument, match=f"^{file}.*{message}"):
        read_comparison(file)


def test_comparison_with_a_rejected_fit_is_marked() -> None:
    rejected = calibrate(2).judged("rejected")
    assert "FIT REJECTED: DO NOT USE" in texts(sd.compare(calibrate(1), rejected).plot())
    assert "FIT REJECTED: DO NOT USE" not in texts(sd.compare(calibrate(1), calibrate(2)).plot())
