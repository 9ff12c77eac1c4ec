"""The keys of a scenario file: which there are, what each expects, its default and its meaning.

One home for all of them: what is refused, what the error message says, the table in docs/scenario.md and the
comments of the file that `stepdiag init` writes are made from the models below.
"""

from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from stepdiag._core import Plan

# Limits that the core checks as well; here they keep numbers inside the integer types behind the bindings.
LARGEST_STEPS: Final = Plan.largest_step_count
SMALLEST_EDGE: Final = 1e-3
LARGEST_EDGE: Final = 1e6
LARGEST_INTERVALS: Final = 1_000_000
LARGEST_SEED: Final = 2**64 - 1
# Beyond a tenth of a radian no set-up is meant, and beyond a kilometre no length.
LARGEST_ANGLE: Final = 99_999.0
LARGEST_LENGTH: Final = 1e6


def key(expected: str, meaning: str, default: Any = ..., example: Any = None) -> Any:
    """A key of a section. `expected` completes "expected ..." in messages; `example` is for the template."""
    return Field(default, description=meaning, json_schema_extra={"expected": expected, "example": example})


def _weighs(choice: str | float) -> str | float:
    if isinstance(choice, str) or 0.0 < choice <= 1e9:
        return choice
    raise ValueError("not positive")


Edge = Annotated[float, Field(ge=SMALLEST_EDGE, le=LARGEST_EDGE)]
Length = Annotated[float, Field(ge=-LARGEST_LENGTH, le=LARGEST_LENGTH)]
PositiveLength = Annotated[float, Field(gt=0.0, le=LARGEST_LENGTH)]
Angle = Annotated[float, Field(ge=-LARGEST_ANGLE, le=LARGEST_ANGLE)]
Amplitude = Annotated[float, Field(ge=0.0, le=LARGEST_LENGTH)]
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
Pair = tuple[Length, Length]
AnglePair = tuple[Angle, Angle]
Choice = Annotated[Literal["free", "fixed"] | float, AfterValidator(_weighs)]

_edge = "a length in mm from 0.001 to 1e6"
_amplitude = "a number of at least 0"
_deviation = "a standard deviation of at least 0"
_positive = "a positive number"
_positive_length = "a positive length in mm"
_seed = "an integer from 0 to 2^64 - 1"
_angles = "two angles below 0.1 rad, in µrad"
_choice = '"free", "fixed" or a positive standard uncertainty'


class Section(BaseModel):
    """Keys are typed strictly (an integer may stand for a float), finite, and no other is accepted."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class VolumeSection(Section):
    """The measured volume; home is its corner (0, 0, 0)."""

    x_mm: Edge = key(_edge, "Travel of X, the volume's edge.", example=800.0)
    y_mm: Edge = key(_edge, "Travel of Y.", example=600.0)
    z_mm: Edge = key(_edge, "Travel of Z.", example=500.0)


class RandomSection(Section):
    """A random error map, made from the seed. Same keys, same map."""

    seed: Seed = key(_seed, "Seed of the map.", example=1)
    translation_um: Amplitude = key(_amplitude, "Peak of each positioning error and straightness.", 20.0)
    rotation_urad: Amplitude = key(_amplitude, "Peak of each angular error.", 60.0)
    squareness_urad: Amplitude = key(_amplitude, "Squarenesses are uniform within plus and minus this.", 60.0)
    intervals: Annotated[int, Field(ge=2, le=LARGEST_INTERVALS)] | None = key(
        "an integer from 2 to 1000000",
        "Intervals between the map's nodes, per axis; by default `plan.steps`.",
        None,
        10,
    )
    screw_pitch_mm: Annotated[float, Field(ge=0.0, le=LARGEST_LENGTH)] = key(
        "a length in mm of at least 0", "Pitch of a periodic positioning error on all axes; 0: none.", 0.0
    )
    screw_amplitude_um: Amplitude = key(_amplitude, "Amplitude of that periodic error.", 0.0)


class MachineSection(Section):
    """The machine; perfect without `errors` and `random`. An evaluation uses only `chain` and `tool_mm`."""

    chain: str = key(
        'a kinematic chain such as "[w X\' b Y Z t]"',
        "Kinematic chain from workpiece w over bed b to tool t; a prime marks the axes before b.",
        example="[w X' b Y Z t]",
    )
    tool_mm: tuple[Length, Length, Length] = key(
        "three lengths in mm", "Offset from the tool's origin to the centre of the mirror.", (0.0, 0.0, 0.0)
    )
    errors: Annotated[str, Field(min_length=1)] | None = key(
        "the path of an error map (CSV)",
        "Error map to simulate with, relative to this file.",
        None,
        "truth.csv",
    )
    random: RandomSection | None = Field(None, description="See `[machine.random]`; not together with `errors`.")


class PlanSection(Section):
    """What the machine is told to do."""

    lines: tuple[str, ...] = key(
        'a list of lines such as "ppp" (three of p, n, 0)',
        'Measured lines: body diagonals such as "npp", face diagonals such as "pp0", single axes such as "p00".',
        example=["ppp", "npp", "pnp", "nnp"],
    )
    steps: Annotated[int, Field(ge=1, le=LARGEST_STEPS)] = key(
        f"an integer from 1 to {LARGEST_STEPS}", "Steps per axis on each line.", example=10
    )
    order: str = key("a permutation of XYZ", "The order in which a step moves the axes.", "XYZ")
    scale_lines: tuple[str, ...] = key(
        'a list of single-axis lines such as "p00"',
        "Lines measured at their two ends only; they fix the slopes of the positioning errors.",
        (),
        ["p00", "0p0", "00p"],
    )


class HeadSection(Section):
    """The measuring head and its mirror."""

    layout: Literal["ideal", "psd", "multi_beam"] = key(
        '"ideal", "psd" or "multi_beam"',
        "`ideal` reads distance and two tilts, `psd` distance and spot, `multi_beam` three or more distances.",
        example="ideal",
    )
    standoff_mm: PositiveLength = key(_positive_length, "Distance from head to mirror at a line's first point.", 100.0)
    psd_distance_mm: Length | None = key(
        "a length in mm",
        "Distance from reference plane to position sensing device; required for `psd`.",
        None,
        50.0,
    )
    beam_offsets_mm: tuple[Pair, ...] | None = key(
        "a list of pairs of lengths in mm",
        "Offsets (u, v) of the beams in the reference plane; required for `multi_beam`, at least three.",
        None,
        [[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]],
    )
    wavelength_nm: Positive = key(
        _positive, "Vacuum wavelength; changes nothing yet: the air's index is given, not computed.", 1530.0
    )
    aperture_mm: PositiveLength = key(
        _positive_length,
        "Edge of the square that takes the beam back. A beam outside it is a lost reading of `ideal`; "
        "the other layouts lose none.",
        50.0,
    )
    mirror_mm: tuple[PositiveLength, PositiveLength] | None = key(
        "two positive lengths in mm",
        "Width and height of the mirror; by default as large as the plan needs. A beam that misses it is a lost "
        "reading of `ideal`; the other layouts lose none.",
        None,
        [120.0, 120.0],
    )


class MisalignmentKeys(Section):
    """How head and mirror are out of true on a line."""

    reflector_urad: AnglePair = key(_angles, "Tilt (a, b) of the mirror about local x and y.", (0.0, 0.0))
    laser_urad: AnglePair = key(
        _angles, "Tilt (a, b) of the beam and the sensor's axes about local x and y.", (0.0, 0.0)
    )
    psd_zero_mm: Pair = key(
        "two lengths in mm", "What the position sensing device reads for a centred spot.", (0.0, 0.0)
    )


class MisalignmentSection(MisalignmentKeys):
    """How head and mirror are out of true, for all of `plan.lines`. Used by `simulate` only.

    `[misalignment.LINE]` replaces, for one line, the keys it names. Scale lines are aligned unless named."""

    by_line: dict[str, MisalignmentKeys] = {}


class EnvironmentSection(Section):
    """The air around the machine."""

    refractive_index: Annotated[float, Field(ge=1.0, le=2.0)] = key(
        "a refractive index from 1 to 2",
        "Refractive index of the air, constant over a run. Readings are lengths with the index taken off, so "
        "it changes them by rounding only.",
        1.0,
    )


class NoiseSection(Section):
    """Standard deviations of the noise that `simulate` adds, independent and Gaussian."""

    distance_um: Amplitude = key(_deviation, "Noise of distances (also d1, d2, ...).", 0.0)
    tilt_urad: Amplitude = key(_deviation, "Noise of the tilts.", 0.0)
    spot_um: Amplitude = key(_deviation, "Noise of the spot position.", 0.0)
    seed: Seed = key(_seed, "Seed of the noise.", 0)


class UncertaintySection(Section):
    """Standard uncertainties of the readings, for an evaluation's weights and results.

    By default the positive standard deviations of `[noise]`, else 0.1 µm, 1 µrad and 1 µm; each key by itself.
    Columns u_... of a measurement file come before these."""

    distance_um: Positive | None = key(_positive, "Of distances (also d1, d2, ...).", None, 0.1)
    tilt_urad: Positive | None = key(_positive, "Of the tilts.", None, 1.0)
    spot_um: Positive | None = key(_positive, "Of the spot position.", None, 1.0)


class AdjustmentKeys(Section):
    """What an adjustment takes each unknown of a line's set-up for."""

    reflector_urad: Choice | None = key(_choice, "Tilt of the mirror.", None, "free")
    laser_urad: Choice | None = key(_choice, "Tilt of the beam.", None, "free")
    distance_constant_mm: Choice | None = key(_choice, "Constant of a line's distances.", None, "free")
    beam_constants_um: Choice | None = key(_choice, "Constants of the beams of `multi_beam`.", None, "fixed")
    psd_zero_mm: Choice | None = key(_choice, "Zero offset of the position sensing device.", None, "fixed")
    lateral_mm: Choice | None = key(_choice, "Lateral offset of the beam.", None, "fixed")
    roll_urad: Choice | None = key(_choice, "Roll of the head about its beam.", None, "fixed")
    gain: Choice | None = key(_choice, "Gain error of the tilts.", None, "fixed")
    drift_um_per_h: Choice | None = key(_choice, "Drift of the distances.", None, "fixed")


class AdjustmentSection(AdjustmentKeys):
    """What an adjustment takes each unknown of the set-up for.

    That is "free", "fixed" at 0, or a number: the standard uncertainty with which it is known to be 0.
    Accepted and checked, but **not used yet**: neither `conventional` nor `enhanced` adjusts the set-up.
    `[adjustment.LINE]` replaces, for one line, the keys it names."""

    by_line: dict[str, AdjustmentKeys] = {}


class ScenarioKeys(Section):
    """The whole file, section by section."""

    volume: VolumeSection
    machine: MachineSection
    plan: PlanSection
    head: HeadSection
    misalignment: MisalignmentSection = MisalignmentSection()
    environment: EnvironmentSection = EnvironmentSection()
    noise: NoiseSection = NoiseSection()
    uncertainty: UncertaintySection = UncertaintySection()
    adjustment: AdjustmentSection = AdjustmentSection()


# Sections that may hold a table for each line, kept under BY_LINE.
SECTIONS_BY_LINE: Final = ("misalignment", "adjustment")
BY_LINE: Final = "by_line"
