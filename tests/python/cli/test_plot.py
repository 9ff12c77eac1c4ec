"""The command plot: every kind of file, the same bytes in every run, where it writes, and mistakes in a line."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from systems import with_slashes

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.io.file_kind import kind_of_file


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from small_scenario import SCENARIO

    folder: Path = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(SCENARIO)
        for command in (
            "simulate scenario.toml -o run.csv",
            "simulate scenario.toml -o run.nc",
            "evaluate scenario.toml run.csv -o a.csv",
            "evaluate scenario.toml run.csv -o b.nc -m enhanced",
            "compare a.csv b.nc -o c.csv",
            "compare a.csv b.nc -o c.nc",
            "uncertainty scenario.toml -o u.nc",
            "uncertainty scenario.toml -o u.csv",
            "observe scenario.toml --steps 2,5,10 -o steps.csv",
        ):
            assert main(command.split()) == 0
        errors = sd.read_scenario("scenario.toml").machine().errors
        errors.write("map.csv")
        sd.read_calibration("a.csv").judged("rejected", ["it contradicts itself"]).write("bad.csv")
        Path("notes.txt").write_text("my notes\n")
    return folder


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


EVERY_KIND = [
    "a.csv",
    "b.nc",
    "a.csv map.csv",
    "a.csv --truth map.csv",
    "a.csv --volume",
    "a.csv b.nc",
    "run.csv",
    "run.nc",
    "run.csv scenario.toml",
    "run.csv --scenario scenario.toml",
    "c.csv",
    "c.nc",
    "u.nc",
    "u.csv",
    "map.csv",
    "scenario.toml",
    "steps.csv",
]


@pytest.mark.slow
@pytest.mark.parametrize("files", EVERY_KIND)
def test_every_kind_is_drawn_with_the_same_bytes_twice(files: str, here: Path) -> None:
    assert main(["plot", *files.split(), "-o", "one.png"]) == 0
    assert main(["plot", *files.split(), "-o", "two.png"]) == 0
    assert kind_of_file(Path("one.png")) == "PNG picture"
    assert Path("one.png").read_bytes() == Path("two.png").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_vector_files_have_the_same_bytes_twice(suffix: str, here: Path) -> None:
    for name in ("one", "two"):
        assert main(["plot", "a.csv", "-o", f"{name}.{suffix}"]) == 0
    assert Path(f"one.{suffix}").read_bytes() == Path(f"two.{suffix}").read_bytes()


def test_without_a_name_it_writes_beside_the_first_file_and_says_so(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On a terminal as elsewhere: what a command writes does not depend on where its text goes."""
    (here / "folder").mkdir()
    shutil.move("a.csv", "folder/a.csv")
    assert main(["plot", "folder/a.csv", "map.csv"]) == 0
    assert with_slashes(capsys.readouterr().out) == "wrote folder/a.png\n"
    first = Path("folder/a.png").read_bytes()
    assert main(["plot", "folder/a.csv"]) == 0, "its own older figure is replaced"
    assert Path("folder/a.png").read_bytes() != first


def test_pictures_of_others_are_not_replaced_unless_named(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from matplotlib.figure import Figure

    Figure().savefig("a.png")
    before = Path("a.png").read_bytes()
    assert main(["plot", "a.csv"]) == 2
    said = capsys.readouterr().err
    assert said == "stepdiag: error: a.png: is a picture that stepdiag has not made; name another one with -o\n"
    assert Path("a.png").read_bytes() == before
    assert main(["plot", "a.csv", "-o", "a.png"]) == 0


@pytest.mark.slow
def test_rejected_fit_ends_with_code_3_and_a_marked_figure(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["bad.csv"], ["a.csv", "bad.csv"], ["bad.csv", "--volume"]):
        assert main(["plot", *arguments, "-o", "bad.svg"]) == 3
        assert "warning: bad.csv: the fit is rejected: do not use this calibration\n" in capsys.readouterr().err
        assert "FIT REJECTED" in Path("bad.svg").read_text()


MISTAKES = [
    ("notes.txt", "expected a calibration (with an error map as its truth), two calibrations, "),
    ("map.csv run.csv", "got map.csv: error map, run.csv: measurement"),
    ("map.csv --volume", "--volume: expected a calibration, got map.csv"),
    ("a.csv run.csv", "got a.csv: calibration, run.csv: measurement"),
    ("nothing.csv", "nothing.csv: "),
    ("run.csv --volume", "--volume: expected a calibration, got run.csv"),
    ("a.csv --truth run.csv", "--truth: expected the error map of a calibration, got run.csv: measurement"),
    ("run.csv --truth map.csv", "--truth: goes with a calibration, got run.csv"),
    ("a.csv --scenario scenario.toml", "--scenario: goes with a measurement, got a.csv"),
    ("a.csv -o a.jpg", "a.jpg: expected a name that ends in .png, .svg or .pdf"),
    ("a.csv -o a.csv", "a.csv: is also an input"),
    ("a.csv map.csv --volume", "--volume: expected a calibration alone, without an error map"),
]


@pytest.mark.parametrize(("arguments", "message"), MISTAKES)
def test_mistakes_are_named_in_a_line(
    arguments: str, message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(here.iterdir())
    assert main(["plot", *arguments.split()]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert sorted(here.iterdir()) == before


def test_damaged_files_are_refused_by_name(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.csv", "c.csv", "run.csv", "u.csv", "map.csv", "steps.csv"):
        lines = Path(name).read_text().splitlines()
        Path(f"bad-{name}").write_text("\n".join([*lines[:-1], lines[-1].replace(",", ";")]) + "\n")
        assert main(["plot", f"bad-{name}", "-o", "x.png"]) == 2
        assert f"bad-{name}" in capsys.readouterr().err
    data = Path("u.nc").read_bytes()
    Path("bad.nc").write_bytes(data[: len(data) // 2])
    assert main(["plot", "bad.nc", "-o", "x.png"]) == 2
    assert not Path("x.png").exists()


def test_importing_the_package_imports_no_matplotlib() -> None:
    text = "import sys, stepdiag; assert not {'matplotlib', 'xarray', 'pydantic'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", text], check=True)


@pytest.mark.slow
def test_picture_has_the_size_of_its_figure(here: Path) -> None:
    from PIL import Image

    assert main(["plot", "a.csv", "-o", "a.png"]) == 0
    picture = np.asarray(Image.open("a.png").convert("RGB"))
    assert picture.shape[1] == 2144  # 13.4 inches of 160 pixels
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
