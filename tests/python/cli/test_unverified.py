"""A calibration without its checksum is unverified: every command says so, and whatever is written from it."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import netCDF4
import pytest
from small_scenario import SCENARIO
from usual import CHAIN

import stepdiag as sd
from stepdiag.cli import main

EDITED = "edited.csv"
# Commands that read a calibration, here that of the name `edited`; what they write has the name `out`.
COMMANDS = (
    "report {edited}",
    "report {edited} --functional-point out.csv",
    "report {edited} -o out.html",
    "report sound.nc {edited} -o out.html",
    "report {edited} sound.nc -o out.html",
    "volume {edited}",
    "compare sound.nc {edited}",
    "compare {edited} sound.nc -o out.csv",
    "compare {edited} sound.nc -o out.nc",
    "positions {edited}",
    "plot {edited} -o out.svg",
    "plot {edited} --volume -o out.svg",
    "plot sound.nc {edited} -o out.svg",
    "check {edited}",
    "export {edited} --to linuxcnc-kins -o out.csv",
    "export {edited} --to linuxcnc-comp -o out",
    "export {edited} --to isg -o out.csv",
    "export {edited} --to csv-grid -o out.csv",
    "export {edited} --to squareness -o out.csv",
    "export {edited} --to matrix -o out.hal",
    "export {edited} --to calibxyzkins -o out.hal",
    "export {edited} --to position-error --axis Y --depends-on X -o out.csv",
)
# These need a covariance.
ON_NETCDF = (
    "verify {edited} other.toml other.csv",
    "recheck {edited} other.toml other.csv --update out.nc",
    "recheck {edited} other.toml other.csv --update out.csv",
    "plan other.toml --recheck {edited} --minutes 60",
)
WORD = re.compile("unverified: a checksum was absent")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(SCENARIO)
        Path("other.toml").write_text(SCENARIO.replace("seed = 3", "seed = 5"))
        for command in (
            "simulate scenario.toml -o run.csv",
            "simulate other.toml -o other.csv",
            "evaluate scenario.toml run.csv -o sound.csv",
            "evaluate scenario.toml run.csv -o sound.nc",
        ):
            assert main(command.split()) == 0
        text = Path("sound.csv").read_text()
        Path(EDITED).write_text(re.sub(r"(?m)^# sha256=.*\n", "", text))
        Path("edited.nc").write_bytes(Path("sound.nc").read_bytes())
        with netCDF4.Dataset("edited.nc", "a") as file:
            del file.sha256
    return folder


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for path in made.iterdir():
        shutil.copy(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def warnings_of(command: str, edited: str, capsys: pytest.CaptureFixture[str], code: int) -> list[str]:
    capsys.readouterr()
    assert main(command.format(edited=edited).split()) == code
    return [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: ")]


@pytest.mark.slow
@pytest.mark.parametrize("edited", [EDITED, "edited.nc"])
@pytest.mark.parametrize("command", COMMANDS)
def test_command_says_it_and_ends_with_status_3(
    here: Path, capsys: pytest.CaptureFixture[str], command: str, edited: str
) -> None:
    warned = warnings_of(command, edited, capsys, 3)
    assert any(line.startswith(f"warning: {edited}: unverified: a checksum was absent") for line in warned)
    sound = warnings_of(command.replace("out", "sound_out"), "sound.csv" if edited == EDITED else "sound.nc", capsys, 0)
    assert not any("unverified" in line for line in sound)


@pytest.mark.parametrize("command", ON_NETCDF)
def test_command_that_needs_a_covariance_says_it(here: Path, capsys: pytest.CaptureFixture[str], command: str) -> None:
    warned = warnings_of(command, "edited.nc", capsys, 3)
    assert any(line.startswith("warning: edited.nc: unverified: ") for line in warned)


@pytest.mark.slow
@pytest.mark.parametrize("command", [command for command in (*COMMANDS, *ON_NETCDF) if re.search(r"out\S*$", command)])
def test_what_is_written_says_it(here: Path, capsys: pytest.CaptureFixture[str], command: str) -> None:
    warnings_of(command, "edited.nc", capsys, 3)
    (out,) = here.glob("out*")
    if out.suffix == ".nc":
        with netCDF4.Dataset(out) as file:
            said = [name for name in file.ncattrs() if name.startswith("unverified")]
            assert file.sha256
        assert said
    elif out.suffix != ".svg":  # its texts are paths
        text = (out / "compensation.ini" if out.is_dir() else out).read_text("utf-8")
        assert WORD.search(text) or "nverified" in text or "unverified=a checksum was absent" in text


@pytest.mark.parametrize(
    ("command", "out"),
    [
        ("export {edited} --to linuxcnc-kins -o out.csv", "out.csv"),
        ("recheck {edited} other.toml other.csv --update out.csv", "out.csv"),
        ("recheck {edited} other.toml other.csv --update out.nc", "out.nc"),
    ],
)
def test_calibration_written_from_it_is_unverified_beside_its_own_checksum(
    here: Path, capsys: pytest.CaptureFixture[str], command: str, out: str
) -> None:
    warnings_of(command, "edited.nc", capsys, 3)
    assert sd.read_calibration(out).unverified
    if out.endswith(".csv"):
        assert re.search(r"(?m)^# sha256=[0-9a-f]{64}$", Path(out).read_text())
    again = warnings_of("export {edited} --to linuxcnc-kins -o again.csv", out, capsys, 3)
    assert any("unverified" in line for line in again)
    assert sd.read_calibration("again.csv").unverified


def test_set_for_linuxcnc_comp_says_it_to_check(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    warnings_of("export {edited} --to linuxcnc-comp -o out", EDITED, capsys, 3)
    assert any("unverified" in line for line in warnings_of("check out/compensation.ini", EDITED, capsys, 3))


@pytest.mark.parametrize("edited", [EDITED, "edited.nc", "sound.csv", "sound.nc"])
def test_objects_say_it(here: Path, capsys: pytest.CaptureFixture[str], edited: str) -> None:
    unverified = edited.startswith("edited")
    for command, fit_of in (
        ("report {edited} --json", lambda said: said["fit"]),
        ("volume {edited} --json", lambda said: said["fit"]),
        ("check {edited} --json", lambda said: said["files"][0]["fit"]),
        ("compare sound.nc {edited} --json", lambda said: said["b"]["fit"]),
        ("positions {edited} --json", lambda said: said["predicted"]["fit"]),
        ("export {edited} --to squareness -o out.csv --json", lambda said: said["fit"]),
    ):
        capsys.readouterr()
        assert main(command.format(edited=edited).split()) == (3 if unverified else 0)
        said = json.loads(capsys.readouterr().out)
        assert fit_of(said)["unverified"] is unverified
        assert any("unverified" in warning for warning in said["warnings"]) is unverified


@pytest.mark.parametrize("edited", [EDITED, "edited.nc"])
def test_read_and_written_in_python_it_stays_unverified(here: Path, edited: str) -> None:
    read = sd.read_calibration(edited)
    assert read.unverified
    for copy in ("copy.csv", "copy.nc"):
        read.write(copy)
        assert sd.read_calibration(copy).unverified
        assert sd.read_calibration(copy).provenance == read.provenance
        assert sd.read_calibration(copy).dated("2026-01-01").unverified
    assert not sd.read_calibration(edited.replace("edited", "sound")).unverified


def test_compensator_refuses_it_unless_told(here: Path) -> None:
    sd.read_calibration(EDITED).write("copy.csv")
    for table in (EDITED, "copy.csv", sd.read_calibration("edited.nc"), sd.read_calibration(EDITED).to_error_map()):
        with pytest.raises(sd.InvalidArgument, match=r"unverified: a checksum was absent .*accept_unverified"):
            sd.Compensator(table, CHAIN)
        with pytest.raises(sd.InvalidArgument, match="unverified"):
            sd.Compensator(table, CHAIN, accept_rejected=True)
        with pytest.warns(UserWarning, match="table is unverified"):
            assert sd.Compensator(table, CHAIN, accept_unverified=True).unverified
    assert not sd.Compensator("sound.csv", CHAIN).unverified


def test_calibration_of_an_earlier_version_is_unverified(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without `format`, and with the number of its rows in place of the checksum."""
    text = re.sub(r"(?m)^# format=.*\n", "", Path(EDITED).read_text())
    rows = len([line for line in text.splitlines() if not line.startswith("#")]) - 1
    Path("old.csv").write_text(f"# rows={rows}\n{text}")
    assert sd.read_calibration("old.csv").unverified
    assert any("unverified" in line for line in warnings_of("check {edited}", "old.csv", capsys, 3))


def test_error_map_made_from_it_says_it(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sd.read_calibration(EDITED).to_error_map().write("map.csv")
    for command in ("check map.csv", "compare sound.csv map.csv", "export map.csv --to linuxcnc-kins -o t.csv"):
        assert any(": unverified: " in line for line in warnings_of(command, EDITED, capsys, 3))
    with pytest.raises(sd.InvalidArgument, match=r"map\.csv: unverified"):
        sd.Compensator("map.csv", CHAIN)


def test_error_map_needs_no_checksum(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("map.csv").write_text("parameter,position_mm,value,unit,standard_uncertainty\nC0Y,,1.0,urad,\n")
    assert not warnings_of("check map.csv", EDITED, capsys, 0)
