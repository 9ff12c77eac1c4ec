"""The command positions: figures of ISO 230-2 and ISO 230-6, measured or predicted."""

from pathlib import Path
from typing import Final

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import PATH, PointInMm, json_option, tell, tell_trust, trust_warnings
from stepdiag.cli.terminal import say
from stepdiag.progress import Progress

Point = tuple[float, float, float]
HOME: Final = (0.0, 0.0, 0.0)
BODY_DIAGONALS: Final = ("ppp", "npp", "pnp", "nnp")
EXAMPLES: Final = """\b
Examples:
  stepdiag positions readings.csv
  stepdiag positions calibration.nc
  stepdiag positions calibration.nc --axis X --at 0,300,250 --points 11
  stepdiag positions calibration.nc --from 100,100,50 --to 700,500,450
"""


@click.command(epilog=EXAMPLES)
@click.argument("file", type=PATH)
@click.option("--axis", type=click.Choice(["X", "Y", "Z"]), help="Predict along this axis, over its whole travel.")
@click.option("--at", type=PointInMm(), help="Point through which the line along --axis goes, mm.  [default: home]")
@click.option("--diagonal", metavar="NAME", help="Predict along a body or face diagonal, such as ppp or np0.")
@click.option("--from", "start", type=PointInMm(), help="Predict along the line from this point, mm ...")
@click.option("--to", "end", type=PointInMm(), help="... to this one.")
@click.option("--points", type=int, metavar="N", help="Targets of a line.  [default: nodes of the axis with the most]")
@click.option("--tool", type=PointInMm(), help="Tool offset, mm.  [default: the calibration's]")
@json_option
@click.pass_context
def positions(
    context: click.Context,
    file: Path,
    axis: str | None,
    at: Point | None,
    diagonal: str | None,
    start: Point | None,
    end: Point | None,
    points: int | None,
    tool: Point | None,
    as_json: bool,
) -> None:
    """Evaluate repeated readings of targets, or predict what they would show.

    FILE with readings: reports accuracy A, systematic error E and M, repeatability R and reversal
    error B of the axis (ISO 230-2) or the diagonal (ISO 230-6). It is CSV (target_mm, direction,
    cycle, and deviation_um or position_mm), a linear test of Renishaw's (.rtl), or a table or
    workbook with targets in rows and runs in columns ("Target [mm]", "Run 1 + [µm]", …).

    FILE with a calibration (CSV or netCDF): reports the systematic part of these figures, E, M and B,
    along the three axes through home and the four body diagonals, or along one line of your choice.
    M, B and bidirectional E need a calibration from forward and backward lines.
    """
    from stepdiag.io.data_files import is_netcdf, read_calibration
    from stepdiag.io.file_kind import kind_of_file
    from stepdiag.io.whole_files import check_input
    from stepdiag.positions.prediction import PredictedPositions, axis_line, diagonal_line, predict_positions
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.positions import predicted_blocks

    check_input(file)
    given = {"axis": axis, "at": at, "diagonal": diagonal, "from": start, "to": end, "points": points, "tool": tool}
    if not is_netcdf(file) and kind_of_file(file) != "calibration":
        for option, value in given.items():
            if value is not None:
                raise InvalidArgument(f"--{option}: goes with a calibration, and {file} is not one")
        _evaluate(file, as_json)
        return
    if (start is None) != (end is None):
        raise InvalidArgument("--from and --to: go together")
    if sum(option is not None for option in (axis, diagonal, start)) > 1:
        raise InvalidArgument("--axis, --diagonal, --from: expected one of them")
    if at is not None and axis is None:
        raise InvalidArgument("--at: goes with --axis")
    calibration = read_calibration(file)
    if start is not None and end is not None:
        lines = {"line": (start, end)}
    elif axis is not None:
        lines = {axis: axis_line(calibration, axis, at or HOME)}
    elif diagonal is not None:
        lines = {diagonal: diagonal_line(calibration, diagonal)}
    else:
        lines = {name: axis_line(calibration, name) for name in "XYZ"}
        lines |= {name: diagonal_line(calibration, name) for name in BODY_DIAGONALS}
    predicted: dict[str, PredictedPositions] = {}
    with Progress("lines") as progress:
        for name, ends in lines.items():
            progress(len(predicted), len(lines))
            predicted[name] = predict_positions(calibration, *ends, points=points, tool=tool)
    if as_json:
        from stepdiag.presentation.objects.positions import predicted_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(predicted_object(calibration, predicted, file, trust_warnings(file, calibration))))
    else:
        for text in text_of(predicted_blocks(calibration, predicted)):
            say(text)
    tell_trust(context, file, calibration)


def _evaluate(file: Path, as_json: bool) -> None:
    from stepdiag.importing.position_table import is_position_table, read_position_table
    from stepdiag.positions.evaluation import evaluate_positions
    from stepdiag.positions.readings import read_positions
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.positions import measured_blocks, measured_warnings

    if is_position_table(file):
        readings, said = read_position_table(file)
        for line in said:
            tell("note", line)
    else:
        readings = read_positions(file)
    try:
        result = evaluate_positions(readings)
    except InvalidArgument as error:
        raise InvalidArgument(f"{file}: {error}") from None
    warnings = [f"{file}: {warning}" for warning in measured_warnings(result)]
    if as_json:
        from stepdiag.presentation.objects.positions import measured_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(measured_object(result, file, warnings)))
    else:
        for text in text_of(measured_blocks(result)):
            say(text)
    for warning in warnings:
        tell("warning", warning)
