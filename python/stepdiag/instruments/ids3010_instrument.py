"""The attocube IDS3010 as the instrument of an acquisition."""

from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Literal, Self

from stepdiag.instruments.ids3010 import ALIGNING, IDLE, RUNNING, STARTING, TWIN, Ids3010
from stepdiag.instruments.instrument import InstrumentError, ReadColumn, Sample


class Ids3010Instrument:
    """Some axes of an IDS3010, each of which fills a channel of the head. See Instrument."""

    def __init__(
        self,
        client: Ids3010,
        channels: Sequence[str],
        axes: Sequence[int],
        *,
        start: Literal["auto", "never"] = "auto",
        start_timeout: float = 90.0,
        axes_by_line: Mapping[str, Sequence[int]] | None = None,
    ) -> None:
        """axes: the instrument's axis, from 1, of each channel; axes_by_line: of lines with heads of their own. start:
        whether its measurement is started again where it is stopped or warns at a set-up; that takes up to
        `start_timeout` seconds."""
        self.name = client.name
        self.columns = tuple(ReadColumn(channel, "pm") for channel in channels)
        self.axes = tuple(axes)
        self._client = client
        self._start, self._start_timeout = start, start_timeout
        self._axes_by_line = axes_by_line or {}
        self._is_twin = False

    def __enter__(self) -> Self:
        self._client.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.__exit__(kind, error, trace)

    def describe(self) -> dict[str, str]:
        known = self._client.describe()
        self._is_twin = TWIN in known.get("type", "")
        return known

    def read(self) -> Sample:
        read = self._client.read([axis - 1 for axis in self.axes])
        return Sample(read.pm, tuple(self._client.error_text(number) if number else "" for number in read.warnings))

    def use_line(self, line: str) -> None:
        self.axes = tuple(self._axes_by_line.get(line, self.axes))

    def visit(self, number: int, index: int, digest: str) -> None:
        if self._is_twin:
            self._client.ask("stepdiag.twin.visit", [number, index, digest])

    def set_up(self, number: int) -> None:
        if self._is_twin:
            self._client.ask("stepdiag.twin.setUp", [number])

    def go_to(self, position: Sequence[float]) -> bool:
        if self._is_twin:
            self._client.ask("stepdiag.twin.moveTo", list(position))
        return self._is_twin

    has_optics_alignment = True

    def optics_alignment(self, is_on: bool) -> None:
        client = self._client
        if is_on and client.mode() != ALIGNING:
            if client.mode() == RUNNING:
                client.ask("system.stopMeasurement")
                client.wait_for(IDLE, self._start_timeout)
            client.ask("system.startOpticsAlignment")
            client.wait_for(ALIGNING, self._start_timeout)
        elif not is_on and client.mode() == ALIGNING:
            client.ask("system.stopOpticsAlignment")
            client.wait_for(IDLE, self._start_timeout)

    def signal(self) -> Sample:
        shown: dict[str, float] = {}
        for column, axis in zip(self.columns, self.axes, strict=True):
            _, contrast, baseline, *_ = self._client.ask("adjustment.getContrastInPermille", [axis - 1])
            shown[f"{column.channel} contrast"] = float(contrast)
            shown[f"{column.channel} baseline"] = float(baseline)
        nothing = (None,) * len(self.columns)
        return Sample(nothing, ("aligning its optics",) * len(self.columns), signal=shown)

    def make_ready(self, is_begun: bool, tell: Callable[[str], None]) -> None:
        """Make sure that the instrument measures and reports no missing beam.

        Moving the head interrupts all beams, so this is called at every set-up."""
        mode = self._client.mode()
        if mode in STARTING:
            self._client.wait_for(RUNNING, self._start_timeout)
            mode = RUNNING
        sample = self.read() if mode == RUNNING else None
        if sample is not None and not any(sample.reasons):
            return
        texts = {text for text in sample.reasons if text} if sample else {mode}
        state = f"{self.name}: {', '.join(sorted(texts))}"
        if is_begun:
            raise InstrumentError(
                f"{state}; restarting the measurement would change the constant of this set-up: use `restart_set_up`"
            )
        if self._start == "never":
            raise InstrumentError(f"{state}; expected a running measurement without warnings")
        tell(f"{state}; restarting its measurement")
        self._client.start(self._start_timeout)
