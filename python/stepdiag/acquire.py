"""Acquisition: a run's readings from the instrument to the disk, and from there to a measurement file."""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from stepdiag._core import InvalidArgument, __version__
from stepdiag.acquire_plan import channels_of, check_axes, described_plan, digest_of, nominal_distances, placement
from stepdiag.acquire_triggers import Context, Operator, Silent, Trigger, point_text
from stepdiag.data_files import write_measurement
from stepdiag.files import check_output
from stepdiag.ids3010 import RUNNING, TWIN, Ids3010, InstrumentError, Sample, parse_source
from stepdiag.raw_file import RawContent, RawFile, Record, read_raw
from stepdiag.run_from_raw import Zero, measurement_of
from stepdiag.scenario import Scenario
from stepdiag.settling import Reading, Settling, take_reading
from stepdiag.visits import Visit, visits_of

Resume = Literal["point", "line", "set-up"]


@dataclass(frozen=True)
class AcquireOptions:
    """How an acquisition reads. Times in seconds."""

    axes: tuple[int, ...] | None = None  # of the instrument, from 1, one for each channel; none: 1, 2, ...
    sign: int = 1  # -1: its positions fall where the distance grows
    settling: Settling = field(default_factory=Settling)
    zero: Zero = "none"
    uncertainties: bool = False
    start: Literal["auto", "never"] = "auto"  # the instrument's measurement, at every set-up
    start_timeout: float = 90.0
    timeout: float = 2.0  # of one request
    attempts: int = 3  # of a request that only asks
    wait_timeout: float = 3600.0  # for a reading to be wanted

    def __post_init__(self) -> None:
        if self.sign not in (1, -1):
            raise InvalidArgument(f"sign: expected 1 or -1, got {self.sign!r}")
        if self.attempts < 1:
            raise InvalidArgument(f"attempts: expected at least 1, got {self.attempts}")
        for name in ("start_timeout", "timeout", "wait_timeout"):
            seconds = getattr(self, name)
            if not 0.0 < seconds < 1e7:
                raise InvalidArgument(f"{name}: expected seconds above 0, got {seconds!r}")


@dataclass(frozen=True)
class Acquired:
    """What there is when an acquisition ends."""

    raw: Path
    output: Path
    readings: int
    lost: int  # of them, with a beam missing at least
    planned: int

    @property
    def complete(self) -> bool:
        return self.readings == self.planned


def raw_path(output: Path) -> Path:
    """Where the raw file of an output stands, if nobody says otherwise: beside it, run.csv as run.raw.jsonl."""
    return output.with_suffix(".raw.jsonl")


def acquire(
    scenario: Scenario,
    source: str,
    output: Path,
    *,
    trigger: Trigger,
    options: AcquireOptions | None = None,
    resume: Resume | None = None,
    raw: Path | None = None,
    operator: Operator | None = None,
) -> Acquired:
    """Takes the readings of a scenario's plan, when `trigger` wants them, from an instrument ("ids3010://HOST[:PORT]").

    Every value goes to the raw file first; `output` is made from it after every visit and at the end, whatever ends
    it. `resume` goes on with a raw file: at the point where it stopped, or with its line or set-up once more. Raises
    InvalidArgument, and InstrumentError where the instrument fails: what is read is kept, and can be resumed."""
    options = options or AcquireOptions()
    channels = channels_of(scenario)
    axes = options.axes or tuple(range(1, len(channels) + 1))
    check_axes(axes, channels)
    address = parse_source(source)
    check_output(output)
    path = raw or raw_path(output)
    plan = described_plan(scenario)
    header = {
        "created": _now(),
        "scenario": scenario.path.name,
        "digest": digest_of(channels, plan),
        "channels": channels,
        "axes": list(axes),
        "sign": options.sign,
        "plan": plan,
    }
    visits = list(visits_of(scenario))
    file, content = _open(path, header, resume)
    try:
        with file, Ids3010(*address, timeout=options.timeout, attempts=options.attempts) as instrument:
            work = _Acquisition(
                scenario, visits, axes, channels, options, file, instrument, trigger, operator or Silent()
            )
            work.done = {} if content is None else content.readings()
            if content is not None:
                work.tell_torn(content)
            try:
                work.run(source, resume, lambda: write_run(path, output, options))
            except InstrumentError as error:
                trigger.failed(str(error))
                raise
            finally:
                if work.done:
                    write_run(path, output, options)
    finally:
        trigger.close()
    lost = sum(1 for reading in work.done.values() if any(pm is None for pm in reading["pm"]))
    return Acquired(path, output, len(work.done), lost, sum(len(visit.points) for visit in visits))


def write_run(raw: Path, output: Path, options: AcquireOptions) -> None:
    """The measurement file of a raw file, whole or not at all."""
    measurement = measurement_of(read_raw(raw), zero=options.zero, uncertainties=options.uncertainties)
    write_measurement(measurement, output)


def _open(path: Path, header: Record, resume: Resume | None) -> tuple[RawFile, RawContent | None]:
    if resume is None:
        return RawFile.create(path, header), None
    file, content = RawFile.resume(path)
    for key, what in (("digest", "plan, head or channels"), ("axes", "axes"), ("sign", "sign")):
        if content.header.get(key) != header[key]:
            file.close()
            raise InvalidArgument(f"{path}: was begun with another {what}: a run is resumed as it was begun")
    return file, content


class _Acquisition:
    """The loop over visits and points."""

    def __init__(
        self,
        scenario: Scenario,
        visits: Sequence[Visit],
        axes: Sequence[int],
        channels: Sequence[str],
        options: AcquireOptions,
        file: RawFile,
        instrument: Ids3010,
        trigger: Trigger,
        operator: Operator,
    ) -> None:
        self._scenario, self._visits, self._channels = scenario, visits, channels
        self._axes = [axis - 1 for axis in axes]
        self._options, self._file, self._instrument = options, file, instrument
        self._trigger, self._operator = trigger, operator
        self._is_twin = False
        self._set_up = 0  # which the instrument was found ready for
        self.done: dict[tuple[int, int], Record] = {}

    def tell_torn(self, content: RawContent) -> None:
        if content.torn_bytes:
            self._operator.tell(
                f"{content.path}: the last line was torn ({content.torn_bytes} bytes without an end) and is cut off"
            )

    def run(self, source: str, resume: Resume | None, write: Any) -> None:
        if resume is not None:
            self._repeat(resume)
        remaining = list(self._remaining())
        if not remaining:
            self._operator.tell("every point of the plan is read already")
            return
        known = self._instrument.describe()
        self._is_twin = TWIN in known.get("type", "")
        visit, index = remaining[0]
        self._file.append([self._session(source, known, visit, index)])
        if self.done:
            self._operator.tell(f"going on with {point_text(visit, index)}: bring the machine there")
        self._trigger.start(
            Context(self._read, self._options.settling, self._options.wait_timeout, self._options.sign, self._operator)
        )
        begun = 0
        for visit, index in remaining:
            if visit.number != begun:
                self._trigger.begin(visit, index, self._instruction(visit, begun))
            self._take(visit, index, first=visit.number != begun)
            begun = visit.number
            if index + 1 == len(visit.points):
                write()
                self._operator.tell(self._summary(visit))

    def _instruction(self, visit: Visit, last: int) -> str:
        if last and self._visits[last - 1].set_up == visit.set_up:
            return f"set-up {visit.set_up} stays as it is: run {visit.run}, {visit.direction}"
        return placement(self._scenario, visit)

    def _repeat(self, resume: Resume) -> None:
        """Takes the last line or set-up out of what is done."""
        if resume == "point" or not self.done:
            return
        last, _ = next(reversed(self.done))
        set_up = self._visits[last - 1].set_up
        first = last if resume == "line" else min(v.number for v in self._visits if v.set_up == set_up)
        self._file.append([{"record": "again", "time": _now(), "visit": first}])
        self.done = {key: reading for key, reading in self.done.items() if key[0] < first}

    def _remaining(self) -> Iterator[tuple[Visit, int]]:
        for visit in self._visits:
            for index, point in enumerate(visit.points):
                if (visit.number, int(point)) not in self.done:
                    yield visit, index

    def _take(self, visit: Visit, index: int, *, first: bool) -> None:
        self._trigger.wait(visit, index, nominal_distances(self._scenario, visit))
        if first and self._is_twin:
            digest = digest_of(self._channels, described_plan(self._scenario))
            self._instrument.ask("stepdiag.twin.visit", [visit.number, index, digest])
        if visit.set_up != self._set_up:
            self._make_ready(visit)
            self._set_up = visit.set_up
        reading = take_reading(self._read, len(self._axes), self._options.settling, told=self._instrument.error_text)
        records = list(self._records(visit, index, reading))
        self._file.append(records)
        self.done[visit.number, int(visit.points[index])] = records[-1]
        for place, why in reading.lost.items():
            self._operator.tell(f"{point_text(visit, index)}: {self._channels[place]} is lost: {why}")
        if any("no beam" in why for why in reading.lost.values()):
            self._operator.tell(
                "what follows on this set-up may carry another constant: stop and take up again with the set-up"
            )
        self._trigger.stored(visit, index, reading.mean_pm)

    def _read(self) -> Sample:
        return self._instrument.read(self._axes)

    def _make_ready(self, visit: Visit) -> None:
        """The instrument measures, and no beam is reported missing: moving the head interrupts them all."""
        mode = self._instrument.mode()
        sample = self._read() if mode == RUNNING else None
        if sample is not None and not any(sample.warnings):
            return
        texts = {self._instrument.error_text(warning) for warning in sample.warnings if warning} if sample else {mode}
        state = f"{self._instrument.name}: {', '.join(sorted(texts))}"
        if any(self._visits[number - 1].set_up == visit.set_up for number, _ in self.done):
            raise InstrumentError(
                f"{state}; starting the measurement anew would give this set-up another constant: resume with the "
                "set-up once more"
            )
        if self._options.start == "never":
            raise InstrumentError(f"{state}; expected a running measurement without warnings")
        self._operator.tell(f"{state}; its measurement is started anew")
        self._instrument.start(self._options.start_timeout)

    # --- records ---

    def _session(self, source: str, instrument: dict[str, str], visit: Visit, index: int) -> Record:
        return {
            "record": "session",
            "time": _now(),
            "stepdiag": __version__,
            "source": source,
            "instrument": instrument,
            "options": dataclasses.asdict(self._options),
            "visit": visit.number,
            "point": int(visit.points[index]),
        }

    def _records(self, visit: Visit, index: int, reading: Reading) -> Iterator[dict[str, Any]]:
        point = {
            "visit": visit.number,
            "line": visit.line,
            "run": visit.run,
            "direction": visit.direction,
            "point": int(visit.points[index]),
            "position_mm": [float(x) for x in visit.positions[index]],
        }
        for value in reading.values:
            yield {"record": "value", "time": _iso(value.time), **point, "kind": value.kind, "pm": list(value.pm)}
        yield {
            "record": "reading",
            "time": _iso(reading.values[-1].time) if reading.values else _now(),
            **point,
            "pm": reading.mean_pm,
            "sd_pm": reading.deviation_pm,
            "values": len(reading.averaged),
            "lost": {self._channels[place]: why for place, why in reading.lost.items()},
        }

    def _summary(self, visit: Visit) -> str:
        readings = [reading for key, reading in self.done.items() if key[0] == visit.number]
        lost = sum(1 for reading in readings if any(pm is None for pm in reading["pm"]))
        return (
            f"visit {visit.number} of {len(self._visits)} (line {visit.line}, run {visit.run}, {visit.direction}): "
            f"{len(readings)} readings, {lost} lost"
        )


def _now() -> str:
    return _iso(datetime.now(UTC))


def _iso(time: datetime) -> str:
    return time.isoformat(timespec="microseconds").replace("+00:00", "Z")
