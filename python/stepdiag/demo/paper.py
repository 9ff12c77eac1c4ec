"""The demonstration: the paper's virtual machine, simulated and evaluated by all methods."""

from collections.abc import Callable
from pathlib import Path

from stepdiag.demo.paper_cases import CASES, METHODS, run_case, scenario_of, write_truths
from stepdiag.demo.paper_figure import draw_figure
from stepdiag.demo.paper_report import error_table, screw_note, traced_note, trend_note
from stepdiag.io import outputs
from stepdiag.io.whole_files import make_folder, write_whole


def claim_demo(folder: Path) -> Path:
    """Return the folder if only files of an earlier demonstration would be lost.

    Raises InvalidArgument otherwise."""
    scenarios = {f"{case.name}/scenario.toml": scenario_of(case) for case in CASES}
    files: dict[str, outputs.FileKind | str] = {
        **scenarios,
        **dict.fromkeys(("truth.csv", "truth_screw.csv"), outputs.ERROR_MAP),
        **{f"{case.name}/run.csv": outputs.MEASUREMENT for case in CASES},
        **{f"{case.name}/{method}.csv": outputs.CALIBRATION for case in CASES for method in METHODS},
        **{"report.txt": outputs.REPORT, "figure.png": outputs.PNG, "figure.svg": outputs.SVG},
    }
    return outputs.claim_folder(folder, files, marks=scenarios)


def run_demo(folder: Path, progress: Callable[[str], None] = lambda text: None) -> list[str]:
    """Write all files of the demonstration into `folder`. Returns the lines of its report."""
    make_folder(folder)
    write_truths(folder)
    results = []
    for case in CASES:
        progress(f"{case.name:<3}simulate, evaluate: {case.title}")
        results.append(run_case(case, folder))
    report = [*error_table(results), "", *trend_note(results), "", *traced_note(results), "", *screw_note(results[-1])]
    write_whole(folder / "report.txt", "\n".join(report) + "\n")
    progress("   draw the figure")
    for name, content in draw_figure(results).items():
        write_whole(folder / name, content)
    return [
        *report,
        "",
        f"All files are in {folder}: figure.png, figure.svg, report.txt, the truths, and for every case",
        "scenario.toml, run.csv, conventional.csv, enhanced.csv and adjustment.csv. To go on, for example:",
        f"  stepdiag evaluate {folder / '1b' / 'scenario.toml'} {folder / '1b' / 'run.csv'} -o calibration.csv",
    ]
