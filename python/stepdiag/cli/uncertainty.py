"""The command that reports how uncertain a calibration would be."""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.interrupts import unwinding
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, Grouped, Writes, tell
from stepdiag.cli.terminal import say
from stepdiag.cli.workers import chosen_workers, worker_options
from stepdiag.interruption import at_end
from stepdiag.io.outputs import CHECKPOINT, UNCERTAINTY, OutputFile
from stepdiag.progress import Progress

if TYPE_CHECKING:
    from stepdiag.scenario.description import Scenario
    from stepdiag.uncertainty.dask_workers import Workers
    from stepdiag.uncertainty.result import UncertaintyResult
    from stepdiag.uncertainty.run import UncertaintyRequest

Point = tuple[tuple[float, float, float], tuple[float, float, float] | None]


def _sample_count(context: click.Context, option: click.Parameter, text: str | None) -> int | None:
    """A whole number; 1e6 is accepted as well."""
    if text is None:
        return None
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not (1.0 <= number <= 1e12 and number == math.floor(number)):
        raise click.BadParameter(f"expected a whole number such as 100000 or 1e6, got {text!r}")
    return int(number)


def _points(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> list[Point]:
    """Three numbers, or six: a position and a tool offset."""
    result: list[Point] = []
    for text in texts:
        try:
            numbers = [float(word) for word in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in (3, 6) or not all(map(math.isfinite, numbers)):
            expected = "X,Y,Z in mm, or X,Y,Z followed by a tool offset"
            raise click.BadParameter(f"expected {expected}, such as 400,300,250, got {text!r}")
        x, y, z, *offset = numbers
        result.append(((x, y, z), (offset[0], offset[1], offset[2]) if offset else None))
    return result


@click.command(
    cls=Grouped,
    groups={
        "Evaluation": ["method", "coverage", "list_inputs"],
        "Monte Carlo method": ["samples", "adaptive", "digits", "seed", "compare", "joint"],
        "Derived quantities": ["points", "volume"],
        "Output": ["output", "covariance", "keep"],
        "Computation": ["threads", "scheduler", "workers", "checkpoint", "resume"],
    },
    epilog="\b\nExample: stepdiag uncertainty scenario.toml -n 1e6 --compare -o uncertainty.nc",
)
@click.argument("scenario", type=PATH)
@click.option(
    "-n",
    "samples",
    metavar="SAMPLES",
    callback=_sample_count,
    help="Number of virtual calibrations (Monte Carlo method), such as 1e6; with --adaptive the largest number.",
)
@click.option(
    "-m",
    "method",
    type=click.Choice(["adjustment", "enhanced", "conventional", "one_step"]),
    default="adjustment",
    show_default=True,
    help="Method of evaluation of each calibration; see above.",
)
@click.option("--adaptive", is_flag=True, help="Draw as many samples as the digits require (JCGM 101, 7.9).")
@click.option(
    "--digits",
    type=click.IntRange(1, 3),
    default=2,
    show_default=True,
    help="Significant digits of standard uncertainties, for --adaptive and --compare.",
)
@click.option(
    "--coverage",
    type=float,
    default=0.95,
    show_default=True,
    metavar="P",
    help="Probability of coverage intervals and expanded uncertainties.",
)
@click.option(
    "--seed", type=click.IntRange(0, 2**64 - 1), default=0, show_default=True, help="Seed of all random numbers."
)
@click.option(
    "--threads",
    type=click.IntRange(0),
    default=0,
    metavar="N",
    help="Number of threads.  [default: all of the computer's]",
)
@click.option("--covariance", is_flag=True, help="Also write the covariance of all outputs (needs -o with .nc).")
@click.option(
    "--keep", multiple=True, metavar="NAME", help="Keep all samples of an output, such as C0Y or EXX@400 (with .nc)."
)
@click.option(
    "--joint", multiple=True, metavar="NAMES", help="Joint coverage region of two or three outputs, such as C0Y,B0Z."
)
@click.option("--compare", is_flag=True, help="Validate the propagation by the Monte Carlo method (JCGM 101, 8).")
@click.option(
    "--point",
    "points",
    multiple=True,
    metavar="X,Y,Z[,TOOL]",
    callback=_points,
    help="Also report the error vector at this point; TOOL: a tool offset x,y,z other than the scenario's.",
)
@click.option(
    "--volume", is_flag=True, help="Also report the volumetric accuracy V_XYZ (ISO 230-1) and the body diagonals."
)
@click.option(
    "--checkpoint",
    type=Writes(CHECKPOINT),
    metavar="FILE",
    help="File for the state of the run (.checkpoint), written every ten seconds and at the end. An existing one is "
    "never overwritten: use --resume, or remove it.  [default: beside -o, kept after an interruption only]",
)
@click.option("--resume", is_flag=True, help="Continue from the checkpoint; the result has the same bits.")
@click.option("--inputs", "list_inputs", is_flag=True, help="List the names of the uncertain inputs and end.")
@click.option(
    "-o", "output", type=Writes(UNCERTAINTY), metavar="FILE", help="Result to write, netCDF (.nc) or CSV (.csv)."
)
@worker_options
@click.pass_context
def uncertainty(
    context: click.Context,
    scenario: Path,
    samples: int | None,
    method: Any,
    adaptive: bool,
    digits: int,
    coverage: float,
    seed: int,
    threads: int,
    covariance: bool,
    keep: tuple[str, ...],
    joint: tuple[str, ...],
    compare: bool,
    points: list[Point],
    volume: bool,
    checkpoint: OutputFile | None,
    resume: bool,
    list_inputs: bool,
    output: OutputFile | None,
    scheduler: str | None,
    workers: int | None,
) -> None:
    """Report how uncertain a calibration of SCENARIO's machine would be.

    The uncertain inputs are those of the scenario's [uncertainty]. Without -n the command uses only
    the law of propagation (GUM). It prints tables by family of parameters, and the sources of the
    largest uncertainties. With -n it also uses the Monte Carlo method (JCGM 101): it makes virtual
    calibrations, for which it draws inputs from their distributions, traces every pose, and adds
    noise.

    \b
    adjustment    all readings at once and exactly: what evaluate does
    enhanced      distances, tilts and scale lines, to first order: ten times faster
    conventional  the distances of body diagonals
    one_step      the adjustment's first step from the solution without deviations

    If more than 0.1 % of the virtual calibrations give no result, the command ends with a warning
    and exit code 3: its Monte Carlo figures are those of the others.
    """
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.uncertainty import input_rows, uncertainty_blocks
    from stepdiag.scenario.description import read_scenario
    from stepdiag.scenario.map_warnings import scenario_warnings
    from stepdiag.uncertainty.run import UncertaintyRequest

    kept = checkpoint or OutputFile(Path(f"{output.path if output else scenario.stem}.checkpoint"), (CHECKPOINT,))
    wanted = UncertaintyRequest(
        method=method,
        samples=samples,
        adaptive=adaptive,
        digits=digits,
        coverage=coverage,
        seed=seed,
        threads=threads,
        covariance=covariance,
        keep=keep,
        joint=tuple(tuple(re.split(r",(?![^(]*\))", names)) for names in joint),  # no comma inside "X at (1, 2, 3)"
        compare=compare,
        points=tuple(points),
        volume=volume,
        checkpoint=kept.path,
        resume=resume,
    )
    _check(wanted, scheduler, workers, checkpoint, output)
    described = read_scenario(scenario)
    path = None if output is None else output.claim(scenario, error_map=described.truth.error_map)
    if list_inputs:
        for line in input_rows(described.known.uncertain):
            say(line)
        return
    if wanted.draws:
        others = [scenario] if path is None else [scenario, path]
        kept.claim(*others, error_map=described.truth.error_map, overwrite=resume)
    for warning in scenario_warnings(described):
        tell("warning", warning)
    with _kept(wanted, KeyboardInterrupt), chosen_workers(scheduler, workers) as chosen, unwinding():
        result = _evaluate(described, wanted, chosen)
    with _kept(wanted, BaseException):
        if path is not None:
            from stepdiag.uncertainty.write import write_uncertainty

            write_uncertainty(result, path)
        for line in text_of(uncertainty_blocks(result)):
            say(line)
    if wanted.draws and checkpoint is None:  # a checkpoint named by the user is kept: it can continue to more samples
        kept.path.unlink(missing_ok=True)
    if result.warning is not None:
        tell("warning", result.warning)
        context.exit(NOT_TO_BE_TRUSTED)


def _check(
    wanted: "UncertaintyRequest",
    scheduler: str | None,
    workers: int | None,
    checkpoint: OutputFile | None,
    output: OutputFile | None,
) -> None:
    """Raises InvalidArgument where options do not go together."""
    from stepdiag.io.data_files import is_netcdf

    wanted.check()
    if (scheduler is not None or workers is not None) and not wanted.draws:
        raise InvalidArgument("--scheduler and --workers: go with the Monte Carlo method: -n or --adaptive")
    if checkpoint is not None and not wanted.draws:
        raise InvalidArgument("--checkpoint: goes with the Monte Carlo method: -n or --adaptive")
    if (wanted.covariance or wanted.keep) and (output is None or not is_netcdf(output.path)):
        raise InvalidArgument(
            f"{'--covariance' if wanted.covariance else '--keep'}: expected -o with a name that ends in .nc"
        )


@contextmanager
def _kept(wanted: "UncertaintyRequest", errors: type[BaseException]) -> Iterator[None]:
    """State how to continue if one of these errors, or an interruption, ends the block."""
    nothing = "no samples were kept"

    def continuation() -> str:
        if wanted.draws and wanted.checkpoint is not None and wanted.checkpoint.exists():
            return f"{wanted.checkpoint} has the finished samples: repeat the command with --resume"
        return nothing

    try:
        with at_end(continuation):
            yield
    except errors as error:
        if (said := continuation()) != nothing or isinstance(error, KeyboardInterrupt):
            tell("note" if isinstance(error, Exception) else "interrupted", said)
        if isinstance(error, KeyboardInterrupt):
            raise click.Abort from None
        raise


def _evaluate(scenario: "Scenario", wanted: "UncertaintyRequest", workers: "Workers | None") -> "UncertaintyResult":
    """Evaluate and show the progress."""
    from stepdiag.uncertainty.packed_calibrations import pack_calibrations
    from stepdiag.uncertainty.run import evaluate_uncertainty

    executor = workers.executor(pack_calibrations(scenario.path, wanted)) if workers is not None else None
    with Progress("virtual calibrations" if wanted.draws else "propagation") as progress:
        return evaluate_uncertainty(scenario, wanted, progress, executor)
