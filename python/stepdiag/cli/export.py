"""The command that writes a calibration for a controller."""

from pathlib import Path
from typing import Any

import click

from stepdiag.cli.options import PATH, Writes, tell, tell_fit
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import COMP_FILE, COMP_LINES, GRID, ISG_TABLE, KINEMATICS_TABLE, OutputFile, claim_folder
from stepdiag.progress import Progress

# Those of stepdiag.export.write.FORMATS, which is slow to import; a test compares them.
FORMATS = ("linuxcnc-comp", "linuxcnc-kins", "isg", "csv-grid")
KINDS = {"linuxcnc-kins": KINEMATICS_TABLE, "isg": ISG_TABLE, "csv-grid": GRID}
FOLDER = {"compensation.ini": COMP_LINES} | {f"joint{n}.comp": COMP_FILE for n in range(3)}  # linuxcnc-comp
MM = "<X Y Z>"


@click.command(
    epilog="\b\nExamples:\n"
    "  stepdiag export calibration.csv --to linuxcnc-kins -o machine.csv\n"
    "  stepdiag export calibration.csv --to linuxcnc-comp --at 400 300 250 -o comp\n"
    "  stepdiag export calibration.csv --to csv-grid --step 25 -o grid.csv"
)
@click.argument("calibration", type=PATH)
@click.option("--to", "to", required=True, type=click.Choice(FORMATS), help="Format.")
@click.option(
    "-o",
    "output",
    required=True,
    type=Writes(*KINDS.values()),
    metavar="OUT",
    help="File to write (.csv); for linuxcnc-comp a folder.",
)
@click.option("--tool", type=float, nargs=3, metavar=MM, help="Tool offset, mm.  [default: the calibration's]")
@click.option(
    "--origin", type=float, nargs=3, metavar=MM, help="Controller's coordinates of home, mm.  [default: 0 0 0]"
)
@click.option("--incomplete", is_flag=True, help="Export undetermined values as 0.")
@click.option(
    "--approach",
    type=click.Choice(("mean", "positive", "negative")),
    help="Direction of approach to compensate if the tables have two (not linuxcnc-comp).  [default: mean]",
)
@click.option(
    "--at",
    type=float,
    nargs=3,
    metavar=MM,
    help="Point on the corrected lines, mm from home (linuxcnc-comp).  [default: centre of the volume]",
)
@click.option(
    "--rows",
    type=int,
    metavar="N",
    help="Largest number of rows in a table (linuxcnc-comp, isg).  [default: 256, 5000]",
)
@click.option(
    "--squareness",
    type=click.Choice(("straightness", "parameters")),
    help="Where to write squareness (isg).  [default: straightness]",
)
@click.option(
    "--nodes", type=int, nargs=3, metavar="<NX NY NZ>", help="Points of the grid (csv-grid).  [default: 11 11 11]"
)
@click.option("--step", type=float, metavar="MM", help="Largest spacing of the grid, instead of --nodes (csv-grid).")
@click.option("--accept-rejected", is_flag=True, help="Export a calibration even if its fit was rejected.")
@click.option("--orientation", is_flag=True, default=None, help="Also write the rotations of the tool (csv-grid).")
@click.pass_context
def export(context: click.Context, /, calibration: Path, to: str, output: OutputFile, **options: Any) -> None:
    """Write a CALIBRATION (CSV or netCDF) for a controller.

    \b
    linuxcnc-kins  the table of the kinematics module stepdiagkins: all 21 errors
    linuxcnc-comp  a COMP_FILE for each joint, and the INI lines: positioning errors along three lines
    isg            volumetric compensation of ISG-CNC and TwinCAT CNC; written from the manual, not tried
    csv-grid       error vectors on a grid

    Reports the sign convention, the reference point, the loss by resampling and what is not
    compensated. Refuses a calibration that does not determine all that the format needs, unless
    --incomplete is given. An error map is accepted as well; parameters that it lacks are 0.
    """
    from stepdiag.export.common import ExportOptions
    from stepdiag.export.write import check_fit, export_calibration, read_what_is_exported
    from stepdiag.io.whole_files import check_input

    if to in KINDS:
        path = OutputFile(output.path, (KINDS[to],)).claim(calibration)
    else:
        path = claim_folder(output.path, FOLDER, marks=["compensation.ini"])
    check_input(calibration)
    read = read_what_is_exported(calibration)
    check_fit(read, f"{calibration}", options["accept_rejected"])
    with Progress("export"):
        lines = export_calibration(read, to, path, ExportOptions(**options))
    for line in lines:
        if line.startswith("warning: "):
            tell("warning", line.removeprefix("warning: "))
        else:
            say(line)
    tell_fit(context, calibration, read.fit)
