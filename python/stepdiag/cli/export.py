"""Commands that write files for controllers: a calibration, and the measuring program of a plan."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.in_book import Kept, OfMachine
from stepdiag.cli.options import (
    PATH,
    Writes,
    json_option,
    made_of,
    options_of,
    out_file,
    tell,
    tell_inputs,
    tell_trust,
    trust_warnings,
)
from stepdiag.cli.terminal import say
from stepdiag.exporting.formats import FORMATS, MAKERS, of_maker
from stepdiag.exporting.options import ExportOptions
from stepdiag.io.outputs import PROGRAM, OutputFile, claim_folder
from stepdiag.program.options import Options
from stepdiag.progress import Progress

FILES = list(dict.fromkeys(one.file for one in FORMATS.values() if one.file is not None))


class FormatOrMaker(click.Choice[str]):
    """A format; the name of a maker lists the formats for that maker's controllers."""

    name = "format"

    def __init__(self) -> None:
        super().__init__(list(FORMATS))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        maker = str(value).casefold()
        if maker not in MAKERS or maker in FORMATS or ctx is None:
            return super().convert(value, param, ctx)
        for name, one in of_maker(maker):
            say(f"{name}: {one.what}; for {one.controllers}; {one.tested}")
        ctx.exit()


def _ending(params: Mapping[str, Any]) -> str:
    """Of an export in a machine book; "/": a folder."""
    kind = FORMATS[params["to"]].file
    return "/" if kind is None else kind.endings[0]


@click.command(
    cls=OfMachine,
    makes={"output": Kept("exports", _ending), "proof": Kept("plans")},
    epilog="\b\nFormats:\n"
    + "".join(f"  {name:<22}{one.what}\n" for name, one in FORMATS.items())
    + f"\n\b\nMakers: {', '.join(MAKERS)}\n"
    "\n\b\nExamples:\n"
    "  stepdiag export calibration.csv --to linuxcnc-kins -o machine.csv\n"
    "  stepdiag export calibration.csv --to siemens-cec -o cec.ini\n"
    "  stepdiag export calibration.csv --to linuxcnc-comp --at 400 300 250 -o comp\n"
    "  stepdiag export calibration.csv --to csv-grid --step 25 -o grid.csv\n"
    "  stepdiag export calibration.csv --to matrix -o matrix.hal\n"
    "  stepdiag export calibration.csv --to position-error --axis Y --depends-on X -o sag.csv",
)
@click.argument("calibration", type=PATH)
@click.option(
    "--to",
    "to",
    required=True,
    is_eager=True,  # a maker's name needs no other argument
    type=FormatOrMaker(),
    metavar="FORMAT",
    help="Format (below), or a maker, whose formats are listed.",
)
@click.option(
    "-o",
    "output",
    required=True,
    type=Writes(*FILES),
    metavar="OUT",
    help="File to write; for linuxcnc-comp and heidenhain-* a folder.",
)
@click.option(
    "--replaces",
    type=PATH,
    metavar="TABLE",
    help="The table that the controller has now: is kept as it is, and named, so that you can go back to it.",
)
@click.option(
    "--proof",
    type=Writes(PROGRAM),
    metavar="FILE",
    help="Also write a short program that shows at two places whether the table helps, and say what to expect there.",
)
@options_of(ExportOptions)
@json_option
@click.pass_context
def export(
    context: click.Context,
    /,
    calibration: Path,
    to: str,
    output: OutputFile,
    replaces: Path | None,
    proof: OutputFile | None,
    as_json: bool,
    **given: Any,
) -> None:
    """Write a CALIBRATION (CSV or netCDF) for a controller.

    Reports the sign convention, the reference point, the loss by resampling, what of the 21 errors
    is left out, and for formats that leave out some, what that leaves in the volume. Refuses a
    calibration that does not determine all that the format needs, unless --incomplete is
    given. An error map is accepted as well; parameters that it lacks are 0.
    """
    from stepdiag.exporting.write import check_fit, read_what_is_exported, write_export
    from stepdiag.io.whole_files import check_input, write_whole

    inputs = [calibration, *([replaces] if replaces is not None else [])]
    if replaces is not None and not replaces.exists():
        raise InvalidArgument(f"{replaces}: cannot be read: no such file")
    asked = FORMATS[to]
    if asked.file is not None:
        path = OutputFile(output.path, (asked.file,)).claim(*inputs)
    else:
        path = claim_folder(output.path, asked.folder, marks=[asked.mark])
    program = proof.claim(*inputs) if proof is not None else None
    options = made_of(ExportOptions, given)
    check_input(calibration)
    read = read_what_is_exported(calibration)
    check_fit(read, f"{calibration}", options.accept_rejected)
    with Progress("export"):
        done = write_export(read, to, path, options)
    if program is not None:
        from stepdiag.program.proof import proof_program

        text, said = proof_program(read, done, options, asked.maker)
        write_whole(program, text)
        done = replace(done, report=[*done.report, *said])
    if as_json:
        from stepdiag.presentation.objects.export import export_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(export_object(done, read, to, calibration, trust_warnings(calibration, read))))
    for line in (*done.report, *(f"wrote {path}" for path in done.files if path != output.path)):
        if line.startswith("warning: "):
            tell("warning", line.removeprefix("warning: "))
        elif not as_json:
            say(line)
    if replaces is not None and not as_json:
        say(f"replaces {replaces}: load that one again to go back")
    tell_trust(context, calibration, read)


@click.command(
    cls=OfMachine,
    makes={"output": Kept("plans", ".ngc")},
    epilog="\b\nExample: stepdiag nc scenario.toml -o run.ngc --dialect linuxcnc",
)
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
