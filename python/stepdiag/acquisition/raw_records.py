"""The records of a raw file, one per line."""

from typing import Annotated, Any, Final, Literal, Self

from pydantic import (
    AliasChoices,
    AwareDatetime,
    Field,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import from_json

from stepdiag._core import InvalidArgument, newer_format
from stepdiag.acquisition.settling import ValueKind
from stepdiag.config.key_types import Section, Triple
from stepdiag.instruments.instrument import Number, ReadColumn

LATEST: Final = 3  # version of the format
LARGEST: Final = 2**63  # pm; 9 km


def _quantity(value: Any) -> Number:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST:
        raise ValueError("expected a finite number")
    return value


# Whole picometres, or mm and urad. Files of version 1 have only the former, under the names `pm` and `sd_pm`.
Quantity = Annotated[Number, PlainValidator(_quantity)]
Quantities = Annotated[list[Quantity | None], Field(validation_alias=AliasChoices("read", "pm"))]
Count = Annotated[int, Field(ge=0, le=10**9)]
Direction = Literal["forward", "backward"]
RecordedColumn = Literal[
    "temperature_c",
    "temperature_x_c",
    "temperature_y_c",
    "temperature_z_c",
    "air_temperature_c",
    "air_pressure_hpa",
    "air_humidity_percent",
]


class Visited(Section):
    """A visit of the plan. `nominal_mm`: readings of an ideal head on a machine without errors."""

    visit: Count
    set_up: Count
    line: str
    run: Count
    direction: Direction
    scale_line: bool
    points: list[Count]
    position_mm: list[Triple]
    nominal_mm: list[float]

    @model_validator(mode="after")
    def _of_one_length(self) -> Self:
        if not len(self.points) == len(self.position_mm) == len(self.nominal_mm):
            raise ValueError("expected as many positions and distances as points")
        return self


class Header(Section):
    """The first record: everything that is needed to make a measurement file."""

    record: Literal["header"] = "header"
    format: Literal["stepdiag raw readings"] = "stepdiag raw readings"
    version: Literal[1, 2, 3] = LATEST
    created: AwareDatetime
    scenario: str
    digest: str  # of channels and plan, see digest_of
    # Channels with the units of `read`, such as d1_pm or spot_x_mm; in version 1 the `channels` alone, in pm.
    columns: list[str] = Field(min_length=1, validation_alias=AliasChoices("columns", "channels"))
    axes: list[Count]  # instrument axis (from 1) of each column; empty where the instrument names its columns
    sign: Literal[1, -1]  # -1: positions decrease as the distance increases
    plan: list[Visited]

    @model_validator(mode="after")
    def _has_columns(self) -> Self:
        for name in self.columns if self.version > 1 else ():
            ReadColumn.of(name)
        return self

    @property
    def read_columns(self) -> tuple[ReadColumn, ...]:
        """What each value of `read` is."""
        if self.version == 1:
            return tuple(ReadColumn(channel, "pm") for channel in self.columns)
        return tuple(ReadColumn.of(name) for name in self.columns)

    @property
    def channels(self) -> list[str]:
        return [column.channel for column in self.read_columns]


class Session(Section):
    """The beginning of an acquisition, or of its continuation."""

    record: Literal["session"] = "session"
    time: AwareDatetime
    stepdiag: str
    source: str
    instrument: dict[str, str]
    options: str
    visit: Count
    point: Count
    temperatures: str | None = None  # the file that was followed


class Again(Section):
    """Marks that this visit and all later ones are read again."""

    record: Literal["again"] = "again"
    time: AwareDatetime
    visit: Count


class Remark(Section):
    """What a person says, and the point that was read or waited for then."""

    record: Literal["remark"] = "remark"
    time: AwareDatetime
    visit: Count
    point: Count
    text: str


class TemperatureRow(Section):
    """A row of the file of temperatures, as it was read; null: an empty field."""

    record: Literal["temperatures"] = "temperatures"
    time: AwareDatetime
    line: Count  # in the file
    values: dict[RecordedColumn, float | None]


class Point(Section):
    """A point of the plan."""

    visit: Count
    line: str
    run: Count
    direction: Direction
    point: Count
    position_mm: Triple  # commanded


class Value(Point):
    """One value of every column; null where it was missing."""

    record: Literal["value"] = "value"
    time: AwareDatetime
    kind: ValueKind
    read: Quantities


class RawReading(Point):
    """The reading of a point.

    Means, standard deviations of a single value, number of averaged values, and reasons for lost
    channels."""

    record: Literal["reading"] = "reading"
    time: AwareDatetime
    read: Quantities
    sd: list[float | None] = Field(validation_alias=AliasChoices("sd", "sd_pm"))
    values: Count
    lost: dict[str, str]

    @property
    def is_lost(self) -> bool:
        """Whether at least one value is missing."""
        return None in self.read


Record = Annotated[
    Header | Session | Again | Remark | TemperatureRow | Value | RawReading, Field(discriminator="record")
]
_RECORD: TypeAdapter[Record] = TypeAdapter(Record)


def _check_not_newer(line: bytes, place: str) -> None:
    """Of a header. Raises InvalidArgument beginning with `place`."""
    try:
        content = from_json(line)  # json.loads ends with a RecursionError where brackets are nested too deeply
    except ValueError:
        return
    given = content.get("version") if isinstance(content, dict) else None
    newer = newer_format(str(LATEST), str(given))
    if newer:
        raise InvalidArgument(f"{place}: version: expected {LATEST} or less, got {given}{newer}") from None


def parse_record(line: bytes, place: str) -> Record:
    """Parse a line. Raises InvalidArgument beginning with `place`."""
    try:
        return _RECORD.validate_json(line)
    except ValidationError as error:
        _check_not_newer(line, place)
        detail = error.errors(include_url=False)[0]
        keys = ".".join(str(key) for key in detail["loc"][1:])
        got = ascii(line[:40].decode(errors="replace") if detail["type"] == "json_invalid" else detail["input"])
        got = got if len(got) <= 60 else got[:60] + "..."
        raise InvalidArgument(f"{place}: {keys + ': ' if keys else ''}{detail['msg']}, got {got}") from None
