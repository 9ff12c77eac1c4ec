"""The command that computes a grid of scenarios."""

from pathlib import Path

import click

from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, out_file, say_of_output, tell
from stepdiag.cli.terminal import say
from stepdiag.cli.workers import chosen_workers, worker_options
from stepdiag.interruption import at_end
from stepdiag.io.outputs import STUDY, OutputFile
from stepdiag.progress import Progress


@click.command(epilog="\b\nExample: stepdiag study study.toml -o study.nc --workers 2")
@click.argument("file", type=PATH, metavar="STUDY")
@out_file("Result to write, netCDF (.nc).", STUDY)
@click.option("--resume", is_flag=True, help="Continue an interrupted study.")
@worker_options
@click.pass_context
def study(
    context: click.Context, file: Path, output: OutputFile, resume: bool, scheduler: str | None, workers: int | None
) -> None:
    """Vary keys of a scenario over a grid, with virtual calibrations for each cell.

    STUDY (TOML) names the scenario, the keys and their values, methods and the number of samples;
    see docs/study.md. The result has a dimension for each key. For each parameter and family it
    contains the largest and the median mean, standard uncertainty and coverage interval over the
    nodes. For a cell that cannot be computed it states the reason. If more than 0.1 % of a cell's
    virtual calibrations give no result, the command ends with a warning and exit code 3.

    Finished cells are kept in a file beside the result until that is written.
    """
    from stepdiag.uncertainty.result import only_survivors
    from stepdiag.uncertainty.study import FinishedCells, run_study
    from stepdiag.uncertainty.study_keys import read_study
    from stepdiag.uncertainty.study_table import write_study

    wanted = read_study(file)
    maps = {str(cell.content["machine"]["errors"]) for cell in wanted.cells() if "errors" in cell.content["machine"]}
    path = output.claim(file, wanted.scenario, *(wanted.scenario.parent / name for name in maps))
    finished = FinishedCells(Path(f"{path}.cells"), resume)

    def continuation() -> str | None:
        if finished.path.stat().st_size == 0:
            finished.path.unlink()
            return None
        return f"{finished.path} has the finished cells: repeat the command with --resume"

    try:
        with at_end(continuation), chosen_workers(scheduler, workers) as chosen, Progress("cells") as progress:
            results = run_study(wanted, finished, workers=chosen, progress=progress)
        write_study(wanted, results, path)
    except BaseException as error:
        finished.close()
        if said := continuation():
            tell("note" if isinstance(error, Exception) else "interrupted", said)
        raise
    finished.remove()
    failures = [result.failure for result in results.values() if result.failure]
    say_of_output(output.path, f": {len(results)} cells of {' x '.join(map(str, wanted.shape))}")
    for failure in dict.fromkeys(failures):
        say(f"no result in {failures.count(failure)} cells: {failure}")
    found = list(filter(None, (only_survivors(result.samples, result.lost) for result in results.values())))
    if found:
        tell("warning", f"cells not to be trusted: {len(found)}; in one of them, {found[0]}")
        context.exit(NOT_TO_BE_TRUSTED)
