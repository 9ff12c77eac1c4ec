"""The command that writes the measuring program of a plan."""

from pathlib import Path
from typing import Any

import click

from stepdiag.cli.options import PATH, out_file, tell, tell_inputs
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import PROGRAM, OutputFile

_AXES = ("X", "Y", "Z")


@click.command(epilog="\b\nExample: stepdiag nc scenario.toml -o run.ngc --dialect linuxcnc")
@click.argument("scenario", type=PATH)
@out_file("Program to write, such as run.ngc (not .nc, which is netCDF here).", PROGRAM)
@click.option(
    "--dialect",
    type=click.Choice(["linuxcnc", "iso"]),
    default="linuxcnc",
    show_default=True,
    help="LinuxCNC's G-code, or words of ISO 6983 that most controllers understand.",
)
@click.option("--origin", nargs=3, type=float, metavar="X Y Z", help="Coordinates of home, mm.  [default: 0 0 0]")
@click.option(
    "--coordinates",
    metavar="G5x",
    help="Machine coordinates G53, or a work offset G54 to G59.  [default: G53 for linuxcnc, G54 for iso]",
)
@click.option(
    "--limits",
    nargs=6,
    type=float,
    metavar="X X Y Y Z Z",
    help="Limits of travel of X, Y, Z, mm; no move exceeds them.  [default: unlimited]",
)
@click.option("--overrun", type=float, metavar="MM", help="Overrun before the first point of a line.  [default: 1]")
@click.option(
    "--safe",
    nargs=3,
    type=float,
    metavar="X Y Z",
    help="Position of the axes for a set-up.  [default: the middle of X and Y, the far end of Z]",
)
@click.option(
    "--retreat",
    metavar="ORDER",
    help="Order in which the axes move to the safe position, one at a time.  [default: ZXY]",
)
@click.option(
    "--trigger",
    type=click.Choice(["handshake", "pulse", "dwell"]),
    help="How the program requests a reading (docs/measuring.md).  [default: handshake for linuxcnc, dwell for iso]",
)
@click.option("--trigger-code", metavar="M80", help="Your own M-code that requests a reading.")
@click.option(
    "--timeout", type=float, metavar="S", help="Seconds that a handshake waits for a reading.  [default: 300]"
)
@click.option(
    "--dwell-word",
    type=click.Choice(["P", "X", "F", "PMS"]),
    help="G4 takes seconds as P, X or F, or milliseconds as P (PMS).  [default: P]",
)
@click.option(
    "--decimals", type=int, metavar="N", help="Decimal places of positions in mm.  [default: 6 for linuxcnc, 4 for iso]"
)
@click.option(
    "--align/--no-align", default=None, help="Stop at the first point of a line to align the beam.  [default: align]"
)
@click.option("--line-numbers", is_flag=True, default=None, help="Number the blocks (iso).")
def nc(scenario: Path, output: OutputFile, **given: Any) -> None:
    """Write the measuring program of SCENARIO: G-code for the machine's controller.

    The axes move through the plan's points in its order, with feed and times of [plan_by_time]. At
    each point the program waits and requests a reading, which `acquire` records. Between lines the
    program stops to set up head and mirror.

    Positions are those of the axes, counted from home, without tool length. Every visit of a line
    begins with an overrun, so that all axes approach all points from the side that the plan
    specifies. With --overrun 0, or where --limits cut the overrun, the program and a warning name
    the points that an axis approaches from another side, or by less.
    """
    from stepdiag.io.whole_files import write_whole
    from stepdiag.program.measuring_program import measuring_program
    from stepdiag.program.options import Options
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    tell_inputs(described)
    path = output.claim(scenario, error_map=described.truth.error_map)
    program = measuring_program(
        described.known, Options(**{name: value for name, value in given.items() if value is not None})
    )
    write_whole(path, program.text)
    for text in program.unapproached:
        tell("warning", text)
    for line in program.summary:
        say(line)
    click.echo(f"wrote {path}")
