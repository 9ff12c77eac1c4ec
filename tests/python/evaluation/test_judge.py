"""One judgement: evaluate, check, report and the library give the same verdict for the same run."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mistaken import changed, moved, rows_of
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

STATED = SCENARIO.replace("seed = 3", "tilt_urad = 1.0\nseed = 3")


def times(factor: float, *names: str) -> Callable[[sd.Measurement], sd.Measurement]:
    return lambda run: changed(run, {name: factor * run.channels[name] for name in names})


def wrong(name: str, rows: slice, size: float) -> Callable[[sd.Measurement], sd.Measurement]:
    def with_fault(run: sd.Measurement) -> sd.Measurement:
        values = np.array(run.channels[name])
        values[rows] += size
        return changed(run, {name: values})

    return with_fault


def scattered(name: str, u: float) -> Callable[[sd.Measurement], sd.Measurement]:
    def with_noise(run: sd.Measurement) -> sd.Measurement:
        noise = np.random.default_rng(7).normal(0.0, u, len(run))
        return changed(run, {name: run.channels[name] + noise})

    return with_noise


def with_readings_of(row_of: Callable[[sd.Measurement], np.ndarray]) -> Callable[[sd.Measurement], sd.Measurement]:
    return lambda run: moved(run, row_of(run))


def exchanged(run: sd.Measurement) -> np.ndarray:
    rows, first, second = np.arange(len(run)), rows_of(run, "ppp"), rows_of(run, "npp")
    rows[first], rows[second] = second, first
    return rows


RUNS = {
    "sound": lambda run: run,
    "tilts with the wrong sign": times(-1.0, "alpha", "beta"),
    "tilts too large": times(2.0, "alpha", "beta"),
    "one wrong tilt": wrong("alpha", slice(7, 8), 1e-4),
    "three wrong tilts": wrong("beta", slice(4, 40, 12), 2e-4),
    "a slip of distances": wrong("distance", slice(6, 16), 3e-3),
    "a wrong distance": wrong("distance", slice(5, 6), 1e-2),
    "distances that scatter more": scattered("distance", 2e-3),
    "two lines exchanged": with_readings_of(exchanged),
    "a reading lost": with_readings_of(lambda run: np.where(np.arange(len(run)) == 9, -1, np.arange(len(run)))),
}
SHIPPED = Path(sd.__file__).parent / "selftest" / "known" / "runs"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(STATED)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_every_way_gives_the_same_verdict(folder: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    RUNS[name](sd.simulate(sd.read_scenario("scenario.toml"))).write("run.csv")
    expect_one_verdict("scenario.toml", "run.csv", capsys)


@pytest.mark.parametrize("name", sorted(folder.name for folder in SHIPPED.iterdir() if folder.is_dir()))
def test_shipped_runs_have_one_verdict(folder: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    expect_one_verdict(str(SHIPPED / name / "scenario.toml"), str(SHIPPED / name / "measurement.csv"), capsys)


def expect_one_verdict(scenario: str, run: str, capsys: pytest.CaptureFixture[str]) -> None:
    judged = sd.judge(sd.read_scenario(scenario), sd.read_measurement(run))

    main(["evaluate", scenario, run, "-o", "calibration.csv", "--json"])
    evaluated = json.loads(capsys.readouterr().out)
    assert evaluated["fit"]["verdict"] == judged.fit
    written = sd.read_calibration("calibration.csv")
    assert [reason["code"] for reason in evaluated["fit"]["reasons"]] == written.fit_codes
    assert written.fit == judged.fit
    assert written.fit_reasons == judged.reasons

    main(["check", scenario, run])
    fit = {"rejected": "REJECTED"}.get(judged.fit, judged.fit)
    assert f"fit: {fit}" in capsys.readouterr().out

    status = main(["report", "calibration.csv", "--scenario", scenario, "--run", run, "-o", "report.html"])
    assert status == (3 if judged.fit == "rejected" else 0)
    page = Path("report.html").read_text()
    for found in judged.mistakes if judged.fit in ("doubtful", "rejected") else ():
        assert found.text.replace("'", "&#x27;").replace("'", "&#39;") in page or found.text in page


def test_a_mistake_rejects_the_run_and_is_its_first_reason(folder: Path) -> None:
    scenario = sd.read_scenario("scenario.toml")
    judged = sd.judge(scenario, RUNS["tilts with the wrong sign"](sd.simulate(scenario)))
    assert judged.fit == "rejected"
    assert judged.mistakes
    assert judged.adjustment is not None
    assert judged.adjustment.verdict.reasons[0].finding == "mistake"
    assert judged.reasons[0].startswith("a mistake explains the readings: the head is turned by 180°")


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_a_linear_method_has_the_worse_of_both_verdicts(folder: Path, method: str) -> None:
    scenario = sd.read_scenario("scenario.toml")
    run = sd.simulate(scenario)
    sound = sd.judge(scenario, run, method=method)  # type: ignore[arg-type]
    assert sound.adjustment is not None
    assert sound.adjustment.verdict.fit == sd.judge(scenario, run).fit
    assert not sound.mistakes
    mistaken = RUNS["tilts with the wrong sign"](run)
    assert sd.judge(scenario, mistaken, method=method).fit == "rejected"  # type: ignore[arg-type]


def test_thresholds_are_those_of_the_core() -> None:
    assert sd._core.thresholds.fault == 28.0
    assert sd._core.thresholds.largest_variance_factor == sd._core.thresholds.largest_noise_factor**2


def test_a_judgement_has_what_was_done_about_the_readings(folder: Path) -> None:
    scenario = sd.read_scenario("scenario.toml")
    run = sd.simulate(scenario)
    tilt = sd.judge(scenario, wrong("alpha", slice(7, 8), 1e-4)(run))
    assert [(reading.row, reading.channel) for reading in tilt.left_out] == [(7, "alpha")]
    assert tilt.freed == []
    noise = sd.judge(scenario, scattered("distance", 2e-3)(run))
    assert (noise.fit, noise.mistakes, noise.left_out, noise.freed) == ("rejected", (), [], [])
    assert [c.channel for c in noise.variance_components if c.used] == ["distance"]
    assert noise.reasons[0].startswith("noise: distance scatters ")
