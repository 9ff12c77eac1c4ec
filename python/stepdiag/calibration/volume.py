"""The error of the tool in the volume: how large, where, how certain, within a limit or not, and what causes it.

The error is that of the functional point, at the tool offset: its actual minus its nominal position, by the exact pose
of the machine's chain, in the machine frame, with axes approached in + direction. The frame is the calibration's: at
home every error is 0, and the straightnesses EYX, EZX and EZY are 0 at both ends of travel. An error that is large far
from home may be small from another reference point. docs/volume.md has the formulas.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag._core import Calibration, InvalidArgument, Machine
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.display import Displayed, Facts, point_text
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES
from stepdiag.style import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Verdict = Literal["within", "not within", "undecided"]
Interval = tuple[float, float]

DIAGONALS: Final = ("ppp", "npp", "pnp", "nnp")
# The axis that a squareness belongs to: in the pose it moves this axis aside.
SQUARENESS_OF: Final[Mapping[str, tuple[str, ...]]] = {"X": (), "Y": ("C0Y",), "Z": ("B0Z", "A0Z")}
# Lengths that differ by less were rounded on the way, mm.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True)
class VolumeContribution:
    """The largest error and the rms (mm) with a parameter, or all parameters of an axis, set to 0."""

    name: str  # "EXX", "C0Y", or "X": its six functions, and of Y and Z also their squarenesses
    parameters: tuple[str, ...]
    largest: float
    rms: float


@dataclass(frozen=True)
class VolumeFigure:
    """A figure, mm or rad, with its 95 % interval; None where the calibration has no covariance.

    The value is NaN where a parameter that it needs is not determined."""

    value: float
    interval: Interval | None = None


@dataclass(frozen=True, eq=False, repr=False)
class VolumeErrors(Displayed):
    """Errors of the functional point and tilts of the tool over a box of commanded positions."""

    source: Calibration | Machine
    tool: FloatArray  # (3,) offset of the functional point, mm
    box: FloatArray  # (2, 3) lowest and highest commanded positions, mm
    grid: tuple[FloatArray, FloatArray, FloatArray]  # positions of X, Y, Z, mm; errors are those at all combinations
    largest: float  # mm; NaN where a parameter that acts in it is not determined, as all figures
    largest_at: FloatArray  # (3,) commanded, mm
    largest_components: FloatArray  # (3,) dx, dy, dz, mm
    largest_interval: Interval | None  # 95 %; None where the calibration has no covariance, as all intervals
    rms: float  # root of the mean of |e|^2 over the box, mm
    rms_interval: Interval | None
    ranges: Mapping[str, VolumeFigure]  # "X", "Y", "Z": largest minus smallest component, mm
    tilts: Mapping[str, VolumeFigure]  # "A", "B", "C": largest absolute rotation of the tool, rad
    tilt_ranges: Mapping[str, VolumeFigure]  # "A", "B", "C": largest minus smallest rotation, rad
    diagonals: Mapping[str, VolumeFigure]  # "ppp" ...: range of the errors along the box's body diagonal, mm
    missing: Mapping[str, tuple[str, ...]]  # "X" ... "C" -> parameters that act in it and are not determined
    between_nodes: float  # standard uncertainty by what lies between the nodes, mm
    between_nodes_estimated: bool  # from second differences of the tables; else it was stated
    limit: float | None  # mm
    verdict: Verdict | None  # None without a limit, without a covariance, or where the largest error is not known
    no_verdict_because: str  # why there is none although there is a limit; else empty
    ranking: tuple[VolumeContribution, ...]  # parameters, then axes; the smallest largest error first
    fit: str | None  # verdict of the calibration's fit

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of positions of X, Y, Z."""
        x, y, z = (len(positions) for positions in self.grid)
        return x, y, z

    def _facts(self) -> Facts:
        low, high = self.largest_interval or (float("nan"), float("nan"))
        interval = "" if self.largest_interval is None else f", 95 % interval {low * 1e3:.3g} to {high * 1e3:.3g} µm"
        facts = [("verdict", f"{self.verdict}, limit {self.limit * 1e3:g} µm")] if self.verdict and self.limit else []
        facts += [("no verdict because", self.no_verdict_because)] if self.no_verdict_because else []
        facts += [
            ("largest", f"{self.largest * 1e3:.4g} µm at {point_text(self.largest_at)}{interval}"),
            ("rms", f"{self.rms * 1e3:.4g} µm"),
            ("fit", self.fit or "not known"),
            ("box", ", ".join(f"{a:g} to {b:g}" for a, b in zip(*self.box, strict=True)) + " mm"),
        ]
        facts += [(f"range of {name}", f"{figure.value * 1e3:.4g} µm") for name, figure in self.ranges.items()]
        facts += [(f"largest tilt {name}", f"{figure.value * 1e6:.4g} µrad") for name, figure in self.tilts.items()]
        return [*facts, *((f"missing in {name}", ", ".join(which)) for name, which in self.missing.items() if which)]

    def plot(self) -> "Figure":
        """Draw the error in three planes through the point with the largest one (a matplotlib Figure)."""
        return drawn(self)


def volume_errors(
    source: Calibration | Machine,
    *,
    tool: npt.ArrayLike | None = None,
    box: npt.ArrayLike | None = None,
    grid: int | None = None,
    limit: float | None = None,
    between_nodes: float | None = None,
    ranking: bool = True,
    samples: int = 10_000,
    seed: int = 0,
) -> VolumeErrors:
    """Summarise the error of the tool over a volume, with 95 % intervals where there is a covariance.

    tool: offset of the functional point, mm; none: the calibration's. box: (2, 3), lowest and highest commanded
    positions, mm; none: the whole volume; of a Machine it is needed. grid: at least as many positions an axis, besides
    the nodes of the tables; none: the nodes. limit: of the largest error, mm. between_nodes: standard uncertainty by
    what lies between the nodes, mm; none: estimated. ranking: whether to compute it. samples: draws of the covariance. Raises InvalidArgument for a box
    that is not in the volume, numbers out of range, and a limit of 0 or less."""
    machine, offset = _machine_of(source, tool)
    corners = _box_of(source, box)
    positions = _positions(machine, corners, grid)
    found = _core.summarise_volume(machine, *positions)
    missing = _missing(source, offset)
    if limit is not None and not (np.isfinite(limit) and limit > 0.0):
        raise InvalidArgument(f"limit: expected a positive length in mm, got {limit:g}")
    known = not any(component in missing for component in AXES)
    here = np.full(3, np.nan)
    return VolumeErrors(
        source=source,
        tool=offset,
        box=corners,
        grid=positions,
        largest=found.largest if known else np.nan,
        largest_at=found.largest_at if known else here,
        largest_components=found.components if known else here,
        largest_interval=None,
        rms=found.rms if known else np.nan,
        rms_interval=None,
        ranges=_figures(AXES, found.highest - found.lowest, missing),
        tilts=_figures("ABC", np.maximum(found.tilt_highest, -found.tilt_lowest), missing),
        tilt_ranges=_figures("ABC", found.tilt_highest - found.tilt_lowest, missing),
        diagonals=_diagonals(machine, corners, positions, known),
        missing=missing,
        between_nodes=0.0 if between_nodes is None else between_nodes,
        between_nodes_estimated=between_nodes is None,
        limit=limit,
        verdict=None,
        no_verdict_because="",
        ranking=_ranking(source, machine, positions) if known and ranking else (),
        fit=source.fit if isinstance(source, Calibration) else None,
    )


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Errors of the functional point and tilts of the tool at commanded points, with their standard uncertainties."""

    point: FloatArray  # (n, 3) commanded, mm
    error: FloatArray  # (n, 3) actual minus nominal, exact, mm; NaN where a parameter is not determined
    tilt: FloatArray  # (n, 3) rotation vector of the tool about X, Y, Z, rad
    error_uncertainty: FloatArray | None  # (n, 3) mm; None where the calibration has no covariance
    tilt_uncertainty: FloatArray | None  # (n, 3) rad


def errors_at_points(
    source: Calibration | Machine,
    points: npt.ArrayLike,
    *,
    tool: npt.ArrayLike | None = None,
    uncertainty: bool = True,
) -> PointErrors:
    """Compute the error vectors of the functional point and the tool's tilts at commanded points (n, 3), mm.

    Exact, with axes approached in + direction; outside of the tables functions keep their end values. The standard
    uncertainties are linear in the covariance; uncertainty: whether to compute them, which takes longer. Raises
    InvalidArgument for points that are not finite."""
    machine, offset = _machine_of(source, tool)
    array = np.asarray(points, dtype=float).reshape(-1, 3)
    found = _core.errors_at(machine, array)
    for component in _missing(source, offset):
        found[:, "XYZABC".index(component)] = np.nan
    u = None
    if uncertainty and isinstance(source, Calibration) and source.covariance is not None:
        u = _core.error_uncertainties_at(source, array, tool=offset)
    return PointErrors(
        array, found[:, :3], found[:, 3:], None if u is None else u[:, :3], None if u is None else u[:, 3:]
    )


def volume_grid(box: npt.ArrayLike, count: int | Sequence[int]) -> FloatArray:
    """Commanded points (n, 3), mm, of a grid with `count` equidistant positions an axis; Z changes fastest.

    box: (2, 3), lowest and highest positions, mm. count: one number, or three. Raises InvalidArgument for fewer than 2
    positions."""
    corners = np.asarray(box, dtype=float)
    counts = [count] * 3 if isinstance(count, int) else list(count)
    if corners.shape != (2, 3) or len(counts) != 3 or min(counts) < 2:
        raise InvalidArgument("grid: expected a box (2, 3) and at least 2 positions an axis")
    axes = [np.linspace(low, high, n) for low, high, n in zip(*corners, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _machine_of(source: Calibration | Machine, tool: npt.ArrayLike | None) -> tuple[Machine, FloatArray]:
    offset = np.asarray(source.tool if tool is None else tool, dtype=float)
    if offset.shape != (3,) or not np.all(np.isfinite(offset)):
        raise InvalidArgument("tool: expected three finite lengths in mm")
    errors = source.to_error_map() if isinstance(source, Calibration) else source.errors
    return Machine(source.chain, errors, offset), offset


def _box_of(source: Calibration | Machine, box: npt.ArrayLike | None) -> FloatArray:
    if box is None:
        if isinstance(source, Machine):
            raise InvalidArgument("box: expected the lowest and highest positions, because a machine has no volume")
        return np.array([np.zeros(3), source.volume])
    corners = np.asarray(box, dtype=float)
    if corners.shape != (2, 3) or not np.all(np.isfinite(corners)):
        raise InvalidArgument("box: expected the lowest and highest positions of X, Y, Z, (2, 3), in mm")
    for axis, low, high in zip(AXES, *corners, strict=True):
        if not low < high:
            raise InvalidArgument(f"box: expected a lowest position of {axis} below the highest, got {low:g} {high:g}")
    if isinstance(source, Calibration):
        for axis, low, high, travel in zip(AXES, *corners, source.volume, strict=True):
            if low < -_ROUNDING or high > travel + _ROUNDING:
                raise InvalidArgument(
                    f"box: expected positions of {axis} in the calibrated volume, 0 to {travel:g} mm, "
                    f"got {low:g} to {high:g} mm"
                )
    return corners


def _positions(machine: Machine, box: FloatArray, grid: int | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The ends of the box and the nodes inside, with equidistant positions where a number is given."""
    if grid is not None and not 2 <= grid <= 1001:
        raise InvalidArgument(f"grid: expected 2 to 1001 positions an axis, got {grid}")
    axes = []
    for axis, low, high in zip(AXES, *box, strict=True):
        nodes = [position for name, (position, _) in machine.errors.functions.items() if name[2] == axis]
        inside = np.concatenate([*nodes, np.linspace(low, high, grid or 2)])
        inside = np.unique(inside[(inside > low) & (inside < high)])
        inside = np.concatenate([[low], inside, [high]])
        # Positions of one node may differ in the last digits between functions.
        apart = np.concatenate([[True], np.diff(inside) > _ROUNDING])
        kept = inside[apart]
        kept[-1] = high
        axes.append(kept)
    x, y, z = axes
    return x, y, z


def _missing(source: Calibration | Machine, tool: FloatArray) -> dict[str, tuple[str, ...]]:
    if isinstance(source, Machine):
        return {}
    somewhere = source.volume * (0.37, 0.61, 0.83)  # where no lever is 0
    found = _core.error_at_point(source, somewhere, tool=tool).missing
    return {component: tuple(found[component]) for component in "XYZABC" if component in found}


def _figures(names: str, values: FloatArray, missing: Mapping[str, object]) -> dict[str, VolumeFigure]:
    return {
        name: VolumeFigure(float(value) if name not in missing else np.nan)
        for name, value in zip(names, values, strict=True)
    }


def _diagonals(
    machine: Machine, box: FloatArray, grid: tuple[FloatArray, FloatArray, FloatArray], known: bool
) -> dict[str, VolumeFigure]:
    """Ranges of the errors along the box's body diagonals: actual minus commanded distance from where they start."""
    share = np.linspace(0.0, 1.0, max(len(positions) for positions in grid))
    found = {}
    for name in DIAGONALS:
        rising = np.array([sign == "p" for sign in name])
        start, end = np.where(rising, box[0], box[1]), np.where(rising, box[1], box[0])
        errors = _core.errors_at(machine, start + share[:, None] * (end - start))[:, :3]
        along = (errors - errors[0]) @ ((end - start) / np.linalg.norm(end - start))
        found[name] = VolumeFigure(float(np.ptp(along)) if known else np.nan)
    return found


def _ranking(
    source: Calibration | Machine, machine: Machine, grid: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[VolumeContribution, ...]:
    there = {*machine.errors.functions, *(source.squareness if isinstance(source, Calibration) else SQUARENESSES)}
    groups = [(name, (name,)) for name in (*FUNCTIONS, *SQUARENESSES) if name in there]
    axes = [(axis, (*(f"E{component}{axis}" for component in "XYZABC"), *SQUARENESS_OF[axis])) for axis in AXES]
    ranked = []
    for members in (groups, axes):
        part = []
        for name, parameters in members:
            without = _core.summarise_volume(machine, *grid, without=list(parameters))
            part.append(VolumeContribution(name, parameters, without.largest, without.rms))
        ranked += sorted(part, key=lambda contribution: contribution.largest)
    return tuple(ranked)
