"""Commands that simulate: the run of a scenario, and the demonstrations."""

from pathlib import Path
from typing import Final

import click

from stepdiag.cli.in_book import Kept, OfMachine
from stepdiag.cli.interrupts import unwinding
from stepdiag.cli.options import PATH, Writes, out_file, tell
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import MEASUREMENT, OutputFile
from stepdiag.progress import Progress

LINUXCNC_PATIENCE: Final = 40.0  # s; what a killed LinuxCNC leaves disturbs the next one


@click.command(
    cls=OfMachine,
    makes={"output": Kept("runs", ".csv")},
    epilog="\b\nExample: stepdiag simulate scenario.toml -o run.csv",
)
@click.argument("scenario", type=PATH)
@out_file("Measurement file to write, CSV or netCDF (.nc).", MEASUREMENT)
@click.option("--overwrite", is_flag=True, help="Replace an existing measurement of this name.")
def simulate(scenario: Path, output: OutputFile, overwrite: bool) -> None:
    """Simulate the run that SCENARIO (TOML) describes.

    The virtual machine moves through the plan with its errors, and the head reads the mirror at
    every point. Lost readings are empty fields, in netCDF missing values. An existing measurement
    is kept unless --overwrite is given.
    """
    from stepdiag.io.data_files import write_measurement
    from stepdiag.scenario.description import read_scenario, simulate_scenario
    from stepdiag.scenario.map_warnings import scenario_warnings

    described = read_scenario(scenario)
    path = output.claim(scenario, error_map=described.truth.error_map, overwrite=overwrite)
    for warning in scenario_warnings(described):
        tell("warning", warning)
    with Progress("simulate"):
        run = simulate_scenario(described)
    write_measurement(run, path)


@click.command(epilog="\b\nExample: stepdiag demo -o demo")
@click.option(
    "-o",
    "output",
    type=Writes(),
    metavar="DIR",
    help="Folder to write: a new one, or that of an earlier demo.  [default: demo, or demo-linuxcnc]",
)
@click.option(
    "--controller",
    type=click.Choice(["linuxcnc", "calculated"]),
    help="Run the closed loop in LinuxCNC, or calculate it without a controller.",
)
def demo(output: OutputFile | None, controller: str | None) -> None:
    """Simulate and evaluate the machine of the method's paper, and draw its Figure 5.

    Writes scenarios, truth, runs, calibrations, a table and the figure, from which you can continue
    with `simulate` and `evaluate`. Another demo replaces these files, unless a scenario was
    changed.

    With --controller linuxcnc the loop is closed: LinuxCNC runs the measuring program on a virtual
    machine, stepdiag evaluates the run, LinuxCNC compensates with the calibration, and the machine
    is measured again (docs/loop.md).
    """
    from stepdiag.demo.paper import claim_demo, run_demo

    def progress(text: str) -> None:
        click.echo(text, err=True)

    folder = output.path if output else Path("demo" if controller is None else f"demo-{controller}")
    if controller is None:
        lines = run_demo(claim_demo(folder), progress=progress)
    else:
        from stepdiag.demo.loop import claim_loop, controller_of, run_loop
        from stepdiag.linuxcnc.processes import LinuxcncError

        try:
            machine = controller_of(controller)  # refused before a folder is made
            with unwinding(LINUXCNC_PATIENCE, "ending LinuxCNC, which takes some seconds; Ctrl-C again ends at once"):
                lines = run_loop(claim_loop(folder), machine, progress=progress)
        except LinuxcncError as error:
            raise click.ClickException(str(error)) from error
    for line in lines:
        say(line)
