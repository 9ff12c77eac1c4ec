"""The records of a raw file, one per line."""

from typing import Annotated, Literal, Self

from pydantic import AwareDatetime, Field, TypeAdapter, ValidationError, model_validator

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.settling import ValueKind
from stepdiag.config.key_types import Section, Triple

Picometres = Annotated[int, Field(gt=-(2**63), lt=2**63)]
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
    version: Literal[1] = 1
    created: AwareDatetime
    scenario: str
    digest: str  # of channels and plan, see digest_of
    channels: Annotated[list[str], Field(min_length=1)]
    axes: list[Count]  # instrument axis (from 1) of each channel
    sign: Literal[1, -1]  # -1: positions decrease as the distance increases
    plan: list[Visited]


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
    """One value of every axis; null where the beam was missing."""

    record: Literal["value"] = "value"
    time: AwareDatetime
    kind: ValueKind
    pm: list[Picometres | None]


class RawReading(Point):
    """The reading of a point.

    Means, standard deviations of a single value, number of averaged values, and reasons for lost
    channels."""

    record: Literal["reading"] = "reading"
    time: AwareDatetime
    pm: list[Picometres | None]
    sd_pm: list[float | None]
    values: Count
    lost: dict[str, str]

    @property
    def is_lost(self) -> bool:
        """Whether at least one beam is missing."""
        return any(pm is None for pm in self.pm)


Record = Annotated[Header | Session | Again | TemperatureRow | Value | RawReading, Field(discriminator="record")]
_RECORD: TypeAdapter[Record] = TypeAdapter(Record)


def parse_record(line: bytes, place: str) -> Record:
    """Parse a line. Raises InvalidArgument beginning with `place`."""
    try:
        return _RECORD.validate_json(line)
    except ValidationError as error:
        detail = error.errors(include_url=False)[0]
        keys = ".".join(str(key) for key in detail["loc"][1:])
        got = ascii(line[:40].decode(errors="replace") if detail["type"] == "json_invalid" else detail["input"])
        got = got if len(got) <= 60 else got[:60] + "..."
        raise InvalidArgument(f"{place}: {keys + ': ' if keys else ''}{detail['msg']}, got {got}") from None
