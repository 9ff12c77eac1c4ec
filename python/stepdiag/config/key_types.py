"""What the keys of our TOML files (scenarios, heads) are made of: sections, and the kinds of values that keys take."""

from typing import Annotated, Any, ClassVar, Final, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field

# Beyond a tenth of a radian no set-up is meant, and beyond a kilometre no length.
LARGEST_ANGLE: Final = 99_999.0  # µrad
LARGEST_LENGTH: Final = 1e6  # mm
LARGEST_SEED: Final = 2**64 - 1

Length = Annotated[float, Field(ge=-LARGEST_LENGTH, le=LARGEST_LENGTH)]
PositiveLength = Annotated[float, Field(gt=0.0, le=LARGEST_LENGTH)]
Angle = Annotated[float, Field(ge=-LARGEST_ANGLE, le=LARGEST_ANGLE)]
Amplitude = Annotated[float, Field(ge=0.0, le=LARGEST_LENGTH)]
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
Pair = tuple[Length, Length]
Triple = tuple[Length, Length, Length]
AnglePair = tuple[Angle, Angle]
AngleTriple = tuple[Angle, Angle, Angle]
Format = Annotated[int, Field(ge=1, le=1)]
ReadingModel = Literal["chief_ray", "coupled_mode"]

# What they expect, for messages and tables.
AMPLITUDE: Final = "a number of at least 0"
DEVIATION: Final = "a standard deviation of at least 0"
POSITIVE: Final = "a positive number"
POSITIVE_LENGTH: Final = "a positive length in mm"
SHARE: Final = "a share from 0 to 1"
SEED: Final = "an integer from 0 to 2^64 - 1"
ANGLES: Final = "two angles below 0.1 rad, in µrad"
THREE_ANGLES: Final = "three angles below 0.1 rad, in µrad"
THREE_LENGTHS: Final = "three lengths in mm"
READING_MODEL: Final = '"chief_ray" or "coupled_mode"'


FILE_FORMAT: Final = (
    1  # of scenarios, heads and studies: a number that changes where an older program would misread one
)


class Section(BaseModel):
    """Keys are typed strictly (an integer may stand for a float), finite, and no other is accepted."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)

    # Of alternatives for one table, the key that says which it is.
    tag: ClassVar[str] = ""


def key(expected: str, meaning: str, default: Any = ..., example: Any = None) -> Any:
    """A key of a section. `expected` completes "expected ..." in messages; `example` is for the template."""
    return Field(default, description=meaning, json_schema_extra={"expected": expected, "example": example})


def format_key() -> Any:
    """The version of a file's format, which is its first key."""
    return key(
        f"the number {FILE_FORMAT}",
        "The version of the file's format; without it 1. A program refuses a newer one.",
        FILE_FORMAT,
    )


def tables(placeholder: str) -> Any:
    """Tables with names of the user's own, by default none; documentation writes [section.PLACEHOLDER]."""
    return Field({}, json_schema_extra={"placeholder": placeholder})


Narrow = TypeVar("Narrow", bound=Section)


def narrowed(section: Section, model: type[Narrow]) -> Narrow:
    """The keys that `model` has, of a section that has others beside them; so of the sections in it."""
    kept: dict[str, Any] = {}
    for name in section.model_fields_set & model.model_fields.keys():
        value, kinds = getattr(section, name), model.model_fields[name].annotation
        sections = [
            kind for kind in (get_args(kinds) or (kinds,)) if isinstance(kind, type) and issubclass(kind, Section)
        ]
        kept[name] = narrowed(value, sections[0]) if sections and isinstance(value, Section) else value
    return model.model_construct(**kept)
