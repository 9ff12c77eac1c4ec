"""What `stepdiag evaluate` says of an adjustment: fit, outliers, set-up, and the method's own notes."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.presentation.setup_table import concise

NOISY = SCENARIO.replace("steps = 5", "steps = 20").replace("seed = 3", "tilt_urad = 1.0\nseed = 3")


def report(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, run: sd.Measurement, *options: str) -> str:
    (tmp_path / "scenario.toml").write_text(text)
    run.write(tmp_path / "run.csv")
    files = [str(tmp_path / name) for name in ("scenario.toml", "run.csv", "calibration.csv")]
    assert main(["evaluate", *files[:2], "-o", files[2], *options]) == 0
    return capsys.readouterr().out


def simulated(tmp_path: Path, text: str) -> sd.Measurement:
    (tmp_path / "scenario.toml").write_text(text)
    return sd.simulate(sd.read_scenario(tmp_path / "scenario.toml"))


def spoilt(run: sd.Measurement, spoils: dict[str, tuple[int, float]]) -> sd.Measurement:
    channels = {name: values.copy() for name, values in run.channels.items()}
    for name, (row, size) in spoils.items():
        channels[name][row] += size
    return sd.Measurement(run.line, run.point.tolist(), run.position, channels, run=run.run.tolist())


@pytest.mark.parametrize(
    ("value", "uncertainty", "text"),
    [
        (12.3456, 0.0567, "12.346(57)"),
        (-0.0004, 0.21, "0.00(21)"),
        (100.0, 4.46, "100.0(45)"),
        (1234.0, 56.0, "1234(56)"),
        (10780.0, 6822.0, "10800(6800)"),
        (1.0, 0.0996, "1.00(10)"),
        (1.0, 0.0, "1"),
        (2.5, float("inf"), "2.5"),
    ],
)
def test_uncertainty_of_the_last_digits_is_in_brackets(value: float, uncertainty: float, text: str) -> None:
    assert concise(value, uncertainty) == text


def test_set_up_that_was_simulated_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = report(tmp_path, capsys, NOISY, simulated(tmp_path, NOISY))
    assert "set-up found" in said
    rows = {
        line.split()[0]: line.split()[1:] for line in said.split("set-up found")[1].splitlines() if line[:2] == "  "
    }
    lines = ["ppp", "npp", "pnp", "nnp", "p00", "0p0", "00p"]
    assert [name for name in rows if name in lines] == lines
    for line in ("ppp", "npp", "pnp", "nnp"):
        for cell, truth in zip(rows[line][:2], (100.0, 300.0), strict=True):
            value, digits = cell.rstrip(")").split("(")
            uncertainty = float(digits) * 10.0 ** -len(value.partition(".")[2])
            assert abs(float(value) - truth) < 5.0 * uncertainty


def test_fit_is_said_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulated(tmp_path, NOISY)
    assert report(tmp_path, capsys, NOISY, run).startswith("fit: accepted: the readings agree")
    sure = NOISY + "[uncertainty]\ndistance_um = 0.05\ntilt_urad = 0.5\n"
    assert report(tmp_path, capsys, sure, run).startswith("fit: doubtful: noise: alpha scatters 1.7")


def test_outliers_are_named_with_their_size(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # Of a step's four distances one is more than needed: a second run tells which of them is wrong.
    twice = NOISY.replace("[plan]", "[plan]\nrepeats = 2")
    run = simulated(tmp_path, twice)
    rows = [row for row, line in enumerate(run.line) if line == "npp"]
    wrong = spoilt(run, {"distance": (rows[7], 3e-3), "alpha": (rows[20], -30e-6)})
    said = report(tmp_path, capsys, twice, wrong)
    faults = [line for line in said.splitlines() if line.startswith("fault ")]
    assert len(faults) == 2
    assert any(
        re.search(r"a wrong reading: distance of npp point 7 is [0-9.]+ ± [0-9.]+ µm too much", f) for f in faults
    )
    (tilt,) = (f for f in faults if "alpha" in f)
    assert re.search(r"a wrong reading: alpha of npp point 20 is [0-9.]+ ± [0-9.]+ µrad too little; left out$", tilt)


def test_outlier_that_may_be_another_is_said_to_be_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulated(tmp_path, NOISY)
    rows = [row for row, line in enumerate(run.line) if line == "npp"]
    said = report(tmp_path, capsys, NOISY, spoilt(run, {"distance": (rows[7], 3e-3)}))
    (fault,) = [line for line in said.splitlines() if line.startswith("fault 1: ")]
    assert "distance of npp point 7" in fault
    assert "; the readings do not distinguish them (stepdiag observe says which plan would)" in fault
    assert fault.endswith("all of these readings are left out")


def test_scale_lines_have_a_word_on_their_cosine_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulated(tmp_path, NOISY)
    own = "[adjustment.p00]\nlaser_urad = 1000.0\n[adjustment.0p0]\nreflector_urad = 500.0\n"
    said = report(tmp_path, capsys, NOISY + own, run)
    assert (
        "scale lines p00: a laser that stands along the axis to 1000 µrad reads too short, never too long, by 1" in said
    )
    assert "scale lines 00p: a laser that stands along the axis to 500 µrad" in said
    # Both known to 500 urad: a tilt leaves half of the variance.
    assert "0p0: a laser that stands along the axis to 500 µrad, the mirror square to it to 500 µrad" in said
    assert "beyond what their tilts show it reads too short, never too long, by 0.12 µm/m" in said


def test_scale_lines_whose_mirror_no_reading_tells_have_a_word_on_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = simulated(tmp_path, NOISY)
    scale = np.isin(run.line, ["p00", "0p0", "00p"])
    channels = {n: np.where(scale & (n in ("alpha", "beta")), np.nan, v) for n, v in run.channels.items()}
    run = sd.Measurement(run.line, run.point.tolist(), run.position, channels, run=run.run.tolist())
    own = "[adjustment.p00]\nreflector_urad = 300.0\n[adjustment.0p0]\nreflector_urad = 'fixed'\n"
    said = report(tmp_path, capsys, NOISY + own, run)
    told = "the angle of the mirror to the beam, taken to be known to"
    # 2 D^2 - l^2 with l known to 500 urad.
    assert f"scale lines p00: the readings do not determine {told} 300 µrad (reflector_urad)" in said
    assert "they read 0.07 µm/m too short on average" in said
    assert f"scale lines 00p: the readings do not determine {told} 500 µrad" in said
    assert "they read 0.25 µm/m too long on average" in said
    assert "scale lines 0p0: a laser that stands along the axis to 500 µrad reads too short, never too long" in said


def test_drift_has_a_word_on_squareness(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Four lines of length D that drift by themselves: rate x duration x D/(2 A B), the largest of 60 x 50 mm: A0Z."""
    run = simulated(tmp_path, NOISY)
    untimed = NOISY.replace("[plan]", "[plan]\nseconds_per_reading = 10.0")
    points = run.line.count("ppp")
    size = 5e-3 / 3600 * 10.0 * (points - 1) * math.hypot(80.0, 60.0, 50.0) / (2 * 60.0 * 50.0) * 1e6
    words = f"5 µm/h of each line's distances would be about {size:.2g} µrad of A0Z"
    assert words in report(tmp_path, capsys, untimed, run)
    assert "drift:" not in report(tmp_path, capsys, NOISY, run)
    timed = simulated(tmp_path, untimed)
    said = report(tmp_path, capsys, untimed, timed)
    assert f"drift by at most 5 µm/h (1 sigma, drift_um_per_h); that is about {size:.2g} µrad of A0Z" in said
    assert f"; 20 µm/h would be {4 * size:.2g} µrad, and single runs hardly show it" in said
    fixed = untimed + '[adjustment]\ndrift_um_per_h = "fixed"\n'
    assert words in report(tmp_path, capsys, fixed, timed)


def test_smoothness_in_force_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulated(tmp_path, NOISY)
    said = report(tmp_path, capsys, NOISY + "[smoothness]\nrotation_urad = 100.0\n", run)
    (row,) = [line for line in said.splitlines() if line.startswith("smoothed")]
    assert "EAX 100 µrad" in row
    assert "EXX" not in row


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_published_methods_say_that_they_do_not_use_the_section(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], method: str
) -> None:
    text = NOISY + '[adjustment]\ngain = "fixed"\n'
    run = simulated(tmp_path, text)
    assert f"note: [adjustment] is not used by the method {method}" in report(tmp_path, capsys, text, run, "-m", method)
    assert "is not used" not in report(tmp_path, capsys, text, run)
