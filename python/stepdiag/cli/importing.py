"""The command that reads sheets of spreadsheet programs."""

from pathlib import Path

import click

from stepdiag.cli.options import PATH, out_file, tell
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import MEASUREMENT, OutputFile
from stepdiag.progress import Progress


@click.command("import", epilog="\b\nExample: stepdiag import readings.xlsx -o run.csv")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@out_file("Measurement to write, CSV or netCDF (.nc).", MEASUREMENT)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="HEAD=NAME",
    help='What a head means: "Distance [µm]=distance", "Tilt A=-alpha [µrad]"; "HEAD=" leaves it out.',
)
@click.option("--separator", type=click.Choice(["comma", "semicolon", "tab"]), help="Separator of fields.")
@click.option("--decimal", type=click.Choice(["point", "comma"]), help="Decimal mark of numbers.")
@click.option("--sheet", metavar="NAME", help="Sheet of the workbook.  [default: the one with the heads]")
@click.option("--scenario", type=PATH, metavar="FILE", help="Take the commanded positions from this scenario's plan.")
@click.option("--overwrite", is_flag=True, help="Replace an existing measurement of this name.")
def import_(
    files: tuple[Path, ...],
    output: OutputFile,
    columns: tuple[str, ...],
    separator: str | None,
    decimal: str | None,
    sheet: str | None,
    scenario: Path | None,
    overwrite: bool,
) -> None:
    """Read the measurement in each FILE in the form that spreadsheet programs give it.

    FILE is text with commas, semicolons or tabs (UTF-8, UTF-16 or Latin-1), or a workbook (.xlsx,
    .ods). Heads may have any case, and units in brackets: "Spot X [µm]". The command prints what
    it took each column for. Where a file can be read in two ways it says which, and does not
    choose. Several files become one measurement.
    """
    from stepdiag.importing.run import import_files
    from stepdiag.io.data_files import write_measurement
    from stepdiag.scenario.description import read_scenario
    from stepdiag.scenario.plausible_inputs import odd_columns

    described = read_scenario(scenario) if scenario is not None else None
    path = output.claim(
        *files,
        *([scenario] if scenario is not None else []),
        error_map=described.truth.error_map if described else None,
        overwrite=overwrite,
    )
    with Progress("import"):
        found = import_files(
            files,
            column=columns,
            separator=separator,
            decimal=decimal,
            sheet=sheet,
            plan=described.known.plan if described else None,
        )
    write_measurement(found.measurement, path)
    for line in found.text:
        say(line)
    for warning in odd_columns(found.measurement, described.known.keys if described else None):
        tell("warning", f"{path}: {warning}")
    click.echo(f"wrote {path}")
