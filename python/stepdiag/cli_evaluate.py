"""The commands that calibrate a machine from a run, and that say beforehand what a run would determine."""

from pathlib import Path

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli_options import PATH, keep_apart, keep_map, out_file


@click.command(
    epilog="\b\nExample: stepdiag evaluate scenario.toml run.csv -m enhanced -o calibration.csv",
)
@click.argument("scenario", type=PATH)
@click.argument("run", type=PATH)
@click.option(
    "-m",
    "method",
    type=click.Choice(["conventional", "enhanced"]),
    default="enhanced",
    show_default=True,
    help="conventional uses distances only; enhanced uses the tilts and scale lines too.",
)
@out_file("Calibration file (CSV) to write.")
def evaluate(scenario: Path, run: Path, method: str, output: Path) -> None:
    """Evaluate the measurement RUN (CSV), made by SCENARIO's plan and head.

    Finds the machine's 21 error parameters with their standard uncertainties, and says what the readings do
    not determine. Of the scenario only chain, tool, plan, head and uncertainties are used.
    """
    from stepdiag import _core
    from stepdiag.files import check_input, check_output
    from stepdiag.report import evaluation_report
    from stepdiag.scenario import evaluate_scenario, read_scenario

    check_output(output)
    keep_apart(output, scenario, run)
    check_input(run)
    plan = read_scenario(scenario)
    keep_map(output, plan.error_map)
    measurement = _core.read_measurement(run)
    try:
        calibration = evaluate_scenario(
            plan, measurement, method="enhanced" if method == "enhanced" else "conventional"
        )
    except InvalidArgument as error:
        raise InvalidArgument(f"{run}: {error}") from None
    calibration.write(output)
    for line in evaluation_report(calibration, measurement, plan):
        click.echo(line)
