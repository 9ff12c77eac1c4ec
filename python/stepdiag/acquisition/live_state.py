"""What an acquisition does at this moment, for whoever watches it: a small file that is overwritten in place.

Beside the raw file `run.raw.jsonl` stands `.run.live.json` while an acquisition runs, and after it, until the next one
begins. It does not grow, is not synced to the disk, and may be lost: all that counts is in the raw file. Any number of
programs may read it at any time.
"""

import json
import os
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, Self

from stepdiag.platform import open_in_place, write_at_begin

Doing = Literal["begins", "waits", "reads", "asks", "paused", "ended"]

ROOM: Final = 2**14  # bytes of the file
MESSAGES: Final = 12  # the last ones
LONGEST: Final = 300  # characters of a message
TRIES: Final = 5  # to read what is just being overwritten
VERSION: Final = 1


@dataclass
class LiveState:
    """What is published. `values` have the units in the names of the columns.

    question: what the person is asked; `answers`: the words of `CONTROLS` that answer it. from_nominal_um: the distance
    beside that of the point that is read or waited for, once the set-up has a reading. messages: number, seconds since
    1970, text."""

    doing: Doing = "begins"
    process: int = field(default_factory=os.getpid)
    failure: str = ""  # why it ended before it was done
    question: str = ""
    answers: list[str] = field(default_factory=list)
    asked: int = 0  # questions so far
    visit: int = 0
    visits: int = 0
    set_up: int = 0
    line: str = ""
    run: int = 0
    direction: str = ""
    index: int = 0  # of the point in its visit
    points: int = 0  # of the visit
    point: int = 0
    position_mm: list[float] = field(default_factory=list)
    values: dict[str, float | None] = field(default_factory=dict)
    reasons: list[str] = field(default_factory=list)  # why values are missing
    signal: dict[str, float] = field(default_factory=dict)
    conditions: dict[str, float] = field(default_factory=dict)  # temperatures and air, by column
    cross_urad: list[float] | None = None  # the mirror against the beam, see cross.py
    limit_urad: float | None = None  # of that, while head and mirror are aligned
    turns: list[str] = field(default_factory=list)  # what to turn, while they are aligned
    is_aligned: bool = False
    from_nominal_um: float | None = None
    distance_mm: float | None = None
    readings: int = 0
    lost: int = 0
    planned: int = 0
    stored: int = 0  # times that a reading came to the disk
    last: str = ""  # the last of these in words
    minutes_left: float | None = None  # at the pace of the last readings
    at: float = 0.0  # when the values were taken, seconds since 1970
    messages: list[tuple[int, float, str]] = field(default_factory=list)

    def tell(self, text: str) -> None:
        number = self.messages[-1][0] + 1 if self.messages else 1
        self.messages = [*self.messages, (number, time.time(), text[:LONGEST])][-MESSAGES:]


def live_path(raw: Path) -> Path:
    """The file beside a raw file: .run.live.json for run.raw.jsonl."""
    return raw.with_name(f".{_stem(raw)}.live.json")


def control_path(raw: Path) -> Path:
    """Where watchers write what they want: .run.control.jsonl for run.raw.jsonl."""
    return raw.with_name(f".{_stem(raw)}.control.jsonl")


def _stem(raw: Path) -> str:
    return raw.name.removesuffix(".jsonl").removesuffix(".raw")


class LiveFile:
    """Publishes a state. What cannot be written is not published; the acquisition goes on."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._number = 0
        self._handle: int | None = None
        with suppress(OSError):
            self._handle = open_in_place(path)

    def publish(self, state: LiveState) -> None:
        if self._handle is None:
            return
        self._number += 1
        content = {"version": VERSION, "number": self._number, **vars(state), "whole": self._number}
        text = json.dumps(content, separators=(",", ":")).encode()
        if len(text) >= ROOM:
            text = json.dumps({**content, "messages": []}, separators=(",", ":")).encode()
        with suppress(OSError):
            write_at_begin(self._handle, text[: ROOM - 1].ljust(ROOM - 1) + b"\n")

    def close(self) -> None:
        if self._handle is not None:
            os.close(self._handle)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_live(path: Path) -> dict[str, Any] | None:
    """The state that was published last; None if there is none, or it is of another version."""
    for _ in range(TRIES):
        try:
            content = json.loads(path.read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValueError):
            time.sleep(0.001)
            continue
        if isinstance(content, dict) and content.get("version") == VERSION and content["number"] == content["whole"]:
            return content
    return None
