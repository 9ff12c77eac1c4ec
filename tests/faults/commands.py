"""The commands of the campaign, in a folder with their inputs, and what each of them writes there."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Command:
    """A command line, and the files and folders that it writes.

    `resumed`: its further arguments after an interruption. `kept`: files that stay for that, wherever it ends."""

    arguments: str
    writes: tuple[str, ...]
    resumed: str | None = None
    kept: tuple[str, ...] = ()

    @property
    def words(self) -> list[str]:
        return self.arguments.split()


STUDY = """
[study]
scenario = "scenario.toml"
methods = ["enhanced"]
samples = 0
[grid]
plan.steps = [2, 3]
"""

COMMANDS = (
    Command("simulate scenario.toml --overwrite -o out.csv", ("out.csv",)),
    Command("simulate scenario.toml --overwrite -o out.nc", ("out.nc",)),
    Command("evaluate scenario.toml run.csv -o out.csv", ("out.csv",)),
    Command("evaluate scenario.toml run.csv -o out.nc", ("out.nc",)),
    Command("evaluate scenario.toml run.csv -m enhanced -o out.nc", ("out.nc",)),
    Command("nc scenario.toml -o out.ngc", ("out.ngc",)),
    Command("export calibration.csv --to linuxcnc-kins -o out.csv --accept-rejected --incomplete", ("out.csv",)),
    Command("export calibration.csv --to linuxcnc-comp -o comp --accept-rejected --incomplete", ("comp",)),
    Command("export calibration.csv --to isg -o out.csv --accept-rejected --incomplete", ("out.csv",)),
    Command("export calibration.csv --to csv-grid -o out.csv --accept-rejected --incomplete", ("out.csv",)),
    Command("plot calibration.csv -o out.svg", ("out.svg",)),
    Command("plot run.csv -o out.png", ("out.png",)),
    Command("report calibration.csv -o out.html", ("out.html",)),
    Command("compare calibration.csv map.csv -o out.csv", ("out.csv",)),
    Command("compare calibration.csv map.csv -o out.nc", ("out.nc",)),
    Command("observe scenario.toml --steps 2,3 -o out.csv", ("out.csv",)),
    Command("uncertainty scenario.toml -o out.csv", ("out.csv",)),
    Command("uncertainty scenario.toml -m enhanced -n 4000 -o out.nc", ("out.nc",), "--resume", ("out.nc.checkpoint",)),
    Command("study study.toml -o out.nc", ("out.nc",), "--resume", ("out.nc.cells",)),
    Command("init -o new", ("new",)),
    Command("head show beam_and_psd -o out.svg", ("out.svg",)),
)


def make_inputs(folder: Path, scenario: str, main: Callable[[list[str]], int]) -> int:
    """Scenario, run, calibration, error map and study."""
    folder.mkdir(parents=True)
    (folder / "scenario.toml").write_text(scenario)
    (folder / "study.toml").write_text(STUDY)
    os.chdir(folder)
    for line in (
        "simulate scenario.toml -o run.csv",
        "simulate scenario.toml -o run.nc",
        "evaluate scenario.toml run.csv -o calibration.csv",
        "evaluate scenario.toml run.csv -o calibration.nc",
    ):
        assert main(line.split()) in (0, 3), line
    import stepdiag

    stepdiag.read_scenario("scenario.toml").machine().errors.write("map.csv")
    return 0
