"""
The C++ core of stepdiag. Native units: mm, rad, nm.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import os
import typing
import xarray
__all__: list[str] = ['Calibration', 'Chain', 'ErrorMap', 'Head', 'InvalidArgument', 'Machine', 'Measurement', 'Misalignment', 'Noise', 'Plan', 'ReadingUncertainty', 'evaluate', 'random_error_map', 'read_calibration', 'read_error_map', 'read_measurement', 'simulate']
class InvalidArgument(ValueError):
    """
    Bad input: the message names the argument, file and line, or key, what was expected and what came.
    """
class Chain:
    """
    Kinematic chain in ISO 10791 style, workpiece to tool, such as "[w X' b Y Z t]"; a prime marks an axis before the bed.
    """
    def __eq__(self, arg0: Chain) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, text: str) -> None:
        """
        Raises InvalidArgument when a link is missing, doubled, or primed on the wrong side of b.
        """
    def __repr__(self) -> str:
        ...
    def __str__(self) -> str:
        ...
    def carries_workpiece(self, axis: str) -> bool:
        """
        Whether the axis "X", "Y" or "Z" stands before the bed.
        """
    @property
    def name(self) -> str:
        ...
class ErrorMap:
    """
    The 21 geometric errors as tables (ISO 230-1 names): functions in mm or rad over positions in mm, linear between nodes, end values held outside; squarenesses in rad. A missing parameter is 0.
    """
    def __init__(self, functions: collections.abc.Mapping[str, tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike]] = {}, squareness: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex] = {}) -> None:
        """
        functions: name -> (position, value), one-dimensional and of one length, positions ascending. Raises InvalidArgument.
        """
    def function(self, name: str, position: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        Values (mm or rad) of one error function at positions (mm), shape (n,).
        """
    def warnings(self, volume: numpy.typing.ArrayLike) -> list[str]:
        """
        Where the map breaks the frame choice (0 at home, straightness 0 at both ends of travel); one sentence each.
        """
    def write(self, path: str | os.PathLike[str], *, chain: Chain | str | None = None, volume: numpy.typing.ArrayLike | None = None, tool: numpy.typing.ArrayLike | None = None) -> None:
        """
        Writes the error-map CSV; numbers are read back to the same bits. What a calibration says of its method and of what it left undetermined is not kept. Raises InvalidArgument when it cannot be written.
        """
    @property
    def functions(self) -> dict[str, tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]]:
        ...
    @property
    def header(self) -> dict[str, str]:
        """
        The leading "# key=value" lines of the file it came from.
        """
    @property
    def squareness(self) -> dict[str, float]:
        ...
class Machine:
    """
    A three-axis machine: chain, the 21 errors, tool offset (mm).
    """
    def __init__(self, chain: Chain | str, errors: ErrorMap = ..., tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        ...
    def error(self, commanded: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        Actual minus nominal functional point (n, 3), mm, exact.
        """
    def first_order_error(self, commanded: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same to first order in the errors: sum over axes of delta + theta x L.
        """
    def pose(self, commanded: numpy.typing.ArrayLike) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Exact pose of the tool in the machine frame: (rotation (n, 3, 3), functional point (n, 3), mm) at commanded positions (n, 3), mm.
        """
    @property
    def chain(self) -> Chain:
        ...
    @property
    def errors(self) -> ErrorMap:
        ...
    @property
    def tool(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class Plan:
    """
    The lines measured through a volume, in single-axis steps. Lines are named by the travel signs of X, Y, Z: three of p n 0.
    """
    largest_step_count: typing.ClassVar[int] = 2000
    def __init__(self, volume: numpy.typing.ArrayLike, lines: collections.abc.Sequence[str], steps: typing.SupportsIndex, order: str = 'XYZ', scale_lines: collections.abc.Sequence[str] = []) -> None:
        """
        volume: edges in mm. steps: per axis. Raises InvalidArgument for an unknown or doubled line, a volume without extent, steps outside 1 .. 2000.
        """
    def frame(self, line: str) -> numpy.typing.NDArray[numpy.float64]:
        """
        Local frame of a line in machine coordinates, (3, 3), columns local x, y, z (eq. 2 of the paper).
        """
    def lateral_excursion(self, line: str) -> numpy.typing.NDArray[numpy.float64]:
        """
        How far a step leads beside the line in local x and y, mm: rows lowest and highest, (2, 2).
        """
    def nodes(self, axis: str) -> numpy.typing.NDArray[numpy.float64]:
        """
        Node positions of axis "X", "Y" or "Z", (steps + 1,), mm.
        """
    def points(self, line: str) -> numpy.typing.NDArray[numpy.float64]:
        """
        Commanded points of a line of this plan, (n, 3), mm.
        """
    def smallest_mirror(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Width and height (local x and y) of the smallest mirror, centred on the functional point, (2,), mm; a beam of finite diameter needs that much more.
        """
    @property
    def lines(self) -> list[str]:
        ...
    @property
    def order(self) -> str:
        ...
    @property
    def scale_lines(self) -> list[str]:
        ...
    @property
    def steps(self) -> int:
        ...
    @property
    def volume(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class Measurement:
    """
    A run's readings, row by row: line, point, run, direction, commanded position (mm), and channels in native units (mm, rad; NaN where a reading was lost).
    """
    def __init__(self, line: collections.abc.Sequence[str], point: collections.abc.Sequence[typing.SupportsIndex], position: numpy.typing.ArrayLike, channels: dict[str, numpy.typing.ArrayLike], *, run: collections.abc.Sequence[typing.SupportsIndex] | None = None, direction: collections.abc.Sequence[str] | None = None, standard_uncertainty: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}) -> None:
        """
        channels: name -> (n,) with names distance, alpha, beta, spot_x, spot_y, d1 ..., time, temperature. Raises InvalidArgument.
        """
    def __len__(self) -> int:
        ...
    def to_xarray(self) -> xarray.Dataset:
        """
        The run as a labelled table.
        """
    def write(self, path: str | os.PathLike[str]) -> None:
        """
        Writes the measurement CSV; numbers are read back to the same bits. Raises InvalidArgument when it cannot be written.
        """
    @property
    def channels(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        ...
    @property
    def direction(self) -> list[str]:
        ...
    @property
    def line(self) -> list[str]:
        ...
    @property
    def point(self) -> numpy.typing.NDArray[numpy.int32]:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def run(self) -> numpy.typing.NDArray[numpy.int32]:
        ...
    @property
    def standard_uncertainty(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        ...
class Head:
    """
    A laser head: layout "ideal" (ray-traced), "psd" or "multi_beam"; lengths in mm, wavelength in nm.
    """
    def __init__(self, layout: str = 'ideal', *, standoff: typing.SupportsFloat | typing.SupportsIndex = 100.0, psd_distance: typing.SupportsFloat | typing.SupportsIndex = 0.0, beam_offsets: collections.abc.Sequence[numpy.typing.ArrayLike] = [], wavelength: typing.SupportsFloat | typing.SupportsIndex = 1530.0, aperture: typing.SupportsFloat | typing.SupportsIndex = 50.0, mirror: numpy.typing.ArrayLike | None = None) -> None:
        """
        mirror: (width, height); none: as large as the plan needs. Raises InvalidArgument for lengths that are not positive and for beams on one line.
        """
    @property
    def aperture(self) -> float:
        ...
    @property
    def beam_offsets(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def layout(self) -> str:
        ...
    @property
    def mirror(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
    @property
    def psd_distance(self) -> float:
        ...
    @property
    def signals(self) -> list[str]:
        """
        Names of the channels that the head reads.
        """
    @property
    def standoff(self) -> float:
        ...
    @property
    def wavelength(self) -> float:
        ...
class Misalignment:
    """
    How head and mirror are out of true on a line: reflector and laser angles (a, b) in rad, psd_zero in mm.
    """
    def __init__(self, reflector: numpy.typing.ArrayLike = (0.0, 0.0), laser: numpy.typing.ArrayLike = (0.0, 0.0), psd_zero: numpy.typing.ArrayLike = (0.0, 0.0)) -> None:
        """
        Raises InvalidArgument for what is no pair of finite numbers.
        """
    @property
    def laser(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def psd_zero(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def reflector(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class Noise:
    """
    Standard deviations of an independent Gaussian per reading: distance (mm; also d1 ...), tilt (rad), spot (mm).
    """
    def __init__(self, distance: typing.SupportsFloat | typing.SupportsIndex = 0.0, tilt: typing.SupportsFloat | typing.SupportsIndex = 0.0, spot: typing.SupportsFloat | typing.SupportsIndex = 0.0, seed: typing.SupportsIndex = 0) -> None:
        """
        Raises InvalidArgument for a deviation that is negative or not finite, and for a seed outside 0 .. 2^64 - 1.
        """
    @property
    def distance(self) -> float:
        ...
    @property
    def seed(self) -> int:
        ...
    @property
    def spot(self) -> float:
        ...
    @property
    def tilt(self) -> float:
        ...
class ReadingUncertainty:
    """
    Standard uncertainty of a reading where the run gives none: distance (mm; also d1 ...), tilt (rad), spot (mm).
    """
    def __init__(self, distance: typing.SupportsFloat | typing.SupportsIndex = 0.0001, tilt: typing.SupportsFloat | typing.SupportsIndex = 1e-06, spot: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> None:
        """
        Raises InvalidArgument for what is not within 1e-12 .. 1e6.
        """
    @property
    def distance(self) -> float:
        ...
    @property
    def spot(self) -> float:
        ...
    @property
    def tilt(self) -> float:
        ...
class Calibration:
    """
    The 21 parameters as far as the readings determine them, with standard uncertainties; native units (mm, rad).
    """
    def to_error_map(self) -> ErrorMap:
        """
        The calibration as a machine's errors; what is undetermined is 0 there.
        """
    def to_xarray(self) -> xarray.Dataset:
        """
        The calibration as a labelled table.
        """
    def write(self, path: str | os.PathLike[str]) -> None:
        """
        Writes the calibration CSV (the covariance is not kept). Raises InvalidArgument when it cannot be written.
        """
    @property
    def chain(self) -> Chain:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        (n, n) in the order of covariance_labels, native units; None unless evaluated with full_covariance.
        """
    @property
    def covariance_labels(self) -> list[tuple[str, float | None]]:
        """
        (parameter, position in mm or None) of each row.
        """
    @property
    def functions(self) -> dict[str, tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]]:
        """
        name -> (position, value, standard uncertainty); what is not determined is absent.
        """
    @property
    def method(self) -> str:
        ...
    @property
    def squareness(self) -> dict[str, tuple[float, float]]:
        """
        name -> (value, standard uncertainty), rad.
        """
    @property
    def tool(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def undetermined(self) -> list[str]:
        """
        What the readings do not determine, why, and what would help; one sentence each.
        """
    @property
    def undetermined_slopes(self) -> list[str]:
        """
        Functions of which only the shape is known; their values are 0 at both ends.
        """
    @property
    def volume(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
def evaluate(measurement: Measurement, plan: Plan, head: Head, chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), *, method: str = 'enhanced', uncertainty: ReadingUncertainty = ..., full_covariance: bool = False) -> Calibration:
    """
    Calibration from a run. Of the head only psd_distance and beam_offsets are used, of the machine only chain and tool offset (mm). Raises InvalidArgument for readings that do not belong to the plan.
    """
def random_error_map(volume: numpy.typing.ArrayLike, *, seed: typing.SupportsIndex, translation: typing.SupportsFloat | typing.SupportsIndex = 0.02, rotation: typing.SupportsFloat | typing.SupportsIndex = 6e-05, squareness: typing.SupportsFloat | typing.SupportsIndex = 6e-05, intervals: typing.SupportsIndex = 50, screw_pitch: typing.SupportsFloat | typing.SupportsIndex = 0.0, screw_amplitude: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> ErrorMap:
    """
    A random machine with peaks of `translation` mm and `rotation` rad at equidistant nodes, squarenesses uniform within +-`squareness` rad, in the frame choice of the conventions. Same arguments, same bits.
    """
def read_calibration(path: str | os.PathLike[str]) -> Calibration:
    """
    Reads a calibration CSV. Raises InvalidArgument naming file and line.
    """
def read_error_map(path: str | os.PathLike[str]) -> ErrorMap:
    """
    Reads an error map or calibration CSV. Raises InvalidArgument naming file and line.
    """
def read_measurement(path: str | os.PathLike[str]) -> Measurement:
    """
    Reads a measurement CSV. Raises InvalidArgument naming file and line.
    """
def simulate(machine: Machine, plan: Plan, head: Head, *, misalignment: collections.abc.Mapping[str, Misalignment] = {}, noise: Noise = ..., refractive_index: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> Measurement:
    """
    A run on the virtual machine: lines of the plan, then its scale lines. misalignment: by line name; a line without an entry is aligned. Readings whose beam misses the mirror or does not come back are lost (NaN). Raises InvalidArgument.
    """
__version__: str = '0.1.0'
