"""The error of the tool in the volume: how large, where, how certain, within a limit or not, and what causes it.

The error is that of the functional point, at the tool offset: its actual minus its nominal position, by the exact pose
of the machine's chain, in the machine frame, with axes approached in + direction; for other directions there is the
largest error alone, from tables of both directions. The frame is the calibration's: at
home every error is 0, and the straightnesses EYX, EZX and EZY are 0 at both ends of travel. An error that is large far
from home may be small from another reference point. docs/volume.md has the formulas.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from statistics import NormalDist
from typing import TYPE_CHECKING, Final, Literal, cast

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag._core import Calibration, ErrorMap, InvalidArgument, Machine
from stepdiag.calibration.parts import OTHER_AXIS, unmeasured_axes
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.display import Displayed, Facts, point_text
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES
from stepdiag.style import drawn
from stepdiag.wrong_arguments import checked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Verdict = Literal["within", "not within", "undecided"]
Interval = tuple[float, float]
Spread = tuple[float, float]  # bias and standard uncertainty

DIAGONALS: Final = ("ppp", "npp", "pnp", "nnp")
# The axis that a squareness belongs to: in the pose it moves this axis aside.
SQUARENESS_OF: Final[Mapping[str, tuple[str, ...]]] = {"X": (), "Y": ("C0Y",), "Z": ("B0Z", "A0Z")}
TWO_SIDED: Final = NormalDist().inv_cdf(0.975)
ONE_SIDED: Final = NormalDist().inv_cdf(0.95)
FEWEST_SAMPLES: Final = 1000
GRID: Final = 5  # positions of each axis, where a figure of the whole volume has to be quick
DRAWS_BETWEEN: Final = 1000  # of what lies between the nodes; its 95 % quantile is good to a tenth of its uncertainty
MOST_NODES: Final = 201  # of an axis that are computed; 8 million points in a tenth of a second
MOST_DRAWN: Final = 51  # positions an axis; more take much longer and change little
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


@dataclass(frozen=True, eq=False)
class ChosenPlaces:
    """What the bounds of the largest error rest on. Draws add noise to the values of a calibration; each chooses the
    place and the direction of its largest error. Arrays (n,) have a number for each draw, after that of the
    calibration itself; mm.

    Of the calibration's error e at that place, with the covariance V: e along the direction, the length of e less the
    noise that chose, the standard uncertainty along the direction, and the traces of V and V V. raised: the largest
    error with draws of what lies between the nodes, less that without, (m,); empty where nothing does."""

    found: FloatArray
    opposite: FloatArray
    u: FloatArray
    variance: FloatArray
    variance2: FloatArray
    raised: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class VolumeErrors(Displayed):
    """Errors of the functional point and tilts of the tool over a box of commanded positions."""

    source: Calibration | Machine
    tool: FloatArray  # (3,) offset of the functional point, mm
    box: FloatArray  # (2, 3) lowest and highest commanded positions, mm
    grid: tuple[FloatArray, FloatArray, FloatArray]  # positions of X, Y, Z, mm; errors are those at all combinations
    every_node: bool  # whether all nodes in the box are among them
    largest: float  # mm; NaN where a parameter that acts in it is not determined, as all figures
    largest_at: FloatArray  # (3,) commanded, mm
    largest_components: FloatArray  # (3,) dx, dy, dz, mm
    largest_chosen: ChosenPlaces | None  # None without a covariance, and where the largest error is not known
    largest_interval: Interval | None  # 95 % or more, with between_nodes; None without a covariance, as all intervals
    rms: float  # root of the mean of |e|^2 over the box, mm
    rms_interval: Interval | None
    ranges: Mapping[str, VolumeFigure]  # "X", "Y", "Z": largest minus smallest component, mm
    tilts: Mapping[str, VolumeFigure]  # "A", "B", "C": largest absolute rotation of the tool, rad
    tilt_ranges: Mapping[str, VolumeFigure]  # "A", "B", "C": largest minus smallest rotation, rad
    diagonals: Mapping[str, VolumeFigure]  # "ppp" ...: range of the errors along the box's body diagonal, mm
    missing: Mapping[str, tuple[str, ...]]  # "X" ... "C" -> parameters that act in it and are not determined
    between_nodes: float  # standard uncertainty of the largest error by what lies between the nodes, mm
    between_nodes_estimated: bool  # from second differences of the tables; else it was stated
    bounds: Interval | None  # of the largest error, mm: above the first, below the second, with 95 % or more each
    limit: float | None  # mm
    verdict: Verdict | None  # None without a limit, without a covariance, or where the largest error is not known
    no_verdict_because: str  # why there is none although there is a limit; else empty
    other_approaches: Mapping[str, float]  # "-++" ...: largest error of X, Y, Z so approached, mm; empty: not known
    ranking: tuple[VolumeContribution, ...]  # parameters, then axes; the smallest largest error first
    fit: str | None  # verdict of the calibration's fit
    plane: "PlaneErrors | None" = None  # where nothing was measured of one axis

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of positions of X, Y, Z."""
        x, y, z = (len(positions) for positions in self.grid)
        return x, y, z

    @property
    def interval_note(self) -> str:
        """Why there is a verdict although the limit is in `largest_interval`; else empty."""
        if self.limit is None or self.verdict in (None, "undecided") or self.largest_interval is None:
            return ""
        low, high = self.largest_interval
        if not low <= self.limit <= high:
            return ""
        return "the limit is in the 95 % interval: that leaves 2.5 % on each side, the verdict 5 % on one"

    def _facts(self) -> Facts:
        low, high = self.largest_interval or (float("nan"), float("nan"))
        interval = "" if self.largest_interval is None else f", 95 % interval {low * 1e3:.3g} to {high * 1e3:.3g} µm"
        facts = [("verdict", f"{self.verdict}, limit {self.limit * 1e3:g} µm")] if self.verdict and self.limit else []
        facts += [("no verdict because", self.no_verdict_because)] if self.no_verdict_because else []
        facts += [("verdict and interval", self.interval_note)] if self.interval_note else []
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


@checked
def volume(
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
    progress: Callable[[int, int], None] | None = None,
) -> VolumeErrors:
    """Summarise the error of the tool over a volume, with 95 % intervals where there is a covariance.

    tool: offset of the functional point, mm; none: the calibration's. box: (2, 3), lowest and highest commanded
    positions, mm; none: the whole volume; of a Machine it is needed. grid: at least as many positions an axis,
    besides the nodes of the tables (of more than 201, 201); none: the nodes. limit: of the largest error, mm.
    between_nodes: standard uncertainty by what lies between the nodes, mm; none: the calibration's, else estimated.
    ranking: whether to compute it. samples: draws of the covariance. progress: called with the number of draws that
    are done, and of all. Raises InvalidArgument for a box that is not in the volume, and for numbers out of range."""
    machine, offset = _machine_of(source, tool)
    corners = _box_of(source, box)
    positions, every_node = _positions(machine, corners, grid)
    _check_numbers(limit, between_nodes, samples)
    found = _core.summarise_volume(machine, *positions)
    missing = _missing(source, offset)
    known = not any(component in missing for component in AXES)
    if between_nodes is None and isinstance(source, Calibration):
        between_nodes = source.between_nodes
    between, estimated = between_nodes or 0.0, False
    if between_nodes is None and isinstance(source, Calibration) and known:
        between, estimated = _between_nodes(source, offset, found.largest_at, found.components), True
    values = _values(found, machine, corners, positions)
    for name in values:
        if not (known if name in ("largest", "rms", *DIAGONALS) else name[-1] not in missing):
            values[name] = math.nan
    spreads: dict[str, Spread] = {}
    chosen = None
    if isinstance(source, Calibration) and source.covariance is not None:
        drawn_at = tuple(_thinned(axis, MOST_DRAWN) for axis in positions)
        draws = _core.VolumeDraws(source, *drawn_at, tool=offset, seed=seed)
        drawn = _drawn(draws, samples, progress)
        spreads = _spreads(draws, drawn)
        if known:
            whole = all(len(some) == len(every) for some, every in zip(drawn_at, positions, strict=True))
            there = found if whole else _core.summarise_volume(machine, *drawn_at, tilts=False)
            chosen = _chosen(found.largest, there.largest, draws.values, drawn)
            if between > 0.0:
                chosen = replace(chosen, raised=_raised(source, offset, drawn_at, between, seed))
    figures = {name: VolumeFigure(value, _interval(value, spreads.get(name))) for name, value in values.items()}
    nowhere = np.full(3, np.nan)
    not_judged = VolumeErrors(
        source=source,
        tool=offset,
        box=corners,
        grid=positions,
        every_node=every_node,
        largest=figures["largest"].value,
        largest_at=found.largest_at if known else nowhere,
        largest_components=found.components if known else nowhere,
        largest_chosen=chosen,
        largest_interval=None,
        rms=figures["rms"].value,
        rms_interval=figures["rms"].interval,
        ranges={axis: figures[f"range {axis}"] for axis in AXES},
        tilts={axis: figures[f"tilt {axis}"] for axis in "ABC"},
        tilt_ranges={axis: figures[f"range {axis}"] for axis in "ABC"},
        diagonals={name: figures[name] for name in DIAGONALS},
        missing=missing,
        between_nodes=between,
        between_nodes_estimated=estimated,
        bounds=None,
        limit=None,
        verdict=None,
        no_verdict_because="",
        other_approaches=_other_approaches(source, machine, positions) if known else {},
        ranking=_ranking(source, machine, positions) if known and ranking else (),
        fit=source.fit if isinstance(source, Calibration) else None,
        plane=None if known else _plane(source, machine, offset, positions),
    )
    return judged(not_judged, limit=limit)


def _check_numbers(limit: float | None, between_nodes: float | None, samples: int) -> None:
    for name, length in (("limit", limit), ("between_nodes", between_nodes)):
        if length is not None and not (math.isfinite(length) and length >= 0.0):
            raise InvalidArgument(f"`{name}`: expected a length of at least 0 mm, got {length:g}")
    if limit == 0.0:
        raise InvalidArgument("`limit`: expected a length above 0 mm, got 0")
    if samples < FEWEST_SAMPLES:
        raise InvalidArgument(f"samples: expected at least {FEWEST_SAMPLES}, got {samples}")


def without_between_nodes(found: VolumeErrors) -> VolumeErrors:
    """The same figures, without a limit, as if nothing lay between the nodes."""
    chosen = found.largest_chosen
    kept = None if chosen is None else replace(chosen, raised=np.zeros(0))
    return judged(replace(found, largest_chosen=kept, between_nodes=0.0), limit=None)


def judged(found: VolumeErrors, *, limit: float | None) -> VolumeErrors:
    """The same figures beside this limit, mm."""
    bounds = _bounds(found.largest_chosen, found.between_nodes, 0.95)
    verdict, why = _verdict(found.source, limit, bounds, found.missing)
    return replace(
        found,
        largest_interval=_bounds(found.largest_chosen, found.between_nodes, 0.975),
        bounds=bounds,
        limit=limit,
        verdict=verdict,
        no_verdict_because=why,
    )


@dataclass(frozen=True, eq=False)
class PlaneErrors:
    """Errors along two axes, in their plane, where nothing was measured of the third one, which stands at home."""

    axes: str  # "XY"
    unmeasured: str  # "Z"
    largest: float  # mm, length of the components along the two axes
    largest_at: FloatArray  # (3,) commanded, mm
    largest_components: FloatArray  # (2,) mm
    largest_uncertainty: float | None  # standard uncertainty along its direction, mm; None without a covariance
    rms: float  # root of the mean of its square over the nodes, mm


def _plane(
    source: Calibration | Machine, machine: Machine, tool: FloatArray, grid: Sequence[FloatArray]
) -> PlaneErrors | None:
    """None unless nothing was measured of just one axis, and the errors along the others are known in their plane."""
    unmeasured = unmeasured_axes(source) if isinstance(source, Calibration) else []
    if len(unmeasured) != 1 or not isinstance(source, Calibration):
        return None
    (axis,) = unmeasured
    along = [n for n, one in enumerate(AXES) if one != axis]
    of_axis = {
        *(name for name in FUNCTIONS if name[2] == axis),
        *(n for n in SQUARENESSES if axis in (n[2], OTHER_AXIS[n])),
    }
    if any(set(_missing(source, tool).get(AXES[n], ())) - of_axis for n in along):
        return None
    places = [np.zeros(1) if one == axis else positions for one, positions in zip(AXES, grid, strict=True)]
    points = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 3)
    errors = _core.errors_at(machine, points)[:, along]
    lengths = np.linalg.norm(errors, axis=1)
    worst = int(np.argmax(lengths))
    u = None
    if source.covariance is not None:
        both = _core.error_uncertainties_at(source, points[worst : worst + 1], tool=tool)[0, along]
        # Along the direction, as if the two components were correlated altogether: at most that much.
        u = float(np.sum(both * np.abs(errors[worst])) / lengths[worst]) if lengths[worst] > 0.0 else float(both.max())
    return PlaneErrors(
        axes="".join(AXES[n] for n in along),
        unmeasured=axis,
        largest=float(lengths[worst]),
        largest_at=points[worst],
        largest_components=errors[worst],
        largest_uncertainty=u,
        rms=float(np.sqrt(np.mean(lengths**2))),
    )


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Errors of the functional point and tilts of the tool at commanded points, with their standard uncertainties."""

    point: FloatArray  # (n, 3) commanded, mm
    error: FloatArray  # (n, 3) actual minus nominal, exact, mm; NaN where a parameter is not determined
    tilt: FloatArray  # (n, 3) rotation vector of the tool about X, Y, Z, rad
    error_uncertainty: FloatArray | None  # (n, 3) mm; None where the calibration has no covariance
    tilt_uncertainty: FloatArray | None  # (n, 3) rad


@checked
def errors_at(
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


def variances_in_volume(calibration: Calibration, count: int = GRID) -> FloatArray:
    """Variance of the functional point's error, summed over X, Y and Z, mm^2, at the points of a grid with so many
    positions an axis, (count^3,); NaN where a parameter is not determined. Of a calibration with covariance."""
    points = errors_at(calibration, volume_grid(np.stack([np.zeros(3), calibration.volume]), count))
    assert points.error_uncertainty is not None
    variances: FloatArray = (points.error_uncertainty**2).sum(axis=1)
    return variances


@checked
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


def _positions(
    machine: Machine, box: FloatArray, grid: int | None
) -> tuple[tuple[FloatArray, FloatArray, FloatArray], bool]:
    """The ends of the box and the nodes inside, with equidistant positions where a number is given; and whether these
    are all nodes."""
    if grid is not None and not 2 <= grid <= 1001:
        raise InvalidArgument(f"grid: expected 2 to 1001 positions an axis, got {grid}")
    axes, every_node = [], True
    for axis, low, high in zip(AXES, *box, strict=True):
        of_functions = [position for name, (position, _) in machine.errors.functions.items() if name[2] == axis]
        nodes = _apart(np.concatenate([[low, high], *of_functions]), low, high)
        every_node = every_node and len(nodes) <= MOST_NODES
        axes.append(_apart(np.concatenate([_thinned(nodes, MOST_NODES), np.linspace(low, high, grid or 2)]), low, high))
    x, y, z = axes
    return (x, y, z), every_node


def _apart(positions: FloatArray, low: float, high: float) -> FloatArray:
    """Ascending, from low to high. Positions of one node may differ in the last digits between functions."""
    inside = np.unique(positions[(positions > low) & (positions < high)])
    inside = np.concatenate([[low], inside, [high]])
    kept: FloatArray = inside[np.concatenate([[True], np.diff(inside) > _ROUNDING])]
    kept[-1] = high
    return kept


def _missing(source: Calibration | Machine, tool: FloatArray) -> dict[str, tuple[str, ...]]:
    if isinstance(source, Machine):
        return {}
    somewhere = source.volume * (0.37, 0.61, 0.83)  # where no lever is 0
    found = _core.error_at_point(source, somewhere, tool=tool).missing
    return {component: tuple(found[component]) for component in "XYZABC" if component in found}


def _values(
    found: _core.VolumeSummary, machine: Machine, box: FloatArray, grid: tuple[FloatArray, FloatArray, FloatArray]
) -> dict[str, float]:
    """All figures by the names of the draws."""
    ranges = found.highest - found.lowest
    tilts = np.maximum(found.tilt_highest, -found.tilt_lowest)
    tilt_ranges = found.tilt_highest - found.tilt_lowest
    numbers = [found.largest, found.rms, *ranges, *tilts, *tilt_ranges, *_diagonals(machine, box, grid)]
    return {name: float(value) for name, value in zip(_core.VolumeDraws.names(), numbers, strict=True)}


def _thinned(positions: FloatArray, most: int) -> FloatArray:
    """At most so many of them, both ends included."""
    if len(positions) <= most:
        return positions
    kept: FloatArray = positions[np.round(np.linspace(0, len(positions) - 1, most)).astype(int)]
    return kept


def _drawn(
    draws: _core.VolumeDraws, samples: int, progress: Callable[[int, int], None] | None
) -> npt.NDArray[np.float64]:
    """So many draws, in parts."""
    parts, done = [], 0
    while done < samples:
        count = min(1000, samples - done)
        parts.append(draws.draw(done, count))
        done += count
        if progress is not None:
            progress(done, samples)
    return np.concatenate(parts)


def _spreads(draws: _core.VolumeDraws, drawn: FloatArray) -> dict[str, Spread]:
    """Of the figures their biases and standard uncertainties. Those of the largest error do not follow from them."""
    bias = drawn.mean(axis=0) - draws.values
    # A bias is known to about half of itself: that of the true errors is not that of the errors found.
    u = np.hypot(drawn.std(axis=0, ddof=1), 0.5 * bias)
    spreads = {name: (float(b), float(own)) for name, b, own in zip(_core.VolumeDraws.names(), bias, u, strict=False)}
    del spreads["largest"]
    return spreads


def _chosen(largest: float, largest_where_drawn: float, own: FloatArray, drawn: FloatArray) -> ChosenPlaces:
    """The places that draws choose; largest: of all positions, and of those where errors are drawn; own: a draw of
    nothing."""
    rows = np.concatenate([own[None], drawn])
    # Draws are of first order, the largest error is exact.
    found, opposite = rows[:, -5:-3].T + (largest_where_drawn - own[0])
    found[0] = largest
    u, variance, variance2 = rows[:, -3:].T
    return ChosenPlaces(found, opposite, u, variance, variance2, raised=np.zeros(0))


def _raised(
    calibration: Calibration, tool: FloatArray, grid: Sequence[FloatArray], between: float, seed: int
) -> FloatArray:
    """What lies between the nodes adds to the largest error in draws of it, mm.

    A third of the variance is that of each axis. The largest error finds the middles of intervals, where a parabola is
    sqrt(15/8) times its root mean square."""
    moves = np.array([name[:2] in ("EX", "EY", "EZ") for name, _ in calibration.covariance_labels])
    only = _core.with_covariance(calibration, np.diag(15.0 / 8.0 * between**2 / 3.0 * moves))
    draws = _core.VolumeDraws(only, *grid, tool=tool, seed=seed)
    raised: FloatArray = draws.draw(0, DRAWS_BETWEEN)[:, 0] - draws.values[0]
    return raised


def _interval(value: float, spread: Spread | None) -> Interval | None:
    """The value less its bias, plus and minus its expanded uncertainty; not below 0."""
    if spread is None or math.isnan(value):
        return None
    bias, u = spread
    return max(value - bias - TWO_SIDED * u, 0.0), max(value - bias + TWO_SIDED * u, 0.0)


def _bounds(chosen: ChosenPlaces | None, between_nodes: float, probability: float) -> Interval | None:
    """Of the largest error: it is above the first and below the second with so much probability, each; not below 0.

    Above: the largest that any place may have along any direction. The largest error found is at least that of the
    place and the direction where the true one is largest, so that none needs a correction for being chosen. Below: the
    places that draws choose, by values that have the opposite noise, of which the choice does not tell anything. The
    square of a length |e| that is found has the expectation |e|^2 + tr V and the variance 4 |e|^2 u^2 + 2 tr V V.
    docs/volume.md has the reasons."""
    if chosen is None:
        return None
    factor = NormalDist().inv_cdf(probability)
    high = float(np.max(chosen.found + factor * chosen.u))
    if len(chosen.raised):
        mean = max(float(np.mean(chosen.raised)), 0.0)
        most = float(np.quantile(chosen.raised, probability)) - mean
        own = float(chosen.found[0])
        high = own + mean + math.hypot(high - own, most)
    # Draws: noise of twice the variance. What lies between the nodes may be of any sign.
    low2 = max(float(np.mean(chosen.opposite[1:] ** 2 - 2.0 * chosen.variance[1:])), 0.0)
    u2, variance, variance2 = (float(np.mean(x[1:])) for x in (chosen.u**2, chosen.variance, chosen.variance2))
    variance2 += 2.0 * between_nodes**2 * variance + 3.0 * between_nodes**4
    spread = math.sqrt(4.0 * low2 * (u2 + between_nodes**2) + 2.0 * variance2)
    return math.sqrt(max(low2 - factor * spread, 0.0)), high


def _verdict(
    source: Calibration | Machine, limit: float | None, bounds: Interval | None, missing: Mapping[str, object]
) -> tuple[Verdict | None, str]:
    """By the guard band of ISO 14253-1: a verdict is wrong with at most 5 %; and why there is none."""
    if limit is None:
        return None, ""
    if isinstance(source, Calibration) and source.fit == "rejected":
        return None, "the fit of the calibration is rejected"
    lacking = sorted({name for axis in AXES for name in cast(tuple[str, ...], missing.get(axis, ()))})
    if lacking:
        return None, f"not determined: {', '.join(lacking)}"
    if bounds is None:
        return None, "the calibration has no covariance"
    return decided(bounds, limit), ""


def decided(bounds: Interval, limit: float) -> Verdict:
    """Whether the largest error is within a limit, by its `VolumeErrors.bounds`, all in one unit."""
    above, below = bounds
    return "within" if below <= limit else "not within" if above > limit else "undecided"


def _between_nodes(calibration: Calibration, tool: FloatArray, point: FloatArray, error: FloatArray) -> float:
    """Standard uncertainty of the error at a point, along itself, if it were anywhere between the nodes, mm.

    From second differences: a function with the second derivative f" deviates from its chord over h by up to
    f" h^2/8, on average over the interval by the root of f"^2 h^4/120."""
    size = float(np.linalg.norm(error))
    if size == 0.0:
        return 0.0
    factors = dict.fromkeys(calibration.functions, 0.0)
    labels = [name for name, _ in calibration.covariance_labels]
    for output, component in zip(_core.derived_at_point(calibration, point, tool=tool), error / size, strict=False):
        for name, factor in zip(labels, output.row, strict=True):
            if name in factors:
                factors[name] += float(component * factor)
    covariance = calibration.covariance
    variances = []
    for name, (position, value, u) in calibration.functions.items():
        own = np.array([label == name for label in labels])
        block = np.diag(np.nan_to_num(u) ** 2) if covariance is None else covariance[np.ix_(own, own)]
        variances.append(factors[name] ** 2 * chord_variance(position, value, block))
    return math.sqrt(sum(variances))


def chord_variance(position: FloatArray, value: FloatArray, covariance: FloatArray) -> float:
    """Mean square of what a function deviates from its chords, estimated from its table; noise is taken off."""
    if len(position) < 3:
        return 0.0
    h = np.diff(position)
    before, after = 2.0 / (h[:-1] * (h[:-1] + h[1:])), 2.0 / (h[1:] * (h[:-1] + h[1:]))
    weights = np.zeros((len(position) - 2, len(position)))  # of second derivatives
    rows = np.arange(len(position) - 2)
    weights[rows, rows], weights[rows, rows + 1], weights[rows, rows + 2] = before, -before - after, after
    noise = np.sum((weights @ covariance) * weights, axis=1)
    return max(float(np.mean((weights @ value) ** 2 - noise)), 0.0) * float(np.mean(h**4)) / 120.0


def _diagonals(machine: Machine, box: FloatArray, grid: tuple[FloatArray, FloatArray, FloatArray]) -> Iterator[float]:
    """Ranges of the errors along the box's body diagonals: actual minus commanded distance from where they start."""
    share = np.linspace(0.0, 1.0, max(len(positions) for positions in grid))
    for name in DIAGONALS:
        rising = np.array([sign == "p" for sign in name])
        start, end = np.where(rising, box[0], box[1]), np.where(rising, box[1], box[0])
        errors = _core.errors_at(machine, start + share[:, None] * (end - start))[:, :3]
        along = (errors - errors[0]) @ ((end - start) / np.linalg.norm(end - start))
        yield float(np.ptp(along))


def _other_approaches(
    source: Calibration | Machine, machine: Machine, grid: tuple[FloatArray, FloatArray, FloatArray]
) -> dict[str, float]:
    """The largest error for the other seven directions of approach, where reversal errors are known."""
    if isinstance(source, Machine) or not source.reversal or source.undetermined_reversal_constants:
        return {}
    negative, found = source.negative_functions, {}
    for approach in map("".join, product("+-", repeat=3)):
        tables = {
            name: negative[name][:2] if name in negative and approach[AXES.index(name[2])] == "-" else table
            for name, table in machine.errors.functions.items()
        }
        other = Machine(machine.chain, ErrorMap(tables, dict(machine.errors.squareness)), machine.tool)
        if "-" in approach:
            found[approach] = _core.summarise_volume(other, *grid, tilts=False).largest
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
            without = _core.summarise_volume(machine, *grid, without=list(parameters), tilts=False)
            part.append(VolumeContribution(name, parameters, without.largest, without.rms))
        ranked += sorted(part, key=lambda contribution: contribution.largest)
    return tuple(ranked)
