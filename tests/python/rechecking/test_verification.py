"""A calibration is tested with readings that it was not made from: in Python and by `stepdiag verify`."""

from pathlib import Path

import numpy as np
import pytest
from calibrations import parts_of
from json_objects import printed
from refusal import refused
from verified import TESTED

import stepdiag as sd
from stepdiag.cli import main


def test_new_readings_of_the_same_machine_agree(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["verify", "calibration.nc", "tested.toml", "new.csv"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("the readings agree with the calibration: chi-square ")
    assert [line.split()[0] for line in said[3:5]] == ["ppp", "nnp"]
    assert said[-1].startswith("largest deviation of a reading: ")


def test_machine_that_was_hit_is_noticed(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parts = parts_of(sd.read_calibration("calibration.nc"))
    value, uncertainty = parts["squareness"]["C0Y"]
    parts["squareness"] |= {"C0Y": (value + 30e-6, uncertainty)}
    sd.Calibration(**parts).write("hit.nc")
    capsys.readouterr()
    assert main(["verify", "hit.nc", "tested.toml", "new.csv"]) == 3
    captured = capsys.readouterr()
    assert captured.out.startswith("the readings do not agree with the calibration: ")
    assert captured.err.startswith("warning: new.csv: does not agree with hit.nc: ")


def test_object_has_what_the_report_has(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = printed("verification", capsys, "verify", "calibration.nc", "tested.toml", "new.csv")
    scenario = sd.read_scenario("tested.toml")
    found = sd.verify(sd.read_calibration("calibration.nc"), scenario, sd.read_measurement("new.csv"))
    assert result["chi_square"] == found.chi_square
    assert [line["deviation"]["value"] for line in result["lines"]] == pytest.approx(
        [1e3 * line.deviation for line in found.lines]
    )


def test_deviations_follow_from_derivatives_of_the_simulator(files: Path) -> None:
    """An oracle that shares nothing with the solution: V dense, derivatives by differences of `simulate`."""
    scenario, calibration = sd.read_scenario("tested.toml"), sd.read_calibration("calibration.nc")
    run = sd.read_measurement("new.csv")
    known = scenario.known
    labels = calibration.covariance_labels

    def read(change: np.ndarray, setups: np.ndarray) -> np.ndarray:
        functions = {name: (p, v.copy()) for name, (p, v, _) in calibration.functions.items()}
        squareness = {name: value for name, (value, _) in calibration.squareness.items()}
        for (name, position), by in zip(labels, change, strict=True):
            if name in squareness:
                squareness[name] += by
            else:
                functions[name][1][functions[name][0] == position] += by
        errors = sd.ErrorMap(functions, squareness)
        misalignment = {
            line: sd.Misalignment(reflector=s[:2], laser=s[2:4], distance_constant=s[4])
            for line, s in zip(("ppp", "nnp"), setups.reshape(2, 5), strict=True)
        }
        machine = sd.Machine(known.chain, errors, known.tool)
        made = sd.simulate(machine, known.plan, sd.Head(), misalignment=misalignment)
        return np.concatenate([made.channels[c] for c in ("distance", "alpha", "beta")])

    u = np.repeat([0.2e-3, 1e-6, 1e-6], len(run))
    zero = np.zeros(len(labels))
    values = np.concatenate([run.channels[c] for c in ("distance", "alpha", "beta")])

    def columns(function, at, steps):  # type: ignore[no-untyped-def]
        return np.stack(
            [(function(at + step) - function(at - step)) / (2 * step[step != 0][0]) for step in np.diag(steps)], axis=1
        )

    sizes = np.array([1e-4 if name[0] == "E" and name[1] in "XYZ" else 1e-6 for name, _ in labels])
    setups = np.zeros(10)
    by_value = columns(lambda change: read(change, setups), zero, sizes)
    covariance = by_value @ calibration.covariance @ by_value.T + np.diag(u**2)
    weight = np.linalg.inv(covariance)
    # The laser is known to 2000 urad; angles of the reflector and the constant are free.
    prior = np.diag(np.tile([0.0, 0.0, 2e-3**-2, 2e-3**-2, 0.0], 2))
    for _ in range(6):
        by_setup = columns(lambda s: read(zero, s), setups, np.tile([1e-6, 1e-6, 1e-6, 1e-6, 1e-3], 2))
        residual = values - read(zero, setups)
        normal = by_setup.T @ weight @ by_setup + prior
        setups = setups + np.linalg.solve(normal, by_setup.T @ weight @ residual - prior @ setups)
    residual = values - read(zero, setups)
    found = sd.verify(calibration, scenario, run)
    # Residuals are exact to differences of derivatives; chi-square to those of the machine's second order.
    assert found.chi_square == pytest.approx(residual @ weight @ residual + setups @ prior @ setups, rel=1e-3)
    deviations = np.concatenate([found.deviations[c] for c in ("distance", "alpha", "beta")])
    assert np.abs((deviations - residual) / u).max() < 2e-2
    spread = covariance - by_setup @ np.linalg.solve(normal, by_setup.T)
    uncertainties = np.concatenate([found.standard_uncertainties[c] for c in ("distance", "alpha", "beta")])
    assert np.allclose(uncertainties, np.sqrt(np.diag(spread)), rtol=1e-3)


def test_run_of_the_calibration_itself_is_refused(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", "calibration.nc", "calibrated.toml", "run.csv"]) == 2
    assert "run.csv: the calibration was made from this run" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["calibration.csv", "tested.toml", "new.csv"], "has no covariance"),
        (["calibration.nc", "other.toml", "new.csv"], "tool: the calibration has 0.0 0.0 0.0 mm"),
        (["calibration.nc", "tested.toml", "new.csv", "--alpha", "2"], "--alpha: expected a probability"),
    ],
)
def test_what_cannot_be_verified_is_refused(
    files: Path, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", "calibrated.toml", "run.csv", "-o", "calibration.csv"]) == 0
    Path("other.toml").write_text(TESTED.replace("[machine]\n", "[machine]\ntool_mm = [1.0, 0.0, 0.0]\n"))
    capsys.readouterr()
    assert main(["verify", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_calibration_without_angles_is_refused_by_name(files: Path) -> None:
    calibration = sd.methods.evaluate(
        sd.read_measurement("run.csv"),
        sd.read_scenario("calibrated.toml").known.plan,
        sd.Head(),
        "[w X' b Y Z t]",
        method="conventional",
    )
    refused(
        sd.verify,
        calibration,
        sd.read_scenario("tested.toml"),
        sd.read_measurement("new.csv"),
        names="does not determine EAX",
    )


def test_points_between_nodes_need_a_stated_uncertainty(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Else the ripple of a screw would count as a change."""
    Path("between.toml").write_text(TESTED.replace("steps = 3", "steps = 4"))
    assert main(["simulate", "between.toml", "-o", "between.csv"]) == 0
    capsys.readouterr()
    assert main(["verify", "calibration.nc", "between.toml", "between.csv"]) == 2
    assert "lie between its nodes, and it states no uncertainty" in capsys.readouterr().err
    stated = Path("between.toml").read_text().replace("[uncertainty]", "[uncertainty]\nbetween_nodes_um = 2.0")
    Path("between.toml").write_text(stated)
    assert main(["verify", "calibration.nc", "between.toml", "between.csv"]) == 0
