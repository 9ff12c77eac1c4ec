"""Any instrument whose adapter sends JSON lines: a header, then a line for every sample.

docs/acquisition.md has the protocol.
"""

import ipaddress
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from types import TracebackType
from typing import Any, Final, Self
from urllib.parse import urlsplit

from stepdiag._core import InvalidArgument, newer_format
from stepdiag.instruments.ids3010 import TWIN
from stepdiag.instruments.ids3010_messages import shown
from stepdiag.instruments.instrument import InstrumentError, ReadColumn, Sample, columns_of_signals
from stepdiag.instruments.line_streams import BAUD, Connection, LineFeed, ProgramOutput, SerialPort, Stream
from stepdiag.io.whole_files import reason
from stepdiag.platform import words_of
from stepdiag.scenario.known import Known

VERSION: Final = 1
KEYS: Final = {"stepdiag_lines", "channels", "visits"}  # of the header; others are texts about the instrument
_HEADER: Final = b'{"stepdiag_lines"'
HEADER: Final = 10.0  # s to wait for the header at least: programs take a while to start
LARGEST: Final = 1e9  # mm or urad
AHEAD: Final = timedelta(minutes=1)  # by which an adapter's clock may be fast


@dataclass(frozen=True)
class LineHeader:
    """The first line: the columns in the adapter's order, whether it is told of visits, and texts about it."""

    columns: tuple[str, ...]
    visits: bool
    about: dict[str, str]


def parse_header(line: bytes) -> LineHeader:
    """Raises ValueError saying what was expected."""
    expected = f'expected a header such as {{"stepdiag_lines": {VERSION}, "channels": ["distance_mm"]}}'
    content = _object(line, expected)
    if content.get("stepdiag_lines") != VERSION or isinstance(content["stepdiag_lines"], bool):
        newer = newer_format(str(VERSION), str(content.get("stepdiag_lines")))
        raise ValueError(f"{expected}, got {shown(line)}{newer}")
    names, visits = content.get("channels"), content.get("visits", False)
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise ValueError("channels: expected a list of names such as distance_mm")
    if len(set(names)) < len(names):
        raise ValueError("channels: expected different names")
    if not isinstance(visits, bool):
        raise ValueError("visits: expected true or false")
    about = {key: value for key, value in content.items() if key not in KEYS}
    wrong = [key for key, value in about.items() if not isinstance(value, str)]
    if wrong:
        raise ValueError(f"{wrong[0][:40]!a}: expected a text")
    return LineHeader(tuple(names), visits, about)


def parse_sample(line: bytes, names: Sequence[str]) -> Sample | int | str:
    """A sample with the columns `names`, which the line may have in any order; or the number of the visit that the
    adapter has gone to; or what a twin has done. Raises ValueError saying what was expected."""
    content = _object(line, f"expected a value for each of {', '.join(names)}")
    if content.keys() == {"error"}:
        raise ValueError(f"the adapter says: {ascii(content['error'])[:200]}")
    if content.keys() == {"visit"}:
        return _visit(content["visit"])
    if content.keys() == {"done"}:
        return str(content["done"])
    values: list[float | None] = []
    for name in names:
        if name not in content:
            raise ValueError(f"{name}: expected a number or null, got none")
        values.append(_value(name, content.pop(name)))
    why, time = content.pop("why", "no reason given"), content.pop("time", None)
    signal = _signal(content.pop("signal", {}))
    if not isinstance(why, str):
        raise ValueError("why: expected a text")
    if content:
        raise ValueError(f"expected {', '.join(names)}, time, why and signal only, got {next(iter(content))[:40]!a}")
    reasons = tuple(why[:100] if value is None else "" for value in values)
    return Sample(tuple(values), reasons, None if time is None else _time(time), signal)


class LineInstrument:
    """An adapter that sends lines. See Instrument."""

    axes: tuple[int, ...] = ()

    def __init__(
        self,
        open_stream: Callable[[], Stream],
        known: Known,
        *,
        timeout: float,
        only: Sequence[str] | None = None,
        repeats: bool = False,
    ) -> None:
        """timeout: seconds to wait for a line. only: the channels of the head that it gives. repeats: the header comes
        again and again, and lines before the first one are passed over."""
        self._repeats = repeats
        self._open_stream, self._timeout = open_stream, timeout
        self._known, self._only = known, only
        self._names: tuple[str, ...] = ()  # of the values of a sample
        self._used: tuple[int, ...] = ()  # of these, the columns of the line's head
        self.name = ""
        self._columns: tuple[ReadColumn, ...] = ()
        self._stream: Stream | None = None
        self._feed: LineFeed | None = None
        self._header: LineHeader | None = None
        self._newest: Sample | None = None
        self._at: int | None = None  # the visit that the adapter has gone to
        self._done = ""  # what a twin did last
        self._old = 0  # samples since one was asked for that were taken before

    @property
    def columns(self) -> tuple[ReadColumn, ...]:
        return self._columns

    def __enter__(self) -> Self:
        self._stream = self._open_stream()
        self.name = self._stream.name
        self._feed = LineFeed(self._stream, self._take)
        try:
            self._feed.wait_for_first(max(self._timeout, HEADER))
            if self._repeats:
                self._feed.wait(HEADER, lambda: self._header is not None, lambda: f"no header within {HEADER:g} s")
            elif self._header is None:  # the line was no header
                self._feed.wait(0.0, lambda: False, lambda: "expected a header")
        except BaseException:
            self._feed.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._feed is not None
        self._feed.close()

    def describe(self) -> dict[str, str]:
        assert self._header is not None
        return self._header.about

    def read(self) -> Sample:
        asked = datetime.now(UTC)
        self._old = 0

        def is_new() -> bool:
            assert self._newest is not None
            taken = self._newest.time
            self._old += taken is not None and taken < asked
            return taken is None or taken >= asked

        def missing() -> str:
            if not self._old or self._newest is None or self._newest.time is None:
                return f"no sample within {self._timeout:g} s"
            late = (asked - self._newest.time).total_seconds()
            return (
                f"no new sample within {self._timeout:g} s: the last of {self._old} has a time {late:.3f} s before it "
                "was asked for; do the clocks agree?"
            )

        assert self._feed is not None
        self._feed.wait(self._timeout, lambda: self._newest is not None and is_new(), missing)
        newest = self._newest
        assert newest is not None
        values = tuple(newest.values[place] for place in self._used)
        return replace(newest, values=values, reasons=tuple(newest.reasons[place] for place in self._used))

    def use_line(self, line: str) -> None:
        own = self._known.described_heads[line].keys.channels
        if own is not None:
            self._used = tuple(self._names.index(name) for name in own)

    def visit(self, number: int, index: int, digest: str) -> None:
        assert self._header is not None
        assert self._stream is not None
        assert self._feed is not None
        if not self._header.visits:
            return
        line = json.dumps({"visit": number, "place": index, "digest": digest}).encode() + b"\n"
        self._at = None
        try:
            self._stream.send(line)
        except OSError as error:
            raise InstrumentError(f"{self.name}: cannot be told of visit {number}: {reason(error)}") from None
        self._feed.wait(
            self._timeout,
            lambda: self._at == number,
            lambda: f'expected the answer {{"visit": {number}}} within {self._timeout:g} s',
        )

    def set_up(self, number: int) -> None:
        self._ask_twin("set_up", number)

    def go_to(self, position: Sequence[float]) -> bool:
        return self._ask_twin("move", [float(one) for one in position])

    has_optics_alignment = False

    def optics_alignment(self, is_on: bool) -> None:
        pass  # the signal comes with every sample

    def signal(self) -> Sample:
        return self.read()

    def _ask_twin(self, what: str, content: Any) -> bool:
        assert self._stream is not None
        assert self._feed is not None
        if self.describe().get("instrument") != TWIN:
            return False
        self._done = ""
        try:
            self._stream.send(json.dumps({what: content}).encode() + b"\n")
        except OSError as error:
            raise InstrumentError(f"{self.name}: cannot be asked: {reason(error)}") from None
        self._feed.wait(self._timeout, lambda: self._done == what, lambda: f"no answer within {self._timeout:g} s")
        return True

    def make_ready(self, is_begun: bool, tell: Callable[[str], None]) -> None:
        pass  # the adapter's business

    def _take(self, number: int, line: bytes) -> None:
        """Called by the feed, one line at a time."""
        if self._header is None or line.startswith(_HEADER):
            try:
                header = parse_header(line)
            except ValueError:
                if self._repeats:  # a line that began before we listened
                    return
                raise
            if self._header is not None:
                if not self._repeats or header != self._header:
                    raise ValueError("a second header")
                return
            self._columns, self._names = columns_of_lines(self._known, header.columns, self._only)
            self._used = tuple(range(len(self._columns)))
            self._header = header
            return
        found = parse_sample(line, self._names)
        if isinstance(found, Sample):
            self._newest = found
        elif isinstance(found, str):
            self._done = found
        else:
            self._at = found


def columns_of_lines(
    known: Known, names: Sequence[str], only: Sequence[str] | None = None
) -> tuple[tuple[ReadColumn, ...], tuple[str, ...]]:
    """The columns of a head, in its order, and how the adapter names them, where these are their names; of several
    heads all names, those of the first head first. Raises ValueError.

    Of an ideal head the distance alone will do, for the conventional evaluation."""
    columns = columns_of_signals(known.signals if only is None else only)
    given, wanted = set(names), [column.name for column in columns]
    if known.head.layout == "ideal" and given == {"distance_mm"}:
        return columns[:1], ("distance_mm",)
    of_heads = [head.keys.channels for head in known.described_heads.values() if head.keys.channels is not None]
    if of_heads:
        for own in of_heads:
            units = [name.rpartition("_")[2] for name in own]
            if units != [column.unit for column in columns]:
                raise ValueError(
                    f"channels: expected names for {', '.join(wanted)}, units included, got {', '.join(own)}"
                )
        wanted = list(dict.fromkeys(name for own in of_heads for name in own))
    if given == set(wanted):
        return columns, tuple(wanted)
    missing = [name for name in wanted if name not in given]
    unknown = [name for name in names if name not in wanted]
    told = [f"{what} {', '.join(which)[:200]}" for what, which in (("without", missing), ("with", unknown)) if which]
    raise ValueError(
        f'channels: the head (layout "{known.head.layout}") has {", ".join(wanted)}; got them {" and ".join(told)}'
    )


def line_instrument(
    source: str,
    known: Known,
    *,
    timeout: float,
    warn: Callable[[str], None],
    only: Sequence[str] | None = None,
) -> LineInstrument:
    """The instrument of "lines://HOST:PORT", "serial:PORT" or "program:COMMAND", not yet connected. only: the channels
    of the head that it gives. Raises InvalidArgument."""
    kind, _, rest = source.partition(":")
    if kind == "serial":
        device, _, speed = rest.partition("?baud=")
        if not device or not (speed or "1").isdecimal():
            raise InvalidArgument(f"source: expected serial:PORT or serial:PORT?baud=115200, got {source!r}")
        return LineInstrument(
            lambda: SerialPort(device, int(speed or BAUD)), known, timeout=timeout, only=only, repeats=True
        )
    if kind == "program":
        try:
            arguments = words_of(rest)
        except ValueError as error:
            raise InvalidArgument(f"source: {rest[:100]!r}: {error}") from None
        if not arguments:
            raise InvalidArgument("source: expected program:COMMAND, got no command")
        name = f"program {arguments[0]}"
        return LineInstrument(lambda: ProgramOutput(name, arguments), known, timeout=timeout, only=only)
    host, port = _address(source)
    if not _is_loopback(host):
        warn(f"warning: {source}: not on this computer: anybody on the way can change the readings")
    return LineInstrument(lambda: Connection(source, host, port, timeout), known, timeout=timeout, only=only)


def _address(source: str) -> tuple[str, int]:
    try:
        parts = urlsplit(source)
        if parts.scheme == "lines" and parts.hostname and parts.port and not (parts.path or parts.query):
            return parts.hostname, parts.port
    except ValueError:
        pass
    raise InvalidArgument(f"source: expected lines://127.0.0.1:PORT, got {source!r}")


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _object(line: bytes, expected: str) -> dict[str, Any]:
    try:
        content = json.loads(line.decode(), parse_constant=_no_number, object_pairs_hook=_different)
    except RecursionError:
        content = None
    except ValueError as error:
        told = "" if isinstance(error, json.JSONDecodeError | UnicodeDecodeError) else f" ({error})"
        raise ValueError(f"{expected}, got {shown(line)}{told}") from None
    if not isinstance(content, dict):
        raise ValueError(f"{expected}, got {shown(line)}")
    return content


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON: a lost value is null")


def _different(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) < len(pairs):
        raise ValueError("a key twice")
    return content


def _value(name: str, value: Any) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"{name}: expected a number of at most {LARGEST:g} or null, got {ascii(value)[:40]}")
    return float(value)


def _signal(value: Any) -> dict[str, float]:
    """How much light comes back: a number, or several by name."""
    named = value if isinstance(value, dict) else {"signal": value}
    for one in named.values():
        if isinstance(one, bool) or not isinstance(one, int | float) or not abs(one) <= LARGEST:
            raise ValueError(f"signal: expected a number, or an object of numbers, got {ascii(one)[:40]}")
    return {str(name)[:30]: float(one) for name, one in list(named.items())[:8]}


def _visit(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"visit: expected a whole number, got {ascii(value)[:40]}")
    return value


def _time(value: Any) -> datetime:
    """A moment: seconds since 1970, or ISO 8601 with its offset from UTC."""
    try:
        if isinstance(value, str):
            time = datetime.fromisoformat(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            time = datetime.fromtimestamp(value, UTC)
        else:
            raise ValueError
        if time.tzinfo is None:
            raise ValueError
        time = time.astimezone(UTC)
    except (ValueError, OverflowError, OSError):
        raise ValueError(
            f"time: expected seconds since 1970, or a time such as 2026-01-31T12:00:00.25Z, got {ascii(value)[:40]}"
        ) from None
    if time > datetime.now(UTC) + AHEAD:
        raise ValueError(f"time: expected one that is past, got {ascii(value)[:40]}")
    return time
