"""The command that writes the measuring program of a plan."""

from pathlib import Path
from typing import Any

import click

from stepdiag.cli.options import PATH, made_of, options_of, out_file, tell, tell_inputs
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import PROGRAM, OutputFile
from stepdiag.program.options import Options


@click.command(epilog="\b\nExample: stepdiag nc scenario.toml -o run.ngc --dialect linuxcnc")
@click.argument("scenario", type=PATH)
@out_file("Program to write, such as run.ngc (not .nc, which is netCDF here).", PROGRAM)
@options_of(Options)
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
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    tell_inputs(described)
    path = output.claim(scenario, error_map=described.truth.error_map)
    program = measuring_program(described.known, made_of(Options, given))
    write_whole(path, program.text)
    for text in program.unapproached:
        tell("warning", text)
    for line in program.summary:
        say(line)
    click.echo(f"wrote {path}")
