"""The command volume: the error of the tool in the volume, and whether it is within a limit."""

from pathlib import Path
from typing import Any, Final

import click

from stepdiag.cli.in_book import OfMachine
from stepdiag.cli.options import PATH, PointInMm, json_option, tell_trust, trust_warnings
from stepdiag.cli.terminal import say
from stepdiag.progress import Progress
from stepdiag.units import MICROMETRE

Box = tuple[tuple[float, ...], tuple[float, ...]]


class BoxInMm(click.ParamType):  # type: ignore[type-arg]
    """Ranges of X, Y and Z: the lowest and the highest positions."""

    name = "X:X,Y:Y,Z:Z"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        try:
            ranges = [tuple(float(end) for end in part.split(":")) for part in value.split(",")]
        except ValueError:
            ranges = []
        if len(ranges) != 3 or any(len(ends) != 2 for ends in ranges):
            self.fail(f"expected ranges of X,Y,Z in mm, such as 0:800,100:500,0:500, got {value!r}", param, ctx)
        return tuple(zip(*ranges, strict=True))


EXAMPLES: Final = """\b
Examples:
  stepdiag volume calibration.nc --limit 20
  stepdiag volume calibration.nc --limit 20 --tool 0,0,120 --box 100:700,0:600,0:400
"""


@click.command(cls=OfMachine, about=True, epilog=EXAMPLES)
@click.argument("calibration", type=PATH)
@click.option("--limit", type=float, metavar="UM", help="Limit of the largest error, µm: adds a verdict.")
@click.option("--tool", type=PointInMm(), help="Tool offset, mm.  [default: the calibration's]")
@click.option("--box", type=BoxInMm(), help="Commanded positions, mm.  [default: the whole volume]")
@click.option(
    "--grid", type=int, metavar="N", help="At least N positions an axis, besides the nodes.  [default: the nodes]"
)
@click.option(
    "--between-nodes",
    type=float,
    metavar="UM",
    help="Standard uncertainty by errors between the nodes, µm.  [default: the scenario's between_nodes_um, which the "
    "calibration carries; else estimated from the tables]",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the draws for the intervals.")
@json_option
@click.pass_context
def volume(
    context: click.Context,
    calibration: Path,
    limit: float | None,
    tool: tuple[float, float, float] | None,
    box: Box | None,
    grid: int | None,
    between_nodes: float | None,
    seed: int,
    as_json: bool,
) -> None:
    """Report the error of the tool in the volume, from a CALIBRATION (CSV or netCDF).

    The error is that of the functional point at the tool offset: actual minus nominal position, by
    the exact pose of the chain, with axes approached in + direction. It is 0 at home by the frame of
    the calibration. Reports the largest error and its place, the rms error, the ranges of its
    components, the largest tilts, the errors along the body diagonals of the box, and the largest
    error without each axis and parameter.

    95 % intervals and the verdict need the covariance, which evaluate writes to netCDF files. The
    verdict is within, not within, or undecided (ISO 14253-1, one-sided, 95 %). The exit code
    is 0 for each of them, and 3 if the fit of the calibration is rejected; programs read --json.
    """
    from stepdiag.calibration.volume import volume
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.whole_files import check_input
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.volume import volume_blocks

    check_input(calibration)
    read = read_calibration(calibration)
    with Progress("draws of the covariance") as progress:
        found = volume(
            read,
            tool=tool,
            box=box,
            grid=grid,
            limit=None if limit is None else limit * MICROMETRE,
            between_nodes=None if between_nodes is None else between_nodes * MICROMETRE,
            seed=seed,
            progress=progress,
        )
    if as_json:
        from stepdiag.presentation.objects.volume import volume_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(volume_object(found, calibration, trust_warnings(calibration, read))))
    else:
        for line in text_of(volume_blocks(found)):
            say(line)
    tell_trust(context, calibration, read)
