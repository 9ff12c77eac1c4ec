"""`stepdiag evaluate --json`."""

from pathlib import Path

import numpy as np
import pytest
from json_objects import printed
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.presentation.objects.calibration import value_unit
from stepdiag.presentation.quantity import BY_KEY
from stepdiag.setup_quantities import SETUP_QUANTITIES
from stepdiag.units import UNITS

TILTED = SCENARIO.replace("steps = 5", "steps = 20").replace("seed = 3", "tilt_urad = 1.0\nseed = 3")
FILES = ("scenario.toml", "run.csv")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write(TILTED)
    return tmp_path


def write(text: str) -> None:
    Path("scenario.toml").write_text(text)
    sd.simulate(sd.read_scenario("scenario.toml")).write("run.csv")


def wrong(size: float) -> None:
    """Makes one distance of the run wrong by this size (mm)."""
    run = sd.read_measurement("run.csv")
    channels = {name: values.copy() for name, values in run.channels.items()}
    channels["distance"][10] += size
    sd.Measurement(run.line, run.point.tolist(), run.position, channels).write("run.csv")


def texts_in(path: str) -> dict[tuple[str, str], tuple[float, float]]:
    """(parameter, position) -> value and standard uncertainty in a calibration CSV, µm or µrad."""
    rows = [line.split(",") for line in Path(path).read_text().splitlines() if not line.startswith("#")]
    return {(row[0], row[1]): (float(row[2]), float(row[4])) for row in rows[1:]}


def test_values_are_those_of_the_written_file_to_the_last_bit(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables = printed("evaluation", capsys, "evaluate", *FILES, "-o", "c.csv")["calibration"]
    found = {}
    for table in tables["functions"]:
        value = table["value"]
        assert value["unit"] == value_unit(table["parameter"])
        for p, one, u in zip(table["position"]["value"], value["value"], value["standard_uncertainty"], strict=True):
            found[table["parameter"], repr(p)] = one, u
    for one in tables["squarenesses"]:
        found[one["parameter"], ""] = one["value"]["value"], one["value"]["standard_uncertainty"]
    assert found == texts_in("c.csv")


def test_date_and_provenance_are_those_of_the_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("c.csv", "c.nc"):
        tables = printed("evaluation", capsys, "evaluate", *FILES, "-o", name)["calibration"]
        written = sd.read_calibration(name)
        assert (tables["date"], tables["provenance"]) == (written.date, written.provenance)
        assert tables["provenance"]["run_sha256"]


def test_file_and_exit_status_are_those_without_json(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    assert main(["evaluate", *FILES, "-o", "a.csv"]) == 0
    assert main(["evaluate", *FILES, "-o", "b.csv", "--json"]) == 0
    assert Path("a.csv").read_bytes() == Path("b.csv").read_bytes()


def test_adjustment_has_setup_reliability_and_fit(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("evaluation", capsys, "evaluate", *FILES, "-o", "c.csv", "--reliability")
    known = sd.read_scenario("scenario.toml").known
    found = sd.methods.adjust_scenario(known, sd.read_measurement("run.csv"), reliability=True)
    adjustment = said["adjustment"]
    assert said["fit"]["verdict"] == found.verdict.fit
    assert said["fit"]["variance_factor"] == found.variance_factor
    assert adjustment["degrees_of_freedom"] == found.degrees_of_freedom
    assert [control["channel"] for control in adjustment["reliability"]] == [c.channel for c in found.reliability]
    estimates = [estimate for estimate in found.setup if estimate.prior > 0.0]
    assert len(adjustment["setup"]) == len(estimates) > 0
    for own, estimate in zip(adjustment["setup"], estimates, strict=True):
        value = own["value"]
        assert value["unit"] == BY_KEY[SETUP_QUANTITIES[estimate.quantity].report_unit]
        # Both are roundings of one number.
        native = SETUP_QUANTITIES[estimate.quantity].report_unit
        np.testing.assert_allclose(value["value"] * UNITS[native].native, estimate.value, rtol=1e-15)


def test_fault_is_told(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong(0.05)
    said = printed("evaluation", capsys, "evaluate", *FILES, "-o", "c.csv")
    (fault,) = said["adjustment"]["faults"]
    assert any(member["row"] == 10 and member["channel"] == "distance" for member in fault["members"])
    # 50 µm are in it; the noise of the readings is 0.1 µm.
    assert any(
        member["size"]["unit"] == "um" and abs(member["size"]["value"] - 50.0) < 5.0 for member in fault["members"]
    )


def test_rejected_fit_prints_its_object_and_ends_with_status_3(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scenario.toml").write_text(f"{TILTED}\n[adjustment]\noutlier_probability = 0.0\n")
    wrong(0.05)
    said = printed("evaluation", capsys, "evaluate", *FILES, "-o", "c.csv", status=3)
    assert said["fit"]["verdict"] == "rejected"
    written = sd.read_calibration("c.csv")
    assert [(reason["code"], reason["text"]) for reason in said["fit"]["reasons"]] == list(
        zip(written.fit_codes, written.fit_reasons, strict=True)
    )
    assert "fault" in written.fit_codes
    assert len(said["warnings"]) == 1


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_linear_method_tells_both_verdicts(here: Path, capsys: pytest.CaptureFixture[str], method: str) -> None:
    main(["evaluate", *FILES, "-m", method, "-o", "c.csv"])
    status = 3 if sd.read_calibration("c.csv").fit == "rejected" else 0
    said = printed("evaluation", capsys, "evaluate", *FILES, "-m", method, "-o", "c.csv", status=status)
    assert said["adjustment"] is None
    assert said["linear"]["adjustment_verdict"] == "accepted"
    own = [reason["code"] for reason in said["fit"]["reasons"] if "by itself" in reason["text"]]
    assert own == ["method_by_itself"] * (said["linear"]["own_verdict"] != "accepted")
    assert said["fit"]["noise_alone"]
    # The conventional method determines no rotations, and says so as data as well.
    assert len(said["calibration"]["findings"]) == len(said["calibration"]["undetermined"])


def test_undetermined_and_combinations_are_told(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(TILTED.replace('scale_lines = ["p00", "0p0", "00p"]', "scale_lines = []"))
    said = printed("evaluation", capsys, "evaluate", *FILES, "-o", "c.csv")
    known = sd.read_scenario("scenario.toml").known
    found = sd.methods.adjust_scenario(known, sd.read_measurement("run.csv"))
    assert [finding["part"] for finding in said["calibration"]["findings"]] == [
        finding.part for finding in found.calibration.findings
    ]
    assert len(said["adjustment"]["combinations"]) == len(found.combinations)
    assert said["calibration"]["undetermined"] == found.calibration.undetermined != []


def test_what_is_undetermined_has_no_value_and_a_reason(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["evaluate", *FILES, "-m", "conventional", "-o", "c.csv"])
    for arguments in (
        ["evaluation", "evaluate", *FILES, "-m", "conventional", "-o", "c.csv"],
        ["report", "report", "c.csv"],
    ):
        name, *command = arguments
        status = 3 if sd.read_calibration("c.csv").fit == "rejected" else 0
        tables = printed(name, capsys, *command, status=status)["calibration"]
        found = sd.read_calibration("c.csv")
        assert len(tables["functions"]) == 18
        open_ones = [one for one in tables["functions"] if one["parameter"] not in found.functions]
        assert {one["parameter"] for one in open_ones} >= {"EAX", "EBX", "ECX"}  # rotations: distances alone
        for one in open_ones:
            assert one["value"]["value"] is None
            assert one["value"]["reason"] == "not in the calibration" or one["value"]["reason"] in found.undetermined


def test_error_prints_nothing_on_standard_output(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "scenario.toml", "missing.csv", "-o", "c.csv", "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("stepdiag: error: missing.csv: ")
    assert not Path("c.csv").exists()
