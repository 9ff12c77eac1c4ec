"""The verdict of a fit and its consequences: report, files, exit status, and who refuses a rejected calibration."""

import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from refusal import refused
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

SOUND = SCENARIO.replace("steps = 5", "steps = 20").replace("seed = 3", "tilt_urad = 1.0\nseed = 3")
# Three distances for three unknowns of each step.
THREE_DISTANCES = (
    SOUND.replace(', "nnp"]', "]").replace('scale_lines = ["p00", "0p0", "00p"]', "").replace("tilt_urad = 1.0\n", "")
    + '[adjustment]\nangles = "fixed"\n'
).replace('layout = "ideal"', 'layout = "ideal"\ntilts = false')
Change = Callable[[dict[str, np.ndarray], np.ndarray], None]


def write_run(text: str = SOUND, change: Change | None = None) -> None:
    """scenario.toml and run.csv, of which `change` spoils channels: given them and the line of each row."""
    Path("scenario.toml").write_text(text)
    run = sd.simulate(sd.read_scenario("scenario.toml"))
    channels = {name: values.copy() for name, values in run.channels.items()}
    if change is not None:
        change(channels, np.asarray(run.line))
    sd.Measurement(run.line, run.point.tolist(), run.position, channels).write("run.csv")


def noisy(factor: float) -> Change:
    """Noise of this factor on the stated standard uncertainties, the same for all channels."""

    def change(channels: dict[str, np.ndarray], line: np.ndarray) -> None:
        noise = np.random.default_rng(5)
        for name, u in (("distance", 0.1e-3), ("alpha", 1e-6), ("beta", 1e-6)):
            channels[name] += noise.normal(0.0, u * np.sqrt(factor**2 - 1.0), len(line))

    return change


def exchange_tilts(channels: dict[str, np.ndarray], line: np.ndarray) -> None:
    channels["alpha"], channels["beta"] = channels["beta"], channels["alpha"]


def spoil_a_line(channels: dict[str, np.ndarray], line: np.ndarray) -> None:
    """Tilts of one line with four times their stated noise."""
    noise = np.random.default_rng(6)
    for name in ("alpha", "beta"):
        channels[name][line == "npp"] += noise.normal(0.0, 4e-6, np.count_nonzero(line == "npp"))


def evaluate(*options: str) -> int:
    return main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv", *options])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def rejected(folder: Path) -> Path:
    write_run(change=exchange_tilts)
    assert evaluate() == 3
    return folder / "calibration.csv"


def test_sound_readings_are_accepted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run()
    assert evaluate() == 0
    said = capsys.readouterr()
    assert said.out.startswith("fit: accepted: ")
    assert "warning:" not in said.err
    assert "# fit=accepted\n" in Path("calibration.csv").read_text()
    calibration = sd.read_calibration("calibration.csv")
    found = sd.methods.adjust_scenario(sd.read_scenario("scenario.toml"), sd.read_measurement("run.csv"))
    assert (calibration.fit, calibration.variance_factor) == ("accepted", found.variance_factor)
    assert (found.verdict.fit, found.verdict.reasons) == ("accepted", [])


def test_exchanged_tilts_are_rejected(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(change=exchange_tilts)
    assert evaluate() == 3
    said = capsys.readouterr()
    assert said.out.startswith("fit: REJECTED: ")
    assert said.err.startswith("warning: calibration.csv: the fit is rejected")
    assert sd.read_calibration("calibration.csv").fit == "rejected"


def test_one_common_factor_on_the_noise_is_doubtful_and_not_rejected(folder: Path) -> None:
    write_run(change=noisy(1.5))
    assert evaluate() == 0
    assert sd.read_calibration("calibration.csv").fit == "doubtful"


@pytest.mark.slow
def test_a_common_factor_above_three_is_rejected_as_noise(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(change=noisy(5.0))
    assert evaluate() == 3
    assert capsys.readouterr().out.startswith("fit: REJECTED: noise: alpha scatters ")
    found = sd.methods.adjust_scenario(sd.read_scenario("scenario.toml"), sd.read_measurement("run.csv"))
    assert [(r.finding, r.channel, r.limit) for r in found.verdict.reasons] == [
        ("noise_factor", channel, 3.0) for channel in ("alpha", "beta", "distance")
    ]
    assert found.faults == []


def test_the_noise_of_one_line_is_named(folder: Path) -> None:
    write_run(change=spoil_a_line)
    found = sd.methods.adjust_scenario(sd.read_scenario("scenario.toml"), sd.read_measurement("run.csv"))
    assert {r.finding for r in found.verdict.reasons} == {"noise_factor"}
    assert {(r.line, r.channel) for r in found.verdict.reasons} == {("npp", "alpha"), ("npp", "beta")}
    assert found.verdict.fit == "rejected"


def test_readings_that_scatter_too_little_are_doubtful(folder: Path) -> None:
    write_run(SOUND + "[uncertainty]\ndistance_um = 1.0\ntilt_urad = 10.0\n")
    assert evaluate() == 0
    assert sd.read_calibration("calibration.csv").fit == "doubtful"


def test_a_set_up_far_from_its_prior_is_rejected(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(SOUND + "[adjustment]\nreflector_urad = 30.0\n")  # the mirror stands at 100, 300
    assert evaluate() == 3
    assert re.search(
        r"rejected because reflector b of line ppp is [0-9.]+ standard uncertainties", capsys.readouterr().out
    )
    found = sd.methods.adjust_scenario(sd.read_scenario("scenario.toml"), sd.read_measurement("run.csv"))
    for reason in (r for r in found.verdict.reasons if r.finding == "prior"):
        (value,) = (
            e
            for e in found.setup
            if (e.line, e.quantity, e.component) == (reason.line, reason.channel, reason.component)
        )
        assert value.value is not None
        known = np.sqrt(value.prior**2 - value.standard_uncertainty**2)
        assert reason.value == pytest.approx(abs(value.value) / known)


def test_without_redundancy_a_fit_is_unchecked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(THREE_DISTANCES)
    assert evaluate() == 0
    said = capsys.readouterr()
    assert said.out.startswith("fit: unchecked: ")
    assert said.err.startswith("warning: calibration.csv: the fit is unchecked")
    calibration = sd.read_calibration("calibration.csv")
    assert (calibration.fit, calibration.variance_factor) == ("unchecked", None)


def test_reports_of_files_word_the_reasons(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(change=exchange_tilts)
    for name in ("calibration.csv", "calibration.nc"):
        assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 3
        reasons = [line for line in capsys.readouterr().out.splitlines() if line.startswith("rejected because ")]
        assert reasons
        assert main(["report", name]) == 3
        assert [r for r in capsys.readouterr().out.splitlines() if r.startswith("rejected because ")] == reasons


def test_scaled_uncertainties_are_said_in_reports_and_files(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(SOUND + "[adjustment]\nscale_uncertainty = true\n", noisy(1.12))  # of no channel alone is it known
    for name in ("calibration.csv", "calibration.nc"):
        assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 0
        said = capsys.readouterr()
        calibration = sd.read_calibration(name)
        assert calibration.variance_factor is not None
        factor = np.sqrt(calibration.variance_factor)
        assert said.out.startswith(f"fit: doubtful: all uncertainties were multiplied by {factor:.3g} ± ")
        assert "the fit is doubtful" in said.err
        assert calibration.fit == "doubtful"
        assert calibration.uncertainty_scaled == factor
        assert main(["report", name]) == 0
        assert f"all standard uncertainties were multiplied by {factor:.3g}" in capsys.readouterr().out


@pytest.mark.slow
def test_false_alarms_are_as_rare_as_the_limits_say(folder: Path) -> None:
    write_run()
    scenario, verdicts = sd.read_scenario("scenario.toml"), []
    for seed in range(200):
        Path("other.toml").write_text(SOUND.replace("seed = 3", f"seed = {seed}"))
        other = sd.read_scenario("other.toml")
        verdicts.append(sd.methods.adjust_scenario(scenario, sd.simulate(other)).verdict.fit)
    assert "rejected" not in verdicts  # expected: less than one in 10,000
    assert verdicts.count("doubtful") <= 9  # expected: 1.1 % of 200; more than nine in one of 3,000 such tests


@pytest.mark.parametrize("name", ["calibration.csv", "calibration.nc"])
def test_files_keep_verdict_and_factor(rejected: Path, name: str) -> None:
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 3
    # The mistake is known: no faults are looked for.
    scenario, run = sd.read_scenario("scenario.toml"), sd.read_measurement("run.csv")
    found = sd.methods.adjust_scenario(scenario, run, search_faults=False)
    calibration = sd.read_calibration(name)
    assert (calibration.fit, calibration.variance_factor) == ("rejected", found.variance_factor)
    calibration.write("again.csv")
    assert (sd.read_calibration("again.csv").fit, sd.read_calibration("again.csv").variance_factor) == (
        "rejected",
        found.variance_factor,
    )


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("fit=great", "fit: expected accepted, doubtful, rejected or unchecked"),
        ("variance_factor=-1", "variance_factor: expected a number of at least 0"),
        ("variance_factor=many", "variance_factor: expected a number of at least 0"),
    ],
)
def test_other_words_are_errors(rejected: Path, line: str, message: str) -> None:
    kept = [text for text in rejected.read_text().splitlines() if not text.startswith(f"# {line.split('=')[0]}=")]
    rejected.write_text("\n".join([f"# {line}", *kept]) + "\n")
    refused(sd.read_calibration, "calibration.csv", names=f"calibration.csv: {message}")


@pytest.mark.parametrize(
    ("to", "output"),
    [("linuxcnc-kins", "kins.csv"), ("csv-grid", "grid.csv"), ("isg", "isg.csv"), ("linuxcnc-comp", "comp")],
)
def test_export_refuses_a_rejected_calibration_unless_told(
    rejected: Path, to: str, output: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", "calibration.csv", "--to", to, "-o", output, "--incomplete"]
    assert main(command) == 2
    assert "calibration.csv: fit=rejected" in capsys.readouterr().err
    assert not Path(output).exists()
    assert main([*command, "--accept-rejected"]) == 3
    said = capsys.readouterr()
    assert said.out.startswith("fit: REJECTED")
    assert said.err.startswith("warning: ")
    files = (
        [Path(output)] if Path(output).is_file() else list(Path(output).glob("*.ini")) or list(Path(output).iterdir())
    )
    assert any("reject" in file.read_text().lower() for file in files)


def test_loading_warns_of_a_fit_that_is_not_accepted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run()
    assert evaluate() == 0
    sound = sd.read_calibration("calibration.csv")
    for fit in ("doubtful", "unchecked"):
        sound.judged(fit).write("calibration.csv")
        assert main(["export", "calibration.csv", "--to", "csv-grid", "-o", "grid.csv"]) == 0
        assert f"warning: calibration.csv: the fit is {fit}" in capsys.readouterr().err
        for table in ("calibration.csv", sound.judged(fit)):
            with pytest.warns(UserWarning, match=f"a fit that is {fit}"):
                assert sd.Compensator(table, "[w X' b Y Z t]").fit == fit
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sd.Compensator(sound, "[w X' b Y Z t]")


def test_a_compensator_refuses_a_rejected_calibration_unless_told(rejected: Path) -> None:
    chain = "[w X' b Y Z t]"
    calibration = sd.read_calibration(rejected)
    for table, name in ((rejected, str(rejected)), (calibration, "calibration")):
        refused(sd.Compensator, table, chain, names=f"{name}: fit=rejected")
        with pytest.warns(UserWarning, match="a fit that is rejected"):
            assert sd.Compensator(table, chain, accept_rejected=True).fit == "rejected"


def test_an_error_map_has_no_verdict_and_loads(folder: Path) -> None:
    sd.random_error_map((80, 60, 50), seed=1).write(
        "map.csv", chain="[w X' b Y Z t]", volume=(80, 60, 50), tool=(0, 0, 0)
    )
    assert sd.Compensator("map.csv", "[w X' b Y Z t]").fit is None
    assert sd.read_calibration("map.csv").fit is None


def test_report_compare_and_check_tell_of_a_rejected_fit(rejected: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    for command in (["report"], ["compare", "calibration.csv"], ["check"]):
        assert main([*command, "calibration.csv"]) == 3
        assert capsys.readouterr().err.startswith("warning: ")
    main(["report", "calibration.csv"])
    assert capsys.readouterr().out.startswith("fit: REJECTED")


# --- check: scenario and run -----------------------------------------------------------------------------------------
def check(*files: str) -> int:
    return main(["check", *(files or ("scenario.toml", "run.csv"))])


def test_check_says_that_scenario_and_run_belong_together(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run()
    assert check() == 0
    assert "run.csv with scenario.toml: fit: accepted" in capsys.readouterr().out


def test_check_rejects_a_run_that_does_not_fit(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(change=exchange_tilts)
    assert check() == 3
    said = capsys.readouterr()
    assert "run.csv with scenario.toml: fit: REJECTED" in said.out
    assert said.err.startswith("warning: ")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("x_mm = 80.0", "x_mm = 81.0", "run.csv: does not belong to scenario.toml: data row 2"),
        ("steps = 20", "steps = 10", "run.csv: does not belong to scenario.toml: data row"),
        ('"npp", ', "", "npp"),
    ],
)
def test_check_refuses_a_run_of_another_plan(
    folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str
) -> None:
    write_run()
    Path("scenario.toml").write_text(SOUND.replace(old, new))
    assert check() == 2
    assert message in capsys.readouterr().err


def test_check_takes_an_empty_sheet(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "-o", "machine"]) == 0
    assert check("machine/scenario.toml", "machine/measurement.csv") == 0
    assert "there are no readings of this head yet" in capsys.readouterr().out
