"""
The C++ core of stepdiag. Native units: mm, rad, nm.
"""
from __future__ import annotations
import collections.abc
import matplotlib.figure
import numpy
import numpy.typing
import os
import pandas
import stepdiag.io.displays
import typing
import xarray
__all__: list[str] = ['AdaptiveProcedure', 'Adjustment', 'AdjustmentOptions', 'BatchEvaluator', 'BeamSegment', 'BeamSpot', 'Bins', 'Calibration', 'CalibrationEntry', 'Camera', 'Chain', 'ChangeCombination', 'ChangePriors', 'ChangeTerm', 'ChangesSeen', 'CheckPoints', 'Compensator', 'DerivedOutput', 'DiagonalErrors', 'Distribution', 'DriftEstimate', 'Environment', 'ErrorAtPoint', 'ErrorMap', 'Expansion', 'ExpansionEstimate', 'Fault', 'FaultClass', 'FaultControl', 'FitQuality', 'FitReason', 'FunctionModel', 'GaussianMode', 'Head', 'HeadBeam', 'HeadBody', 'HeadCalibration', 'HeadDesign', 'Interferometer', 'InvalidArgument', 'JointRegion', 'KnownByLines', 'KnownCombination', 'KnownExpansion', 'LateralEffect', 'LineDeviation', 'LineInformation', 'Machine', 'MachineDrift', 'Measurement', 'Misalignment', 'MonteCarloResult', 'Noise', 'Outlier', 'Output', 'PartialStatistics', 'Plan', 'PlannedPass', 'PlausibleLimits', 'PredictedReading', 'Propagation', 'RangeModel', 'ReadingNoise', 'ReadingUncertainty', 'Recheck', 'ReplayMismatch', 'ReturnedBeam', 'RoundedChannel', 'SampleModel', 'ScaleTemperatures', 'SeenChanges', 'Sensitivity', 'SetupEstimate', 'SetupPriors', 'SetupQuantity', 'SimulationOptions', 'Smoothness', 'SpotSensor', 'Stability', 'StatisticsOptions', 'Thresholds', 'UncertainInput', 'UncertainInputs', 'UncertainQuantity', 'Undetermined', 'UnseenFault', 'Validation', 'VarianceComponent', 'Verdict', 'Verification', 'VirtualCalibrations', 'VirtualReadout', 'VolumeDraws', 'VolumeSummary', 'VolumetricAccuracy', 'adjust', 'adjusted_quantity_count', 'beam_radius', 'check_points', 'choose_instruction_set', 'compare', 'couple', 'cramer_rao_bound', 'derived_at_point', 'derived_on_diagonals', 'diagonal_errors', 'drawn_inputs', 'error_at_point', 'error_changes_at', 'error_uncertainties_at', 'errors_at', 'evaluate', 'expose', 'fit_quality', 'head_sensitivities', 'in_recorded_air', 'instruction_set', 'instruction_sets', 'judge', 'known_by_run', 'largest_repeat_count', 'leaf_samples', 'locate', 'make_bins', 'newer_format', 'normal_quantile', 'numerical_tolerance', 'pilot_samples', 'power_inside', 'propagate', 'propagate_linear', 'random_error_map', 'read_calibration', 'read_distance', 'read_error_map', 'read_measurement', 'read_signals', 'recheck', 'run_leaves', 'run_ranges', 'setup_quantities', 'simulate', 'straightness_reference', 'summarise_volume', 't_quantile', 'thresholds', 'trace_beams', 'uncertain_quantities', 'verify', 'volumetric_accuracy', 'with_covariance', 'without_lost_marks', 'word_wrong_arguments_with']
class InvalidArgument(ValueError):
    """
    Bad input: the message names the argument, file and line, or key, what was expected and what came.
    """
    @staticmethod
    def __reduce__(error: InvalidArgument) -> tuple[type[InvalidArgument], tuple[str]]:
        ...
    @staticmethod
    def __str__(error: InvalidArgument) -> str:
        """
        The message of an error. That of readings that determine nothing has a finding, which says why.
        """
class Environment:
    """
    The air around machine and head: a constant refractive index.
    """
    @staticmethod
    def from_air(*, temperature: typing.SupportsFloat | typing.SupportsIndex = 20.0, pressure: typing.SupportsFloat | typing.SupportsIndex = 101325.0, relative_humidity: typing.SupportsFloat | typing.SupportsIndex = 0.5, carbon_dioxide: typing.SupportsFloat | typing.SupportsIndex = 450.0, equation: str = 'ciddor') -> Environment:
        """
        From the state of the air: degrees Celsius, Pa, 0..1, ppm; equation: "ciddor", "modified_edlen" or "edlen_1966". Raises InvalidArgument outside their ranges.
        """
    def __init__(self, refractive_index: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    def refractive_index(self, wavelength: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        Phase index at a vacuum wavelength (nm).
        """
    @property
    def equation(self) -> str:
        """
        Of the index, as from_air takes it.
        """
    @property
    def state(self) -> dict[str, float] | None:
        """
        Arguments of from_air, without the equation; None of a constant index.
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
    def _repr_html_(self) -> str:
        ...
    def carries_workpiece(self, axis: str) -> bool:
        """
        Whether the axis "X", "Y" or "Z" stands before the bed.
        """
    @property
    def name(self) -> str:
        """
        As it is written: "[w X' b Y Z t]".
        """
class ErrorMap:
    """
    The 21 geometric errors as tables (ISO 230-1 names): functions in mm or rad over positions in mm, linear between nodes, end values held outside; squarenesses in rad. A missing parameter is 0. A function may have another table for positions approached in - direction; its other one then is of the + direction.
    """
    def __init__(self, functions: collections.abc.Mapping[str, tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike]] = {}, squareness: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex] = {}, *, negative_functions: collections.abc.Mapping[str, tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike]] = {}) -> None:
        """
        functions: name -> (position, value), one-dimensional and of one length, positions ascending. negative_functions: the same of the - direction, where it has others. Raises InvalidArgument.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def frame_deviations(self, volume: numpy.typing.ArrayLike) -> list[tuple[str, float, float]]:
        """
        Where the map breaks the frame choice (0 at home, straightness 0 at both ends of travel, approached in + direction): (function, position in mm, value in mm or rad) each.
        """
    def function(self, name: str, position: numpy.typing.ArrayLike, approach: str = '+') -> numpy.typing.NDArray[numpy.float64]:
        """
        Values (mm or rad) of one error function at positions (mm), shape (n,), approached in the direction "+" or "-".
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
    def negative_functions(self) -> dict[str, tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]]:
        """
        The functions that have another table for the - direction: that table.
        """
    @property
    def squareness(self) -> dict[str, float]:
        ...
class Expansion:
    """
    Thermal expansion of the axes' scales: position p stands at p + coefficient (T - reference)(p - fixed_point).
    """
    def __init__(self, coefficient: numpy.typing.ArrayLike, *, fixed_point: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), reference: typing.SupportsFloat | typing.SupportsIndex = 20.0) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        coefficient: (3,) of X, Y, Z, 1/K, 1e-3 at most
        fixed_point: (3,) mm
        reference: degrees Celsius
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def shift(self, commanded: numpy.typing.ArrayLike, temperature: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        What the expansion adds to the positions of X, Y, Z (3,), mm, at the scales' temperatures (3,), degrees Celsius.
        """
    @property
    def coefficient(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of X, Y, Z, 1/K, 1e-3 at most
        """
    @property
    def fixed_point(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) mm
        """
    @property
    def reference(self) -> float:
        """
        degrees Celsius
        """
class Machine:
    """
    A three-axis machine: chain, the 21 errors, tool offset (mm).
    """
    def __init__(self, chain: Chain | str, errors: ErrorMap = ..., tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def error(self, commanded: numpy.typing.ArrayLike, approach: str = '+++') -> numpy.typing.NDArray[numpy.float64]:
        """
        Actual minus nominal functional point (n, 3), mm, exact.
        """
    def first_order_error(self, commanded: numpy.typing.ArrayLike, approach: str = '+++') -> numpy.typing.NDArray[numpy.float64]:
        """
        The same to first order in the errors: sum over axes of delta + theta x L.
        """
    def pose(self, commanded: numpy.typing.ArrayLike, approach: str = '+++', expansion: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Exact pose of the tool in the machine frame: (rotation (n, 3, 3), functional point (n, 3), mm) at commanded positions (n, 3), mm. approach: the direction + or - in which X, Y, Z came there. expansion: what that of the scales adds to the positions of X, Y, Z, mm (Expansion.shift).
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
class PlannedPass:
    """
    One pass along a line of a plan, as Plan.passes gives it.
    """
    @property
    def approach(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        How the axes X, Y, Z come to every point, the first included: +1 or -1, (3,).
        """
    @property
    def direction(self) -> str:
        """
        "forward" or "backward".
        """
    @property
    def line(self) -> str:
        ...
    @property
    def line_index(self) -> int:
        """
        The line's place among the plan's lines, then its scale lines, from 0.
        """
    @property
    def points(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        Numbers of the points in the order in which they are read, (n,): they descend on a backward pass.
        """
    @property
    def positions(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        The commanded positions of these points, (n, 3), mm.
        """
    @property
    def run(self) -> int:
        ...
class CheckPoints:
    """
    Returns to one point of each line but scale lines, which distinguish a drift from the machine's errors.
    """
    def __init__(self, every: typing.SupportsIndex = 0, at: typing.SupportsIndex = 0) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        every: After so many steps, each a move of every axis; 0: there are none.
        at: The point is that after so many steps, 0 the line's first.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def at(self) -> int:
        """
        The point is that after so many steps, 0 the line's first.
        """
    @property
    def every(self) -> int:
        """
        After so many steps, each a move of every axis; 0: there are none.
        """
class Plan:
    """
    The lines measured through a volume, in single-axis steps. Lines are named by the travel signs of X, Y, Z: three of p n 0.
    """
    largest_step_count: typing.ClassVar[int] = 2000
    def __init__(self, volume: numpy.typing.ArrayLike, lines: collections.abc.Sequence[str], steps: typing.SupportsIndex, order: str | collections.abc.Sequence[str] = 'XYZ', scale_lines: collections.abc.Sequence[str] = [], *, check_points: CheckPoints = ..., scale_points: str = 'ends', block: typing.SupportsIndex = 1) -> None:
        """
        volume: edges in mm. steps: per axis. order: in which a step moves the axes, "XYZ" ...; of several, run r goes in the order r modulo their number. scale_points: where scale lines are read, at their two "ends" or after all "steps". block: so many steps of an axis follow each other before the next axis moves. Raises InvalidArgument for an unknown or doubled line, a volume without extent, steps outside 1 .. 2000, check points that are outside 0 .. steps, "steps" without scale lines.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def check_numbers(self, line: str) -> list[int]:
        """
        Numbers of the points of a line that are returns to its check point.
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
    def passes(self, repeats: typing.SupportsIndex = 1, *, backward: bool = False) -> list[PlannedPass]:
        """
        The passes of a run in the order in which they are measured: the plan's lines in their order, then its scale lines; of each line runs 0, 1, 2, ..., `repeats` of them; with `backward` runs 0, 2, ... and after each its backward run 1, 3, ... Raises InvalidArgument for repeats below 1.
        """
    def points(self, line: str, run: typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        Commanded points of a line of this plan in the order of travel, returns to its check point included, (n, 3), mm.
        """
    def smallest_mirror(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Width and height (local x and y) of the smallest mirror, centred on the functional point, (2,), mm; a beam of finite diameter needs that much more.
        """
    @property
    def block(self) -> int:
        """
        So many steps of an axis follow each other before the next axis moves.
        """
    @property
    def check_points(self) -> CheckPoints:
        """
        Returns that tell drift.
        """
    @property
    def lines(self) -> list[str]:
        ...
    @property
    def order(self) -> str:
        """
        The order of run 0.
        """
    @property
    def orders(self) -> list[str]:
        ...
    @property
    def scale_lines(self) -> list[str]:
        """
        Single-axis lines whose laser stands along the axis.
        """
    @property
    def scale_points(self) -> str:
        """
        Where scale lines are read: at their two "ends", or after all "steps".
        """
    @property
    def steps(self) -> int:
        ...
    @property
    def volume(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class SetupQuantity:
    """
    What a line's set-up is made of: a row of setup_quantities().
    """
    @property
    def components(self) -> str:
        """
        A letter each; empty: a single one without a letter.
        """
    @property
    def key(self) -> str:
        """
        In scenarios, with its unit.
        """
    @property
    def layout(self) -> str | None:
        """
        The only layout of heads that has it.
        """
    @property
    def meaning(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        In options and files.
        """
    @property
    def of_beams(self) -> bool:
        """
        Whether there is one for each of d1 ... dn.
        """
    @property
    def prior(self) -> float:
        """
        Its prior in an adjustment by default: infinite: free; 0: fixed at 0; else the standard uncertainty with which it is known to be 0.
        """
    @property
    def report_unit(self) -> str:
        """
        As in keys.
        """
    @property
    def scale_line_prior(self) -> float:
        """
        The same on scale lines.
        """
    @property
    def scale_line_usual(self) -> float:
        """
        The same on scale lines whose readings do not tell it.
        """
    @property
    def symbol(self) -> str:
        """
        Over a column of a report.
        """
    @property
    def unit(self) -> str:
        """
        Of the library: rad, mm, 1, mm s-1.
        """
    @property
    def usual(self) -> float:
        """
        How far from 0 it usually is, where readings do not tell; infinite: they always do.
        """
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
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def plot(self, *, adjustment: Adjustment | None = None) -> matplotlib.figure.Figure:
        """
        Draw the readings, or with the adjustment of this measurement its residuals (a matplotlib Figure).
        """
    def to_dataframe(self) -> pandas.DataFrame:
        """
        The measurement as a pandas.DataFrame: a row for each point, with its line, number, run, direction, commanded
            position x, y, z (mm), channels (mm, rad) and their standard uncertainties as NAME_u.
        """
    def to_xarray(self) -> xarray.Dataset:
        """
        The measurement as a labelled table (xarray.Dataset).
        """
    def write(self, path: str | os.PathLike[str]) -> None:
        """
        Write the measurement, CSV or netCDF (a name that ends in .nc). Reading it returns the same bits.
        
            Raises InvalidArgument where it cannot be written.
        """
    def write_csv(self, path: str | os.PathLike[str]) -> None:
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
class HeadBody:
    """
    A body of a head: flat faces in its own frame, placed in the head's. Lengths in mm; rotation: a rotation vector in rad about the body's origin; material: a glass by name or an absolute index; reflectance: share of the power that each of its faces sends back (0: coated so that none is). All raise InvalidArgument.
    """
    @staticmethod
    def corner_cube(name: str, *, depth: typing.SupportsFloat | typing.SupportsIndex, material: str | float, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> HeadBody:
        """
        Corner cube: origin in the corner, light enters at z = depth along -z.
        """
    @staticmethod
    def cube_splitter(name: str, *, edge: typing.SupportsFloat | typing.SupportsIndex, material: str | float, reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.5, absorptance: typing.SupportsFloat | typing.SupportsIndex = 0.0, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> HeadBody:
        """
        Two prisms with a splitting face between them: origin in the middle; see make_cube_splitter for the way it sends light. reflectance, absorptance: of the splitting face.
        """
    @staticmethod
    def mirror(name: str, *, width: typing.SupportsFloat | typing.SupportsIndex, height: typing.SupportsFloat | typing.SupportsIndex, reflectance: typing.SupportsFloat | typing.SupportsIndex = 1.0, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> HeadBody:
        """
        A mirror in its own x-y plane, reflecting on both sides.
        """
    @staticmethod
    def plate(name: str, *, width: typing.SupportsFloat | typing.SupportsIndex, height: typing.SupportsFloat | typing.SupportsIndex, thickness: typing.SupportsFloat | typing.SupportsIndex, material: str | float, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> HeadBody:
        """
        Plate: origin in the middle, thickness along z.
        """
    @staticmethod
    def polyhedron(name: str, *, corners: numpy.typing.ArrayLike, faces: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]], material: str | float, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> HeadBody:
        """
        A convex polyhedron: corners (n, 3), faces as lists of corner indices in order around each face. It must be closed, its faces planar.
        """
    @staticmethod
    def right_angle_prism(name: str, *, side: typing.SupportsFloat | typing.SupportsIndex, height: typing.SupportsFloat | typing.SupportsIndex, material: str | float, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> HeadBody:
        """
        Right-angle prism: origin in the middle of the hypotenuse, the right angle on +z.
        """
    @staticmethod
    def screen(name: str, *, width: typing.SupportsFloat | typing.SupportsIndex, height: typing.SupportsFloat | typing.SupportsIndex, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> HeadBody:
        """
        A screen in its own x-y plane that absorbs all light.
        """
    @staticmethod
    def wedge(name: str, *, width: typing.SupportsFloat | typing.SupportsIndex, height: typing.SupportsFloat | typing.SupportsIndex, thickness: typing.SupportsFloat | typing.SupportsIndex, angle: typing.SupportsFloat | typing.SupportsIndex, material: str | float, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), reflectance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> HeadBody:
        """
        Wedge: a plate whose face at +z is turned by `angle` (rad) about y, thicker at +x.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def material(self) -> str | float:
        ...
    @property
    def name(self) -> str:
        """
        As the description has it.
        """
    @property
    def outlines(self) -> list[numpy.typing.NDArray[numpy.float64]]:
        """
        The faces' corners in the head's frame, a (k, 3) array each.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def rotation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        head_R_body, (3, 3).
        """
    @property
    def surfaces(self) -> list[str]:
        ...
class HeadCalibration:
    """
    What evaluators know of a head: the constants that its readings are reduced with, mm.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def beam_offsets(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def head_constants(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        What glass and way before the reference plane add to each distance, mm; readings are corrected for it.
        """
    @property
    def psd_distance(self) -> float | None:
        """
        Of the unfolded sensor behind the reference plane, mm, reduced: glass counts as t n_air/n; None without one.
        """
    @property
    def spot_beam(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,) where the beam that makes the spot leaves, (u, v), mm.
        """
class HeadBeam:
    """
    A light source of a head, its beam along +z of its own frame. Lengths in mm, wavelength (in vacuum) in nm, rotation vector in rad.
    """
    @staticmethod
    def interferometer(name: str, *, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), wavelength: typing.SupportsFloat | typing.SupportsIndex = 1530.0, waist_radius: typing.SupportsFloat | typing.SupportsIndex = 0.8, waist_position: typing.SupportsFloat | typing.SupportsIndex = 0.0, aperture: typing.SupportsFloat | typing.SupportsIndex = 10.0, acceptance: typing.SupportsFloat | typing.SupportsIndex = 0.1, least_coupling: typing.SupportsFloat | typing.SupportsIndex = 0.0, resolution: typing.SupportsFloat | typing.SupportsIndex = 0.0, periodic_amplitude: typing.SupportsFloat | typing.SupportsIndex = 0.0, dead_path: typing.SupportsFloat | typing.SupportsIndex = 0.0, index_error: typing.SupportsFloat | typing.SupportsIndex = 0.0, reading_model: str = 'chief_ray') -> HeadBeam:
        """
        A beam that an interferometer measures with: it is taken back by a square of edge `aperture` around the source, within the angle `acceptance` (rad). reading_model: "chief_ray" or "coupled_mode".
        """
    @staticmethod
    def spot(name: str, *, sensor: str, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), wavelength: typing.SupportsFloat | typing.SupportsIndex = 635.0, waist_radius: typing.SupportsFloat | typing.SupportsIndex = 0.8, waist_position: typing.SupportsFloat | typing.SupportsIndex = 0.0, housing: typing.SupportsFloat | typing.SupportsIndex = 10.0) -> HeadBeam:
        """
        A conventional laser whose beam comes to a sensor; `housing`: edge of the square around it that stops light.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def is_interferometer(self) -> bool:
        """
        Otherwise it is a laser to a sensor.
        """
    @property
    def name(self) -> str:
        """
        As the description has it.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def rotation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        head_R_beam, (3, 3).
        """
    @property
    def sensor(self) -> str:
        """
        Name of the sensor it comes to; empty of an interferometer.
        """
    @property
    def size(self) -> float:
        """
        Edge of the square around the source, mm.
        """
    @property
    def waist_position(self) -> float:
        """
        Along the beam from its source, mm.
        """
    @property
    def waist_radius(self) -> float:
        """
        1/e^2 of power, mm
        """
    @property
    def wavelength(self) -> float:
        """
        In vacuum, nm.
        """
class SpotSensor:
    """
    A sensor in the x-y plane of its own frame; mm, rotation vector in rad.
    """
    @staticmethod
    def camera(name: str, *, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), pixel: typing.SupportsFloat | typing.SupportsIndex = 0.01, columns: typing.SupportsInt | typing.SupportsIndex = 512, rows: typing.SupportsInt | typing.SupportsIndex = 512, electrons: typing.SupportsFloat | typing.SupportsIndex = 1000000.0, background: typing.SupportsFloat | typing.SupportsIndex = 0.0, read_noise: typing.SupportsFloat | typing.SupportsIndex = 0.0, shot_noise: bool = False, full_well: typing.SupportsFloat | typing.SupportsIndex = 1000000000.0, bits: typing.SupportsInt | typing.SupportsIndex = 0, centroid: str = 'gaussian_fit', threshold: typing.SupportsFloat | typing.SupportsIndex = 0.05) -> SpotSensor:
        """
        A pixel array; centroid: "gaussian_fit" or "centre_of_gravity".
        """
    @staticmethod
    def lateral_effect(name: str, *, position: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), rotation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), size: numpy.typing.ArrayLike = (10.0, 10.0), noise: typing.SupportsFloat | typing.SupportsIndex = 0.0, resolution: typing.SupportsFloat | typing.SupportsIndex = 0.0, least_power: typing.SupportsFloat | typing.SupportsIndex = 1e-06) -> SpotSensor:
        """
        A lateral-effect position sensing device.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        As the description has it.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def rotation(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def size(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,) width and height, mm
        """
class HeadDesign:
    """
    A laser head as drawn: bodies, beams and sensors in the head's frame.
    """
    def __init__(self, name: str, layout: str, bodies: collections.abc.Sequence[HeadBody], beams: collections.abc.Sequence[HeadBeam], sensors: collections.abc.Sequence[SpotSensor] = [], *, most_hits: typing.SupportsInt | typing.SupportsIndex = 64, least_power: typing.SupportsFloat | typing.SupportsIndex = 1e-06) -> None:
        """
        Raises InvalidArgument for names given twice, a layout without its beams or sensor, components that overlap or touch, a beam that does not come back from a mirror square to it.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def beams(self) -> list[HeadBeam]:
        ...
    @property
    def bodies(self) -> list[HeadBody]:
        ...
    @property
    def layout(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        As the description has it.
        """
    @property
    def sensors(self) -> list[SpotSensor]:
        ...
class Head:
    """
    A laser head by the closed definition of its layout's readings: "ideal" (ray-traced), "psd" or "multi_beam"; from_design makes a traced one. Lengths in mm, wavelength in nm.
    """
    @staticmethod
    def from_design(design: HeadDesign, *, standoff: typing.SupportsFloat | typing.SupportsIndex = 100.0, mirror: numpy.typing.ArrayLike | None = None, pose_errors: collections.abc.Mapping[str, tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike]] = {}, reading_model: str | None = None) -> Head:
        """
        A traced head. pose_errors: component name -> (shift in mm, rotation vector in rad about its own origin), both along the head's axes. reading_model: of all interferometers instead of the design's. Raises InvalidArgument.
        """
    def __init__(self, layout: str = 'ideal', *, standoff: typing.SupportsFloat | typing.SupportsIndex = 100.0, psd_distance: typing.SupportsFloat | typing.SupportsIndex = 0.0, beam_offsets: collections.abc.Sequence[numpy.typing.ArrayLike] = [], wavelength: typing.SupportsFloat | typing.SupportsIndex = 1530.0, aperture: typing.SupportsFloat | typing.SupportsIndex = 50.0, mirror: numpy.typing.ArrayLike | None = None) -> None:
        """
        mirror: (width, height); none: as large as the plan needs. Raises InvalidArgument for lengths that are not positive and for beams on one line.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def aperture(self) -> float:
        """
        Edge of the square that takes a beam back, mm.
        """
    @property
    def beam_offsets(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def calibration(self) -> HeadCalibration:
        """
        What evaluators know of the head, by a nominal trace where it has a design.
        """
    @property
    def design(self) -> HeadDesign | None:
        ...
    @property
    def layout(self) -> str:
        ...
    @property
    def mirror(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
    @property
    def psd_distance(self) -> float:
        """
        Of the unfolded sensor behind the reference plane, mm.
        """
    @property
    def signals(self) -> list[str]:
        """
        Names of the channels that the head reads.
        """
    @property
    def standoff(self) -> float:
        """
        From the beam's origin to a line's first functional point, mm.
        """
    @property
    def wavelength(self) -> float:
        ...
class GaussianMode:
    """
    A collimator's Gaussian mode.
    """
    def __init__(self, wavelength: typing.SupportsFloat | typing.SupportsIndex, waist_radius: typing.SupportsFloat | typing.SupportsIndex, waist_position: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        wavelength: In vacuum, nm.
        waist_radius: 1/e^2 of power, mm
        waist_position: Along the beam from the collimator's plane, reduced (t/n), mm.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def rayleigh_length(self) -> float:
        """
        pi w0^2 / wavelength, mm (reduced: t/n).
        """
    @property
    def waist_position(self) -> float:
        """
        Along the beam from the collimator's plane, reduced (t/n), mm.
        """
    @property
    def waist_radius(self) -> float:
        """
        1/e^2 of power, mm
        """
    @property
    def wavelength(self) -> float:
        """
        In vacuum, nm.
        """
class ReturnedBeam:
    """
    A beam that has come back, in the collimator's frame (beam out along +z, its plane z = 0).
    """
    def __init__(self, position: numpy.typing.ArrayLike, direction: numpy.typing.ArrayLike, optical_length: typing.SupportsFloat | typing.SupportsIndex, reduced_length: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        position: (2,), where the axis meets the collimator's plane, mm
        direction: (3,), unit, z < 0
        optical_length: Sum of n t out and back, mm.
        reduced_length: Sum of t/n out and back, mm.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def direction(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), unit, z < 0
        """
    @property
    def optical_length(self) -> float:
        """
        Sum of n t out and back, mm.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,), where the axis meets the collimator's plane, mm
        """
    @property
    def reduced_length(self) -> float:
        """
        Sum of t/n out and back, mm.
        """
class Interferometer:
    """
    What an interferometer makes of the light that comes back to its collimator.
    """
    def __init__(self, *, aperture: typing.SupportsFloat | typing.SupportsIndex = 10.0, acceptance: typing.SupportsFloat | typing.SupportsIndex = 0.1, least_coupling: typing.SupportsFloat | typing.SupportsIndex = 0.0, resolution: typing.SupportsFloat | typing.SupportsIndex = 0.0, periodic_amplitude: typing.SupportsFloat | typing.SupportsIndex = 0.0, dead_path: typing.SupportsFloat | typing.SupportsIndex = 0.0, index_error: typing.SupportsFloat | typing.SupportsIndex = 0.0, reading_model: str = 'chief_ray') -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        aperture: Edge of the square that takes the beam back, mm.
        acceptance: Largest angle of the returned beam, rad.
        least_coupling: Share of the light.
        resolution: mm
        periodic_amplitude: mm
        dead_path: mm
        index_error: Relative.
        reading_model: "chief_ray" or "coupled_mode".
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def acceptance(self) -> float:
        """
        Largest angle of the returned beam, rad.
        """
    @property
    def aperture(self) -> float:
        """
        Edge of the square that takes the beam back, mm.
        """
    @property
    def dead_path(self) -> float:
        """
        mm
        """
    @property
    def index_error(self) -> float:
        """
        Relative.
        """
    @property
    def least_coupling(self) -> float:
        """
        Share of the light.
        """
    @property
    def periodic_amplitude(self) -> float:
        """
        mm
        """
    @property
    def reading_model(self) -> str:
        """
        "chief_ray" or "coupled_mode".
        """
    @property
    def resolution(self) -> float:
        """
        mm
        """
class BeamSpot:
    """
    A beam's spot on a sensor: centre (2,) and radius (1/e^2 of power) in mm, share of the source's power.
    """
    def __init__(self, centre: numpy.typing.ArrayLike, radius: typing.SupportsFloat | typing.SupportsIndex, power: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        """
        Raises InvalidArgument for what is not finite, no radius or a negative power.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def centre(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def power(self) -> float:
        ...
    @property
    def radius(self) -> float:
        ...
class Camera:
    """
    A pixel array and how a spot is located on it.
    """
    def __init__(self, *, pixel: typing.SupportsFloat | typing.SupportsIndex = 0.01, columns: typing.SupportsIndex = 512, rows: typing.SupportsIndex = 512, electrons: typing.SupportsFloat | typing.SupportsIndex = 1000000.0, background: typing.SupportsFloat | typing.SupportsIndex = 0.0, read_noise: typing.SupportsFloat | typing.SupportsIndex = 0.0, shot_noise: bool = False, full_well: typing.SupportsFloat | typing.SupportsIndex = 1000000000.0, bits: typing.SupportsIndex = 0, centroid: str = 'gaussian_fit', threshold: typing.SupportsFloat | typing.SupportsIndex = 0.05) -> None:
        """
        pixel: pitch, mm; electrons: of a whole spot of power 1; background (a pixel), read_noise (standard deviation), full_well: electrons; bits: of the converter over the full well, 0: not quantised; centroid: "gaussian_fit" or "centre_of_gravity", the latter of what exceeds the threshold, a share of the brightest pixel above background. Raises InvalidArgument naming the value.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def background(self) -> float:
        ...
    @property
    def bits(self) -> int:
        ...
    @property
    def centroid(self) -> str:
        ...
    @property
    def columns(self) -> int:
        """
        Pixels along x.
        """
    @property
    def electrons(self) -> float:
        ...
    @property
    def full_well(self) -> float:
        ...
    @property
    def pixel(self) -> float:
        ...
    @property
    def read_noise(self) -> float:
        ...
    @property
    def rows(self) -> int:
        """
        Pixels along y.
        """
    @property
    def shot_noise(self) -> bool:
        """
        Whether the light is counted in quanta.
        """
    @property
    def threshold(self) -> float:
        ...
class LateralEffect:
    """
    A lateral-effect position sensing device: it gives the power centroid of what falls on it.
    """
    def __init__(self, *, size: numpy.typing.ArrayLike = (10.0, 10.0), noise: typing.SupportsFloat | typing.SupportsIndex = 0.0, resolution: typing.SupportsFloat | typing.SupportsIndex = 0.0, least_power: typing.SupportsFloat | typing.SupportsIndex = 1e-06) -> None:
        """
        size: (2,) of the active area, mm; noise: standard deviation at full power, mm, growing as 1 / power; resolution: mm; least_power: share of the source's power, below which a reading is lost. Raises InvalidArgument naming the value.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def least_power(self) -> float:
        ...
    @property
    def noise(self) -> float:
        ...
    @property
    def resolution(self) -> float:
        ...
    @property
    def size(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class ReplayMismatch(RuntimeError):
    """
    A replayed pose differs from its trace, because another face is in the path of the beam; it names the pose.
    """
class BeamSegment:
    """
    A straight piece of a beam's way, in the sensor frame, mm.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def arrives(self) -> str | None:
        """
        Name of the detector that it arrives at, or None.
        """
    @property
    def beam(self) -> str:
        ...
    @property
    def end(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Where it meets a face; 50 mm on where it leaves.
        """
    @property
    def fate(self) -> str:
        """
        "goes_on", "absorbed", "left" or "cut".
        """
    @property
    def index(self) -> float:
        """
        Refractive index of what it runs in.
        """
    @property
    def parent(self) -> int:
        """
        Index of the segment it comes from; -1: the source.
        """
    @property
    def power(self) -> float:
        """
        Share of the source's power.
        """
    @property
    def start(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) mm
        """
class Sensitivity:
    """
    First derivatives of a head's readings by one parameter: signals (n,) in mm by its unit, and reading (3,): distance (mm), alpha and beta (rad).
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def component(self) -> str:
        """
        Its name; "mirror", "air", "all interferometers".
        """
    @property
    def quantity(self) -> str:
        """
        "shift x", ..., "rotation x", ..., "index", "temperature", "pressure", "humidity"
        """
    @property
    def reading(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) change of distance (mm), alpha and beta (rad) by unit of the quantity
        """
    @property
    def signals(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) change of the signals by unit of the quantity, mm
        """
    @property
    def unit(self) -> str:
        """
        Of the quantity: "mm", "rad", "1", "K", "Pa"
        """
class Misalignment:
    """
    How head and mirror are out of true on a line.
    """
    def __init__(self, reflector: numpy.typing.ArrayLike = (0.0, 0.0), laser: numpy.typing.ArrayLike = (0.0, 0.0), psd_zero: numpy.typing.ArrayLike = (0.0, 0.0), distance_constant: typing.SupportsFloat | typing.SupportsIndex = 0.0, beam_constants: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], *, lateral: numpy.typing.ArrayLike = (0.0, 0.0), roll: typing.SupportsFloat | typing.SupportsIndex = 0.0, gain: typing.SupportsFloat | typing.SupportsIndex = 0.0, drift: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        reflector: (2,) angles of the mirror a, b, rad
        laser: (2,) angles of the laser a, b, rad
        psd_zero: (2,) zero offset of the position sensing device, mm
        distance_constant: Constant error of all distances, mm.
        beam_constants: Constant errors of d1, d2, ..., mm.
        lateral: (2,) offset of the beam's origin, mm
        roll: Of the head, rad.
        gain: Relative error of tilts and spots; beams are at 1 + gain times their offsets.
        drift: Of the distances, mm/s.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def beam_constants(self) -> list[float]:
        """
        Constant errors of d1, d2, ..., mm.
        """
    @property
    def distance_constant(self) -> float:
        """
        Constant error of all distances, mm.
        """
    @property
    def drift(self) -> float:
        """
        Of the distances, mm/s.
        """
    @property
    def gain(self) -> float:
        """
        Relative error of tilts and spots; beams are at 1 + gain times their offsets.
        """
    @property
    def laser(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,) angles of the laser a, b, rad
        """
    @property
    def lateral(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,) offset of the beam's origin, mm
        """
    @property
    def psd_zero(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,) zero offset of the position sensing device, mm
        """
    @property
    def reflector(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (2,) angles of the mirror a, b, rad
        """
    @property
    def roll(self) -> float:
        """
        Of the head, rad.
        """
class Noise:
    """
    Standard deviations of an independent Gaussian per reading.
    """
    def __init__(self, distance: typing.SupportsFloat | typing.SupportsIndex = 0.0, tilt: typing.SupportsFloat | typing.SupportsIndex = 0.0, spot: typing.SupportsFloat | typing.SupportsIndex = 0.0, seed: typing.SupportsIndex = 0, common: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        distance: mm; also of d1, ...
        tilt: rad
        spot: mm
        seed: 0 to 2^64 - 1
        common: mm: one draw a row, added to all of its distances
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def common(self) -> float:
        """
        mm: one draw a row, added to all of its distances
        """
    @property
    def distance(self) -> float:
        """
        mm; also of d1, ...
        """
    @property
    def seed(self) -> int:
        """
        0 to 2^64 - 1
        """
    @property
    def spot(self) -> float:
        """
        mm
        """
    @property
    def tilt(self) -> float:
        """
        rad
        """
class ScaleTemperatures:
    """
    How warm the scales of the axes are, and how they expand. Makes the channels temperature_x, temperature_y and temperature_z, or temperature alone of one sensor. simulate() checks it.
    """
    def __init__(self, expansion: Expansion, start: numpy.typing.ArrayLike, rate: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), *, one_sensor: bool = False) -> None:
        """
        expansion: Of the scales.
        start: (3,) of X, Y, Z at the run's first reading, degrees Celsius
        rate: (3,) K/s
        one_sensor: Whether one sensor measures for all axes.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def expansion(self) -> Expansion:
        """
        Of the scales.
        """
    @property
    def one_sensor(self) -> bool:
        """
        Whether one sensor measures for all axes.
        """
    @property
    def rate(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) K/s
        """
    @property
    def start(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of X, Y, Z at the run's first reading, degrees Celsius
        """
class SimulationOptions:
    """
    What simulate() takes beside machine, plan and head, and checks.
    """
    def __init__(self, *, misalignment: collections.abc.Mapping[str, Misalignment] = {}, noise: Noise = ..., environment: Environment | None = None, assumed_environment: Environment | None = None, verified_share: typing.SupportsFloat | typing.SupportsIndex = 0.001, repeats: typing.SupportsIndex = 1, backward: bool = False, seconds_per_reading: typing.SupportsFloat | typing.SupportsIndex | None = None, scales: ScaleTemperatures | None = None, machine_drift: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """
        misalignment: By line name; a line without an entry is aligned.
        noise: Of the readings.
        environment: The air of the trace; None: of 20 degrees Celsius for a head with a design, an index of 1 for others.
        assumed_environment: What the readings are reduced with; None: the same.
        verified_share: Of a traced head's replayed poses, traced again and compared.
        repeats: How often each line is measured: runs 0, 1, 2, ...
        backward: Runs 0, 2, ... are each followed by one in reverse order, 1, 3, ...
        seconds_per_reading: Makes the channel time; None: no times.
        scales: They expand, and their temperatures are recorded.
        machine_drift: (3,) of the functional point along the axes since the first reading, mm/s
        """
    @property
    def assumed_environment(self) -> Environment | None:
        """
        What the readings are reduced with; None: the same.
        """
    @property
    def backward(self) -> bool:
        """
        Runs 0, 2, ... are each followed by one in reverse order, 1, 3, ...
        """
    @property
    def environment(self) -> Environment | None:
        """
        The air of the trace; None: of 20 degrees Celsius for a head with a design, an index of 1 for others.
        """
    @property
    def machine_drift(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of the functional point along the axes since the first reading, mm/s
        """
    @property
    def misalignment(self) -> dict[str, Misalignment]:
        """
        By line name; a line without an entry is aligned.
        """
    @property
    def noise(self) -> Noise:
        """
        Of the readings.
        """
    @property
    def repeats(self) -> int:
        """
        How often each line is measured: runs 0, 1, 2, ...
        """
    @property
    def scales(self) -> ScaleTemperatures | None:
        """
        They expand, and their temperatures are recorded.
        """
    @property
    def seconds_per_reading(self) -> float | None:
        """
        Makes the channel time; None: no times.
        """
    @property
    def verified_share(self) -> float:
        """
        Of a traced head's replayed poses, traced again and compared.
        """
class VirtualReadout:
    """
    The virtual head set up on one line, read with the axes at any position: the row that simulate makes there.
    """
    def __init__(self, machine: Machine, plan: Plan, head: Head | collections.abc.Mapping[str, Head], line: str, options: SimulationOptions | None = None, **kwargs: typing.Any) -> None:
        """
        Arguments as those of simulate. Raises InvalidArgument as it does, and for a line that is not in the plan.
        """
    def read(self, position: numpy.typing.ArrayLike, approach: str = '+++', *, row: typing.SupportsIndex = 0, elapsed: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> numpy.typing.NDArray[numpy.float64]:
        """
        The head's signals (n,), mm and rad, NaN where lost, with the axes at `position` (mm). approach: the directions that the axes came from, + or - of each. row: which draws the noise takes, as the number of a simulated row; elapsed: seconds since the set-up's first reading.
        """
class KnownExpansion:
    """
    What is known of the expansion of the scales. With it, positioning errors are referred to the reference temperature, by the temperatures in the run's channels.
    """
    def __init__(self, expansion: Expansion, standard_uncertainty: numpy.typing.ArrayLike, *, one_coefficient: bool, sensor_uncertainty: typing.SupportsFloat | typing.SupportsIndex, temperature: numpy.typing.ArrayLike | None = None, one_temperature: bool = False) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        expansion: Of the scales.
        standard_uncertainty: (3,) of the coefficients, 1/K
        one_coefficient: Whether it is common to the axes.
        sensor_uncertainty: Standard uncertainty of each sensor's constant deviation, K.
        temperature: (3,) of the scales where the run says nothing, degrees Celsius
        one_temperature: Whether one sensor measured it for all axes.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def expansion(self) -> Expansion:
        """
        Of the scales.
        """
    @property
    def one_coefficient(self) -> bool:
        """
        Whether it is common to the axes.
        """
    @property
    def one_temperature(self) -> bool:
        """
        Whether one sensor measured it for all axes.
        """
    @property
    def sensor_uncertainty(self) -> float:
        """
        Standard uncertainty of each sensor's constant deviation, K.
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of the coefficients, 1/K
        """
    @property
    def temperature(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        (3,) of the scales where the run says nothing, degrees Celsius
        """
class ReadingUncertainty:
    """
    Standard uncertainty of a reading where the run gives none: 1e-12 to 1e6 each.
    """
    def __init__(self, distance: typing.SupportsFloat | typing.SupportsIndex = 0.0001, tilt: typing.SupportsFloat | typing.SupportsIndex = 1e-06, spot: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        distance: mm; also of d1, ...
        tilt: rad
        spot: mm
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def distance(self) -> float:
        """
        mm; also of d1, ...
        """
    @property
    def spot(self) -> float:
        """
        mm
        """
    @property
    def tilt(self) -> float:
        """
        rad
        """
class PlausibleLimits:
    """
    What a machine can be. A result beyond is an error; inf: no limit.
    """
    def __init__(self, *, positioning: typing.SupportsFloat | typing.SupportsIndex = 0.001, translation: typing.SupportsFloat | typing.SupportsIndex = 2.0, rotation: typing.SupportsFloat | typing.SupportsIndex = 0.005) -> None:
        """
        Raises InvalidArgument for what makes no sense.
        
        positioning: Positioning errors by the travel of their axis.
        translation: Positioning errors and straightnesses, mm.
        rotation: Angular errors and squarenesses, rad.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def positioning(self) -> float:
        """
        Positioning errors by the travel of their axis.
        """
    @property
    def rotation(self) -> float:
        """
        Angular errors and squarenesses, rad.
        """
    @property
    def translation(self) -> float:
        """
        Positioning errors and straightnesses, mm.
        """
class Undetermined:
    """
    What the readings leave open, as data; `Calibration.undetermined` has it in words.
    """
    @staticmethod
    def all_remedies() -> list[str]:
        ...
    @staticmethod
    def reasons() -> list[str]:
        ...
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def component(self) -> int:
        """
        Of a set-up: as in SetupEstimate.
        """
    @property
    def line(self) -> str:
        """
        The line to add; else empty.
        """
    @property
    def lines_planned(self) -> int:
        """
        Of such a step: its lines in the plan.
        """
    @property
    def lines_read(self) -> int:
        """
        Of such a step: the lines that it was read on.
        """
    @property
    def parameters(self) -> list[str]:
        """
        "EXX", ..., "C0Y"; of a set-up its quantity, as in SetupEstimate.
        """
    @property
    def part(self) -> str:
        """
        What is open: "whole"; "slope"; "positions": at some of them; "reversal"; "reversal_at_home": of the reversal errors only the change along the axis is known; "setup".
        """
    @property
    def positions(self) -> list[float]:
        """
        mm: where it is open; of a step that was read on too few lines its two ends.
        """
    @property
    def reason(self) -> str:
        """
        One of `reasons()`.
        """
    @property
    def remedies(self) -> list[str]:
        """
        What would help, the best first; any one of them does. Of `all_remedies()`.
        """
    @property
    def setups(self) -> list[tuple[int, str]]:
        """
        Of a set-up: (first run, line) of each that is open.
        """
    @property
    def step(self) -> int:
        """
        Of such a step: its number, from 1; else 0.
        """
class Calibration:
    """
    The 21 parameters as far as the readings determine them, with standard uncertainties; native units (mm, rad).
    """
    @staticmethod
    def provenance_keys() -> list[str]:
        """
        The keys that a provenance may have.
        """
    def __contains__(self, parameter: object) -> bool:
        ...
    def __getitem__(self, parameter: str) -> stepdiag.io.displays.ParameterValues:
        """
        Return position, value and standard uncertainty of a parameter, such as EXX, C0Y or EXX_reversal; mm, rad.
        
            Of a function these are arrays (n,), of a squareness numbers without a position. Raises KeyError naming the
            parameters that there are.
        """
    def __init__(self, method: str, chain: Chain | str, volume: numpy.typing.ArrayLike, tool: numpy.typing.ArrayLike, functions: collections.abc.Mapping[str, tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike, numpy.typing.ArrayLike]], squareness: collections.abc.Mapping[str, tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]] = {}, *, undetermined_slopes: collections.abc.Sequence[str] = [], undetermined: collections.abc.Sequence[str] = [], covariance: numpy.typing.ArrayLike | None = None, reversal: collections.abc.Mapping[str, tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike, numpy.typing.ArrayLike]] = {}, reversal_negative_uncertainty: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, undetermined_reversal_constants: collections.abc.Sequence[str] = [], date: str = '', fit: str | None = None, variance_factor: typing.SupportsFloat | typing.SupportsIndex | None = None, fit_codes: collections.abc.Sequence[str] = [], fit_reasons: collections.abc.Sequence[str] = [], uncertainty_scaled: typing.SupportsFloat | typing.SupportsIndex | None = None, provenance: collections.abc.Mapping[str, str] = {}, unseen_faults: collections.abc.Sequence[str] = [], conditions: collections.abc.Sequence[str] = [], budget: str = '', between_nodes: typing.SupportsFloat | typing.SupportsIndex | None = None, temperature_reference: typing.SupportsFloat | typing.SupportsIndex | None = None, temperature_as_found: numpy.typing.ArrayLike | None = None, expansion: numpy.typing.ArrayLike | None = None, fixed_point: numpy.typing.ArrayLike | None = None, unverified: bool = False) -> None:
        """
        A calibration from its parts, each as the property of its name gives it; reversal_negative_uncertainty: name -> (n,), of negative_functions. A standard uncertainty that is not known is NaN. Raises InvalidArgument naming the parameter for what is none: nodes that do not ascend, values that are not finite, a covariance that is not one of these values.
        """
    def __iter__(self) -> collections.abc.Iterator[str]:
        """
        Names of the parameters that there are: functions, reversal errors, squarenesses.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def dated(self, date: str) -> Calibration:
        """
        The same calibration with this date. Raises InvalidArgument for more than one line.
        """
    def judged(self, fit: str, fit_reasons: collections.abc.Sequence[str] = [], fit_codes: collections.abc.Sequence[str] = []) -> Calibration:
        """
        The same calibration with this verdict of its fit. Raises InvalidArgument for another word, and for reasons and codes that differ in number.
        """
    def plot(self, *, truth: ErrorMap | None = None) -> matplotlib.figure.Figure:
        """
        Draw the 21 parameters with 95 % bands (a matplotlib Figure). truth: errors to draw beside them.
        """
    def to_dataframe(self) -> pandas.DataFrame:
        """
        The calibration as a pandas.DataFrame: a row for each value, with the columns parameter, position (mm; NaN of a
            squareness), value, standard_uncertainty (mm or rad) and unit.
        """
    def to_error_map(self) -> ErrorMap:
        """
        The calibration as a machine's errors; what is undetermined is 0 there.
        """
    def to_xarray(self) -> xarray.Dataset:
        """
        The calibration as a labelled table (xarray.Dataset).
        """
    def with_between_nodes(self, between_nodes: typing.SupportsFloat | typing.SupportsIndex | None) -> Calibration:
        """
        The same calibration with this standard uncertainty by errors between the nodes, mm. Raises InvalidArgument below 0.
        """
    def with_conditions(self, conditions: collections.abc.Sequence[str], budget: str) -> Calibration:
        """
        The same calibration with these words. Raises InvalidArgument for a sentence of more than one line.
        """
    def with_provenance(self, provenance: collections.abc.Mapping[str, str]) -> Calibration:
        """
        The same calibration with this provenance, by the keys of the property. Raises InvalidArgument for other keys, and for texts that are empty or of more than one line.
        """
    def with_sentences(self, *, undetermined: collections.abc.Sequence[str], fit_reasons: collections.abc.Sequence[str] = [], unseen_faults: collections.abc.Sequence[str] = []) -> Calibration:
        """
        The same calibration with its findings in these words. Raises InvalidArgument for a sentence of more than one line.
        """
    def write(self, path: str | os.PathLike[str], *, provenance: collections.abc.Mapping[str, str] | None = None, between_nodes: float | None = None) -> Calibration:
        """
        Write the calibration, CSV or netCDF (a name that ends in .nc), and return it as written, with a date.
        
            Reading it returns the same bits; CSV has no covariance. `provenance` and `between_nodes` (mm) replace those of the
            calibration. Raises InvalidArgument where it cannot be written, or the provenance has other keys.
        """
    def write_csv(self, path: str | os.PathLike[str]) -> None:
        """
        Writes the calibration CSV (the covariance is not kept). Raises InvalidArgument when it cannot be written.
        """
    @property
    def A0Z(self) -> stepdiag.io.displays.ParameterValues:
        """
        A0Z: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def B0Z(self) -> stepdiag.io.displays.ParameterValues:
        """
        B0Z: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def C0Y(self) -> stepdiag.io.displays.ParameterValues:
        """
        C0Y: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EAX(self) -> stepdiag.io.displays.ParameterValues:
        """
        EAX: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EAY(self) -> stepdiag.io.displays.ParameterValues:
        """
        EAY: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EAZ(self) -> stepdiag.io.displays.ParameterValues:
        """
        EAZ: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EBX(self) -> stepdiag.io.displays.ParameterValues:
        """
        EBX: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EBY(self) -> stepdiag.io.displays.ParameterValues:
        """
        EBY: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EBZ(self) -> stepdiag.io.displays.ParameterValues:
        """
        EBZ: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def ECX(self) -> stepdiag.io.displays.ParameterValues:
        """
        ECX: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def ECY(self) -> stepdiag.io.displays.ParameterValues:
        """
        ECY: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def ECZ(self) -> stepdiag.io.displays.ParameterValues:
        """
        ECZ: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EXX(self) -> stepdiag.io.displays.ParameterValues:
        """
        EXX: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EXY(self) -> stepdiag.io.displays.ParameterValues:
        """
        EXY: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EXZ(self) -> stepdiag.io.displays.ParameterValues:
        """
        EXZ: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EYX(self) -> stepdiag.io.displays.ParameterValues:
        """
        EYX: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EYY(self) -> stepdiag.io.displays.ParameterValues:
        """
        EYY: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EYZ(self) -> stepdiag.io.displays.ParameterValues:
        """
        EYZ: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EZX(self) -> stepdiag.io.displays.ParameterValues:
        """
        EZX: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EZY(self) -> stepdiag.io.displays.ParameterValues:
        """
        EZY: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def EZZ(self) -> stepdiag.io.displays.ParameterValues:
        """
        EZZ: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.
        """
    @property
    def between_nodes(self) -> float | None:
        """
        Standard uncertainty of the functional point by errors between the nodes, as it was stated, mm; None: nothing was stated. It is in no other uncertainty.
        """
    @property
    def budget(self) -> str:
        """
        What makes its largest positioning uncertainty: one line; empty where it is not known.
        """
    @property
    def chain(self) -> Chain:
        """
        Of the machine.
        """
    @property
    def conditions(self) -> list[str]:
        """
        Under which conditions it was evaluated, as they were used: temperatures, coefficients, the air, the instrument; a sentence each.
        """
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
    def date(self) -> str:
        """
        When it was evaluated: ISO 8601, UTC; empty where it is not known.
        """
    @property
    def expansion(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        Coefficients of the scales of X, Y, Z (3,) by which positioning errors are referred to temperature_reference, 1/K; of an adjustment as it found them. None: as found, or not known.
        """
    @property
    def findings(self) -> list[Undetermined]:
        """
        What the readings do not determine, why, and what would help; files keep it in words only.
        """
    @property
    def fit(self) -> str | None:
        """
        Verdict of the fit: "accepted", "doubtful", "rejected" (not to be used) or "unchecked" (nothing controls the readings); None where it is not known.
        """
    @property
    def fit_codes(self) -> list[str]:
        """
        Why that verdict, as stable codes: of an adjustment those of FitReason.finding; empty where it is not known.
        """
    @property
    def fit_reasons(self) -> list[str]:
        """
        Why that verdict, a sentence each.
        """
    @property
    def fixed_point(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Positions from which these scales expand (3,), mm.
        """
    @property
    def functions(self) -> dict[str, tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]]:
        """
        name -> (position, value, standard uncertainty); what is not determined is absent.
        """
    @property
    def method(self) -> str:
        """
        "conventional", "enhanced" or "adjustment", perhaps with remarks.
        """
    @property
    def negative_functions(self) -> dict[str, tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]]:
        """
        name -> (position, value, standard uncertainty) of functions approached in - direction, which are functions - reversal.
        """
    @property
    def provenance(self) -> dict[str, str]:
        """
        What it was made from, as far as it is known: program and version, SHA-256 of the run, the scenario and the descriptions of heads, options that are not the default ones. Keys: program, run_sha256, scenario_sha256, heads_sha256, options.
        """
    @property
    def reversal(self) -> dict[str, tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]]:
        """
        name -> (position, value, standard uncertainty): the function approached in + direction less that in - direction, where backward runs tell it. `functions` are those of the + direction.
        """
    @property
    def squareness(self) -> dict[str, tuple[float, float]]:
        """
        name -> (value, standard uncertainty), rad.
        """
    @property
    def straightness_reference(self) -> str:
        """
        One line: to which point the straightnesses refer, and what they are at the functional point.
        """
    @property
    def temperature_as_found(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        Temperatures of the scales of X, Y, Z (3,) where errors are as found, means over all readings, degrees Celsius; None: nothing was recorded, or they are referred to temperature_reference.
        """
    @property
    def temperature_reference(self) -> float | None:
        """
        Temperature of the scales that positioning errors are referred to, degrees Celsius; None: they are as found.
        """
    @property
    def tool(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) offset of the functional point, mm
        """
    @property
    def uncertainty_parts(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        Of an adjustment, by source ("scale" of the instrument, "temperature", "air"): what it makes of the standard uncertainties, mm or rad, in the order of covariance_labels. Sources that are not stated are absent; a file does not have them.
        """
    @property
    def uncertainty_scaled(self) -> float | None:
        """
        What all uncertainties were multiplied by, beyond what follows from those of the readings (scale_uncertainty); None: by nothing.
        """
    @property
    def undetermined(self) -> list[str]:
        """
        The findings in words, one sentence each; empty until they are put in (with_sentences).
        """
    @property
    def undetermined_reversal_constants(self) -> list[str]:
        """
        Functions of whose reversal error only the change from home is known; its values are 0 at home.
        """
    @property
    def undetermined_slopes(self) -> list[str]:
        """
        Functions of which only the shape is known; their values are 0 at both ends.
        """
    @property
    def unseen_faults(self) -> list[str]:
        """
        How large faults of readings may be in it unseen, and what they then do, a sentence each.
        """
    @property
    def unverified(self) -> bool:
        """
        Whether it, or one that it was made from, was read from a file without a checksum: nothing tells whether its values are those that were written.
        """
    @property
    def variance_factor(self) -> float | None:
        """
        Of the fit: 1 is expected; None where nothing controls the readings, or it is not known.
        """
    @property
    def volume(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) edges, mm
        """
class Thresholds:
    """
    Every limit that a verdict, or the search for faults and mistakes, is made with. thresholds has the values in force.
    """
    @property
    def alternative(self) -> float:
        """
        What is less behind the best fault or mistake may be it.
        """
    @property
    def chance(self) -> float:
        """
        Difference in chi-square that does not make one mistake better than another.
        """
    @property
    def far_below_stated(self) -> float:
        """
        Noise factor below which such residuals are no noise.
        """
    @property
    def farthest_prior(self) -> float:
        """
        Distance of a set-up value from its prior, in sqrt(u_prior^2 - u^2), beyond which a fit is rejected.
        """
    @property
    def fault(self) -> float:
        """
        Least gain of a fault in chi-square.
        """
    @property
    def fault_cost(self) -> float:
        """
        How many times as large uncertainties what was done about faults may make the largest of a family.
        """
    @property
    def faults_of_mistake(self) -> float:
        """
        Number of faults from which one mistake that explains as much is the likelier.
        """
    @property
    def found_with_99_percent(self) -> float:
        """
        Size of a fault, in its standard uncertainties, that is found with a probability of 99 %.
        """
    @property
    def gross_scatter(self) -> float:
        """
        Of the square sum a reading: values far from any machine.
        """
    @property
    def largest_noise_factor(self) -> float:
        """
        Beyond it a fit is rejected.
        """
    @property
    def largest_variance_factor(self) -> float:
        """
        Square of largest_noise_factor.
        """
    @property
    def lines_of_mistake(self) -> float:
        """
        The same of lines that have faults.
        """
    @property
    def misfit_doubtful(self) -> float:
        """
        Probability of a misfit below which a fit is doubtful.
        """
    @property
    def misfit_rejected(self) -> float:
        """
        Probability of a misfit below which a fit is rejected, where the misfit also differs between lines, channels or times.
        """
    @property
    def mistake(self) -> float:
        """
        Least gain of a mistake in the whole run.
        """
    @property
    def most_faults(self) -> float:
        """
        Of a channel, by its redundancy; one in any case.
        """
    @property
    def no_misfit_doubtful(self) -> float:
        """
        The same above which there is less noise than stated.
        """
    @property
    def noise_component(self) -> float:
        """
        Probability below which the scatter of a channel is taken for its noise.
        """
    @property
    def pattern(self) -> float:
        """
        Probability of a pattern of residuals, where chi-square finds a misfit.
        """
    @property
    def pattern_alone(self) -> float:
        """
        The same, where it finds none.
        """
    @property
    def prior_scatter_rejected(self) -> float:
        """
        Probability of set-up values that scatter more than their priors, below which a fit is rejected.
        """
    @property
    def rounding_alone(self) -> float:
        """
        Rms of residuals in units of their rounding.
        """
    @property
    def second_order(self) -> float:
        """
        Gain from which second order may distinguish faults.
        """
    @property
    def widest_component(self) -> float:
        """
        Largest relative standard uncertainty of a noise factor that is used.
        """
class SetupPriors:
    """
    How each unknown of a line's set-up is taken: "free", "fixed" at 0, or the standard uncertainty with which it is known to be 0 (rad, mm, 1 for gain, mm/s for drift); None: the default.
    """
    def __init__(self, *, reflector: float | str | None = None, laser: float | str | None = None, distance_constant: float | str | None = None, beam_constants: float | str | None = None, psd_zero: float | str | None = None, lateral: float | str | None = None, roll: float | str | None = None, gain: float | str | None = None, drift: float | str | None = None) -> None:
        """
        Raises InvalidArgument.
        """
class Smoothness:
    """
    Standard deviations with which second differences of neighbouring nodes are known to be 0; 0: no such knowledge.
    """
    def __init__(self, *, translation: typing.SupportsFloat | typing.SupportsIndex = 0.0, rotation: typing.SupportsFloat | typing.SupportsIndex = 0.0, cross_validated: bool = False) -> None:
        """
        translation: mm
        rotation: rad
        cross_validated: They are found for each function, not below these.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def cross_validated(self) -> bool:
        """
        They are found for each function, not below these.
        """
    @property
    def rotation(self) -> float:
        """
        rad
        """
    @property
    def translation(self) -> float:
        """
        mm
        """
class MachineDrift:
    """
    A drift of the functional point along the axes that is no expansion of scales, in proportion to a record since the run's first reading: its rates are unknowns. adjust() checks it.
    """
    def __init__(self, standard_uncertainty: numpy.typing.ArrayLike, *, record: str = 'time') -> None:
        """
        standard_uncertainty: (3,) of the rates along X, Y, Z about 0, mm/s, or mm/K with a temperature; 0: no drift
        record: "time", or the channel of a temperature: "temperature", "temperature_x", ..., "air_temperature".
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def record(self) -> str:
        """
        "time", or the channel of a temperature: "temperature", "temperature_x", ..., "air_temperature".
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of the rates along X, Y, Z about 0, mm/s, or mm/K with a temperature; 0: no drift
        """
class AdjustmentOptions:
    """
    What adjust() takes for known and unknown, and checks.
    """
    def __init__(self, *, uncertainty: ReadingUncertainty = ..., setup: SetupPriors = ..., setup_by_line: collections.abc.Mapping[str, SetupPriors] = {}, one_setup_per_line: bool = False, reversal: bool = True, rotations: bool = True, smoothness: Smoothness | None = None, outlier_probability: typing.SupportsFloat | typing.SupportsIndex = 0.00012, slips: str = 'report', scale_uncertainty: bool = False, full_covariance: bool = False, plausible: PlausibleLimits = ..., expansion: KnownExpansion | None = None, machine_drift: MachineDrift | None = None, reliability: bool = False, search_faults: bool = True, distance_scale_uncertainty: typing.SupportsFloat | typing.SupportsIndex = 0.0, air_index_uncertainty: typing.SupportsFloat | typing.SupportsIndex = 0.0, variance_components: bool = True) -> None:
        """
        uncertainty: Of readings where the run states none.
        setup: How the set-up of all lines is known.
        setup_by_line: Line -> SetupPriors that replace the quantities that they name.
        one_setup_per_line: All runs of a line share its set-up.
        reversal: Tables of their own for nodes that are approached in - direction.
        rotations: False: the machine has no angular errors.
        smoothness: None: errors of neighbouring nodes are independent.
        outlier_probability: Of a false alarm among a thousand tests for faults; 0: faults are named and not corrected.
        slips: "report" rejects a run with a slip, "estimate" makes it an unknown and accepts that.
        scale_uncertainty: Where the variance factor is above 1, its root multiplies all stated uncertainties, and the fit is doubtful at best.
        full_covariance: Whether the calibration has the covariance of all its entries.
        plausible: What a machine can be.
        expansion: Of the scales; coefficients that are uncertain are unknowns.
        machine_drift: Its rates are unknowns.
        reliability: Also which faults the readings control.
        search_faults: False: it is known already what is wrong with the run as a whole. Faults are not looked for; where the minimum is not reached soon, values are those that were, and rejected.
        distance_scale_uncertainty: Relative standard uncertainty of all distances in common, by the instrument's scale; it counts in the uncertainties only.
        air_index_uncertainty: The same, by the index of the air.
        variance_components: Estimates how much each channel scatters, and takes that for its noise where it is more than is stated.
        """
    @property
    def air_index_uncertainty(self) -> float:
        """
        The same, by the index of the air.
        """
    @property
    def distance_scale_uncertainty(self) -> float:
        """
        Relative standard uncertainty of all distances in common, by the instrument's scale; it counts in the uncertainties only.
        """
    @property
    def expansion(self) -> KnownExpansion | None:
        """
        Of the scales; coefficients that are uncertain are unknowns.
        """
    @property
    def full_covariance(self) -> bool:
        """
        Whether the calibration has the covariance of all its entries.
        """
    @property
    def machine_drift(self) -> MachineDrift | None:
        """
        Its rates are unknowns.
        """
    @property
    def one_setup_per_line(self) -> bool:
        """
        All runs of a line share its set-up.
        """
    @property
    def outlier_probability(self) -> float:
        """
        Of a false alarm among a thousand tests for faults; 0: faults are named and not corrected.
        """
    @property
    def plausible(self) -> PlausibleLimits:
        """
        What a machine can be.
        """
    @property
    def reliability(self) -> bool:
        """
        Also which faults the readings control.
        """
    @property
    def reversal(self) -> bool:
        """
        Tables of their own for nodes that are approached in - direction.
        """
    @property
    def rotations(self) -> bool:
        """
        False: the machine has no angular errors.
        """
    @property
    def scale_uncertainty(self) -> bool:
        """
        Where the variance factor is above 1, its root multiplies all stated uncertainties, and the fit is doubtful at best.
        """
    @property
    def search_faults(self) -> bool:
        """
        False: it is known already what is wrong with the run as a whole. Faults are not looked for; where the minimum is not reached soon, values are those that were, and rejected.
        """
    @property
    def setup(self) -> SetupPriors:
        """
        How the set-up of all lines is known.
        """
    @property
    def setup_by_line(self) -> dict[str, SetupPriors]:
        """
        Line -> SetupPriors that replace the quantities that they name.
        """
    @property
    def slips(self) -> str:
        """
        "report" rejects a run with a slip, "estimate" makes it an unknown and accepts that.
        """
    @property
    def smoothness(self) -> Smoothness | None:
        """
        None: errors of neighbouring nodes are independent.
        """
    @property
    def uncertainty(self) -> ReadingUncertainty:
        """
        Of readings where the run states none.
        """
    @property
    def variance_components(self) -> bool:
        """
        Estimates how much each channel scatters, and takes that for its noise where it is more than is stated.
        """
class SetupEstimate:
    """
    One unknown of a line's set-up as it was found; rad, mm, 1, mm/s.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def component(self) -> int:
        """
        0 or 1 of pairs; of beam_constants 1 for d2, ...
        """
    @property
    def line(self) -> str:
        """
        Such as "ppp".
        """
    @property
    def prior(self) -> float:
        """
        Standard uncertainty of its prior; infinite where it is free (1 m, 1 rad, 1 for a free lateral offset, roll, gain).
        """
    @property
    def quantity(self) -> str:
        """
        "reflector", "laser", ...
        """
    @property
    def run(self) -> int:
        """
        The first run that has this set-up.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        In the unit of the value.
        """
    @property
    def value(self) -> float | None:
        """
        None where it is not determined.
        """
class ExpansionEstimate:
    """
    An expansion coefficient as it was found, 1/K.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def axes(self) -> list[int]:
        """
        That have it in common: 0, 1, 2 of X, Y, Z.
        """
    @property
    def prior(self) -> float:
        """
        Standard uncertainty of its prior.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        1/K
        """
    @property
    def stated(self) -> float:
        """
        Value of its prior.
        """
    @property
    def value(self) -> float:
        """
        1/K
        """
class RoundedChannel:
    """
    What took the place of a channel's stated uncertainties, which were too small; mm or rad.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def cause(self) -> str:
        """
        "doubles": rounding of numbers; "decimals": of the file; "weights": tilts or the laser are known so much worse that double precision could not weigh both.
        """
    @property
    def channel(self) -> str:
        """
        "distance", ...
        """
    @property
    def stated(self) -> float:
        """
        Standard uncertainty.
        """
    @property
    def step(self) -> float:
        """
        Of the decimals; 0: more of them than count.
        """
    @property
    def used(self) -> float:
        """
        Standard uncertainty in its place.
        """
class DriftEstimate:
    """
    A rate of the machine's drift as it was found, mm/s or mm/K.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def axis(self) -> int:
        """
        0, 1, 2 of X, Y, Z.
        """
    @property
    def prior(self) -> float:
        """
        Standard uncertainty of its prior.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        mm/s
        """
    @property
    def value(self) -> float:
        """
        mm/s
        """
class VarianceComponent:
    """
    How much the readings of a channel scatter, as their residuals tell it.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def channel(self) -> str:
        """
        "distance" (of beams, too), "alpha", ...
        """
    @property
    def factor(self) -> float:
        """
        Root of the component: times the noise that is stated.
        """
    @property
    def line(self) -> str:
        """
        Of a line that scatters unlike the channel's others; empty: all others.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        Of the factor.
        """
    @property
    def used(self) -> bool:
        """
        Stated uncertainties were multiplied by it; otherwise they stayed.
        """
class Outlier:
    """
    A reading that was left out.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def channel(self) -> str:
        """
        "distance", ...
        """
    @property
    def line(self) -> str:
        """
        Such as "ppp".
        """
    @property
    def normalised(self) -> float:
        """
        In its standard uncertainties.
        """
    @property
    def number(self) -> int:
        """
        Of its class in Adjustment.faults, from 1.
        """
    @property
    def point(self) -> int:
        """
        On the line, from 0.
        """
    @property
    def residual(self) -> float:
        """
        mm or rad
        """
    @property
    def row(self) -> int:
        """
        Row of the measurement, from 0.
        """
    @property
    def run(self) -> int:
        """
        Of the line, from 0.
        """
class Fault:
    """
    A fault that explains the readings, if it is the one.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def channel(self) -> str:
        """
        "distance", ...
        """
    @property
    def chi_square_gain(self) -> float:
        """
        How much chi-square falls without it.
        """
    @property
    def kind(self) -> str:
        """
        "reading", "slip": an offset of its channel from this reading on, or "factor": distances of its line too long by a part of the travel.
        """
    @property
    def line(self) -> str:
        """
        Such as "ppp".
        """
    @property
    def point(self) -> int:
        """
        On the line, from 0.
        """
    @property
    def row(self) -> int:
        """
        Row of the measurement, from 0.
        """
    @property
    def run(self) -> int:
        """
        Of the line, from 0.
        """
    @property
    def size(self) -> float:
        """
        Error of the reading, mm or rad.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        Of the size.
        """
class FaultClass:
    """
    Faults of which the readings do not tell which one happened.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def corrected(self) -> bool:
        """
        Whether the verdict is that of the fit after its treatment.
        """
    @property
    def distinguished(self) -> bool:
        """
        Whether the readings determine which one it was.
        """
    @property
    def members(self) -> list[Fault]:
        """
        The best first.
        """
    @property
    def plausible(self) -> float:
        """
        The plausible limit of that parameter.
        """
    @property
    def spread(self) -> float:
        """
        By how much they differ in it, mm or rad.
        """
    @property
    def treatment(self) -> str:
        """
        "left_out": all readings that may be the wrong one; "estimated": their sizes are unknowns, which share the fault between them, so that the spread of the alternatives is in the uncertainties; "none".
        """
    @property
    def widest(self) -> str:
        """
        The parameter that estimated alternatives differ in most; empty where there are none.
        """
class FitReason:
    """
    Why a fit is not accepted, or what its residuals have in common.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def alternative(self) -> bool:
        """
        Of a trend: it is there instead of the one before; the readings do not tell which.
        """
    @property
    def aspect(self) -> str:
        """
        Of an uneven misfit "second_half" of the run or "far_half" of the lines; of a trend what it runs with: "time" (the order of the rows, where there is no time), "position" along the line, "time_or_position", which are alike in this run; else empty.
        """
    @property
    def channel(self) -> str:
        """
        Of an uneven misfit or a trend; empty: all. Of a prior or prior_scatter the set-up quantity.
        """
    @property
    def component(self) -> int:
        """
        Of a prior: as of SetupEstimate.
        """
    @property
    def fault(self) -> int:
        """
        Of a fault or alternatives: its class, from 1; else 0.
        """
    @property
    def finding(self) -> str:
        """
        "no_redundancy"; "no_noise": rms of the residuals in units of their rounding; "noise_factor", "misfit", "no_misfit": root of the variance factor, or the noise factor of `channel` on `line`, not credible, or larger or smaller than chance explains; "uneven_misfit": noise factor of one group of readings, and as the limit that of the others; "trend": what residuals of one channel run by, from the first reading to the last (mm or rad); "prior": distance of a set-up value from its prior, in sqrt(u_prior^2 - u^2); "fault": what a fault that was not corrected takes off chi-square; "fault_cost": what the uncertainty of `parameter` is multiplied by because of corrected faults; "undetermined": they leave `parameter` undetermined; "alternatives": by how much alternative faults differ in `parameter`; "scaled": what the uncertainties were multiplied by; "mistake": `parameter` says which one would explain the readings; "implausible_input": `parameter` says what no workshop has.
        """
    @property
    def limit(self) -> float:
        """
        Of an uneven misfit the value of the other readings; of noise, trends and scatter what is expected.
        """
    @property
    def line(self) -> str:
        """
        Of an uneven misfit, a trend or a prior; empty: all.
        """
    @property
    def parameter(self) -> str:
        """
        Of alternatives; of a mistake or an input its sentence; else empty.
        """
    @property
    def run(self) -> int:
        """
        Of an uneven misfit: the run; -1: all.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        Of the value of a misfit, no_misfit, trend, scaled; else 0.
        """
    @property
    def value(self) -> float:
        """
        Of a trend mm or rad.
        """
class Verdict:
    """
    Whether the readings of an adjustment agree with each other, with their uncertainties and with the priors. It does not see what the parameters absorb: a wrong wavelength, tool or place of b in the chain.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def fit(self) -> str:
        """
        "accepted", "doubtful", "rejected" or "unchecked".
        """
    @property
    def reasons(self) -> list[FitReason]:
        """
        A FitReason for each; empty of an accepted fit without remarks.
        """
class KnownCombination:
    """
    A sum of unknowns that are not determined one by one: of slopes of positioning errors and straightnesses, or of two unknowns of one set-up.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def component(self) -> int:
        """
        Of a set-up: as in SetupEstimate.
        """
    @property
    def line(self) -> str:
        """
        Of a set-up; empty for slopes.
        """
    @property
    def run(self) -> int:
        """
        Of a set-up: the first run that has it.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        rad; of slopes mm/mm.
        """
    @property
    def terms(self) -> list[tuple[float, str]]:
        """
        (weight, parameter) each; of a set-up its quantities, as in SetupEstimate.
        """
    @property
    def value(self) -> float:
        """
        rad; of slopes mm/mm.
        """
class FaultControl:
    """
    Which faults of one kind the readings control (reliability, W. Baarda 1968). One is found with a probability of 99 % where it is 7.6 times as large as the standard uncertainty of its size, and distinguished from another one where that makes chi-square larger by 25. Twins are not distinguished at any size: their effects have a correlation of 0.999 and more, but the calibration differs.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def channel(self) -> str:
        """
        "distance", "tilt" or "spot".
        """
    @property
    def count(self) -> int:
        """
        Of controlled faults, one a place (of long runs: evenly spaced).
        """
    @property
    def distinguished_from(self) -> float:
        """
        Those without a twin are distinguished from all others from this size on; mm or rad.
        """
    @property
    def found_from(self) -> float:
        """
        All of `count` are found from here on; mm or rad.
        """
    @property
    def hidden(self) -> dict[str, float]:
        """
        Kind of parameter -> largest effect of a fault just not found, mm or rad; infinite: of one that nothing controls.
        """
    @property
    def kind(self) -> str:
        """
        "reading", "slip": an offset of its channel from a reading on, or "factor" on a line's distances.
        """
    @property
    def shared(self) -> dict[str, float]:
        """
        Kind of parameter -> by how much it differs, by the size of a fault, if its twin was it; in mm or rad each.
        """
    @property
    def twins(self) -> int:
        """
        Those of `count` that have a twin.
        """
    @property
    def uncontrolled(self) -> int:
        """
        More of them, which no other reading controls.
        """
class UnseenFault:
    """
    What the faults of one kind may do to a calibration without being seen, one at a time: the worst of them.
    """
    @property
    def channel(self) -> str:
        """
        "distance", "tilt" or "spot".
        """
    @property
    def controlled(self) -> bool:
        """
        Whether all are; otherwise some may have any size.
        """
    @property
    def hidden(self) -> dict[str, float]:
        """
        Kind of parameter -> largest effect of a fault just not found, mm or rad; infinite: of one that nothing controls.
        """
    @property
    def kind(self) -> str:
        """
        As of FaultControl.
        """
    @property
    def size(self) -> float:
        """
        From here on all that are controlled are found with 99 %; mm or rad; 0: none is controlled.
        """
class Adjustment:
    """
    What an adjustment found: calibration, set-ups, and how the readings fit.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def with_calibration(self, calibration: Calibration) -> Adjustment:
        """
        The same, with this calibration: its own, with more words.
        """
    def write(self, path: str | os.PathLike[str], *, measurement: Measurement | None = None, provenance: collections.abc.Mapping[str, str] | None = None, between_nodes: float | None = None) -> Calibration:
        """
        Write the calibration as Calibration.write does; in netCDF with set-ups, residuals and test values.
        
            `measurement` labels the residuals with run, line, point and direction.
        """
    @property
    def calibration(self) -> Calibration:
        """
        With fit and variance factor.
        """
    @property
    def chi_square_probability(self) -> float:
        """
        Of a larger square sum, if model and uncertainties are right.
        """
    @property
    def combinations(self) -> list[KnownCombination]:
        """
        What is known of unknowns that are not determined one by one.
        """
    @property
    def degrees_of_freedom(self) -> int:
        """
        Readings and priors more than unknowns.
        """
    @property
    def expansion(self) -> list[ExpansionEstimate]:
        """
        Expansion coefficients that were unknowns.
        """
    @property
    def faults(self) -> list[FaultClass]:
        """
        Classes of faults that were found, and what was done about them.
        """
    @property
    def iterations(self) -> int:
        """
        Gauss-Newton steps from zero.
        """
    @property
    def machine_drift(self) -> list[DriftEstimate]:
        """
        Rates of the machine's drift that were unknowns.
        """
    @property
    def normalised_residuals(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        channel -> (n,): residuals by their own standard uncertainty.
        """
    @property
    def outliers(self) -> list[Outlier]:
        """
        Readings that were left out.
        """
    @property
    def redundancy(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        channel -> (n,): 0 where nothing controls a reading, 1 where all others know it better.
        """
    @property
    def reliability(self) -> list[FaultControl]:
        """
        If it was asked for.
        """
    @property
    def residuals(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        channel -> (n,) read minus adjusted, mm or rad, by row of the measurement; NaN where nothing was read.
        """
    @property
    def rounded(self) -> list[RoundedChannel]:
        """
        Channels of which the stated uncertainties are below what their numbers, or double precision, can bear; that took their place.
        """
    @property
    def setup(self) -> list[SetupEstimate]:
        """
        A SetupEstimate for each set-up unknown.
        """
    @property
    def smoothness(self) -> dict[str, float]:
        """
        function -> standard deviation of its second differences (mm or rad) in force.
        """
    @property
    def unseen(self) -> list[UnseenFault]:
        """
        By kind of fault, what may be in it unseen.
        """
    @property
    def used(self) -> dict[str, numpy.typing.NDArray[numpy.bool]]:
        """
        channel -> (n,) whether a reading was used: it was there, and is no outlier.
        """
    @property
    def variance_components(self) -> list[VarianceComponent]:
        """
        VarianceComponent of each channel, and of its lines that scatter otherwise; of what others control.
        """
    @property
    def variance_factor(self) -> float:
        """
        weighted_square_sum/degrees_of_freedom; 1 without freedom.
        """
    @property
    def verdict(self) -> Verdict:
        """
        Whether the readings agree with each other and with the priors.
        """
    @property
    def weighted_square_sum(self) -> float:
        """
        Of residuals and priors.
        """
class KnownByLines:
    """
    What the adjustment of a run of some lines would know.
    """
    @property
    def determined(self) -> list[str]:
        """
        Parameters that are determined as a whole.
        """
    @property
    def largest(self) -> dict[str, float]:
        """
        parameter -> largest standard uncertainty of its values, mm or rad.
        """
    @property
    def volume(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (grid^3,) variances of the functional point's error, summed over X, Y and Z, mm^2, at commanded positions, Z changing fastest; NaN where something that acts there is not determined.
        """
class LineInformation:
    """
    What each line of a run tells of a machine, for comparing thousands of choices of lines with the same settings: known_by() of some of them gives the uncertainties of adjust() within a hundredth or so, in a small part of its time.
    """
    def __init__(self, measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike, options: AdjustmentOptions, *, grid: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Of a run without noise, in which lines visit every node that any line visits. grid: positions of each axis in the grid of KnownByLines. Raises InvalidArgument.
        """
    def add(self, measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], options: AdjustmentOptions) -> None:
        """
        Lines of another run of as many steps, but for those that there are already. Raises InvalidArgument.
        """
    def known_by(self, lines: collections.abc.Sequence[str], scale_lines: collections.abc.Sequence[str]) -> KnownByLines:
        """
        Raises InvalidArgument for a line that no run has.
        """
class FitQuality:
    """
    How well a run fits, and nothing else.
    """
    @property
    def degrees_of_freedom(self) -> int:
        ...
    @property
    def weighted_square_sum(self) -> float:
        ...
class ChangePriors:
    """
    Standard uncertainties with which changes of a machine are known to be 0; 0: there is none of it.
    """
    def __init__(self, *, scale: typing.SupportsFloat | typing.SupportsIndex = 3e-05, bow: typing.SupportsFloat | typing.SupportsIndex = 0.005, slope: typing.SupportsFloat | typing.SupportsIndex = 3e-05, squareness: typing.SupportsFloat | typing.SupportsIndex = 5e-05) -> None:
        """
        scale: Of a positioning deviation, mm/mm.
        bow: Of a straightness, in the middle of the travel, mm.
        slope: Of an angle, from end to end of the travel, rad.
        squareness: rad
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def bow(self) -> float:
        """
        Of a straightness, in the middle of the travel, mm.
        """
    @property
    def scale(self) -> float:
        """
        Of a positioning deviation, mm/mm.
        """
    @property
    def slope(self) -> float:
        """
        Of an angle, from end to end of the travel, rad.
        """
    @property
    def squareness(self) -> float:
        """
        rad
        """
class ChangeTerm:
    """
    How a parameter of the machine has changed.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def determined(self) -> float:
        """
        How much of it the readings determine, 0 to 1: near 1 by itself; in between only in sums.
        """
    @property
    def kind(self) -> str:
        """
        "scale" (mm/mm), "bow" (mm, in the middle), "slope" (rad, from end to end) or "squareness" (rad).
        """
    @property
    def parameter(self) -> str:
        ...
    @property
    def prior(self) -> float:
        """
        Standard uncertainty with which it was known to be 0.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        With the prior.
        """
    @property
    def value(self) -> float:
        ...
class ChangeCombination:
    """
    A sum of changes, by their priors, that readings determine.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def standard_uncertainty(self) -> float:
        """
        Of the readings and the calibration alone.
        """
    @property
    def value(self) -> float:
        """
        In units of the priors.
        """
    @property
    def weight(self) -> list[float]:
        """
        By term; the square sum is 1.
        """
class PredictedReading:
    """
    A reading against what was to be read.
    """
    @property
    def channel(self) -> str:
        """
        "distance", ...
        """
    @property
    def deviation(self) -> float:
        """
        Read minus predicted, mm or rad.
        """
    @property
    def row(self) -> int:
        """
        Of the measurement, from 0.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        Of the deviation.
        """
class Recheck:
    """
    Whether a machine has changed since its calibration, and by what.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def smallest_changes_seen(self, *, alpha: typing.SupportsFloat | typing.SupportsIndex = 0.001, power: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) smallest change of each term, alone, that such readings show with the probability `power` if an unchanged machine is said to have changed with the probability `alpha`; inf where they tell nothing of it. Raises InvalidArgument unless 0 < alpha < power < 1.
        """
    @property
    def chi_square(self) -> float:
        """
        Of no change at all.
        """
    @property
    def combinations(self) -> tuple[ChangeCombination, ...]:
        """
        The best determined first.
        """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, n) of the terms.
        """
    @property
    def degrees_of_freedom(self) -> int:
        """
        Directions of change that the readings tell better than the priors.
        """
    @property
    def fit_chi_square(self) -> float:
        """
        Of all readings, with the change.
        """
    @property
    def fit_degrees_of_freedom(self) -> int:
        """
        Of all readings, with the change.
        """
    @property
    def fit_probability(self) -> float:
        """
        Of a larger one, if such a change, of any size, explains the readings.
        """
    @property
    def left_out(self) -> tuple[FaultClass, ...]:
        """
        A FaultClass for each fault that an adjustment of the run by itself finds, where the readings do not go with the baseline. The readings that they may have spoilt are left out of everything.
        """
    @property
    def misfits(self) -> tuple[PredictedReading, ...]:
        """
        Where no such change explains the readings, a PredictedReading for those that are farthest from the machine with the change, the worst first.
        """
    @property
    def probability(self) -> float:
        """
        Of a larger chi-square, if nothing has changed.
        """
    @property
    def shape(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (entries of the calibration's covariance, n): what a change of 1 of each term adds to them.
        """
    @property
    def terms(self) -> tuple[ChangeTerm, ...]:
        """
        A ChangeTerm for each way in which the machine may change.
        """
    @property
    def updated(self) -> Calibration:
        """
        The calibration with the change, and their joint covariance.
        """
class SeenChanges:
    """
    What a recheck by some lines would know of the changes of a machine.
    """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, n) of the terms, with their priors.
        """
    @property
    def smallest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) smallest change of each term that is seen, as Recheck.smallest_changes_seen.
        """
class ChangesSeen:
    """
    Which changes of a machine short runs would show, before anyone measures: by() of some lines gives the figures of recheck(), for many choices of lines with the same steps.
    """
    def __init__(self, baseline: Calibration, measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike, options: AdjustmentOptions, priors: ChangePriors) -> None:
        """
        Of readings without noise of a machine as the baseline has it, at temperatures that stay, each line measured once. Raises InvalidArgument as recheck.
        """
    def by(self, lines: collections.abc.Sequence[str], scale_lines: collections.abc.Sequence[str], *, repeats: typing.SupportsInt | typing.SupportsIndex = 1, alpha: typing.SupportsFloat | typing.SupportsIndex = 0.001, power: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> SeenChanges:
        """
        SeenChanges of lines of the run, measured `repeats` times. Raises InvalidArgument, also where so few readings would tell nothing of the machine.
        """
    @property
    def shape(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        As Recheck.shape.
        """
    @property
    def terms(self) -> tuple[ChangeTerm, ...]:
        """
        A ChangeTerm for each way in which the machine may change; their values are not estimated.
        """
class LineDeviation:
    """
    Deviation of the length of a line of one run from end to end.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def deviation(self) -> float:
        """
        Read minus predicted, mm; of beams their mean.
        """
    @property
    def direction(self) -> str:
        """
        "forward" or "backward".
        """
    @property
    def line(self) -> str:
        """
        Such as "ppp".
        """
    @property
    def normalised(self) -> float:
        """
        E_n: the deviation by its expanded uncertainty (k = 2).
        """
    @property
    def run(self) -> int:
        """
        Of the line, from 0.
        """
    @property
    def standard_uncertainty(self) -> float:
        """
        Of the deviation, mm.
        """
class Verification:
    """
    How readings agree with a calibration that was made without them.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def chi_square(self) -> float:
        """
        Of all deviations.
        """
    @property
    def degrees_of_freedom(self) -> int:
        """
        Of chi_square.
        """
    @property
    def deviations(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        channel -> (n,) read minus predicted, mm or rad, by row of the measurement; NaN where nothing was read.
        """
    @property
    def left_out(self) -> tuple[FaultClass, ...]:
        """
        A FaultClass for each fault that an adjustment of the run by itself finds, where the readings do not agree. The readings that they may have spoilt are left out of everything.
        """
    @property
    def lines(self) -> tuple[LineDeviation, ...]:
        """
        A LineDeviation for each pass of a line that has two distances.
        """
    @property
    def normalised(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        channel -> (n,) E_n: deviations by their expanded uncertainties (k = 2); 0 for a reading that only shows how head and mirror stood.
        """
    @property
    def probability(self) -> float:
        """
        Of a larger chi-square, if calibration, readings and uncertainties are right.
        """
    @property
    def standard_uncertainties(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        channel -> (n,): of the deviations.
        """
    @property
    def worst(self) -> tuple[int, str]:
        """
        Row and channel of the reading with the largest |E_n|.
        """
class CalibrationEntry:
    """
    A value of a calibration's tables.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def parameter(self) -> str:
        """
        "EXX", ..., "C0Y"
        """
    @property
    def position(self) -> float:
        """
        mm; NaN for a squareness
        """
class BatchEvaluator:
    """
    One evaluation of many sets of readings of the same plan, heads and pattern of readings; what is known of the pattern serves all of them.
    """
    def __init__(self, pattern: Measurement, plan: Plan, heads: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), *, method: str = 'enhanced', options: AdjustmentOptions | None = None, **kwargs: typing.Any) -> None:
        """
        pattern: a run whose readings are there; lost ones are not used in any set. method: "conventional", "enhanced", "adjustment" (each set converged to 1e-4 of its values' standard uncertainties, without a search for outliers) or "one_step" (the pattern's values plus gain times what differs: off by terms of second order). The options are AdjustmentOptions, or its fields by name: full_covariance and plausible concern the pattern alone, an outlier_probability other than 0 or the default and scale_uncertainty are refused; linear methods take the uncertainty alone. Raises InvalidArgument.
        """
    def evaluate(self, readings: numpy.typing.ArrayLike, threads: typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, entries), mm and rad, from readings (n, rows of the pattern, channels); NaN for a set with a lost reading or without a solution. A set gives the same bits whatever stands beside it. threads: 0 for all cores. Raises InvalidArgument.
        """
    def gain(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (entries, rows, channels): d value / d reading at the pattern.
        """
    @property
    def calibration(self) -> Calibration:
        """
        The evaluation of the pattern, with standard uncertainties.
        """
    @property
    def channels(self) -> list[str]:
        """
        Of a set of readings.
        """
    @property
    def entries(self) -> list[CalibrationEntry]:
        """
        The values that a set of readings gives: functions EXX ... ECZ, nodes ascending, then squarenesses.
        """
class Output:
    """
    An output of a sample model. Native units.
    """
    def __repr__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def position(self) -> float:
        """
        mm; NaN where it has none.
        """
    @property
    def unit(self) -> str:
        """
        "mm", "rad", "1"
        """
class SampleModel:
    """
    A measurement model as the Monte Carlo method sees it (JCGM 101, 5.9): outputs of sample after sample, each a pure function of the seed and the sample's index.
    """
    def evaluate(self, first_sample: typing.SupportsIndex, samples: typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        Array (outputs, samples); NaN in all outputs of a sample that gave no result. Raises InvalidArgument.
        """
    @property
    def outputs(self) -> list[Output]:
        """
        With name, position (mm) and unit.
        """
    @property
    def seed(self) -> int:
        """
        Of the random numbers.
        """
    @property
    def target(self) -> str:
        """
        The instruction set, for which the bits of a sample are the same.
        """
class Distribution:
    """
    A distribution that JCGM 101 (6.4) assigns to an input quantity: "normal" (spread: standard deviation), "rectangular", "triangular", "arcsine" (half width), "t" (scale; degrees_of_freedom), "curvilinear_trapezoid" (half width, known to plus and minus edge only).
    """
    def __init__(self, kind: str = 'normal', *, spread: typing.SupportsFloat | typing.SupportsIndex, expectation: typing.SupportsFloat | typing.SupportsIndex = 0.0, degrees_of_freedom: typing.SupportsFloat | typing.SupportsIndex = ..., edge: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        degrees_of_freedom of a kind other than t: those of its standard uncertainty (GUM G.4). Raises InvalidArgument for a spread below 0, an edge not between 0 and the half width, degrees of freedom not above 0 (t: 2).
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def degrees_of_freedom(self) -> float:
        ...
    @property
    def edge(self) -> float:
        ...
    @property
    def expectation(self) -> float:
        """
        In the unit of the input.
        """
    @property
    def kind(self) -> str:
        ...
    @property
    def spread(self) -> float:
        ...
    @property
    def standard_uncertainty(self) -> float:
        """
        In the unit of the input.
        """
class FunctionModel(SampleModel):
    """
    A model given as a function of its inputs.
    """
    def __init__(self, function: collections.abc.Callable[[numpy.typing.NDArray[numpy.float64]], typing.Any], distributions: collections.abc.Sequence[Distribution], outputs: collections.abc.Sequence[str], *, seed: typing.SupportsIndex = 0, correlations: collections.abc.Sequence[tuple[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], numpy.typing.ArrayLike]] = []) -> None:
        """
        function: takes an (inputs, n) array, gives an (outputs, n) array; a sample with a value that is not finite is lost. correlations: pairs of indices of normal inputs and their correlation matrix. Raises InvalidArgument.
        """
class StatisticsOptions:
    """
    What a Monte Carlo run is to find out of its samples. make_bins checks it.
    """
    def __init__(self, *, coverage: typing.SupportsFloat | typing.SupportsIndex = 0.95, digits: typing.SupportsIndex = 2, covariance: bool = False, kept: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], joint: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]] = []) -> None:
        """
        coverage: Of intervals.
        digits: Of standard uncertainties that matter, 1 to 3; bins are a fifth of delta wide (JCGM 101, 7.9.2).
        covariance: Of all outputs.
        kept: Outputs of which every value is kept, 8 bytes each.
        joint: Sets of one to three outputs that get joint coverage regions (JCGM 102, 6.5).
        """
    @property
    def covariance(self) -> bool:
        """
        Of all outputs.
        """
    @property
    def coverage(self) -> float:
        """
        Of intervals.
        """
    @property
    def digits(self) -> int:
        """
        Of standard uncertainties that matter, 1 to 3; bins are a fifth of delta wide (JCGM 101, 7.9.2).
        """
    @property
    def joint(self) -> list[list[int]]:
        """
        Sets of one to three outputs that get joint coverage regions (JCGM 102, 6.5).
        """
    @property
    def kept(self) -> list[int]:
        """
        Outputs of which every value is kept, 8 bytes each.
        """
class Bins:
    """
    What all parts of one Monte Carlo run share, fixed by its pilot run.
    """
    @staticmethod
    def from_bytes(bytes: bytes) -> Bins:
        """
        Raises InvalidArgument for damaged bytes.
        """
    def to_bytes(self) -> bytes:
        ...
    @property
    def counts(self) -> int:
        """
        Bins of all outputs: 6 bytes each, for every thread.
        """
    @property
    def options(self) -> StatisticsOptions:
        ...
    @property
    def outputs(self) -> list[Output]:
        ...
    @property
    def seed(self) -> int:
        ...
    @property
    def target(self) -> str:
        ...
class JointRegion:
    """
    A region of up to three outputs that holds the coverage (JCGM 102, 6.5): an ellipsoid and a rectangle about the pilot run's mean, of its covariance's shape, and the smallest region made of cells of a grid.
    """
    @property
    def centre(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def ellipsoid_factor(self) -> float:
        """
        k_p: (y - centre) covariance^-1 (y - centre) <= k_p^2; nan for a singular covariance
        """
    @property
    def ellipsoid_volume(self) -> float:
        ...
    @property
    def grid_from(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def grid_width(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def outputs(self) -> list[int]:
        ...
    @property
    def rectangle_factor(self) -> float:
        """
        k_q: |y_j - centre_j| <= k_q u_j
        """
    @property
    def rectangle_volume(self) -> float:
        ...
    @property
    def smallest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        1 for each cell of the grid that is in the smallest region
        """
    @property
    def smallest_share(self) -> float:
        """
        of all samples
        """
    @property
    def smallest_volume(self) -> float:
        ...
class Stability:
    """
    How far an adaptive procedure is from its end.
    """
    @property
    def blocks(self) -> int:
        ...
    @property
    def figure(self) -> str:
        ...
    @property
    def output(self) -> int:
        ...
    @property
    def ratio(self) -> float:
        """
        Twice the standard deviation of the average over blocks by delta, the largest of all.
        """
    @property
    def stable(self) -> bool:
        ...
    @property
    def unstable(self) -> int:
        """
        Outputs with a ratio above 1.
        """
class MonteCarloResult:
    """
    Figures of every output. Native units.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
    @property
    def highest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (outputs,) of all samples
        """
    @property
    def joint(self) -> list[JointRegion]:
        """
        A JointRegion for each group that was asked for.
        """
    @property
    def kept(self) -> dict[int, numpy.typing.NDArray[numpy.float64]]:
        """
        Values by output, in the order of samples; nan for a lost one.
        """
    @property
    def lost(self) -> int:
        """
        Samples that gave none: left out.
        """
    @property
    def lowest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (outputs,) of all samples
        """
    @property
    def mean(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (outputs,)
        """
    @property
    def options(self) -> StatisticsOptions:
        """
        The StatisticsOptions of the run.
        """
    @property
    def outputs(self) -> list[Output]:
        """
        With name, position (mm) and unit.
        """
    @property
    def outside(self) -> list[int]:
        """
        Values beyond the bins, by output: an interval's end among them is known roughly.
        """
    @property
    def samples(self) -> int:
        """
        Samples that gave a result.
        """
    @property
    def seed(self) -> int:
        """
        Of the random numbers.
        """
    @property
    def shortest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (outputs, 2): ends of the shortest coverage intervals
        """
    @property
    def stability(self) -> Stability | None:
        """
        Of an adaptive run; else None.
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def symmetric(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (outputs, 2): ends of the probabilistically symmetric coverage intervals
        """
    @property
    def target(self) -> str:
        """
        The instruction set: the same bits for the same one.
        """
class PartialStatistics:
    """
    Statistics of a set of leaves of 2,000 samples.
    """
    @staticmethod
    def from_bytes(bytes: bytes) -> PartialStatistics:
        """
        Raises InvalidArgument for damaged bytes.
        """
    def __init__(self, bins: Bins) -> None:
        """
        Of no leaves.
        """
    def merge(self, other: PartialStatistics) -> None:
        """
        Raises InvalidArgument for statistics of another run, saying in what, and for leaves that are in both.
        """
    def result(self) -> MonteCarloResult:
        ...
    def run(self, model: SampleModel, first_leaf: typing.SupportsIndex, leaves: typing.SupportsIndex, *, threads: typing.SupportsIndex = 0, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> None:
        """
        Adds these leaves, as run_leaves computes them. Those that are done stay also where progress ends the run, by False or by an exception. progress may not use these statistics.
        """
    def to_bytes(self) -> bytes:
        ...
    @property
    def bins(self) -> Bins:
        ...
    @property
    def leaves(self) -> list[tuple[int, int]]:
        """
        Half-open ranges, ascending.
        """
    @property
    def lost(self) -> int:
        ...
    @property
    def samples(self) -> int:
        ...
class AdaptiveProcedure:
    """
    JCGM 101, 7.9.4: blocks of M samples until mean, standard uncertainty and both ends of the symmetric interval of every output are stable to delta.
    """
    @staticmethod
    def from_bytes(bytes: bytes) -> AdaptiveProcedure:
        """
        Raises InvalidArgument for damaged bytes.
        """
    @staticmethod
    def leaves_per_block(coverage: typing.SupportsFloat | typing.SupportsIndex) -> int:
        ...
    def __init__(self, bins: Bins) -> None:
        ...
    def add(self, block: PartialStatistics, all: PartialStatistics) -> None:
        """
        The next block, which is also merged into `all`. Raises InvalidArgument for what is not the next block.
        """
    def result(self, all: PartialStatistics) -> MonteCarloResult:
        """
        That of `all`, with its stability.
        """
    def stability(self, all: PartialStatistics) -> Stability:
        """
        all: the statistics of all blocks so far.
        """
    def to_bytes(self) -> bytes:
        ...
    @property
    def blocks(self) -> int:
        ...
    @property
    def next_block(self) -> tuple[int, int]:
        """
        Its leaves, half-open.
        """
class UncertainQuantity:
    """
    What may be uncertain about a virtual calibration.
    """
    def count(self, beams: typing.SupportsInt | typing.SupportsIndex) -> int:
        """
        Of components, with so many beams.
        """
    @property
    def key(self) -> str:
        """
        In scenarios, with its unit; empty: it has others.
        """
    @property
    def layout(self) -> str | None:
        """
        The only layout of heads that has it.
        """
    @property
    def name(self) -> str:
        ...
    @property
    def of(self) -> str:
        """
        "line", "part" (of the head), "head", "air", "machine" or "noise".
        """
class UncertainInput:
    """
    An input quantity that is drawn once for each virtual calibration, as a deviation added to what is nominal.
    """
    def __init__(self, quantity: str, distribution: Distribution, *, line: str = '', part: str = '', component: typing.SupportsIndex = 0) -> None:
        """
        quantity: One of setup_quantities(), of a line (component 0, 1: a, b or x, y); "part_shift" (mm), "part_rotation" (rad): of a part of the head; "psd_distance", "beam_offset" (mm), "reading_model" (1): of the head; "temperature" (degrees Celsius), "pressure" (Pa), "humidity" (1), "refractive_index", "wavelength" (1, relative): of the air; "machine_drift" (mm/s, x, y, z).
        distribution: Of the deviation from the nominal value, mm, rad or the quantity's unit.
        line: 
        part: 
        component: 
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def component(self) -> int:
        ...
    @property
    def distribution(self) -> Distribution:
        """
        Of the deviation from the nominal value, mm, rad or the quantity's unit.
        """
    @property
    def line(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        With its line, component and part.
        """
    @property
    def part(self) -> str:
        ...
    @property
    def quantity(self) -> str:
        """
        One of setup_quantities(), of a line (component 0, 1: a, b or x, y); "part_shift" (mm), "part_rotation" (rad): of a part of the head; "psd_distance", "beam_offset" (mm), "reading_model" (1): of the head; "temperature" (degrees Celsius), "pressure" (Pa), "humidity" (1), "refractive_index", "wavelength" (1, relative): of the air; "machine_drift" (mm/s, x, y, z).
        """
class ReadingNoise:
    """
    What is drawn for every reading or pose.
    """
    def __init__(self, quantity: str, distribution: Distribution, *, channel: str = '', component: typing.SupportsIndex = 0) -> None:
        """
        quantity: "channel" (of the channel named), "common" (mm, one draw a reading for all its distances), "head_walk", "machine_walk" (mm/sqrt(s), random walks), "position" (mm), "orientation" (rad): repeatability of the machine, component x, y, z.
        distribution: Of each draw, mm or rad.
        channel: 
        component: 
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def channel(self) -> str:
        ...
    @property
    def component(self) -> int:
        ...
    @property
    def distribution(self) -> Distribution:
        """
        Of each draw, mm or rad.
        """
    @property
    def name(self) -> str:
        """
        With its line and component.
        """
    @property
    def quantity(self) -> str:
        """
        "channel" (of the channel named), "common" (mm, one draw a reading for all its distances), "head_walk", "machine_walk" (mm/sqrt(s), random walks), "position" (mm), "orientation" (rad): repeatability of the machine, component x, y, z.
        """
class UncertainInputs:
    """
    What is uncertain about a virtual calibration.
    """
    def __init__(self, inputs: collections.abc.Sequence[UncertainInput] = [], noise: collections.abc.Sequence[ReadingNoise] = [], correlations: collections.abc.Sequence[tuple[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], numpy.typing.ArrayLike]] = []) -> None:
        """
        correlations: pairs of indices of normal inputs and their correlation matrix. Raises InvalidArgument for an input given twice, a line, part or component that its quantity does not have, a matrix that is no correlation.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def correlations(self) -> list[tuple[list[int], numpy.typing.NDArray[numpy.float64]]]:
        ...
    @property
    def inputs(self) -> list[UncertainInput]:
        ...
    @property
    def noise(self) -> list[ReadingNoise]:
        """
        A ReadingNoise for each.
        """
class DerivedOutput:
    """
    A linear combination of a calibration's entries, as an output of virtual calibrations.
    """
    @typing.overload
    def __init__(self, name: str, unit: str, row: numpy.typing.ArrayLike) -> None:
        """
        row: coefficients by entry, in the order of Calibration.covariance_labels. A tuple of the three does as well where one is expected.
        """
    @typing.overload
    def __init__(self, arg0: tuple[str, str, numpy.typing.ArrayLike]) -> None:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def row(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def unit(self) -> str:
        ...
class ErrorAtPoint:
    """
    The deviations X, Y, Z (mm) of the functional point and A, B, C (rad) of the tool at a commanded point, to first order, with covariance from the calibration's. NaN where the calibration lacks something that acts there.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (6, 6) mm^2, mm rad, rad^2; NaN where the calibration has none.
        """
    @property
    def missing(self) -> dict[str, list[str]]:
        """
        "X" ... "C" -> parameters that act in it and are not determined: "EAX", "slope of EXX".
        """
    @property
    def point(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) mm
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (6,) mm, rad; NaN where the calibration has no covariance.
        """
    @property
    def tool(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) mm
        """
    @property
    def value(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (6,) mm, rad
        """
class DiagonalErrors:
    """
    Along a body diagonal (ISO 230-6): how much further than commanded the functional point is from where the diagonal begins.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, n) mm^2
        """
    @property
    def line(self) -> str:
        """
        The body diagonal: "ppp", ...
        """
    @property
    def missing(self) -> list[str]:
        """
        Parameters that are not determined.
        """
    @property
    def point(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 3) mm, commanded
        """
    @property
    def range(self) -> float:
        """
        Largest less smallest value, mm; its uncertainty: volumetric_accuracy.
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) mm; NaN where the calibration has no covariance.
        """
    @property
    def travel(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) mm, commanded, from the first point
        """
    @property
    def value(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,) mm; NaN where the calibration lacks something.
        """
class VolumetricAccuracy:
    """
    ISO 230-1's V_XYZ: the ranges over the volume of the deviations X, Y, Z (mm) of the functional point and A, B, C (rad) of the tool, and the ranges of the four body diagonals' errors (mm); in the order of `names`. A range is not linear in the parameters and noise makes it larger: `bias` says about how much larger `value` is than the true range; `interval` takes that off.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10,) mean - value
        """
    @property
    def bound(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10,) the true range is within value -+ bound with at least the coverage probability: the quantile of the range of noise alone.
        """
    @property
    def drawn_interval(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10, 2) probabilistically symmetric coverage interval of the draws: too large by twice the bias.
        """
    @property
    def interval(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10, 2) the drawn interval mirrored about the value, 2 value - drawn_interval: takes the bias off to first order; not below 0.
        """
    @property
    def mean(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10,) of the draws.
        """
    @property
    def missing(self) -> dict[str, list[str]]:
        """
        Name -> parameters that act in it and are not determined; its numbers are NaN.
        """
    @property
    def names(self) -> typing.Annotated[list[str], "FixedSize(10)"]:
        ...
    @property
    def resolution(self) -> float:
        """
        By how much V_X, V_Y, V_Z may be too small on either side for want of points between the nodes of axes that carry the workpiece, mm; 0 with one such axis.
        """
    @property
    def samples(self) -> int:
        """
        Draws of the covariance.
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10,) standard deviation of the draws.
        """
    @property
    def value(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (10,) of the calibration's values.
        """
class RangeModel(SampleModel):
    """
    The ranges of VolumetricAccuracy as a model for the Monte Carlo method; those that something is missing for are no outputs.
    """
    def __init__(self, calibration: Calibration, *, tool: numpy.typing.ArrayLike | None = None, seed: typing.SupportsIndex = 0) -> None:
        """
        Raises InvalidArgument for a calibration without covariance.
        """
class VolumeSummary:
    """
    Errors e of the functional point (mm) and tilts of the tool (rad) on a grid, by the exact pose, of axes that came in + direction.
    """
    @property
    def components(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) e there, mm
        """
    @property
    def highest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of e by component, mm
        """
    @property
    def largest(self) -> float:
        """
        Largest |e|, mm.
        """
    @property
    def largest_at(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) where, mm
        """
    @property
    def lowest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of e by component, mm
        """
    @property
    def rms(self) -> float:
        """
        Root of the mean of |e|^2 over the box, by the trapezoidal rule, mm.
        """
    @property
    def tilt_highest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) A, B, C, rad
        """
    @property
    def tilt_lowest(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) A, B, C, rad
        """
class VolumeDraws:
    """
    Draws of figures over a volume from the joint normal distribution of a calibration's values, to first order.
    """
    @staticmethod
    def names() -> list[str]:
        """
        Columns of draw, without the last five.
        """
    def __init__(self, calibration: Calibration, x: numpy.typing.ArrayLike, y: numpy.typing.ArrayLike, z: numpy.typing.ArrayLike, *, tool: numpy.typing.ArrayLike | None = None, seed: typing.SupportsIndex = 0) -> None:
        """
        On the grid of all combinations of these ascending positions (mm). Raises InvalidArgument for a calibration without covariance.
        """
    def draw(self, first: typing.SupportsIndex, count: typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        (count, 20) mm and rad, of the draws first, first + 1, ...: the same bits on any number of threads. The last five columns are of the place and the direction of the draw's largest error: the calibration's error e there along that direction, the length of e less what was drawn there, the standard uncertainty of e along the direction, and the traces of its covariance V and of V V.
        """
    @property
    def values(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (20,) as a draw, of the calibration's own values, of which nothing is drawn.
        """
class VirtualCalibrations(SampleModel):
    """
    Whole virtual calibrations: a run with drawn inputs and reading noise, traced by replay and evaluated with the unperturbed calibration. Outputs are the values of the calibration's tables, then those derived.
    """
    def __init__(self, machine: Machine, plan: Plan, heads: Head | collections.abc.Mapping[str, Head], inputs: UncertainInputs, *, calibration_heads: Head | collections.abc.Mapping[str, Head] | None = None, method: str = 'enhanced', seed: typing.SupportsIndex = 0, derived: collections.abc.Sequence[DerivedOutput] = [], simulation: SimulationOptions | None = None, adjustment: AdjustmentOptions | None = None, **kwargs: typing.Any) -> None:
        """
        simulation: SimulationOptions as of simulate(); of their noise nothing is used, it is among the inputs. calibration_heads: what the evaluation knows the heads as (none: the heads). method: "conventional", "enhanced", "adjustment" or "one_step". adjustment: AdjustmentOptions as of BatchEvaluator. The fields of both may be given by name instead. verified_share: of the samples, in each of which one reading of every line is traced again. derived: as derived_at_point gives them, or (name, unit, coefficients of the values of the tables). Raises InvalidArgument.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def evaluate_at(self, deviations: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        (outputs, n) for given deviations (inputs, n) of the inputs, without reading noise. Raises InvalidArgument.
        """
    def readings(self, sample: typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        (rows, channels) of one sample, with noise; NaN where lost.
        """
    @property
    def calibration(self) -> Calibration:
        """
        The evaluation of `nominal`.
        """
    @property
    def count(self) -> dict[str, int]:
        """
        Samples so far: replayed, traced as a whole, and of the replayed ones verified.
        """
    @property
    def in_lanes(self) -> bool:
        """
        Whether samples are replayed, many at once; else each pose of each is traced: cameras, coupled modes, sensors with noise or resolution of their own, faces near a beam's way.
        """
    @property
    def nominal(self) -> Measurement:
        """
        The run with every input at its expectation, without noise.
        """
class Propagation:
    """
    Uncertainty of outputs by the law of propagation (GUM, JCGM 100), native units; arrays in the order of `outputs`.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def expanded(self, coverage: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) U = t_p u, of degrees of freedom truncated to whole ones (GUM G.4.1, G.6.4). Raises InvalidArgument for a probability outside 0 .. 1.
        """
    @property
    def between_groups(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) part of the variance by correlation between inputs of two groups.
        """
    @property
    def budget(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        group of inputs -> (m,) standard uncertainty of each output by that group alone; with between_groups, the squares sum to the square of standard_uncertainty.
        """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        (m, m); None unless asked for.
        """
    @property
    def degrees_of_freedom(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) effective ones by Welch and Satterthwaite (GUM G.4.1); NaN where that does not apply: correlated inputs with finite degrees of freedom contribute.
        """
    @property
    def first_order(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m, inputs) sensitivity x standard uncertainty.
        """
    @property
    def inputs(self) -> list[str]:
        """
        Names of the inputs that are drawn once: columns of first_order and second_order.
        """
    @property
    def knows_products(self) -> bool:
        """
        Whether strongest_product, product_variance and product_shift are known: of virtual calibrations with up to 120 inputs.
        """
    @property
    def outputs(self) -> list[Output]:
        ...
    @property
    def product_shift(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) by how much products of correlated inputs shift the mean; empty where not known.
        """
    @property
    def product_variance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) variance by products of two independent inputs; empty where not known.
        """
    @property
    def second_order(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m, inputs) what the square of a deviation by the standard uncertainty does, (f(+u) + f(-u) - 2 f(0))/2; linear propagation leaves it out. 0 where not known.
        """
    @property
    def second_order_shift(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) by how much squares of deviations, and products of correlated ones, shift the mean.
        """
    @property
    def second_order_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) standard uncertainty with the squares and products of normal, independent inputs.
        """
    @property
    def standard_uncertainty(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,)
        """
    @property
    def strongest_product(self) -> list[tuple[str, str, float]]:
        """
        Of each output the two inputs whose product does most when both deviate by their standard uncertainty, and what it does; empty where not known.
        """
    @property
    def value(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,)
        """
class Validation:
    """
    Propagation beside the Monte Carlo method (JCGM 101, 8), arrays in the order of `outputs`, native units: validated where neither end of y -+ U is further than delta from that of the symmetric coverage interval.
    """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    @property
    def coverage(self) -> float:
        """
        Of the intervals.
        """
    @property
    def d_high(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) |y + U - y_high|
        """
    @property
    def d_low(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) |y - U - y_low|
        """
    @property
    def delta(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) half a unit of the last significant digit of u.
        """
    @property
    def digits(self) -> int:
        """
        Significant digits of u that the tolerance comes from.
        """
    @property
    def failures(self) -> int:
        """
        How many outputs are not validated.
        """
    @property
    def high(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) y + U
        """
    @property
    def low(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) y - U
        """
    @property
    def outputs(self) -> list[Output]:
        """
        With name, position (mm) and unit.
        """
    @property
    def reason(self) -> list[str]:
        """
        Where it is not validated, why: which square or distribution, with figures; empty elsewhere.
        """
    @property
    def sampling(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (m,) standard uncertainty of the Monte Carlo interval's ends by the number of samples; should be small beside delta.
        """
    @property
    def validated(self) -> list[bool]:
        ...
class Compensator:
    """
    Volumetric compensation as a controller does it (the C++ library stepdiag::controller): forward(c) = c + error(c) is where the tool is when the axes stand at c, command(t) where they must stand for it to be at t. Positions (n, 3) are axis positions in the controller's coordinates, mm; tool: offset of the functional point (3,), mm, by default that of the calibration; temperature: of the scales of X, Y, Z (3,), degrees Celsius, by default none: the error is that of the table. NaN where there is no answer: outside with "refuse", beyond the margin, a position that is not finite, a tool longer than largest_tool, a temperature outside `temperatures`.
    """
    def __init__(self, table: str | os.PathLike[str] | Calibration | ErrorMap, chain: Chain | str, *, origin: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), outside: str = 'hold', margin: typing.SupportsFloat | typing.SupportsIndex = 0.0, largest_correction: typing.SupportsFloat | typing.SupportsIndex = 1.0, approach: str = 'mean', largest_tool: typing.SupportsFloat | typing.SupportsIndex = 1000.0, accept_rejected: bool = False, accept_unverified: bool = False, temperatures: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"] | None = None) -> None:
        """
        table: a file, a Calibration or an ErrorMap that carries chain, volume and tool. chain: the controller's. origin: home in the controller's coordinates. outside the calibrated volume: "hold" the error of its nearest point, go on "linear" up to `margin`, or "refuse". largest_correction: command and forward shorten a longer error to this length. approach: "mean", "positive" or "negative", of a table with reversal. accept_rejected: take a table whose fit was rejected. accept_unverified: take a calibration whose checksum was absent when it was read. temperatures: lowest and highest of a scale that calls may state, degrees Celsius; needs a table that is referred to a temperature by a known expansion. Warns (UserWarning) of a fit that is not accepted, and of an unverified table. Raises InvalidArgument for a table or options that a controller should not use.
        """
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> str:
        ...
    def command(self, targets: numpy.typing.ArrayLike, tool: numpy.typing.ArrayLike | None = None, temperature: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Where the axes must stand (n, 3), mm, for the tool to be at the targets (n, 3).
        """
    def error(self, positions: numpy.typing.ArrayLike, tool: numpy.typing.ArrayLike | None = None, temperature: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Error of the functional point (n, 3), mm: exact, and the whole of it where corrections are capped.
        """
    def forward(self, commands: numpy.typing.ArrayLike, tool: numpy.typing.ArrayLike | None = None, temperature: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Where the tool is (n, 3), mm, when the axes stand at the commands (n, 3).
        """
    def orientation(self, positions: numpy.typing.ArrayLike, tool: numpy.typing.ArrayLike | None = None, temperature: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Rotation vectors of the tool (n, 3), rad.
        """
    def status(self, positions: numpy.typing.ArrayLike, tool: numpy.typing.ArrayLike | None = None, temperature: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.int32]:
        """
        Of the error at positions (n, 3): 0, or the sum of 1 outside the volume, 2 longer than largest_correction, 4 refused, 16 (with 4) a temperature that is not taken; shape (n,).
        """
    @property
    def fingerprint(self) -> int:
        """
        The table in force: a hash of chain, volume, tool, nodes, values and expansion, 64 bit.
        """
    @property
    def fit(self) -> str | None:
        """
        Verdict of the table's fit: "accepted", "doubtful", "rejected", "unchecked"; None where it has none.
        """
    @property
    def inverse_bound(self) -> float:
        """
        |forward(command(t)) - t| never exceeds this, mm.
        """
    @property
    def temperature_reference(self) -> float | None:
        """
        Temperature of the scales at which they add nothing, degrees Celsius; None: none may be stated.
        """
    @property
    def tool(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Of the calibration, mm.
        """
    @property
    def uncompensated(self) -> list[str]:
        """
        What the table does not tell: "EXX", "EYX (slope)", "EXX (above 784.0 mm)" ...
        """
    @property
    def unverified(self) -> bool:
        """
        Whether the table is a calibration whose checksum was absent when it was read.
        """
    @property
    def volume(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
def adjust(measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), options: AdjustmentOptions | None = None, **kwargs: typing.Any) -> Adjustment:
    """
    The exact adjustment of all readings of a run, with the set-up of every line among the unknowns. The options are AdjustmentOptions, or its fields by name. Findings are data; methods.adjust gives them in words, too. Raises InvalidArgument.
    """
def beam_radius(mode: GaussianMode, reduced_length: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Radius (1/e^2 of power, mm) of a beam after a reduced length (sum of t/n, mm) from the collimator's plane.
    """
def check_points(measurement: Measurement, plan: Plan) -> None:
    """
    Raises InvalidArgument for a row whose point the plan does not have, or has more than 1 um elsewhere.
    """
def choose_instruction_set(name: str) -> None:
    """
    For the whole process, from now on; by default the fastest is in use. Raises InvalidArgument.
    """
def compare(propagation: Propagation, monte_carlo: MonteCarloResult, *, digits: typing.SupportsIndex | None = None) -> Validation:
    """
    Validates propagation by the Monte Carlo method at the coverage probability of the latter; digits of u that matter, 1 to 3 (none: those of the Monte Carlo result). Raises InvalidArgument for results of other outputs.
    """
def couple(mode: GaussianMode, beam: ReturnedBeam, index: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> tuple[float, float]:
    """
    Round trip as the fibre's phase has it (mm) and share of the light that couples: the overlap integral of the returned beam with the mode in a medium of this index, in closed form (Joyce and DeLoach, Appl. Opt. 23 (1984) 4187); the phase that an aligned beam gains by diffraction is taken off.
    """
def cramer_rao_bound(camera: Camera, spot: BeamSpot) -> float:
    """
    Smallest standard deviation (mm) of the spot's x that an unbiased estimate can have with position, radius, brightness and background unknown (Winick, J. Opt. Soc. Am. A 3 (1986) 1809); 0 without noise, inf where x is not observable.
    """
def derived_at_point(calibration: Calibration, point: numpy.typing.ArrayLike, *, tool: numpy.typing.ArrayLike | None = None) -> list[DerivedOutput]:
    """
    The deviations of error_at_point as outputs of virtual calibrations with entries like this calibration's: up to six, those that nothing is missing for.
    """
def derived_on_diagonals(calibration: Calibration, *, tool: numpy.typing.ArrayLike | None = None) -> list[DerivedOutput]:
    """
    The values of diagonal_errors as outputs of virtual calibrations, those that nothing is missing for.
    """
def diagonal_errors(calibration: Calibration, *, tool: numpy.typing.ArrayLike | None = None) -> dict[str, DiagonalErrors]:
    """
    Of the body diagonals "ppp", "npp", "pnp", "nnp". tool: offset (mm); none: the calibration's. Raises InvalidArgument for an offset that is not finite.
    """
def drawn_inputs(inputs: UncertainInputs, seed: typing.SupportsIndex, sample: typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
    """
    Deviations of one sample's inputs, in their order. Raises InvalidArgument.
    """
def error_at_point(calibration: Calibration, point: numpy.typing.ArrayLike, *, tool: numpy.typing.ArrayLike | None = None) -> ErrorAtPoint:
    """
    The error at a commanded point (mm) with a tool offset (mm; none: the calibration's), of axes that came in + direction: e = sum over axes of delta + theta x lever. Raises InvalidArgument for lengths that are not finite.
    """
def error_changes_at(calibration: Calibration, points: numpy.typing.ArrayLike, changes: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    How errors_at change with the values of a calibration, to first order, (6 n, k), mm and rad, six rows a point: for changes (entries, k) of all its entries in the order of the covariance; NaN where a parameter is missing. Raises InvalidArgument.
    """
def error_uncertainties_at(calibration: Calibration, points: numpy.typing.ArrayLike, *, tool: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float64]:
    """
    Standard uncertainties of errors_at from the covariance of a calibration, (n, 6), mm and rad; NaN where a parameter is missing. Raises InvalidArgument without a covariance.
    """
def errors_at(machine: Machine, points: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Error of the functional point (mm) and rotation vector of the tool (rad) at commanded points (n, 3), mm: (n, 6), exact, of axes that came in + direction.
    """
def evaluate(measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), *, method: str, uncertainty: ReadingUncertainty = ..., full_covariance: bool = False, plausible: PlausibleLimits = ..., expansion: KnownExpansion | None = None) -> Calibration:
    """
    Calibration from a run by a linear method; findings are data, methods.evaluate gives them in words, too.
    """
def expose(camera: Camera, spots: collections.abc.Sequence[BeamSpot], *, seed: typing.SupportsIndex = 0, counter: typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Image in electrons, shape (rows, columns), pixel (0, 0) at the lowest x and y; the array is centred on the sensor's origin. The noise depends on seed and counter alone. Raises InvalidArgument for a seed outside 0 .. 2^64 - 1.
    """
def fit_quality(measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike, options: AdjustmentOptions, most_steps: typing.SupportsInt | typing.SupportsIndex) -> FitQuality | None:
    """
    How well a run fits, without search for faults and without uncertainties, in a tenth of the time of adjust: the least square sum that so many plain steps of Gauss-Newton meet; None where no number comes out. Raises InvalidArgument.
    """
def head_sensitivities(head: Head, *, distance: typing.SupportsFloat | typing.SupportsIndex, tilt: numpy.typing.ArrayLike = (0.0, 0.0), lateral: numpy.typing.ArrayLike = (0.0, 0.0), environment: Environment | None = None) -> list[Sensitivity]:
    """
    Derivatives of a traced head's readings by the six degrees of freedom of every component (along the head's axes, rotations about its own origin) and of the mirror, by indices, and by the state of the air: exact, by forward mode through the replay. Raises InvalidArgument where a beam is lost.
    """
def in_recorded_air(measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], assumed_environment: Environment) -> Measurement:
    """
    The run of an instrument that counted with the constant index of the assumed air, with distances in the air that the run's channels air_temperature, air_pressure and air_humidity recorded. Raises InvalidArgument for a run without any of them, a quantity that nothing states, and air out of the equation's range.
    """
def instruction_set() -> str:
    """
    The instruction set of this processor that is in use, such as "AVX3": traces and random numbers have the same bits for the same one.
    """
def instruction_sets() -> list[str]:
    """
    Those that this processor has, fastest first.
    """
def judge(adjustment: Adjustment, *, mistake: str = '', implausible_inputs: collections.abc.Sequence[str] = []) -> Adjustment:
    """
    The same, rejected where a mistake would explain the readings; at best doubtful where there are inputs that no workshop has, a sentence each.
    """
def known_by_run(measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike, options: AdjustmentOptions, *, grid: typing.SupportsInt | typing.SupportsIndex) -> KnownByLines:
    """
    What adjust() knows by a run without noise (KnownByLines), without its tests of the readings. Raises InvalidArgument as LineInformation does, and where nothing is determined.
    """
@typing.overload
def locate(camera: Camera, image: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64] | None:
    """
    Position (2,) of the spot in an image (rows, columns) of electrons, mm from the sensor's origin; None where nothing can be located. Raises InvalidArgument for an image of another shape or not finite.
    """
@typing.overload
def locate(device: LateralEffect, spots: collections.abc.Sequence[BeamSpot], *, seed: typing.SupportsIndex = 0, counter: typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64] | None:
    """
    Position (2,) that the device gives for these spots, mm from its centre; None below its least power.
    """
def make_bins(model: SampleModel, options: StatisticsOptions = ..., threads: typing.SupportsIndex = 0) -> Bins:
    """
    The pilot run over the first 10,000 samples. threads: 0 takes all processors. Raises InvalidArgument.
    """
def newer_format(expected: str, given: str) -> str:
    """
    The end of a refusal: where `given` is `expected` with a larger number at its end, it says that it takes a newer stepdiag; else it is empty.
    """
def normal_quantile(probability: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    The number that a standard normal number is below with this probability. Raises InvalidArgument.
    """
def numerical_tolerance(standard_uncertainty: typing.SupportsFloat | typing.SupportsIndex, digits: typing.SupportsInt | typing.SupportsIndex) -> float:
    """
    delta = 10^r / 2 for u = c 10^r, c a whole number of so many digits (JCGM 101, 7.9.2).
    """
def power_inside(spot: BeamSpot, low: numpy.typing.ArrayLike, high: numpy.typing.ArrayLike) -> float:
    """
    Share of the source's power that a spot has in the rectangle between two corners (2,), mm.
    """
def propagate(virtual_calibrations: VirtualCalibrations, calibration: Calibration | None = None, *, covariance: bool = False) -> Propagation:
    """
    Uncertainty of all outputs of virtual calibrations: every input by central differences of whole calibrations at its expectation plus and minus its standard uncertainty; reading noise by the evaluation's gain, with its real covariance. A t distribution counts with its scale and degrees of freedom (GUM 4.2.3). calibration: one from a measurement, evaluated with full_covariance; values are then its own, the group "readings" is its own covariance (noise, and set-ups that were solved for), and what the inputs of the virtual calibrations (same plan, head and evaluation) contribute is added; their reading noise is not. Raises InvalidArgument for a calibration of other parameters or nodes, and where a deviation leaves the evaluation without a result.
    """
def propagate_linear(value: numpy.typing.ArrayLike, sensitivity: numpy.typing.ArrayLike, standard_uncertainty: numpy.typing.ArrayLike, *, degrees_of_freedom: numpy.typing.ArrayLike | None = None, estimates: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] | None = None, names: collections.abc.Sequence[str] | None = None, groups: collections.abc.Sequence[str] | None = None, outputs: collections.abc.Sequence[str] | None = None, correlation: numpy.typing.ArrayLike | None = None, covariance: bool = False) -> Propagation:
    """
    Cov(y) = C Cov(x) C^T with C = sensitivity (m, n), x of these standard uncertainties (n,), degrees of freedom (n,; none: infinite) and correlation (n, n; none: independent). estimates: a number for each input; those with the same number, 0 or more, have their standard uncertainty from one estimate, so that its degrees of freedom count once; -1: its own. groups: of the budget; none: each input by itself. Least squares is the case C = A+. Raises InvalidArgument for what makes no sense.
    """
def random_error_map(volume: numpy.typing.ArrayLike, *, seed: typing.SupportsIndex, translation: typing.SupportsFloat | typing.SupportsIndex = 0.02, rotation: typing.SupportsFloat | typing.SupportsIndex = 6e-05, squareness: typing.SupportsFloat | typing.SupportsIndex = 6e-05, intervals: typing.SupportsIndex = 50, screw_pitch: typing.SupportsFloat | typing.SupportsIndex = 0.0, screw_amplitude: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> ErrorMap:
    """
    A random machine with peaks of `translation` mm and `rotation` rad at equidistant nodes, squarenesses uniform within +-`squareness` rad, in the frame choice of the conventions. Same arguments, same bits.
    """
def read_calibration(path: str | os.PathLike[str]) -> Calibration:
    """
    Reads a calibration CSV. Raises InvalidArgument naming file and line.
    """
def read_distance(interferometer: Interferometer, mode: GaussianMode, beam: ReturnedBeam, *, true_index: typing.SupportsFloat | typing.SupportsIndex = 1.0, assumed_index: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> float | None:
    """
    The distance that the instrument gives, mm; None where the beam is outside aperture, acceptance or least coupling.
    """
def read_error_map(path: str | os.PathLike[str]) -> ErrorMap:
    """
    Reads an error map or calibration CSV. Raises InvalidArgument naming file and line.
    """
def read_measurement(path: str | os.PathLike[str]) -> Measurement:
    """
    Reads a measurement CSV. Raises InvalidArgument naming file and line.
    """
def read_signals(head: Head, *, distance: typing.SupportsFloat | typing.SupportsIndex, tilt: numpy.typing.ArrayLike = (0.0, 0.0), lateral: numpy.typing.ArrayLike = (0.0, 0.0), environment: Environment | None = None, assumed_environment: Environment | None = None) -> dict[str, float | None]:
    """
    The signals of a traced head for one mirror pose, by the trace of all its light; None for a lost one.
    """
def recheck(baseline: Calibration, measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), options: AdjustmentOptions | None = None, priors: ChangePriors = ...) -> Recheck:
    """
    Whether the machine has changed since its calibration `baseline`, by readings of a short run; plan, head and options (AdjustmentOptions) are those of the readings. Raises InvalidArgument as verify does.
    """
def run_leaves(model: SampleModel, bins: Bins, first_leaf: typing.SupportsIndex, leaves: typing.SupportsIndex, *, threads: typing.SupportsIndex = 0, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> PartialStatistics:
    """
    Statistics of these leaves; the bits depend on nothing else. progress(leaves_done) is called some times a second; False ends the run with the leaves that are done, an exception ends it at once and comes through. Raises InvalidArgument for a model that is not that of the bins.
    """
def run_ranges(model: SampleModel, bins: Bins, ranges: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]], *, threads: typing.SupportsIndex = 0, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> list[PartialStatistics]:
    """
    The same for half-open ranges of leaves, each computed by one thread; those that are whole.
    """
def setup_quantities() -> tuple[SetupQuantity, ...]:
    """
    The table of set-up quantities. The first adjusted_quantity_count of them are unknowns of an adjustment.
    """
def simulate(machine: Machine, plan: Plan, head: Head | collections.abc.Mapping[str, Head], options: SimulationOptions | None = None, **kwargs: typing.Any) -> Measurement:
    """
    A run on the virtual machine: lines of the plan, then its scale lines. head: one, or a dict with one for each line. The options are SimulationOptions, or its fields by name. Points of a visit are approached in the direction of its own travel. Readings whose beam misses the mirror or does not come back are lost (NaN). Raises InvalidArgument; RuntimeError where a replay and its trace differ.
    """
def straightness_reference(chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> str:
    """
    One line: to which point straightnesses refer, and what they are at the functional point.
    """
def summarise_volume(machine: Machine, x: numpy.typing.ArrayLike, y: numpy.typing.ArrayLike, z: numpy.typing.ArrayLike, *, without: collections.abc.Sequence[str] = [], tilts: bool = True) -> VolumeSummary:
    """
    On the grid of all combinations of these ascending positions (mm). without: names of parameters to be set to 0. tilts: whether to compute them, which takes most of the time. Raises InvalidArgument for positions that do not ascend and unknown names.
    """
def t_quantile(probability: typing.SupportsFloat | typing.SupportsIndex, degrees_of_freedom: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    The same of Student's t distribution (coverage factors, GUM G.3). Raises InvalidArgument.
    """
def trace_beams(head: Head, *, distance: typing.SupportsFloat | typing.SupportsIndex, tilt: numpy.typing.ArrayLike = (0.0, 0.0), lateral: numpy.typing.ArrayLike = (0.0, 0.0), environment: Environment | None = None) -> list[BeamSegment]:
    """
    All light of a traced head, as segments: the mirror's centre at (lateral, distance) in the sensor frame, mm, its tilts (alpha, beta) in rad. A parent stands before its children. Raises InvalidArgument.
    """
def uncertain_quantities() -> tuple[UncertainQuantity, ...]:
    """
    The set-up quantities, what lines share, and the noises.
    """
def verify(calibration: Calibration, measurement: Measurement, plan: Plan, head: Head | collections.abc.Mapping[str, Head], chain: Chain | str, tool: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), options: AdjustmentOptions | None = None, sent: numpy.typing.ArrayLike | None = None, **kwargs: typing.Any) -> Verification:
    """
    Predicts readings from a calibration that was made without them, with uncertainty, and judges the deviations. Plan, head and options (AdjustmentOptions, or its fields by name) are those of the readings. sent (n, 3), mm: where a table sent the motors less the commanded positions, by row of a run with a compensation in force. Raises InvalidArgument, also for a calibration without covariance, of another chain, volume or tool, or without all 21 parameters.
    """
def volumetric_accuracy(calibration: Calibration, *, tool: numpy.typing.ArrayLike | None = None, coverage: typing.SupportsFloat | typing.SupportsIndex = 0.95, samples: typing.SupportsIndex = 10000, seed: typing.SupportsIndex = 0) -> VolumetricAccuracy:
    """
    By draws from the joint normal distribution of a calibration evaluated with full_covariance. tool: offset (mm); none: the calibration's. Raises InvalidArgument without a covariance and for fewer samples than 100/(1 - coverage).
    """
def with_covariance(calibration: Calibration, covariance: numpy.typing.ArrayLike) -> Calibration:
    """
    The calibration with another covariance of its values, such as Propagation.covariance of its entries, and the standard uncertainties that go with it. Raises InvalidArgument for what is no covariance of these values.
    """
def without_lost_marks(measurement: Measurement) -> Measurement:
    """
    The measurement without distances of 0 that stand for a lost beam, as read_measurement gives it. Raises InvalidArgument naming the row of another such mark.
    """
def word_wrong_arguments_with(words: typing.Any) -> None:
    """
    Sets the function that makes the line for arguments that a function does not take; the package does so.
    """
__version__: str = '1.0.0'
adjusted_quantity_count: int = 9
largest_repeat_count: int = 1000
leaf_samples: int = 2000
pilot_samples: int = 10000
thresholds: Thresholds
