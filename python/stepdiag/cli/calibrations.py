"""Commands that read calibrations: report one, compare two."""

from pathlib import Path

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, Writes, fit_warnings, json_option, tell, tell_fit
from stepdiag.io.outputs import COMPARISON, FUNCTIONAL_POINT, OutputFile


@click.command(epilog="\b\nExample: stepdiag report calibration.nc --functional-point straightness.csv")
@click.argument("calibration", type=PATH)
@click.option(
    "--functional-point",
    "output",
    type=Writes(FUNCTIONAL_POINT),
    metavar="FILE",
    help="Also write the straightness of the functional point and that of the table (CSV).",
)
@json_option
@click.pass_context
def report(context: click.Context, calibration: Path, output: OutputFile | None, as_json: bool) -> None:
    """Summarise a CALIBRATION (CSV or netCDF).

    Reports the largest values and uncertainties, and the point to which straightness refers. The
    tables refer to the axes' own frames. For an axis that carries the workpiece, or with a tool
    offset, the straightness of the functional point differs; netCDF files contain it as well.
    """
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.whole_files import check_input, write_whole
    from stepdiag.report.calibration import calibration_report, functional_point_csv

    path = None if output is None else output.claim(calibration)
    check_input(calibration)
    read = read_calibration(calibration)
    if path is not None:
        write_whole(path, functional_point_csv(read))
    if as_json:
        from stepdiag.objects.report import report_object
        from stepdiag.objects.writer import json_text

        click.echo(json_text(report_object(read, calibration, fit_warnings(calibration, read.fit))))
    else:
        for line in calibration_report(read):
            click.echo(line)
    tell_fit(context, calibration, read.fit)


@click.command(epilog="\b\nExample: stepdiag compare before.csv after.nc -o differences.csv")
@click.argument("a", type=PATH)
@click.argument("b", type=PATH)
@click.option(
    "-o", "output", type=Writes(COMPARISON), metavar="FILE", help="Differences to write, CSV or netCDF (.nc)."
)
@click.option(
    "--limit",
    type=float,
    default=0.05,
    show_default=True,
    metavar="P",
    help="A difference is significant if its probability by chance is smaller than this (for all values together).",
)
@json_option
@click.pass_context
def compare(context: click.Context, a: Path, b: Path, output: OutputFile | None, limit: float, as_json: bool) -> None:
    """Compare two calibrations A and B (CSV or netCDF).

    Reports for every parameter the largest difference B - A, its position, its standard uncertainty
    sqrt(u_A^2 + u_B^2), and whether a difference is significant. The probability of each difference
    is multiplied by the number of values compared (Bonferroni). If nodes differ, the longer table
    is interpolated. Functions whose slope is not determined in both are compared by shape.
    """
    from stepdiag.calibration.comparison import compare_calibrations
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.whole_files import check_input
    from stepdiag.report.comparison import comparison_report

    written = None if output is None else output.claim(a, b)
    if not 0.0 < limit < 1.0:
        raise InvalidArgument(f"--limit: expected a probability between 0 and 1, got {limit:g}")
    for path in (a, b):
        check_input(path)
    one, other = read_calibration(a), read_calibration(b)
    try:
        comparison = compare_calibrations(one, other, limit=limit)
    except InvalidArgument as error:
        raise InvalidArgument(f"{a}, {b}: {error}") from None
    if written is not None:
        from stepdiag.report.comparison import write_comparison

        write_comparison(comparison, written)
    warnings = [*fit_warnings(a, one.fit), *fit_warnings(b, other.fit)]
    if as_json:
        from stepdiag.objects.comparison import comparison_object
        from stepdiag.objects.writer import json_text

        click.echo(json_text(comparison_object(comparison, (a, b), warnings)))
    else:
        for line in comparison_report(comparison, str(a), str(b)):
            click.echo(line)
    for warning in warnings:
        tell("warning", warning)
    if "rejected" in (one.fit, other.fit):
        context.exit(NOT_TO_BE_TRUSTED)
