"""Acquisition of a run: from the instrument to a raw file, then to a measurement file."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.conductor import Conductor
from stepdiag.acquisition.options import AcquireOptions, Resume
from stepdiag.acquisition.raw_file import RawContent, RawFile, check_new
from stepdiag.acquisition.raw_records import Header, Record
from stepdiag.acquisition.reading_plan import channels_of_axes, check_axes, described_plan, digest_of
from stepdiag.acquisition.run_from_raw import measurement_of
from stepdiag.acquisition.temperature_file import TemperatureFile
from stepdiag.acquisition.triggers import Operator, Silent, Trigger
from stepdiag.acquisition.visit_loop import Acquisition
from stepdiag.instruments.ids3010 import Ids3010, parse_source
from stepdiag.instruments.ids3010_instrument import Ids3010Instrument
from stepdiag.instruments.instrument import Instrument, InstrumentError
from stepdiag.instruments.joined import JoinedInstruments
from stepdiag.instruments.line_instrument import line_instrument
from stepdiag.io.data_files import write_measurement
from stepdiag.io.whole_files import check_output
from stepdiag.planning.measuring_time import times_of
from stepdiag.scenario.description import Scenario
from stepdiag.scenario.known import Known
from stepdiag.wrong_arguments import checked


@dataclass(frozen=True)
class Acquired:
    """The files and counts of a finished or interrupted acquisition."""

    raw: Path
    output: Path
    readings: int
    lost: int  # readings with at least one missing beam
    planned: int

    @property
    def complete(self) -> bool:
        return self.readings == self.planned


def raw_path(output: Path) -> Path:
    """Default path of the raw file: beside the output, run.raw.jsonl for run.csv."""
    return output.with_suffix(".raw.jsonl")


@checked
def acquire(
    scenario: Scenario | Known,
    source: str,
    output: Path,
    *,
    trigger: Trigger,
    options: AcquireOptions | None = None,
    resume: Resume | None = None,
    raw: Path | None = None,
    operator: Operator | None = None,
    temperatures: Path | None = None,
    watched: bool = False,
    after_visit: Callable[[Conductor], None] | None = None,
) -> Acquired:
    """Acquire the readings of a scenario's plan from an instrument and write the measurement.

    Every value goes to the raw file first. `output` is rewritten from it after every visit and at
    the end, also when an error or an interruption ends the acquisition. Then the readings so far
    are kept and the acquisition can be resumed. The trigger is closed in any case.

    Args:
        scenario: its `known` half is used; the instrument must give the channels of its head
            (docs/acquisition.md).
        source: the instrument: "ids3010://HOST[:PORT]", "lines://HOST:PORT" or "program:COMMAND".
        output: measurement to write, CSV or netCDF (.nc).
        trigger: decides when to read: KeyTrigger, SettleTrigger or TcpTrigger.
        resume: continue a raw file: "point", where it stopped; "line" or "set-up", reading its last
            line or set-up again. None: begin a new one.
        raw: the raw file; None: `raw_path(output)`.
        operator: receives messages and confirms; None: messages are dropped.
        temperatures: CSV file that another program appends temperatures to (docs/acquisition.md).
        watched: publish what happens beside the raw file, and do what watchers want (docs/acquisition.md).
        after_visit: called when a line has been read and `output` has it; may `tell` the people.

    Raises:
        InvalidArgument: an option, the head or a file does not suit, or a file exists that would be
            lost.
        InstrumentError: the instrument cannot be reached or fails.
    """
    known, options, operator = scenario.known, options or AcquireOptions(), operator or Silent()
    try:
        instrument = instrument_of(source, known, options, operator.tell)
        path = _checked_raw_path(raw, output)
        followed = None
        if temperatures is not None:
            followed = TemperatureFile(temperatures, age=options.temperature_age, tell=operator.tell)
        plan = described_plan(known)
        with ExitStack() as opened:
            opened.enter_context(instrument)
            columns = instrument.columns
            header = Header(
                created=datetime.now(UTC),
                scenario=known.path.name,
                digest=digest_of([column.channel for column in columns], plan),
                columns=[column.name for column in columns],
                axes=list(instrument.axes),
                sign=options.sign,
                plan=plan,
            )
            file, content = opened.enter_context(_opened(path, header, resume, instrument))
            conductor = opened.enter_context(Conductor(instrument, operator, path if watched else None, options.sign))
            work = Acquisition(known, header, file, instrument, trigger, conductor, options, followed)
            conductor.state.visits, conductor.state.planned = len(plan), sum(len(visit.points) for visit in plan)
            conductor.set_ups = plan[-1].set_up
            conductor.set_up_seconds = times_of(known.keys.plan_by_time, f"{known.path}: plan_by_time").line_change
            if content is not None:
                work.go_on(content, resume or "point")

            def write() -> None:
                # Same content as the raw file, without reading it again after every visit.
                records: tuple[Record, ...] = (*work.recorded, *work.done.values())
                run = measurement_of(
                    RawContent(path, header, records, sound_bytes=0, torn_bytes=0),
                    zero=options.zero,
                    uncertainties=options.uncertainties,
                    temperature_age=options.temperature_age,
                )
                write_measurement(run, output)
                if after_visit is not None:
                    after_visit(conductor)

            try:
                work.run(source, write)
            except (InstrumentError, InvalidArgument) as error:
                trigger.failed(str(error))
                raise
            finally:
                if work.done:
                    after_visit = None
                    write()
    finally:
        trigger.close()
    lost = sum(1 for reading in work.done.values() if reading.is_lost)
    return Acquired(path, output, len(work.done), lost, sum(len(visit.points) for visit in plan))


def _checked_raw_path(raw: Path | None, output: Path) -> Path:
    """The path of the raw file. Raises InvalidArgument where the acquisition would overwrite a file."""
    check_output(output)
    path = raw or raw_path(output)
    if path.resolve() == output.resolve():
        raise InvalidArgument(f"{path}: expected different names for the raw file and the output")
    if output.exists() and output.stat().st_size > 0 and not path.exists():  # an empty one holds a name
        raise InvalidArgument(f"{output}: exists, and was not made from {path}: move it away, or name another -o")
    return path


def instrument_of(source: str, known: Known, options: AcquireOptions, warn: Callable[[str], None]) -> Instrument:
    """The instrument of a source, not yet connected. Raises InvalidArgument."""
    first, plus, second = source.partition(" + ")
    if plus:
        if known.head.layout not in ("psd", "ideal"):
            raise InvalidArgument(
                f'source: two instruments read distance and spot, or distance and tilts; a head "{known.head.layout}" '
                "has beams"
            )
        options = replace(options, axes=options.axes or (1,))
        distance, others = known.signals[:1], known.signals[1:]
        one = _ids3010(first, list(distance), known, options)
        return JoinedInstruments(one, line_instrument(second, known, timeout=options.timeout, warn=warn, only=others))
    kind = source.partition(":")[0]
    if kind in ("lines", "program", "serial"):
        if options.axes is not None:
            raise InvalidArgument(f"axes: lines name their channels; only an IDS3010 has axes, got {source!r}")
        return line_instrument(source, known, timeout=options.timeout, warn=warn)
    if kind != "ids3010":
        raise InvalidArgument(
            "source: expected ids3010://HOST, lines://127.0.0.1:PORT, serial:PORT or program:COMMAND, or an IDS3010 "
            f"and one of the others with ' + ' between them, got {source!r}"
        )
    return _ids3010(source, channels_of_axes(known), known, options)


def _ids3010(source: str, channels: list[str], known: Known, options: AcquireOptions) -> Ids3010Instrument:
    own = {line: head.keys.channels for line, head in known.described_heads.items() if head.keys.channels is not None}
    if own and options.axes is not None:
        raise InvalidArgument("axes: the scenario says in `channels` of its heads which axes they have; expected one")
    by_line = {line: _axes_of_head(known, line, names, channels) for line, names in own.items()}
    axes = options.axes or next(iter(by_line.values()), tuple(range(1, len(channels) + 1)))
    check_axes(axes, channels)
    host, port = parse_source(source)
    client = Ids3010(host, port, timeout=options.timeout, attempts=options.attempts)
    return Ids3010Instrument(
        client, channels, axes, start=options.start, start_timeout=options.start_timeout, axes_by_line=by_line
    )


def _axes_of_head(known: Known, line: str, names: Sequence[str], channels: Sequence[str]) -> tuple[int, ...]:
    place = f"{known.path}: {known.described_heads[line].place}.channels"
    if not all(name.isdecimal() for name in names):
        raise InvalidArgument(f'{place}: expected axes of the IDS3010 such as ["2"], got {list(names)!r}')
    axes = tuple(int(name) for name in names)
    try:
        check_axes(axes, channels)
    except InvalidArgument as error:
        raise InvalidArgument(f"{place}: {error}") from None
    return axes


@contextmanager
def _opened(
    path: Path, header: Header, resume: Resume | None, instrument: Instrument
) -> Iterator[tuple[RawFile, RawContent | None]]:
    """Open the raw file: a new one, or one to continue together with its content."""
    if resume is None:
        check_new(path)
        instrument.describe()  # before the file is made: an unreachable instrument leaves none
        with RawFile.create(path, header) as file:
            yield file, None
        return
    file, content = RawFile.resume(path)
    with file:
        for key, what in (
            ("digest", "plan, head or channels"),
            ("read_columns", "instrument"),
            ("axes", "axes"),
            ("sign", "sign"),
        ):
            if getattr(content.header, key) != getattr(header, key):
                raise InvalidArgument(f"{path}: was begun with another {what}; resume it with the same")
        yield file, content
