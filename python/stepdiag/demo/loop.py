"""The closed loop: a controller measures a machine, compensates with the calibration, and repeats.

All steps use the commands' functions (nc, twin, acquire, evaluate) and their files. The loop is
judged by the virtual machine itself: the exact pose of its tool at the axis positions that the
controller commands.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from stepdiag.demo.loop_cases import CASES, STEPS, LoopCase, runs_of, scenario_text
from stepdiag.demo.loop_figure import draw_loop
from stepdiag.demo.loop_job import Calculated, Controller
from stepdiag.demo.loop_linuxcnc import Linuxcnc
from stepdiag.demo.loop_outcome import LoopOutcome, Progress, repetitions, run_case
from stepdiag.demo.loop_report import point_table, report_lines
from stepdiag.io import outputs
from stepdiag.io.whole_files import make_folder, write_whole

NODES: Final = 100  # nodes of the plan's grid that the controller goes to; all of them are calculated
COUNT: Final = 1000  # random points
SEEDS: Final = 40  # repetitions of the noisy case, by calculation


def claim_loop(folder: Path, steps: int = STEPS) -> Path:
    """Return the folder if only files of an earlier loop would be lost. Raises InvalidArgument."""
    scenarios = {}
    files: dict[str, outputs.FileKind | str] = {
        **{"report.txt": outputs.REPORT, "points.csv": outputs.POINTS},
        **{"loop.png": outputs.PNG, "loop.svg": outputs.SVG},
    }
    for case in CASES:
        files[case.truth] = outputs.ERROR_MAP
        files[f"{case.name}/program.ngc"] = outputs.PROGRAM
        files[f"{case.name}/calibration.csv"] = outputs.CALIBRATION
        for run, in_use in runs_of(case):
            scenarios[f"{run}/scenario.toml"] = scenario_text(case, steps, in_use=in_use)
            files[f"{run}/run.csv"] = outputs.MEASUREMENT
            files[f"{run}/run.raw.jsonl"] = outputs.RAW
            files[f"{run}/points.ngc"] = outputs.PROGRAM
    return outputs.claim_folder(folder, files | scenarios, marks=scenarios)


def run_loop(
    folder: Path,
    controller: Controller,
    *,
    cases: Sequence[LoopCase] = CASES,
    steps: int = STEPS,
    nodes: int = NODES,
    count: int = COUNT,
    seeds: int = SEEDS,
    progress: Progress = lambda text: None,
) -> list[str]:
    """Write all files of the loop into `folder`. Returns the lines of its report."""
    make_folder(folder)
    outcomes: list[LoopOutcome] = []
    standing = None  # where the axes stand for the points without compensation: once for all machines
    for case in cases:
        outcome, standing = run_case(case, folder, controller, standing, steps, (nodes, count), progress)
        outcomes.append(outcome)
    repeated = None
    if seeds and any(case.noise for case in cases):
        progress(f"noise: {seeds} repetitions, calculated")
        repeated = repetitions(next(outcome for outcome in outcomes if outcome.case.noise), seeds)
    report = list(report_lines(outcomes, repeated, controller.name))
    write_whole(folder / "report.txt", "\n".join(report) + "\n")
    write_whole(folder / "points.csv", point_table(outcomes))
    progress("draw the figure")
    for name, content in draw_loop(outcomes, repeated).items():
        write_whole(folder / name, content)
    return [
        *report,
        "",
        f"All files are in {folder}: loop.png, loop.svg, report.txt, points.csv, the truths, and for every case",
        "scenario.toml, program.ngc, run.csv, calibration.csv, and in other folders (-again, -cold) the later runs.",
    ]


def controller_of(name: str) -> Controller:
    """The controller by its name on the command line."""
    return Calculated() if name == "calculated" else Linuxcnc()
