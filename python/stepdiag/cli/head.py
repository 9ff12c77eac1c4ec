"""The commands `stepdiag head ...`: list, show, check and sensitivity."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import InOrder, out_file
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import FIGURE, OutputFile

if TYPE_CHECKING:
    from stepdiag import _core

EPILOG = """\b
Look at a shipped head, then make your own from it:
  stepdiag head show beam_and_psd -o head.png
  stepdiag init -o machine --head beam_and_psd
  stepdiag head check machine/head.toml
"""
MARGIN = 100.0  # mm by which the mirror exceeds the extent of the beams
DISTANCES = (100.0, 300.0, 600.0, 1200.0)  # mm

HEAD = click.argument("name", metavar="HEAD")
MIRROR = click.option(
    "--mirror",
    nargs=2,
    type=float,
    metavar="W H",
    help="Width and height of the mirror, mm.  [default: 100 mm more than the beams need]",
)


@click.group(cls=InOrder, epilog=EPILOG)
def head() -> None:
    """Draw and check descriptions of laser heads.

    HEAD is the path of a description (TOML), or the name of a shipped one.
    """


@head.command("list", short_help="List the shipped heads.", epilog="\b\nExample: stepdiag head list")
def list_heads() -> None:
    """List the heads that come with stepdiag, and the paths of their files."""
    from stepdiag.head.description import find_head, read_head_design, shipped_heads

    for name in shipped_heads():
        path = find_head(name)
        design = read_head_design(path)
        click.echo(f"{name:<16}{design.layout:<12}{design.name}: {path}")


@head.command(short_help="Draw a head.", epilog="\b\nExample: stepdiag head show beam_and_psd -o head.png")
@HEAD
@out_file("Figure to write (.png, .svg, .pdf).", *FIGURE)
@click.option("--distance", type=float, metavar="MM", help=f"Distance of the mirror.  [default: {DISTANCES[1]:g}]")
@MIRROR
def show(name: str, output: OutputFile, distance: float | None, mirror: tuple[float, float] | None) -> None:
    """Draw bodies, beams and detectors of HEAD from two sides.

    Light that arrives at its detector is a solid line. Other light is dashed; weaker light is
    paler.
    """
    from stepdiag.io.whole_files import write_whole

    path = output.claim(Path(name))
    made, distances = _prepare(name, mirror, () if distance is None else (distance,), DISTANCES[1:2])
    from stepdiag.head.drawing import draw_head

    write_whole(path, draw_head(made, distances[0], path.suffix.lower().removeprefix(".")))


@head.command(
    short_help="Report where light arrives, and its limits.", epilog="\b\nExample: stepdiag head check beam_and_psd"
)
@HEAD
@click.option(
    "--distance",
    "distances",
    multiple=True,
    type=float,
    metavar="MM",
    help=f"Distance of the mirror; may be repeated.  [default: {', '.join(f'{d:g}' for d in DISTANCES)}]",
)
@MIRROR
def check(name: str, distances: tuple[float, ...], mirror: tuple[float, float] | None) -> None:
    """Report what HEAD reads in front of an aligned mirror.

    The report has the nominal calibration; spot, path and power at every detector; how far the
    mirror may tilt and move before a reading is lost; and the smallest mirror.
    """
    from stepdiag.head.check import check_report

    for line in check_report(*_prepare(name, mirror, distances, DISTANCES)):
        say(line)


@head.command(
    short_help="Report what imperfections of a head change.",
    epilog="\b\nExample: stepdiag head sensitivity three_beams --distance 600",
)
@HEAD
@click.option("--distance", type=float, metavar="MM", help=f"Distance of the mirror.  [default: {DISTANCES[2]:g}]")
@click.option(
    "--tilt",
    nargs=2,
    default=(300.0, 300.0),
    show_default=True,
    metavar="A B",
    help="Tilts alpha and beta of the mirror, µrad.",
)
def sensitivity(name: str, distance: float | None, tilt: tuple[float, float]) -> None:
    """List the effect of every imperfection of HEAD, strongest first.

    Imperfections are pose errors, index errors and changes of the air. The effects are exact
    derivatives along the traced rays, for distance and tilts after reduction with the nominal
    calibration.
    """
    from stepdiag.head.sensitivity import sensitivity_report
    from stepdiag.units import MICRORADIAN

    if not all(math.isfinite(angle) for angle in tilt):
        raise InvalidArgument(f"--tilt: expected two angles in µrad, got {tilt[0]:g} {tilt[1]:g}")
    made, distances = _prepare(name, None, () if distance is None else (distance,), DISTANCES[2:3])
    for line in sensitivity_report(made, distances[0], (tilt[0] * MICRORADIAN, tilt[1] * MICRORADIAN)):
        say(line)


def _prepare(
    name: str, mirror: tuple[float, float] | None, distances: Sequence[float], standard: Sequence[float]
) -> tuple["_core.Head", Sequence[float]]:
    """The head with the given mirror, or one that no beam misses; and the distances to use."""
    from stepdiag.head.description import ROOM, before_the_head, find_head, reach, read_head_design

    if mirror is not None and not all(math.isfinite(edge) and edge > 0.0 for edge in mirror):
        raise InvalidArgument(f"--mirror: expected two positive lengths in mm, got {mirror[0]:g} {mirror[1]:g}")
    path = Path(name) if Path(name).is_file() else find_head(name)
    design = read_head_design(path)
    nearest = reach(design)
    for distance in distances:
        if not (math.isfinite(distance) and distance > nearest):
            raise InvalidArgument(
                f"--distance: expected more than the {nearest:g} mm that the head reaches to, got {distance:g}"
            )
    edge = MARGIN + 2.0 * max(float(abs(beam.position[:2]).max()) for beam in design.beams)
    wanted = distances or [distance for distance in standard if distance > nearest] or [nearest + ROOM]
    return before_the_head(design, mirror or (edge, edge)), wanted
