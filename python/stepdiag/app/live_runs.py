"""Acquisitions and alignments of a machine: processes of their own, which a page starts, watches and asks.

They go on when page, browser or server end, and any number of pages may watch: all is in files beside the raw file.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.control import Control, ask_for
from stepdiag.acquisition.live_state import control_path, live_path, read_live
from stepdiag.acquisition.raw_records import Again, Header, RawReading, parse_record
from stepdiag.app.jobs import COMMAND
from stepdiag.book.book import MachineFolder
from stepdiag.instruments.instrument import mean_distance
from stepdiag.platform import OWN_GROUP, is_running, quiet_environment

ALIGNMENT: Final = "align"  # the name of a machine's alignment; runs have dates
LOG: Final = 4000  # characters of what a process said that are shown
_READING: Final = b'"record":"reading"'
_AGAIN: Final = b'"record":"again"'


class LiveRun:
    """What a process of a machine does, by its files. name: of the run, such as 2026-11-28."""

    def __init__(self, machine: MachineFolder, name: str) -> None:
        self.name = name
        self._raw = machine.folder / "runs" / f"{name}.raw.jsonl"
        self._log = self._raw.with_name(f".{name}.log")

    @property
    def raw(self) -> Path:
        return self._raw

    @property
    def exists(self) -> bool:
        return self._log.exists() or live_path(self._raw).exists()

    def state(self) -> dict[str, Any] | None:
        """As it was published last; None before that. `doing` is "ended" if the process is gone, however it went."""
        found = read_live(live_path(self._raw))
        if found is not None and found["doing"] != "ended" and not is_running(int(found["process"])):
            found["doing"], found["question"], found["answers"] = "ended", "", []
        return found

    def said(self) -> str:
        """The end of what the process said."""
        try:
            return self._log.read_bytes()[-LOG:].decode(errors="replace")
        except OSError:
            return ""

    def ask(self, control: Control, text: str = "") -> None:
        """Raises InvalidArgument where nothing runs."""
        ask_for(control_path(self._raw), control, text)


@dataclass
class RawTail:
    """Follows a raw file as it grows: of each point the last reading's deviation from the nominal way."""

    path: Path
    _read: int = 0
    _header: Header | None = None

    def __post_init__(self) -> None:
        self._first: dict[int, float] = {}  # by set-up, of the first reading's distance from nominal

    def new(self) -> list[dict[str, Any]]:
        """Readings since the last call; `{"again": visit}` where that visit and later ones are read once more."""
        try:
            with self.path.open("rb") as file:
                file.seek(self._read)
                data = file.read()
        except OSError:
            return []
        whole = data.rfind(b"\n") + 1
        self._read += whole
        found: list[dict[str, Any]] = []
        for line in data[:whole].split(b"\n")[:-1]:
            if self._header is None:
                first = parse_record(line, f"{self.path}, line 1")
                if not isinstance(first, Header):
                    raise InvalidArgument(f"{self.path}, line 1: expected the header of a raw file")
                self._header = first
            elif _READING in line or _AGAIN in line:
                record = parse_record(line, str(self.path))
                if isinstance(record, Again):
                    found.append({"again": record.visit})
                elif isinstance(record, RawReading):
                    found.append(self._deviation(record, self._header))
        return found

    def _deviation(self, reading: RawReading, header: Header) -> dict[str, Any]:
        visit = header.plan[reading.visit - 1]
        index = visit.points.index(reading.point)
        distance = header.sign * mean_distance(header.read_columns, reading.read)
        off = distance - visit.nominal_mm[index]
        if off == off:
            self._first.setdefault(visit.set_up, off)
        first = self._first.get(visit.set_up)
        return {
            "visit": reading.visit,
            "line": reading.line,
            "point": reading.point,
            "points": len(visit.points),
            "um": None if off != off or first is None else round(1e3 * (off - first), 4),
        }


class LiveRuns:
    """Starts them. Those that run when the server ends go on."""

    def __init__(self) -> None:
        self._children: list[subprocess.Popen[bytes]] = []

    def begin(self, run: LiveRun, words: Sequence[str]) -> None:
        """Raises InvalidArgument where one of this name runs."""
        state = run.state()
        if state is not None and state["doing"] != "ended":
            raise InvalidArgument(f"{run.name} is running already")
        run.raw.parent.mkdir(parents=True, exist_ok=True)
        live_path(run.raw).unlink(missing_ok=True)
        self._reap()
        with run.raw.with_name(f".{run.name}.log").open("wb") as log:
            self._children.append(
                subprocess.Popen(
                    [sys.executable, *COMMAND, *words],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    cwd=run.raw.parent,
                    env=quiet_environment(),
                    **OWN_GROUP,
                )
            )

    def of(self, machine: MachineFolder) -> list[LiveRun]:
        """All that a machine has, the latest name first."""
        self._reap()
        folder = machine.folder / "runs"
        logs = {path.name[1 : -len(".log")] for path in folder.glob(".*.log")}
        states = {path.name[1 : -len(".live.json")] for path in folder.glob(".*.live.json")}
        return [LiveRun(machine, name) for name in sorted(logs | states, reverse=True)]

    def _reap(self) -> None:
        """A process that has ended is none any more, once its parent has asked."""
        self._children = [child for child in self._children if child.poll() is None]


def event(name: str, content: object) -> bytes:
    """A server-sent event."""
    return f"event: {name}\ndata: {json.dumps(content, separators=(',', ':'))}\n\n".encode()
