"""Nothing is lost: no command writes over its inputs, nor over a file that is not an older result of its own kind."""

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import acquiring
import click
import numpy as np
import pytest
import xarray as xr
from places import SHIPPED_HEADS
from small_scenario import SCENARIO, of_map
from systems import link_under

import stepdiag as sd
from stepdiag._core import InvalidArgument
from stepdiag.cli import main
from stepdiag.cli.command_line import cli
from stepdiag.cli.options import Writes
from stepdiag.demo.loop import claim_loop, run_loop
from stepdiag.demo.loop_job import Calculated
from stepdiag.demo.paper import claim_demo, run_demo
from stepdiag.exporting.formats import FORMATS
from stepdiag.io.file_kind import kind_of_file
from stepdiag.twin.server import Twin

PLANNED = SCENARIO + '[plan_by_time]\nsteps = [5]\nrepeats = [1]\nline_sets = [["ppp", "npp", "p00"]]\n'
STUDY = '[study]\nscenario = "scenario.toml"\nsamples = 0\n[grid]\nplan.steps = [2]\n'
OUT: Final = "OUT"
NOBODY: Final = ("--source", "ids3010://127.0.0.1:1")
PLACES: Final = ("FILE", "DIR", "OUT", "FOLDER", "PATH", "HEAD", "SCENARIO")  # metavars of what is on a disk

# Every option that writes a file: how it is used, and the endings that it takes. What it reads stands in the command.
FILES: dict[tuple[str, str], list[tuple[list[str], tuple[str, ...]]]] = {
    ("simulate", "output"): [(["scenario.toml", "-o", OUT], (".csv", ".nc"))],
    ("import", "output"): [(["run.csv", "-o", OUT], (".csv", ".nc"))],
    ("evaluate", "output"): [(["scenario.toml", "run.csv", "-o", OUT], (".csv", ".nc"))],
    ("observe", "output"): [(["scenario.toml", "--steps", "2", "-o", OUT], (".csv",))],
    ("plan", "output"): [(["scenario.toml", "-o", OUT], (".csv", ".png", ".svg", ".pdf"))],
    ("plan", "written"): [(["scenario.toml", "--write", OUT], (".toml",))],
    ("uncertainty", "output"): [(["scenario.toml", "-o", OUT], (".csv", ".nc"))],
    ("uncertainty", "checkpoint"): [(["scenario.toml", "-n", "1e4", "--checkpoint", OUT], (".checkpoint",))],
    ("study", "output"): [(["study.toml", "-o", OUT], (".nc",))],
    ("nc", "output"): [
        (["scenario.toml", "-o", OUT], (".ngc", ".txt")),
        (["scenario.toml", "--dialect", "iso", "-o", OUT], (".iso",)),
    ],
    ("acquire", "output"): [
        (["beams.toml", *NOBODY, "-o", OUT], (".csv", ".nc")),
        (["--from-raw", "acquired.raw.jsonl", "-o", OUT], (".csv", ".nc")),
    ],
    ("acquire", "raw"): [
        (["beams.toml", *NOBODY, "-o", "acquired.csv", "--raw", OUT], (".jsonl",)),
        (["beams.toml", *NOBODY, "-o", "acquired.csv", "--resume", "--raw", OUT], (".jsonl",)),
    ],
    ("report", "output"): [
        (["calibration.csv", "--scenario", "scenario.toml", "--run", "run.csv", "-o", OUT], (".html",))
    ],
    ("report", "functional_point"): [(["calibration.csv", "--functional-point", OUT], (".csv",))],
    ("plot", "output"): [(["calibration.csv", "-o", OUT], (".png", ".svg", ".pdf"))],
    ("compare", "output"): [(["calibration.csv", "calibration.nc", "-o", OUT], (".csv", ".nc"))],
    ("recheck", "update"): [(["calibration.nc", "scenario.toml", "again.nc", "--update", OUT], (".csv", ".nc"))],
    ("export", "output"): [
        (["calibration.csv", "--to", "linuxcnc-kins", "-o", OUT], (".csv",)),
        (["calibration.csv", "--to", "isg", "-o", OUT], (".csv",)),
        (["calibration.csv", "--to", "csv-grid", "--nodes", "2", "2", "2", "-o", OUT], (".csv",)),
        (["calibration.csv", "--to", "squareness", "-o", OUT], (".csv",)),
        (["calibration.csv", "--to", "matrix", "-o", OUT], (".hal",)),
        (["calibration.csv", "--to", "calibxyzkins", "-o", OUT], (".hal",)),
        (["calibration.csv", "--to", "siemens-cec", "-o", OUT], (".ini", ".mpf", ".arc")),
        (["calibration.csv", "--to", "siemens-enc-comp", "-o", OUT], (".ini",)),
        (["calibration.csv", "--to", "etalon", "-o", OUT], (".txt", ".etalon")),
        (["calibration.csv", "--to", "klipper", "-o", OUT], (".gcode", ".g", ".cfg")),
        (["calibration.csv", "--to", "position-error", "--axis", "Y", "--depends-on", "X", "-o", OUT], (".csv",)),
    ],
    ("export", "proof"): [
        (["calibration.csv", "--to", "siemens-cec", "-o", "cec.ini", "--proof", OUT], (".mpf", ".txt"))
    ],
    ("selftest", "output"): [(["-o", OUT], (".txt",))],
    ("head show", "output"): [(["three_beams.toml", "-o", OUT], (".png", ".svg", ".pdf"))],
}
# Every option that writes a folder: see the tests of these.
FOLDERS = {("demo", "output"), ("init", "output"), ("export", "output")}
# Every parameter that names a file to read.
INPUTS = {
    *{(name, "scenario") for name in ("simulate", "evaluate", "observe", "plan", "uncertainty", "nc")},
    *{
        ("acquire", "scenario"),
        ("acquire", "from_raw"),
        ("align", "scenario"),
        ("twin", "scenario"),
        ("init", "scenario"),
        ("study", "file"),
    },
    *{("report", name) for name in ("calibrations", "scenario", "run", "uncertainty", "logo")},
    *{("import", "files"), ("import", "scenario"), ("evaluate", "run"), ("verify", "tables")},
    *{("compare", "a"), ("compare", "b"), ("positions", "file")},
    *{("verify", name) for name in ("calibration", "scenario", "run")},
    *{("recheck", name) for name in ("baseline", "scenario", "run")},
    ("plan", "baseline"),
    ("plan", "measured"),
    *{
        ("export", "calibration"),
        ("export", "replaces"),
        ("export", "ini"),
        ("volume", "calibration"),
        ("book add", "files"),
    },
    *{("check", "files"), ("head show", "name"), ("head check", "name"), ("head sensitivity", "name")},
    *{("plot", "files"), ("plot", "truth"), ("plot", "scenario"), ("acquire", "temperatures")},
}
# Of files that are continued, if their header is that of the command; others are refused (test_temperatures.py).
APPENDED = {("twin", "temperatures")}


@dataclass(frozen=True)
class Way:
    """A command that writes a file of this ending."""

    command: str
    arguments: tuple[str, ...]
    ending: str

    @property
    def out(self) -> Path:
        return Path(f"out{self.ending}")

    def run(self, out: Path | None = None, *more: str) -> int:
        words = (str(out or self.out) if word == OUT else word for word in self.arguments)
        return main([*self.command.split(), *words, *more])

    def __str__(self) -> str:
        return f"{self.command} {' '.join(self.arguments)} {self.ending}"


WAYS = [
    Way(command, tuple(arguments), ending)
    for (command, _), uses in FILES.items()
    for arguments, endings in uses
    for ending in endings
]
every_way = pytest.mark.parametrize("way", WAYS, ids=str)


@dataclass(frozen=True)
class Made:
    """A folder of files that commands read, and elsewhere a file of every kind: `own` by what writes it."""

    folder: Path
    own: dict[Way, bytes]
    others: dict[str, bytes]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder: Path = tmp_path_factory.mktemp("made")
    own = {}
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(PLANNED)
        Path("study.toml").write_text(STUDY)
        Path("beams.toml").write_text(acquiring.SCENARIO.format(plan=acquiring.SMALL, head=acquiring.BEAMS, noise=""))
        assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
        assert main(["simulate", "scenario.toml", "-o", "again.nc"]) == 0
        for name in ("calibration.csv", "calibration.nc"):
            assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 0
        shutil.copy(SHIPPED_HEADS / "three_beams.toml", folder)
        described = sd.read_scenario("beams.toml")
        with Twin(described) as twin:
            acquiring.acquire_through(described, twin, Path("acquired.csv"))
        for way in WAYS:
            if NOBODY[1] in way.arguments:
                own[way] = Path("acquired.raw.jsonl" if way.ending == ".jsonl" else "acquired.csv").read_bytes()
            else:
                assert way.run() == 0, way
                own[way] = way.out.read_bytes()
                way.out.unlink()
        others = {str(kind_of_file(path)): path.read_bytes() for path in folder.iterdir()}
        xr.Dataset({"EXX": ("x", np.zeros(3))}, attrs={"format": "of others"}).to_netcdf("others.nc")
        others["netCDF file of others"] = Path("others.nc").read_bytes()
        Path("others.nc").unlink()
    others["half a netCDF file"] = (folder / "calibration.nc").read_bytes()[:8000]
    others["text"] = b"my notes on the machine\n"
    others["something binary"] = bytes(range(256)) * 300
    return Made(folder, own, others)


@pytest.fixture
def folder(made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the files that commands read."""
    shutil.copytree(made.folder, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def content(folder: Path) -> dict[str, bytes]:
    """Without what an acquisition shows to others."""
    found = [path for path in folder.rglob("*") if path.is_file()]
    shown = (".live.json", ".control.jsonl")
    return {str(path.relative_to(folder)): path.read_bytes() for path in found if not path.name.endswith(shown)}


@contextmanager
def nothing_is_lost(folder: Path, what: str) -> Iterator[None]:
    before = content(folder)
    yield
    assert content(folder) == before, what


def commands(group: click.Group = cli, prefix: str = "") -> Iterator[tuple[str, click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from commands(command, f"{prefix}{name} ")
        else:
            yield f"{prefix}{name}", command


def test_every_option_that_writes_is_known_here() -> None:
    """A new one that is declared to read (PATH), or as a plain text, is noticed, too."""
    writes, reads = set(), set()
    for name, command in commands():
        for parameter in command.params:
            if parameter.name == "book":  # a folder in which nothing is replaced: tests/python/book
                continue
            named = parameter.metavar if isinstance(parameter, click.Option) else parameter.human_readable_name
            if isinstance(parameter.type, Writes):
                writes.add((name, parameter.name))
            elif isinstance(parameter.type, click.Path | click.File) or named in PLACES:
                reads.add((name, parameter.name))
    assert writes == FILES.keys() | FOLDERS
    assert reads == INPUTS | APPENDED


@pytest.mark.slow
@every_way
def test_what_is_of_another_kind_is_not_replaced(
    way: Way, made: Made, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    way.out.write_bytes(made.own[way])
    mine = kind_of_file(way.out)
    assert mine is not None
    others = {str(other): data for other, data in made.own.items()} | made.others
    for name, data in others.items():
        way.out.write_bytes(data)
        if kind_of_file(way.out) == mine:
            continue
        capsys.readouterr()
        with nothing_is_lost(folder, name):
            assert way.run() == 2, name
        said = capsys.readouterr().err
        assert said.startswith(f"stepdiag: error: {way.out}: is ")
        assert f", and is not replaced by a{'n' if mine[0] in 'aeiouI' else ''} {mine}: move it away" in said
        assert said.count("\n") == 1


@every_way
def test_own_inputs_are_not_replaced_under_any_name(way: Way, folder: Path) -> None:
    inputs = [Path(word) for word in way.arguments if Path(word).is_file()]
    assert inputs or way.command == "selftest"
    for given in inputs:
        with nothing_is_lost(folder, str(given)):
            assert way.run(given) == 2
        if link_under(way.out, given):
            with nothing_is_lost(folder, str(given)):
                assert way.run() == 2
            way.out.unlink()
        way.out.hardlink_to(given)
        with nothing_is_lost(folder, str(given)):
            assert way.run() == 2
        way.out.unlink()


@every_way
def test_unknown_endings_are_refused(way: Way, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    endings = {".dat", ".toml", "", ".csv.bak", *([".nc"] if way.command == "nc" else [])} - {way.ending}
    for ending in endings:
        capsys.readouterr()
        with nothing_is_lost(folder, ending):
            assert way.run(Path(f"result{ending}")) == 2
        said = capsys.readouterr().err
        assert f"result{ending}: expected a name that ends in " in said
        assert way.ending in said


@pytest.mark.slow
@every_way
def test_older_result_is_replaced_where_it_can_be_computed_again(
    way: Way, made: Made, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refusals = {
        "simulate": "perhaps the work of hours: --overwrite replaces it",
        "import": "perhaps the work of hours: --overwrite replaces it",
        "plan": "exists already, perhaps written by hand: name another file",
        "uncertainty": "is the checkpoint of an earlier run: --resume continues it; or remove it",
        "acquire": "exists already: --resume" if way.ending == ".jsonl" else "move it away, or name another -o",
    }
    way.out.write_bytes(made.own[way])
    if "--resume" in way.arguments:
        with nothing_is_lost(folder, "a raw file that is complete"):
            assert way.run() == 0
    elif way.command in ("simulate", "import", "acquire") or way.ending in (".checkpoint", ".toml"):
        with nothing_is_lost(folder, str(way)):
            assert way.run() == 2
        assert refusals[way.command] in capsys.readouterr().err
    else:
        assert way.run() == 0
        assert way.out.read_bytes() == made.own[way]


@pytest.mark.slow
@every_way
def test_empty_file_is_no_loss(way: Way, made: Made, folder: Path) -> None:
    if NOBODY[1] in way.arguments or "--from-raw" in way.arguments:
        return  # an acquisition has rules of its own
    way.out.touch()
    assert way.run() == 0
    assert way.out.read_bytes() == made.own[way]


@pytest.mark.parametrize("ending", [".csv", ".nc"])
def test_measurement_is_replaced_where_the_user_says_so(ending: str, made: Made, folder: Path) -> None:
    way = Way("simulate", ("scenario.toml", "-o", OUT), ending)
    assert way.run() == 0
    Path("scenario.toml").write_text(SCENARIO.replace("seed = 3", "seed = 4"))
    assert way.run(None, "--overwrite") == 0
    assert way.out.read_bytes() != made.own[way]
    Path("calibration.csv").rename("c.csv")
    with nothing_is_lost(folder, "another kind all the same"):
        assert way.run(Path("c.csv"), "--overwrite") == 2


def test_run_is_made_from_its_raw_file_again(folder: Path) -> None:
    assert main(["acquire", "--from-raw", "acquired.raw.jsonl", "--zero", "first", "-o", "acquired.csv"]) == 0
    assert sd.read_measurement("acquired.csv").channels["d1"][0] == 100.0


def test_map_of_a_study_is_not_replaced(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("of_map.toml").write_text(of_map("one.nc"))
    Path("maps.toml").write_text(
        STUDY.replace("scenario.toml", "of_map.toml") + 'machine.errors = ["one.nc", "two.nc"]\n'
    )
    sd.ErrorMap().write("one.nc")
    sd.ErrorMap().write("two.nc")
    for name in ("one.nc", "two.nc"):
        with nothing_is_lost(folder, name):
            assert main(["study", "maps.toml", "-o", name]) == 2
        assert f"{name}: is also an input" in capsys.readouterr().err


@pytest.mark.parametrize("more", [[], ["--resume"]])
@pytest.mark.parametrize("there", ["run.csv", "scenario.toml"])
def test_cells_of_a_study_replace_nothing(there: str, more: list[str], folder: Path) -> None:
    shutil.copy(there, "study.nc.cells")
    with nothing_is_lost(folder, there):
        assert main(["study", "study.toml", "-o", "study.nc", *more]) == 2


@pytest.mark.parametrize("there", ["run.csv", "scenario.toml", "calibration.csv"])
def test_checkpoint_beside_the_result_replaces_nothing(there: str, folder: Path) -> None:
    shutil.copy(there, "u.csv.checkpoint")
    with nothing_is_lost(folder, there):
        assert main(["uncertainty", "scenario.toml", "-n", "1e4", "-o", "u.csv"]) == 2


# --- folders ---------------------------------------------------------------------------------------------------------
FOREIGN = ["my notes\n", SCENARIO, "line,point,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0,0,100\n"]


@pytest.fixture(scope="module")
def demonstrations(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder: Path = tmp_path_factory.mktemp("demonstrations")
    run_demo(folder / "demo")
    small = {"steps": 3, "nodes": 8, "count": 5, "seeds": 0}
    run_loop(folder / "loop", Calculated(), **small)  # type: ignore[arg-type]
    return {"demo": folder / "demo", "loop": folder / "loop"}


@pytest.mark.parametrize("name", ["demo", "loop"])
def test_demonstration_replaces_what_it_has_written_and_nothing_else(
    demonstrations: dict[str, Path], name: str, tmp_path: Path
) -> None:
    folder = tmp_path / name
    shutil.copytree(demonstrations[name], folder)
    claim = claim_demo if name == "demo" else partial(claim_loop, steps=3)
    assert claim(folder) == folder
    assert claim(tmp_path) == tmp_path, "nothing of its files is there"
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        before = file.read_bytes()
        for foreign in FOREIGN:
            if file.name == "run.csv" and foreign == FOREIGN[2]:
                continue  # the run beside a scenario of the demonstration is its own
            file.write_text(foreign)
            with pytest.raises(InvalidArgument, match=f"{re.escape(str(file))}: .*is not replaced"):
                claim(folder)
        file.write_bytes(before)
    changed = next(folder.rglob("scenario.toml"))
    changed.write_text(changed.read_text().replace("steps", "steps "))
    with pytest.raises(InvalidArgument, match="was changed, and is not replaced: name another folder"):
        claim(folder)


@pytest.mark.parametrize("arguments", [["demo"], ["demo", "--controller", "calculated"]])
def test_demo_refuses_the_folder_of_a_user(folder: Path, arguments: list[str]) -> None:
    sd.ErrorMap().write("truth.csv")  # of the same name and kind as the demo's
    with nothing_is_lost(folder, "truth.csv"):
        assert main([*arguments, "-o", "."]) == 2
        assert main([*arguments, "-o", "run.csv"]) == 2


def test_init_replaces_nothing(folder: Path) -> None:
    shutil.copy("calibration.csv", "measurement.csv")
    with nothing_is_lost(folder, "scenario.toml"):
        assert main(["init", "-o", "."]) == 2
        assert main(["init", "-o", ".", "--sheet-for", "scenario.toml"]) == 2
        assert main(["init", "-o", "run.csv"]) == 2


@pytest.mark.parametrize("to", [to for to, one in FORMATS.items() if one.folder])
def test_folder_of_tables_is_written_again_if_it_is_ours(made: Made, folder: Path, to: str) -> None:
    export = ["export", "calibration.csv", "--to", to, "-o", "comp"]
    assert main(export) == 0
    written = content(Path("comp"))
    assert main(export) == 0
    for name, data in written.items():
        for foreign in [*made.others.values(), *(text.encode() for text in FOREIGN)]:
            Path("comp", name).write_bytes(foreign)
            with nothing_is_lost(folder, name):
                assert main(export) == 2
        Path("comp", name).write_bytes(data)
    Path("comp", FORMATS[to].mark).unlink()
    with nothing_is_lost(folder, "somebody else's tables"):
        assert main(export) == 2
