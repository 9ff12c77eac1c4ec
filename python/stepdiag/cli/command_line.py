"""The command line: simulate, demo, check, init, and those of the other cli_ modules.

What is imported inside a command keeps the others fast.
"""

import io
import sys
from pathlib import Path

import click

from stepdiag._core import InvalidArgument, ReplayMismatch, __version__
from stepdiag.cli.acquire import acquire, twin
from stepdiag.cli.calibrations import compare, report
from stepdiag.cli.evaluate import evaluate, observe
from stepdiag.cli.export import export
from stepdiag.cli.head import head
from stepdiag.cli.nc import nc
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, InOrder, Writes, out_file, tell
from stepdiag.cli.plan import plan
from stepdiag.cli.study import study
from stepdiag.cli.uncertainty import uncertainty
from stepdiag.io.outputs import MEASUREMENT, OutputFile

EPILOG = """\b
See it all at once:
  stepdiag demo
A first round trip (uncomment [machine.random] in the scenario for a machine with errors):
  stepdiag init -o machine
  stepdiag simulate machine/scenario.toml -o run.csv
  stepdiag evaluate machine/scenario.toml run.csv -o calibration.csv
Your own measurement: fill in machine/measurement.csv, then evaluate it in place of run.csv.
What a plan would determine, before measuring: stepdiag observe machine/scenario.toml
"""

# In the order in which somebody new needs them.
SHORT = {
    "demo": "Show the method on the machine of its paper.",
    "init": "Begin with your own machine: scenario and sheet.",
    "observe": "Tell what a plan and head can determine, before measuring.",
    "plan": "Tell which plan to measure in the time that there is.",
    "uncertainty": "Tell how uncertain a calibration would be.",
    "study": "Tell the same over a grid of scenarios.",
    "nc": "Write the measuring program for a controller.",
    "acquire": "Take a run's readings from an IDS3010.",
    "twin": "Simulate the instrument, behind a socket.",
    "simulate": "Simulate the run of a scenario.",
    "evaluate": "Calibrate the machine from a run.",
    "report": "Tell what a calibration says.",
    "compare": "Set two calibrations side by side.",
    "export": "Write a calibration for a controller.",
    "check": "Tell what a file is, and whether it is sound.",
    "head": "Look at the description of a laser head.",
}


@click.group(
    cls=InOrder, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(__version__, message="stepdiag %(version)s")
def cli() -> None:
    """Calibrate three-axis machine tools by the laser step-diagonal method."""


@cli.command(short_help=SHORT["simulate"], epilog="\b\nExample: stepdiag simulate scenario.toml -o run.csv")
@click.argument("scenario", type=PATH)
@out_file("Measurement file to write, CSV or netCDF (.nc).", MEASUREMENT)
@click.option("--overwrite", is_flag=True, help="Also where a measurement has this name: it is lost.")
def simulate(scenario: Path, output: OutputFile, overwrite: bool) -> None:
    """Simulate the run that SCENARIO (TOML) describes.

    The virtual machine moves through the plan with its errors, and the head reads the mirror at every point.
    Lost readings are empty fields, in netCDF missing values. A measurement that is there already is kept, unless told
    to overwrite it.
    """
    from stepdiag.io.data_files import write_measurement
    from stepdiag.scenario.description import read_scenario, simulate_scenario
    from stepdiag.scenario.map_warnings import scenario_warnings

    described = read_scenario(scenario)
    path = output.claim(scenario, error_map=described.error_map, overwrite=overwrite)
    for warning in scenario_warnings(described):
        tell("warning", warning)
    write_measurement(simulate_scenario(described), path)


@cli.command(short_help=SHORT["demo"], epilog="\b\nExample: stepdiag demo -o demo")
@click.option(
    "-o",
    "output",
    type=Writes(),
    metavar="DIR",
    help="Folder to write, a new one or that of an earlier demo.  [default: demo, or demo-linuxcnc]",
)
@click.option(
    "--controller",
    type=click.Choice(["linuxcnc", "calculated"]),
    help="Close the loop in LinuxCNC, or calculate the same without it.",
)
def demo(output: OutputFile | None, controller: str | None) -> None:
    """Simulate and evaluate the machine of the method's paper, and draw its Figure 5.

    Writes scenarios, truth, runs, calibrations, a table and the figure; go on from them with simulate and
    evaluate. Written again, they are replaced, unless a scenario was changed.

    With --controller linuxcnc the loop is closed: LinuxCNC runs the measuring program on a virtual machine, the run
    is evaluated, LinuxCNC compensates with the calibration, and is measured again (docs/loop.md).
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
            lines = run_loop(claim_loop(folder), controller_of(controller), progress=progress)
        except LinuxcncError as error:
            raise click.ClickException(str(error)) from error
    for line in lines:
        click.echo(line)


@cli.command(short_help=SHORT["check"], epilog="\b\nExample: stepdiag check scenario.toml run.csv")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@click.pass_context
def check(context: click.Context, files: tuple[Path, ...]) -> None:
    """Tell what kind each FILE is, and whether it is sound.

    Knows scenarios, heads and studies (TOML), measurements and calibrations (CSV or netCDF), error maps (CSV)
    and raw readings (JSON lines). A
    scenario is checked together with the error map that it names. With one scenario among the files, each measurement
    is adjusted with it: do its lines, points and distances belong to that plan, and what is the verdict of the fit?

    Exit code 2 if any file is not sound or two do not belong together, 3 if a fit is rejected.
    """
    from stepdiag.report.file_check import examine

    sound, untrusted = True, False
    found: dict[str, list[Path]] = {}
    for file in files:
        try:
            finding = examine(file)
        except InvalidArgument as error:
            sound = False
            _complain(str(error))
            continue
        click.echo(f"{file}: {finding.kind}: {finding.summary}")
        for warning in finding.warnings:
            click.echo(f"{file}: warning: {warning}")
        found.setdefault(finding.kind, []).append(file)
        untrusted = untrusted or finding.fit == "rejected"
    if len(found.get("scenario", [])) == 1:
        from stepdiag.report.scenario_and_run import adjust_run

        (scenario,) = found["scenario"]
        for run in found.get("measurement", []):
            try:
                said, fit = adjust_run(scenario, run)
            except InvalidArgument as error:
                sound = False
                _complain(str(error))
                continue
            for line in said:
                click.echo(f"{run} with {scenario}: {line}")
            untrusted = untrusted or fit == "rejected"
    if not sound:
        context.exit(2)
    if untrusted:
        tell("warning", "a fit is rejected: do not use what comes of it")
        context.exit(NOT_TO_BE_TRUSTED)


@cli.command(short_help=SHORT["init"], epilog="\b\nExample: stepdiag init -o machine")
@click.option("-o", "output", required=True, type=Writes(), metavar="DIR", help="Folder to write.")
@click.option(
    "--sheet-for",
    "scenario",
    type=PATH,
    metavar="SCENARIO",
    help="Write only measurement.csv, for the plan and head of this scenario.",
)
@click.option("--head", "head_name", metavar="NAME", help="Begin with a copy of this shipped head (see head list).")
def init(output: OutputFile, scenario: Path | None, head_name: str | None) -> None:
    """Begin with your own machine: a scenario to edit and a sheet to fill in.

    Writes scenario.toml, with a comment on every key, and measurement.csv with all commanded points and empty
    fields for the readings of your instrument. Existing files are never overwritten. After changing the plan
    in the scenario, make a new sheet with --sheet-for. With --head the scenario's head is head.toml, a copy of a
    shipped description, in place of a layout.
    """
    from stepdiag.config.scenario_template import template
    from stepdiag.head.description import find_shipped_head
    from stepdiag.io.whole_files import make_folder, read_text, write_whole
    from stepdiag.scenario.description import parse_scenario, read_scenario, runs_of
    from stepdiag.scenario.planned_readings import empty_sheet

    if scenario is not None and head_name is not None:
        raise InvalidArgument("--head: goes with a new scenario, not with --sheet-for")
    texts = {}
    if scenario is not None:
        plan = read_scenario(scenario)
    else:
        texts["scenario.toml"] = template("head.toml" if head_name else None)
        shipped = find_shipped_head(head_name) if head_name else None
        if shipped is not None:
            texts["head.toml"] = read_text(shipped)
        # As it is read in its new folder, where the head's copy is not yet.
        plan = parse_scenario(template(head_name))
    folder = output.path
    written = [folder / name for name in (*texts, "measurement.csv")]
    for path in written:
        if path.exists() or path.is_symlink():
            raise InvalidArgument(f"{path}: exists already, and is not overwritten")
    make_folder(folder)
    for name, text in texts.items():
        write_whole(folder / name, text)
    empty_sheet(plan.plan, plan.signals, repeats=runs_of(plan.keys.plan), backward=plan.keys.plan.backward).write(
        folder / "measurement.csv"
    )
    for path in written:
        click.echo(f"wrote {path}")


for command in (evaluate, observe, plan, uncertainty, study, nc, acquire, twin, report, compare, export, head):
    command.short_help = SHORT[str(command.name)]
    cli.add_command(command)
cli.commands = {name: cli.commands[name] for name in SHORT}  # the order in which help lists them


def _complain(message: str) -> None:
    tell("error", message)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command line and returns the exit code: 0 done, 1 our mistake, 2 a caller's, 3 done but not to be
    trusted, 130 interrupted."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without µ still gets the rest of the line
    try:
        result = cli.main(arguments, prog_name="stepdiag", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.Abort:
        return 130
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 0
    except click.UsageError as error:
        hint = f' (see "{error.ctx.command_path} --help")' if error.ctx else ""
        _complain(error.format_message() + hint)
    except (InvalidArgument, click.ClickException) as error:
        _complain(error.format_message() if isinstance(error, click.ClickException) else str(error))
    except ReplayMismatch as error:
        _complain(f"{error}; nothing was written (verified_share = 1 traces every pose)")
        return 1
    except OSError as error:
        _complain(str(error))
    return 2


if __name__ == "__main__":
    sys.exit(main())
