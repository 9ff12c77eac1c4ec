"""The command that draws files."""

from pathlib import Path

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, Writes, is_untrusted, tell, trust_warnings
from stepdiag.io.outputs import FIGURE, PNG, OutputFile
from stepdiag.progress import Progress


@click.command(epilog="\b\nExample: stepdiag plot calibration.nc truth.csv -o calibration.pdf")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@click.option(
    "-o",
    "output",
    type=Writes(*FIGURE),
    metavar="FILE",
    help="Figure to write (.png, .svg, .pdf).  [default: .png beside the first FILE]",
)
@click.option("--truth", type=PATH, metavar="MAP", help="Error map to draw beside a calibration.")
@click.option("--scenario", type=PATH, metavar="SCENARIO", help="Draw the residuals of a measurement's adjustment.")
@click.option("--volume", is_flag=True, help="Draw the error in the volume of a calibration.")
@click.pass_context
def plot(
    context: click.Context,
    files: tuple[Path, ...],
    output: OutputFile | None,
    truth: Path | None,
    scenario: Path | None,
    volume: bool,
) -> None:
    """Draw each kind of FILE: calibrations, measurements, comparisons, uncertainties, plans.

    The content of the files decides what is drawn:

    \b
    calibration            the 21 parameters with 95 % bands; with an error map also the truth
    two calibrations       their differences B - A, with the limits of significance
    measurement            the readings; with its scenario the residuals, outliers and slips
    comparison             the differences in a file of compare
    error map              its errors
    uncertainty result     standard uncertainties, from a netCDF file of uncertainty also the budget
    scenario               what its plan determines, and how well
    table of observe       how uncertainties grow with the number of steps

    Without -o the figure is written beside the first FILE, as a PNG file of its name. It replaces
    an older figure of stepdiag there, and nothing else. If a fit is rejected, the figure says so,
    and the command ends with exit code 3.
    """
    from stepdiag.figures.files import draw_files
    from stepdiag.io.outputs import claim_beside
    from stepdiag.io.whole_files import check_input, write_whole
    from stepdiag.style import own_style, save

    everything = [*files, *(file for file in (truth, scenario) if file is not None)]
    for file in everything:
        check_input(file)
    path = claim_beside(files[0], PNG) if output is None else output.claim(*everything)
    _check_options(files, truth, scenario)
    with Progress("plot"):
        figure, drawn = draw_files(everything, volume=volume)
        with own_style():
            content = save(figure, path.suffix.lower().removeprefix("."))
    write_whole(path, content)
    if output is None:
        click.echo(f"wrote {path}")
    for file, calibration in drawn.items():
        for warning in trust_warnings(file, calibration):
            tell("warning", warning)
    if is_untrusted(*drawn.values()):
        context.exit(NOT_TO_BE_TRUSTED)


def _check_options(files: tuple[Path, ...], truth: Path | None, scenario: Path | None) -> None:
    """The options name files of one kind each."""
    from stepdiag.io.file_kind import kind_of_file

    for option, file, kind, with_kind in (
        ("--truth", truth, "error map", "calibration"),
        ("--scenario", scenario, "TOML file", "measurement"),
    ):
        if file is None:
            continue
        found = kind_of_file(file)
        if found != kind:
            name = "scenario" if kind == "TOML file" else kind
            raise InvalidArgument(f"{option}: expected the {name} of a {with_kind}, got {file}: {found or 'unknown'}")
        if with_kind not in [kind_of_file(given) for given in files]:
            raise InvalidArgument(f"{option}: goes with a {with_kind}, got {', '.join(map(str, files))}")
