"""The keys of a scenario file: which there are, what each expects, its default and its meaning.

One home for all of them: what is refused, what the error message says, the table in docs/scenario.md and the
comments of the file that `stepdiag init` writes are made from the models below.
"""

from typing import Annotated, Final, Literal

from pydantic import Field

from stepdiag._core import Plan, largest_repeat_count
from stepdiag.config.adjustment_keys import AdjustmentSection, SmoothnessSection
from stepdiag.config.input_limit_keys import InputLimitsSection
from stepdiag.config.instrument_keys import InstrumentSection
from stepdiag.config.key_errors import BY_HEAD, BY_LINE
from stepdiag.config.key_types import (
    AMPLITUDE,
    ANGLES,
    DEVIATION,
    LARGEST_LENGTH,
    POSITIVE,
    SEED,
    THREE_LENGTHS,
    Amplitude,
    Angle,
    AnglePair,
    Format,
    Length,
    Pair,
    Positive,
    Section,
    Seed,
    Triple,
    format_key,
    key,
    tables,
)
from stepdiag.config.plan_by_time_keys import PlanByTimeSection
from stepdiag.config.report_keys import ReportSection
from stepdiag.config.scenario_head_keys import (
    EnvironmentSection,
    HeadSection,
    KnownEnvironmentKeys,
    KnownHeadKeys,
    LineKeys,
)
from stepdiag.config.temperature_keys import KnownTemperatureKeys, TemperatureSection, TrueTemperatureKeys
from stepdiag.config.uncertainty_keys import UncertaintySection

# Limits that the core checks as well; here they keep numbers inside the integer types behind the bindings.
LARGEST_STEPS: Final = Plan.largest_step_count
LARGEST_REPEATS: Final = largest_repeat_count
SMALLEST_EDGE: Final = 1e-3
LARGEST_EDGE: Final = 1e6
LARGEST_INTERVALS: Final = 1_000_000


Edge = Annotated[float, Field(ge=SMALLEST_EDGE, le=LARGEST_EDGE)]

_edge = "a length in mm from 0.001 to 1e6"


class VolumeSection(Section):
    """The measured volume; home is its corner (0, 0, 0)."""

    x_mm: Edge = key(_edge, "Travel of X, the volume's edge.", example=800.0)
    y_mm: Edge = key(_edge, "Travel of Y.", example=600.0)
    z_mm: Edge = key(_edge, "Travel of Z.", example=500.0)


class RandomSection(Section):
    """A random error map, made from the seed. Same keys, same map."""

    seed: Seed = key(SEED, "Seed of the map.", example=1)
    translation_um: Amplitude = key(AMPLITUDE, "Peak of each positioning error and straightness.", 20.0)
    rotation_urad: Amplitude = key(AMPLITUDE, "Peak of each angular error.", 60.0)
    squareness_urad: Amplitude = key(AMPLITUDE, "Squarenesses are uniform within plus and minus this.", 60.0)
    intervals: Annotated[int, Field(ge=2, le=LARGEST_INTERVALS)] | None = key(
        "an integer from 2 to 1000000",
        "Intervals between the map's nodes, per axis; by default `plan.steps`.",
        None,
        10,
    )
    screw_pitch_mm: Annotated[float, Field(ge=0.0, le=LARGEST_LENGTH)] = key(
        "a length in mm of at least 0", "Pitch of a periodic positioning error on all axes; 0: none.", 0.0
    )
    screw_amplitude_um: Amplitude = key(AMPLITUDE, "Amplitude of that periodic error.", 0.0)


class KnownMachineKeys(Section):
    """What is known of the machine."""

    chain: str = key(
        'a kinematic chain such as "[w X\' b Y Z t]"',
        "Kinematic chain from workpiece w over bed b to tool t; a prime marks the axes before b.",
        example="[w X' b Y Z t]",
    )
    tool_mm: Triple = key(THREE_LENGTHS, "Offset from the tool's origin to the centre of the mirror.", (0.0, 0.0, 0.0))


class MachineErrorsKeys(Section):
    """The errors that a machine is simulated with."""

    errors: Annotated[str, Field(min_length=1)] | None = key(
        "the path of an error map (CSV)",
        "Error map to simulate with, relative to this file.",
        None,
        "truth.csv",
    )
    drift_um_per_h: Triple = key(
        "three drifts in µm/h",
        "Of the functional point along X, Y, Z since the run's first reading, which no temperature of a scale "
        "explains; needs `plan.seconds_per_reading`.",
        (0.0, 0.0, 0.0),
    )
    random: RandomSection | None = Field(
        default=None, description="See `[machine.random]`; not together with `errors`."
    )


class MachineSection(MachineErrorsKeys, KnownMachineKeys):
    """The machine; perfect without `errors` and `random`. An evaluation uses only `chain` and `tool_mm`."""


class PlanSection(Section):
    """The commanded measurement: lines, steps and order."""

    lines: tuple[str, ...] = key(
        'a list of lines such as "ppp" (three of p, n, 0)',
        'Measured lines: body diagonals such as "npp", face diagonals such as "pp0", single axes such as "p00". Four '
        "body diagonals do not show on which of them a distance was wrong or the counter slipped; with face diagonals "
        "in the three planes, or `repeats = 2`, they do (`stepdiag observe`).",
        example=["ppp", "npp", "pnp", "nnp"],
    )
    steps: Annotated[int, Field(ge=1, le=LARGEST_STEPS)] = key(
        f"an integer from 1 to {LARGEST_STEPS}", "Steps per axis on each line.", example=10
    )
    order: str | tuple[str, ...] = key(
        "a permutation of XYZ, or a list of them",
        "The order in which a step moves the axes. Of several, every line is measured in each of them: in the first in "
        "run 0, in the second in run 1 (with `backward`: runs 0 and 1, 2 and 3), and so on in turn.",
        "XYZ",
    )
    block: Annotated[int, Field(ge=1, le=LARGEST_STEPS)] = key(
        f"an integer from 1 to {LARGEST_STEPS}",
        "Steps of an axis that follow each other before the next axis moves. A larger block makes straightness, "
        "angles and squareness better known, and needs a mirror that is so many times as large (docs/plans.md).",
        1,
    )
    scale_lines: tuple[str, ...] = key(
        'a list of single-axis lines such as "p00"',
        "Lines along one axis whose laser is aligned with it; they fix the slopes of the positioning errors.",
        (),
        ["p00", "0p0", "00p"],
    )
    scale_points: Literal["ends", "steps"] = key(
        '"ends" or "steps"',
        "Where scale lines are read: at their two ends, or after every step. Steps take some minutes more and make "
        "positioning several times better known (docs/plans.md).",
        "ends",
        "steps",
    )
    check_points: Annotated[int, Field(ge=0, le=LARGEST_STEPS)] = key(
        f"an integer from 0 to {LARGEST_STEPS}",
        "After every so many steps the program returns to the check point of the line and reads it again, which shows "
        "drift from the machine's errors (docs/temperature.md); 0: never. Scale lines have none.",
        0,
        5,
    )
    check_point: Annotated[int, Field(ge=0, le=LARGEST_STEPS)] = key(
        f"an integer from 0 to {LARGEST_STEPS}",
        "The check point is where the line is after so many steps; 0: its first point.",
        0,
    )
    repeats: Annotated[int, Field(ge=1, le=LARGEST_REPEATS)] = key(
        f"an integer from 1 to {LARGEST_REPEATS}",
        "How often each line is measured in each order, with head and mirror as they are; runs 0, 1, 2, ... "
        "Used by `simulate` only, as are the next two.",
        1,
    )
    backward: bool = key(
        "true or false",
        "Each run of a line is followed by a backward one, its points in reverse order: runs 0, 2, ... and 1, 3, ...",
        False,
    )
    seconds_per_reading: Positive | None = key(
        POSITIVE, "Time from a reading to the next one; makes the column `time_s` of the measurement.", None, 5.0
    )


class MisalignmentKeys(Section):
    """Misalignment of head and mirror on a line."""

    reflector_urad: AnglePair = key(ANGLES, "Tilt (a, b) of the mirror about local x and y.", (0.0, 0.0))
    laser_urad: AnglePair = key(
        ANGLES, "Tilt (a, b) of the beam and the sensor's axes about local x and y.", (0.0, 0.0)
    )
    psd_zero_mm: Pair = key(
        "two lengths in mm", "Reading of the position sensing device for a centred spot.", (0.0, 0.0)
    )
    distance_constant_mm: Length = key("a length in mm", "Constant error of all distances of a line.", 0.0)
    beam_constants_um: tuple[Length, ...] | None = key(
        "a list of lengths in µm, one for each beam",
        "The same of each of d1, d2, ... by itself.",
        None,
        [0.0, 1.0, -1.0],
    )
    lateral_mm: Pair = key("two lengths in mm", "Offset of the beam's origin along local x and y.", (0.0, 0.0))
    roll_urad: Angle = key("an angle below 0.1 rad, in µrad", "Roll of the head about its beam.", 0.0)
    gain: Annotated[float, Field(ge=-0.5, le=0.5)] = key(
        "a number from -0.5 to 0.5",
        "Relative error of tilts; `psd`: of spots; `multi_beam`: the beams are at 1 + gain times their "
        "offsets (of a traced head they stand where its design says).",
        0.0,
    )
    drift_um_per_h: Length = key(
        "a drift in µm/h",
        "Of all distances, from the first reading of a run and through its backward run; needs "
        "`plan.seconds_per_reading`.",
        0.0,
    )


class MisalignmentSection(MisalignmentKeys):
    """Misalignment of head and mirror, for all of `plan.lines`. Used by `simulate` only.

    `[misalignment.LINE]` replaces, for one line, the keys it names. Scale lines are aligned unless named."""

    by_line: dict[str, MisalignmentKeys] = tables("LINE")


class NoiseKeys(Section):
    """How large the noise of the readings is: what it is simulated with, and the weights by default."""

    distance_um: Amplitude = key(DEVIATION, "Noise of distances (also d1, d2, ...).", 0.0)
    common_um: Amplitude = key(DEVIATION, "Noise that all distances of a point have in common.", 0.0)
    tilt_urad: Amplitude = key(DEVIATION, "Noise of the tilts.", 0.0)
    spot_um: Amplitude = key(DEVIATION, "Noise of the spot position.", 0.0)


class NoiseSection(NoiseKeys):
    """Standard deviations of the noise that `simulate` adds, independent and Gaussian."""

    seed: Seed = key(SEED, "Seed of the noise.", 0)


class PlausibleSection(Section):
    """Limits of plausible errors. An evaluation whose result exceeds these limits, by more than three times its
    standard uncertainty, ends with an error: the readings are in another unit, of another volume or of another plan."""

    positioning_um_per_m: Positive = key(
        POSITIVE, "Limit of a positioning error, by the travel of its axis.", 1000.0, 1000.0
    )
    translation_um: Positive = key(POSITIVE, "Limit of a positioning error or a straightness.", 2000.0, 2000.0)
    rotation_urad: Positive = key(POSITIVE, "Limit of an angular error or a squareness.", 5000.0, 5000.0)
    inputs: InputLimitsSection = InputLimitsSection.model_construct()


class ChangeSection(Section):
    """Possible changes of the machine since its calibration, for `stepdiag recheck`: standard uncertainties with which
    a change is known to be 0. With 0 this change is impossible. The defaults are typical for wear, a collision, another
    temperature and re-levelling."""

    scale_um_per_m: Amplitude = key(AMPLITUDE, "Of the scale of each axis.", 30.0, 30.0)
    bow_um: Amplitude = key(AMPLITUDE, "Of each straightness, in the middle of the travel.", 5.0, 5.0)
    slope_urad: Amplitude = key(AMPLITUDE, "Of each angle, from one end of the travel to the other.", 30.0, 30.0)
    squareness_urad: Amplitude = key(AMPLITUDE, "Of each squareness.", 50.0, 50.0)


class KnownKeys(Section):
    """What is known when a run is evaluated: these keys, and how the heads are made by design."""

    format: Format = format_key()
    volume: VolumeSection
    machine: KnownMachineKeys
    plan: PlanSection
    head: KnownHeadKeys
    line: dict[str, LineKeys] = tables("LINE")
    temperature: KnownTemperatureKeys | None = None
    environment: KnownEnvironmentKeys = KnownEnvironmentKeys.model_construct()
    instrument: InstrumentSection = InstrumentSection.model_construct()
    noise: NoiseKeys = NoiseKeys.model_construct()
    uncertainty: UncertaintySection = UncertaintySection.model_construct()
    adjustment: AdjustmentSection = AdjustmentSection.model_construct()
    smoothness: SmoothnessSection = SmoothnessSection.model_construct()
    plausible: PlausibleSection = PlausibleSection.model_construct()
    change: ChangeSection = ChangeSection.model_construct()
    plan_by_time: PlanByTimeSection = PlanByTimeSection.model_construct()
    report: ReportSection = ReportSection.model_construct()


class TruthKeys(Section):
    """What a run is simulated with beside what is known; by default nothing is wrong with machine, head and air."""

    machine: MachineErrorsKeys = MachineErrorsKeys.model_construct()
    noise: NoiseSection = NoiseSection.model_construct()
    misalignment: MisalignmentSection = MisalignmentSection.model_construct()
    temperature: TrueTemperatureKeys | None = None
    environment: EnvironmentSection = EnvironmentSection.model_construct()


class ScenarioKeys(TruthKeys, KnownKeys):
    """The first key, above all sections:"""

    machine: MachineSection
    head: HeadSection
    temperature: TemperatureSection | None = None
    environment: EnvironmentSection = EnvironmentSection.model_construct()
    noise: NoiseSection = NoiseSection.model_construct()


# Sections that may hold tables of the user's own names, and where these are kept.
SECTIONS_BY_LINE: Final = ("misalignment", "adjustment", "uncertainty")
TABLES_BY_NAME: Final = {"misalignment": BY_LINE, "adjustment": BY_LINE, "uncertainty": BY_LINE, "head": BY_HEAD}
