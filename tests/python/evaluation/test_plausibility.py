"""Results that no machine can have are errors that say what the readings look like."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from refusal import refused
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

SOUND = SCENARIO.replace("steps = 5", "steps = 20").replace("80.0", "800.0").replace("60.0", "600.0")
SOUND = SOUND.replace("z_mm = 50.0", "z_mm = 500.0").replace("seed = 3", "tilt_urad = 1.0\nseed = 3")
METHODS = ("conventional", "enhanced", "adjustment")
Spoil = Callable[[np.ndarray], np.ndarray]


def one_reading(size: float) -> Spoil:
    def spoil(distance: np.ndarray) -> np.ndarray:
        distance = distance.copy()
        distance[30] = size
        return distance

    return spoil


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> sd.Measurement:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SOUND)
    return sd.simulate(sd.read_scenario("scenario.toml"))


def with_distance(run: sd.Measurement, spoil: Spoil) -> sd.Measurement:
    channels = dict(run.channels) | {"distance": spoil(run.channels["distance"])}
    return sd.Measurement(run.line, run.point.tolist(), run.position, channels)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda d: d * 1e-3, "are they in m?"),
        (lambda d: d * 1e3, "are they in um?"),
        (lambda d: d / 25.4, "are they in inches?"),
        (lambda d: 2.0 * d, "are they the whole way to the mirror and back?"),
        (lambda d: 0.5 * d, "have they been halved twice?"),
        (lambda d: -d, "distances that grow while the mirror moves away"),
        (lambda d: 0.0 * d, "they hardly change"),
    ],
)
def test_distances_in_another_unit_are_an_error_that_names_it(
    run: sd.Measurement, method: str, spoil: Spoil, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with_distance(run, spoil).write("run.csv")
    assert main(["evaluate", "scenario.toml", "run.csv", "-m", method, "-o", "calibration.csv"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: run.csv: run 0, line ")
    assert message in said
    assert not Path("calibration.csv").exists()


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [1.0, 1e6, 1e308, -1e308])  # 0 is a lost beam
def test_one_absurd_reading_is_named(
    run: sd.Measurement, method: str, size: float, capsys: pytest.CaptureFixture[str]
) -> None:
    with_distance(run, one_reading(size)).write("run.csv")
    status = main(["evaluate", "scenario.toml", "run.csv", "-m", method, "-o", "calibration.csv"])
    said = capsys.readouterr()
    if method == "adjustment" and status == 0:  # its solver may still find the others' solution, by the roundings
        assert "distance of ppp point 30" in said.out
        return
    assert status == 2
    assert "data row 31 (run 0, line ppp, point 30): the distance" in said.err


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("axis", "edge"), [("X", 801.0), ("Y", 598.0), ("Z", 501.0)])
def test_another_volume_is_an_error_that_tells_its_edge(
    run: sd.Measurement, method: str, axis: str, edge: float
) -> None:
    # Measured with the true volume, evaluated with one whose edge is another.
    key = f"{axis.lower()}_mm"
    line = next(text for text in SOUND.splitlines() if text.startswith(key))
    true_edge = float(line.split("=")[1])
    Path("other.toml").write_text(SOUND.replace(line, f"{key} = {edge}"))
    other = sd.read_scenario("other.toml")
    stretched = run.position * np.array([edge / true_edge if axis == a else 1.0 for a in "XYZ"])
    moved = sd.Measurement(run.line, run.point.tolist(), stretched, dict(run.channels))
    refused(sd.methods.evaluate_scenario, other, moved, method=method, names="the readings fit a travel of ")


@pytest.mark.slow
def test_limits_are_those_of_the_scenario(run: sd.Measurement, capsys: pytest.CaptureFixture[str]) -> None:
    run.write("run.csv")
    for key, limit, message in (
        ("positioning_um_per_m", 10.0, "limit of positioning"),
        ("translation_um", 5.0, "limit of translation"),
        ("rotation_urad", 10.0, "limit of rotation"),
    ):
        Path("strict.toml").write_text(SOUND + f"[plausible]\n{key} = {limit}\n")
        assert main(["evaluate", "strict.toml", "run.csv", "-o", "calibration.csv"]) == 2
        assert message in capsys.readouterr().err


def test_a_large_value_of_larger_uncertainty_is_no_error() -> None:
    # Face diagonals with a noise of 1 mm know scales to millimetres: the result says so by its uncertainty.
    plan = sd.Plan((800, 600, 500), ["pp0", "np0", "p0p", "n0p", "0pp", "0np"], 5)
    machine = sd.Machine("[w X' b Y Z t]")
    run = sd.simulate(machine, plan, sd.Head("ideal"), noise=sd.Noise(distance=1.0, seed=2))
    calibration = sd.methods.evaluate(
        run,
        plan,
        sd.Head("ideal"),
        machine.chain,
        method="enhanced",
        uncertainty=sd.methods.ReadingUncertainty(distance=1.0),
    )
    assert any(np.max(np.abs(value)) > 2.0 for _, value, _ in calibration.functions.values())


def test_limits_that_are_none_are_refused() -> None:
    for value in (0.0, -1.0, float("nan")):
        refused(sd.methods.PlausibleLimits, rotation=value, names="plausible rotation: expected a positive limit")
