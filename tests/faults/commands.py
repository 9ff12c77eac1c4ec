"""The commands of the campaign, in a folder with their inputs, and what each of them writes there."""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Command:
    """A command line, and the files and folders that it writes.

    `resumed`: its further arguments after an interruption. `kept`: files that stay for that, wherever it ends.
    `in_book`: it changes the machine book of the inputs."""

    arguments: str
    writes: tuple[str, ...]
    resumed: str | None = None
    kept: tuple[str, ...] = ()
    in_book: bool = False

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

ADDED = ("scenario.toml", "run.csv", "calibration.nc")  # of the inputs, those in the book

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
    Command("export calibration.csv --to squareness -o out.csv --accept-rejected --incomplete", ("out.csv",)),
    Command("export calibration.csv --to matrix -o out.hal --accept-rejected --incomplete", ("out.hal",)),
    Command("plot calibration.csv -o out.svg", ("out.svg",)),
    Command("plot run.csv -o out.png", ("out.png",)),
    Command("report calibration.csv -o out.html", ("out.html",)),
    Command("compare calibration.csv map.csv -o out.csv", ("out.csv",)),
    Command("compare calibration.csv map.csv -o out.nc", ("out.nc",)),
    Command("observe scenario.toml --steps 2,3 -o out.csv", ("out.csv",)),
    Command("uncertainty scenario.toml -o out.csv", ("out.csv",)),
    Command("uncertainty scenario.toml -m enhanced -n 4000 -o out.nc", ("out.nc",), "--resume", ("out.nc.checkpoint",)),
    Command("study study.toml -o out.nc", ("out.nc",), "--resume", ("out.nc.cells",)),
    Command("recheck calibration.nc again.toml again.csv --update out.nc", ("out.nc",)),
    Command("recheck calibration.nc again.toml again.csv --update out.csv", ("out.csv",)),
    Command("import sheet.csv --overwrite -o out.csv", ("out.csv",)),
    Command("import sheet.xlsx --overwrite -o out.nc", ("out.nc",)),
    Command("plan planned.toml -o out.csv", ("out.csv",)),
    Command("acquire --from-raw out.raw.jsonl -o out.csv", ("out.csv",)),
    Command("init -o new", ("new",)),
    Command("head show beam_and_psd -o out.svg", ("out.svg",)),
    *(
        Command(f"{arguments} --book book", (), in_book=True)
        for arguments in (
            "book new Other",
            "book add --machine M again.csv",
            "book add --machine M mapped.toml",
            "book remove --machine M calibration.nc",
            "book reindex",
            "evaluate --machine M",
            "export --machine M --to linuxcnc-comp --accept-rejected --incomplete",
            "report --machine M -o report.html",
        )
    ),
)


PLANNED = '[plan_by_time]\nsteps = [5]\nrepeats = [1]\nline_sets = [["ppp", "npp", "p00"]]\n'


def make_inputs(folder: Path, scenario: str, main: Callable[[list[str]], int]) -> int:
    """Scenarios, runs, a raw file, sheets, calibrations, error map and study."""
    import openpyxl

    import stepdiag

    folder.mkdir(parents=True)
    (folder / "scenario.toml").write_text(scenario)
    (folder / "again.toml").write_text(scenario.replace("steps = 5", "steps = 1").replace("seed = 3", "seed = 4"))
    (folder / "planned.toml").write_text(scenario + PLANNED)
    (folder / "study.toml").write_text(STUDY)
    os.chdir(folder)
    for line in (
        "simulate scenario.toml -o run.csv",
        "simulate scenario.toml -o run.nc",
        "simulate again.toml -o again.csv",
        "evaluate scenario.toml run.csv -o calibration.csv",
        "evaluate scenario.toml run.csv -o calibration.nc",
    ):
        assert main(line.split()) in (0, 3), line
    stepdiag.read_scenario("scenario.toml").machine().errors.write("map.csv")
    with_map = scenario.replace("[machine.random]\nseed = 7", 'errors = "map.csv"')
    (folder / "mapped.toml").write_text(with_map.replace("[machine.random]\nseed = 8", 'errors = "map.csv"'))
    assert main(["book", "new", "M", "--book", "book"]) == 0
    assert main(["book", "add", "--book", "book", "--machine", "M", *ADDED]) == 0
    rows = [line.split(",") for line in Path("run.csv").read_text().splitlines() if not line.startswith("#")]
    Path("sheet.csv").write_text("\n".join(";".join(row).replace(".", ",") for row in rows))
    book = openpyxl.Workbook()
    for k, row in enumerate(rows):
        book.active.append(row if k == 0 else [row[0], *(float(value) if value else None for value in row[1:])])
    book.save("sheet.xlsx")
    from hostile import acquiring, make_place, serving
    from processes import in_child

    make_place(folder / "acquired")
    with serving("program", "sound", 1) as source:
        done = in_child(acquiring(folder / "acquired", source), folder / "acquired.said")
    assert done.status == 0, done
    (folder / "acquired" / "out.raw.jsonl").rename("out.raw.jsonl")
    shutil.rmtree("acquired")
    for ending in ("said", "told"):
        Path(f"acquired.{ending}").unlink()
    return 0
