"""The keys of a head description: bodies of glass, beams and sensors, each in its place.

One home for all of them, as scenario_keys is for scenarios: what is refused, what the message says and the tables in
docs/head.md are made from the models below.
"""

from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field

from stepdiag.config.body_keys import AnyBody, Placed
from stepdiag.config.key_types import (
    AMPLITUDE,
    DEVIATION,
    POSITIVE,
    POSITIVE_LENGTH,
    READING_MODEL,
    SHARE,
    Amplitude,
    Format,
    Length,
    Positive,
    PositiveLength,
    ReadingModel,
    Section,
    Share,
    format_key,
    key,
    tables,
)

# Of a row or a column, and of a frame, which takes eight bytes for each while it is read.
FEWEST_PIXELS: Final = 4
MOST_PIXELS: Final = 16_384
MOST_PIXELS_OF_A_FRAME: Final = 2**24
Pixels = Annotated[int, Field(ge=FEWEST_PIXELS, le=MOST_PIXELS)]
Electrons = Annotated[float, Field(gt=0.0, le=1e15)]

_pixels = f"an integer from {FEWEST_PIXELS} to {MOST_PIXELS}"


class BeamKeys(Placed):
    """A source of light; its beam leaves along its own +z. Without `sensor` it is an interferometer, whose plane z = 0
    takes the beam back; with one it is a conventional laser, whose light makes the spot on that sensor."""

    sensor: Annotated[str, Field(min_length=1)] | None = key(
        "the name of a sensor", "The sensor that the beam comes to; without it an interferometer.", None
    )
    wavelength_nm: Positive = key(POSITIVE, "Vacuum wavelength.", example=1530.0)
    waist_radius_mm: PositiveLength = key(POSITIVE_LENGTH, "Radius of the waist (1/e² of power).", example=0.8)
    waist_position_mm: Length = key("a length in mm", "Where the waist is along the beam, from its source.", 0.0)
    housing_mm: PositiveLength = key(
        POSITIVE_LENGTH, "Laser to a sensor: edge of the square around its source that stops light.", 10.0
    )
    aperture_mm: PositiveLength = key(
        POSITIVE_LENGTH, "Interferometer: edge of the square that takes the beam back.", 10.0
    )
    acceptance_mrad: Annotated[float, Field(gt=0.0, le=1570.0)] = key(
        "a positive angle up to 1570 mrad",
        "Interferometer: largest angle between returned beam and axis; beyond it a reading is lost.",
        100.0,
    )
    least_coupling: Share = key(
        SHARE, "Interferometer, coupled_mode: a reading is lost where less of the light couples.", 0.0
    )
    resolution_nm: Amplitude = key(AMPLITUDE, "Interferometer: step of the distance; 0: none.", 0.0)
    periodic_amplitude_nm: Amplitude = key(
        AMPLITUDE, "Interferometer: amplitude of the non-linearity that repeats every half wavelength.", 0.0
    )
    dead_path_mm: Length = key(
        "a length in mm", "Interferometer: path in air before the reference plane that is not compensated.", 0.0
    )
    index_error_ppm: Annotated[float, Field(ge=-1000.0, le=1000.0)] = key(
        "a number from -1000 to 1000", "Interferometer: relative error of the air index it reduces with.", 0.0
    )
    reading_model: ReadingModel = key(
        READING_MODEL,
        "Interferometer: path of the beam's axis, or phase and share of the light that couples back. With it a "
        "lateral-effect sensor reads the axis of its beam, or all the light on its area.",
        "chief_ray",
    )


# Keys that only a beam of the other kind has.
INTERFEROMETER_KEYS: Final = (
    "aperture_mm",
    "acceptance_mrad",
    "least_coupling",
    "resolution_nm",
    "periodic_amplitude_nm",
    "dead_path_mm",
    "index_error_ppm",
    "reading_model",
)
SPOT_KEYS: Final = ("housing_mm",)


_sensors = '"lateral_effect" or "camera"'


class SensorKeys(Placed):
    """A sensor in its own x-y plane, origin in its middle, light from either side; of one `kind` of those below."""

    tag: ClassVar[str] = "kind"


class LateralEffectKeys(SensorKeys):
    """A lateral-effect position sensing device: gives the centroid of the power on its area."""

    kind: Literal["lateral_effect"] = key(_sensors, "What it is.")
    size_mm: tuple[PositiveLength, PositiveLength] = key("two positive lengths in mm", "Its active area.", (10.0, 10.0))
    noise_um: Amplitude = key(DEVIATION, "Noise of the position for all of the power; grows as 1 / power.", 0.0)
    resolution_um: Amplitude = key(AMPLITUDE, "Step of the position; 0: none.", 0.0)
    least_power: Share = key(SHARE, "Of the source's power on its area; below it a reading is lost.", 1e-6)


class CameraKeys(SensorKeys):
    """A pixel array: gives the position that is found in its image."""

    kind: Literal["camera"] = key(_sensors, "What it is.")
    pixel_um: Positive = key(POSITIVE, "Pitch of the pixels.", 10.0)
    columns: Pixels = key(_pixels, "Pixels along x; columns times rows are at most 2^24.", 512)
    rows: Pixels = key(_pixels, "Pixels along y.", 512)
    electrons: Electrons = key(
        "a positive number up to 1e15",
        "Photo-electrons of the whole spot of a beam that has kept all of its power.",
        1e6,
    )
    background: Annotated[float, Field(ge=0.0, le=1e12)] = key(AMPLITUDE, "Electrons a pixel without light.", 0.0)
    read_noise: Annotated[float, Field(ge=0.0, le=1e12)] = key(DEVIATION, "Of the read-out, in electrons.", 0.0)
    shot_noise: bool = key("true or false", "Whether the light is counted in quanta.", False)
    full_well: Annotated[float, Field(gt=0.0, le=1e18)] = key(
        POSITIVE, "Electrons that a pixel holds; more are lost.", 1e9
    )
    bits: Annotated[int, Field(ge=0, le=32)] = key(
        "an integer from 0 to 32", "Of the converter over the full well; 0: not quantised.", 0
    )
    centroid: Literal["gaussian_fit", "centre_of_gravity"] = key(
        '"gaussian_fit" or "centre_of_gravity"', "How the position is found.", "gaussian_fit"
    )
    threshold: Annotated[float, Field(ge=0.0, le=0.99)] = key(
        "a share from 0 to 0.99", "For the centre of gravity: share of the brightest pixel that counts.", 0.05
    )


class LimitsSection(Section):
    """Where the tree of rays that split at faces ends."""

    most_hits: Annotated[int, Field(ge=1, le=1000)] = key(
        "an integer from 1 to 1000", "Faces that light meets on its way.", 64
    )
    least_power: Annotated[float, Field(gt=0.0, le=1.0)] = key(
        "a share above 0, up to 1", "Of the source's power; weaker light is not followed.", 1e-6
    )


AnySensor = Annotated[LateralEffectKeys | CameraKeys, Field(discriminator="kind")]


class HeadFile(Section):
    """The first keys, above all sections:"""

    format: Format = format_key()
    name: Annotated[str, Field(min_length=1)] = key("a text", "What the head is called.", example="my head")
    layout: Literal["psd", "multi_beam"] = key(
        '"psd" or "multi_beam"',
        "`psd`: one interferometer, and one laser to a sensor; `multi_beam`: three or more interferometers, d1, d2, "
        "... in the order of the file.",
        example="multi_beam",
    )
    beam: dict[str, BeamKeys] = tables("NAME")
    body: dict[str, AnyBody] = tables("NAME")
    sensor: dict[str, AnySensor] = tables("NAME")
    limits: LimitsSection = LimitsSection()
