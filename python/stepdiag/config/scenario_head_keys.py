"""The keys of a scenario that say what it is measured with, and in what air: `[head]`, `[line]`, `[environment]`."""

from typing import Annotated, Final, Literal

from pydantic import Field

from stepdiag.config.key_types import (
    POSITIVE,
    POSITIVE_LENGTH,
    READING_MODEL,
    SHARE,
    THREE_ANGLES,
    THREE_LENGTHS,
    AngleTriple,
    Length,
    Pair,
    Positive,
    PositiveLength,
    ReadingModel,
    Section,
    Share,
    Triple,
    key,
    tables,
)


class PoseErrorKeys(Section):
    """Pose error of a component of the described head, along the axes of the head. Used by `simulate` only."""

    shift_mm: Triple = key(THREE_LENGTHS, "Shift along the head's x, y, z.", (0.0, 0.0, 0.0))
    rotation_urad: AngleTriple = key(
        THREE_ANGLES, "Rotation vector, about the component's own origin.", (0.0, 0.0, 0.0)
    )


class NominalHeadKeys(Section):
    """How a head is made by design."""

    layout: Literal["ideal", "psd", "multi_beam"] | None = key(
        '"ideal", "psd" or "multi_beam"',
        "Readings by their closed definition: `ideal` reads distance and two tilts, `psd` distance and spot, "
        "`multi_beam` three or more distances. Required, unless there is a `description`.",
        None,
        "ideal",
    )
    description: Annotated[str, Field(min_length=1)] | None = key(
        "the name of a shipped head, or the path of a head description (TOML)",
        "Readings by ray tracing of a described head (docs/head.md); a path is relative to this file.",
        None,
        "beam_and_psd",
    )
    standoff_mm: PositiveLength = key(POSITIVE_LENGTH, "Distance from head to mirror at a line's first point.", 100.0)
    mirror_mm: tuple[PositiveLength, PositiveLength] | None = key(
        "two positive lengths in mm",
        "Width and height of the mirror; by default as large as the plan and the beams need. A beam that misses it is "
        "a lost reading.",
        None,
        [120.0, 120.0],
    )
    psd_distance_mm: Length | None = key(
        "a length in mm",
        "Distance from reference plane to position sensing device; required for the layout `psd`.",
        None,
        50.0,
    )
    beam_offsets_mm: tuple[Pair, ...] | None = key(
        "a list of pairs of lengths in mm",
        "Offsets (u, v) of the beams in the reference plane; required for the layout `multi_beam`, at least three.",
        None,
        [[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]],
    )
    wavelength_nm: Positive = key(
        POSITIVE, "Vacuum wavelength, for the index of the air; a description has one for each beam.", 1530.0
    )
    aperture_mm: PositiveLength = key(
        POSITIVE_LENGTH,
        "Edge of the square that takes each beam back, around the place where it leaves the head. A beam that comes "
        "back outside it is a lost reading.",
        50.0,
    )
    reading_model: ReadingModel | None = key(
        READING_MODEL,
        "What the interferometers of a description read; by default what it says for each.",
        None,
        "coupled_mode",
    )
    channels: tuple[Annotated[str, Field(min_length=1, max_length=60)], ...] | None = key(
        "a list of names",
        "How an instrument that serves several heads names the readings of this one, in the order of its channels: "
        'axes of an IDS3010 such as "2", or what an adapter sends, units included. By default axes from 1 on, and the '
        "channels' own names.",
        None,
        ["left_distance_mm"],
    )


class HeadKeys(NominalHeadKeys):
    """What `[head]` and `[head.NAME]` have in common."""

    pose_errors: dict[str, PoseErrorKeys] = tables("COMPONENT")


class KnownHeadKeys(Section):
    """What is known of all heads, beside how each is made by design."""

    verified_share: Share = key(
        SHARE, "Described heads: share of the poses whose replay is compared with the full trace.", 1e-3
    )
    tilts: bool = key(
        "true or false",
        "false: distances only. Runs and sheets have no tilts or spots, and an evaluation does not look at those of a "
        "run that has them. Not for beams d1, d2, ...",
        True,
    )


class HeadSection(KnownHeadKeys, HeadKeys):
    """The measuring head and its mirror: a `layout`, or a `description` of its optics.

    `[head.NAME]` describes further heads; each replaces the keys that it names, and has the others from `[head]`.
    `[line.LINE]` says which of them measures a line; a line without is measured with that of `[head]`. All heads of a
    run have the same layout and number of beams."""

    by_head: dict[str, HeadKeys] = tables("NAME")


# Keys of [head] that go with a layout or a description alone.
LAYOUT_KEYS: Final = ("psd_distance_mm", "beam_offsets_mm", "wavelength_nm", "aperture_mm")
DESCRIPTION_KEYS: Final = ("reading_model", "pose_errors")


class LineKeys(Section):
    """Keys of one line, such as `[line.ppp]`."""

    head: Annotated[str, Field(min_length=1)] = key(
        "the name of a head", "The `[head.NAME]` that measures it.", example="left"
    )


class AirKeys(Section):
    """The state of the air, or its index."""

    refractive_index: Annotated[float, Field(ge=1.0, le=2.0)] | None = key(
        "a refractive index from 1 to 2",
        "Index at every wavelength, in place of the keys below.",
        None,
        1.0,
    )
    temperature_c: Annotated[float, Field(ge=-40.0, le=100.0)] | None = key(
        "a temperature from -40 to 100", "By default 20, if any of these keys is there.", None, 20.0
    )
    pressure_hpa: Annotated[float, Field(ge=100.0, le=1400.0)] | None = key(
        "a pressure from 100 to 1400", "By default 1013.25.", None, 1013.25
    )
    humidity_percent: Annotated[float, Field(ge=0.0, le=100.0)] | None = key(
        "a relative humidity from 0 to 100", "By default 50.", None, 50.0
    )
    co2_ppm: Annotated[float, Field(ge=0.0, le=2000.0)] | None = key(
        "a number from 0 to 2000", "Carbon dioxide by volume, for Ciddor's equation alone; by default 450.", None, 450.0
    )
    equation: Literal["ciddor", "modified_edlen", "edlen_1966"] | None = key(
        '"ciddor", "modified_edlen" or "edlen_1966"', "From state to index; by default Ciddor's.", None, "ciddor"
    )


class AssumedAirKeys(AirKeys):
    """The air with which readings are reduced, if the instrument assumes another air.

    Keys that are not named are as in `[environment]`. By default the true air."""


class KnownEnvironmentKeys(Section):
    """What the instrument does about the air."""

    readings: Literal["compensated", "constant_index"] = key(
        '"compensated" or "constant_index"',
        "The instrument has reduced its distances with the true air; or it counted with the constant index of the "
        "assumed air, and evaluations reduce distances with the run's columns `air_temperature_c`, "
        "`air_pressure_hpa`, `air_humidity_percent`: docs/temperature.md.",
        "compensated",
    )
    altitude_m: Annotated[float, Field(ge=-500.0, le=6000.0)] | None = key(
        "a height from -500 to 6000, in m",
        "Height of the place above sea level, which says what air pressures are plausible; by default 0 to 500.",
        None,
        300.0,
    )


class EnvironmentSection(KnownEnvironmentKeys, AirKeys):
    """The air around machine and head, constant over a run: a `refractive_index`, or the state of the air.

    Without any key, the air is that of 20 °C for a described head, and the index is 1 for a head given by its layout.
    With a key in `[environment.assumed]`, the air is that of 20 °C for every head.

    Used by `simulate` only, except `readings`, `altitude_m`, and the assumed air with `constant_index`. The equations
    hold for wavelengths of 300 to 1700 nm."""

    assumed: AssumedAirKeys | None = None
