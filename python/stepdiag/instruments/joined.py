"""Two instruments that read one head together: an interferometer its distance, an adapter the spot or the tilts."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime
from types import TracebackType
from typing import Final, Self

from stepdiag.instruments.instrument import Instrument, ReadColumn, Sample

APART: Final = 0.1  # s between the values of both, of a sample


@dataclass
class JoinedInstruments:
    """See Instrument. The columns of the first, then those of the second.

    Both are read one after the other, and each gives what it has taken since it was asked. A sample whose values are
    further apart than APART has none: the mirror may have moved between them."""

    first: Instrument
    second: Instrument
    _opened: ExitStack = field(default_factory=ExitStack)

    @property
    def name(self) -> str:
        return f"{self.first.name} + {self.second.name}"

    @property
    def columns(self) -> tuple[ReadColumn, ...]:
        return (*self.first.columns, *self.second.columns)

    @property
    def axes(self) -> tuple[int, ...]:
        return self.first.axes

    def __enter__(self) -> Self:
        self._opened.enter_context(self.first)
        try:
            self._opened.enter_context(self.second)
        except BaseException:
            self._opened.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._opened.close()

    def describe(self) -> dict[str, str]:
        return {**self.first.describe(), **{f"second {name}": text for name, text in self.second.describe().items()}}

    def read(self) -> Sample:
        one = self.first.read()
        first_taken = one.time or datetime.now(UTC)
        other = self.second.read()
        apart = abs(((other.time or datetime.now(UTC)) - first_taken).total_seconds())
        values, reasons = (*one.values, *other.values), (*one.reasons, *other.reasons)
        if apart > APART:
            values, reasons = (None,) * len(values), (f"the two instruments are {apart:.2f} s apart",) * len(values)
        return Sample(values, reasons, first_taken, {**one.signal, **other.signal})

    def use_line(self, line: str) -> None:
        self.first.use_line(line)
        self.second.use_line(line)

    def visit(self, number: int, index: int, digest: str) -> None:
        self.first.visit(number, index, digest)
        self.second.visit(number, index, digest)

    def set_up(self, number: int) -> None:
        self.first.set_up(number)
        self.second.set_up(number)

    def go_to(self, position: Sequence[float]) -> bool:
        moved = self.first.go_to(position)
        return self.second.go_to(position) or moved

    @property
    def has_optics_alignment(self) -> bool:
        return self.first.has_optics_alignment

    def optics_alignment(self, is_on: bool) -> None:
        self.first.optics_alignment(is_on)

    def signal(self) -> Sample:
        one, other = self.first.signal(), self.second.read()
        return Sample((*one.values, *other.values), (*one.reasons, *other.reasons), other.time, one.signal)

    def make_ready(self, is_begun: bool, tell: Callable[[str], None]) -> None:
        self.first.make_ready(is_begun, tell)
        self.second.make_ready(is_begun, tell)
