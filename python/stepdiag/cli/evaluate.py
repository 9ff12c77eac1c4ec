"""Commands that calibrate a machine from a run, or report beforehand what a run would determine."""

from pathlib import Path
from typing import Final, Literal

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.in_book import Kept, OfMachine
from stepdiag.cli.options import (
    PATH,
    Writes,
    input_warnings,
    json_option,
    out_file,
    tell,
    tell_inputs,
    tell_trust,
    trust_warnings,
)
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import CALIBRATION, OBSERVATION, OutputFile
from stepdiag.parameters import FUNCTIONS, SQUARENESSES
from stepdiag.progress import Progress

# Values of a calibration whose covariance is written unless the user decides: 32 MB. It grows with their square.
MOST_COVARIED: Final = 2000


@click.command(
    cls=OfMachine,
    makes={"output": Kept("calibrations", ".nc")},
    groups={"Evaluation": ["method", "reliability"], "Output": ["output", "covariance", "as_json"]},
    epilog="\b\nExample: stepdiag evaluate scenario.toml run.csv -o calibration.csv",
)
@click.argument("scenario", type=PATH)
@click.argument("run", type=PATH)
@click.option(
    "-m",
    "method",
    type=click.Choice(["adjustment", "enhanced", "conventional"]),
    default="adjustment",
    show_default=True,
    help="Method of evaluation; see above.",
)
@click.option(
    "--covariance/--no-covariance",
    default=None,
    help=f"Write the covariance of all values (netCDF only).  [default: up to {MOST_COVARIED} values]",
)
@click.option("--reliability", is_flag=True, help="Also report which faults of the readings would have been found.")
@out_file("Calibration to write, CSV or netCDF (.nc, with set-ups and residuals).", CALIBRATION)
@json_option
@click.pass_context
def evaluate(
    context: click.Context,
    scenario: Path,
    run: Path,
    method: Literal["adjustment", "enhanced", "conventional"],
    covariance: bool | None,
    reliability: bool,
    output: OutputFile,
    as_json: bool,
) -> None:
    """Evaluate the measurement RUN (CSV or netCDF) that was made with SCENARIO's plan and head.

    Determines the machine's 21 error parameters with their standard uncertainties, and reports what
    the readings do not determine. Only chain, tool, plan, head, uncertainties and the unknowns of
    the adjustment are taken from the scenario.

    The first line of the report is the verdict of the fit, which is also stored in the calibration.
    If the fit is rejected, the command ends with a warning and exit code 3; the calibration is
    written, but must not be used. A mistake that would explain a fit that is not accepted is named,
    with what to change, and rejects it. For the linear methods the verdict is the worse of two: that
    of their own test, and that of the adjustment of the same readings. A result that no machine can
    have ([plausible] in the scenario) is an error, and nothing is written.

    netCDF files (.nc) have the covariance of all values, which volume needs for its intervals.

    \b
    adjustment    all readings at once and exactly: the machine's errors, and how head and mirror were set up
    enhanced      distances, tilts and scale lines, to first order
    conventional  the distances of body diagonals
    """
    from stepdiag.config.toml_text import located
    from stepdiag.evaluation.judge import judge
    from stepdiag.findings.temperature import temperature_warnings
    from stepdiag.io.data_files import is_netcdf, read_measurement, write_calibration
    from stepdiag.io.whole_files import check_input
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.evaluation import evaluation_blocks
    from stepdiag.scenario.description import JudgedEvaluation, read_scenario
    from stepdiag.scenario.provenance import provenance_of

    check_input(run)
    if covariance and not is_netcdf(output.path):
        raise InvalidArgument(f"--covariance: expected an output named .nc (CSV has no covariance), got {output.path}")
    if reliability and method != "adjustment":
        raise InvalidArgument(f"--reliability: expected the method adjustment, got {method}")
    described = read_scenario(scenario)
    path = output.claim(scenario, run, error_map=described.truth.error_map)
    known = described.known
    values = len(FUNCTIONS) * (known.plan.steps + 1) + len(SQUARENESSES)
    if covariance is None and is_netcdf(path) and values > MOST_COVARIED:
        tell("note", f"no covariance of {values} values, {8e-6 * values**2:.0f} MB: `covariance` writes it")
    with_covariance = is_netcdf(path) and values <= MOST_COVARIED if covariance is None else covariance
    measurement = read_measurement(run)
    provenance = provenance_of(known, run, method=method)
    with located(str(run)), Progress("evaluate"):
        of_inputs = input_warnings(known, run, measurement)
        judged = judge(known, measurement, method=method, full_covariance=with_covariance, reliability=reliability)
    result, mistakes = judged.result, judged.mistakes
    written = write_calibration(
        result.calibration if isinstance(result, JudgedEvaluation) else result,
        path,
        measurement=measurement,
        provenance=provenance,
        between_nodes=known.between_nodes,
    )
    of_inputs += temperature_warnings(written, measurement)
    if as_json:
        from stepdiag.presentation.objects.evaluation import evaluated_files, evaluation_object
        from stepdiag.presentation.objects.writer import json_text

        files, warnings = evaluated_files(scenario, run, path), [*of_inputs, *trust_warnings(path, written)]
        click.echo(json_text(evaluation_object(result, written, files, measurement, known, warnings, mistakes)))
    else:
        for line in text_of(evaluation_blocks(result, measurement, known, mistakes)):
            say(line)
    for warning in of_inputs:
        tell("warning", warning)
    tell_trust(context, path, written)


def _step_counts(context: click.Context, option: click.Parameter, text: str | None) -> tuple[int, ...] | None:
    from stepdiag._core import Plan

    if text is None:
        return None
    try:
        counts = tuple(int(word) for word in text.split(","))
    except ValueError:
        counts = (0,)
    if not all(1 <= count <= Plan.largest_step_count for count in counts):
        expected = f"numbers from 1 to {Plan.largest_step_count} with commas between them, such as 10,20,50"
        raise click.BadParameter(f"expected {expected}, got {text!r}")
    return counts


@click.command(
    cls=OfMachine,
    makes={"output": Kept("plans")},
    epilog="\b\nExample: stepdiag observe scenario.toml --steps 10,20,50,100",
)
@click.argument("scenario", type=PATH)
@click.option(
    "--steps",
    metavar="N,N,...",
    callback=_step_counts,
    help="Numbers of steps per axis in the table; the scenario's own is added.  [default: 5,10,20,50,100,200]",
)
@click.option("-o", "output", type=Writes(OBSERVATION), metavar="FILE", help="Also write the table (CSV).")
@json_option
def observe(scenario: Path, steps: tuple[int, ...] | None, output: OutputFile | None, as_json: bool) -> None:
    """Report what SCENARIO's plan and head can determine, and how well, before you measure.

    Adjusts an error-free run with the scenario's uncertainties and unknowns. Reports which of the
    21 parameters and of the set-up's unknowns the readings determine, their standard uncertainties,
    what is missing for the others, which faults of single readings and slips of a counter would be
    found and distinguished, and how the largest uncertainties grow with the number of steps.
    """
    from stepdiag.io.whole_files import write_whole
    from stepdiag.planning.fault_control import distinguishes_all, extensions
    from stepdiag.planning.observation import USUAL_STEPS, observe, prospects
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.fault_control import control_blocks, extension_blocks
    from stepdiag.presentation.observation import observation_blocks, prospect_blocks, prospect_csv
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    tell_inputs(described)
    path = None if output is None else output.claim(scenario, error_map=described.truth.error_map)
    known = described.known
    with Progress("observe"):
        run, found = observe(described)
    if not as_json:
        for line in text_of([*observation_blocks(found, run, known), *control_blocks(found.reliability)]):
            say(line)
    with Progress("larger plans"):
        tried = [] if distinguishes_all(found.reliability) else list(extensions(known))
    if not as_json:
        for line in text_of(extension_blocks(found.reliability, tried)):
            say(line)
    with Progress("numbers of steps") as progress:
        table = prospects(known, [*(steps or USUAL_STEPS), known.plan.steps], progress)
    if as_json:
        from stepdiag.presentation.objects.observation import observation_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(observation_object(found, run, known, tried, table)))
    else:
        for line in text_of(prospect_blocks(table)):
            say(line)
    if path is not None:
        write_whole(path, prospect_csv(table))
