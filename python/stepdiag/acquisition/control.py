"""What watchers of an acquisition want of it: lines that they append to a file, which it reads as they come."""

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Literal

from stepdiag._core import InvalidArgument
from stepdiag.io.whole_files import reason
from stepdiag.platform import open_to_append

Control = Literal["confirm", "pause", "go_on", "repeat_point", "repeat_line", "repeat_set_up", "keep", "remark", "stop"]

CONTROLS: Final[dict[Control, str]] = {
    "confirm": "yes, read",
    "pause": "read nothing until it goes on",
    "go_on": "the end of a pause",
    "repeat_point": "read the last point once more",
    "repeat_line": "read the last line once more",
    "repeat_set_up": "read all lines of the last set-up once more",
    "keep": "keep an odd reading",
    "remark": "a text for the raw file",
    "stop": "stop, to go on later",
}
LONGEST_REMARK: Final = 500  # characters
LARGEST: Final = 2**20  # bytes of the file, after which nothing more is taken


class ControlFile:
    """Reads what was appended since it was opened."""

    def __init__(self, path: Path) -> None:
        """What an earlier acquisition was asked for is gone. Where the file cannot be made, nobody can ask."""
        self._path, self._read = path, 0
        with suppress(OSError):
            path.write_bytes(b"")

    def new(self) -> Iterator[tuple[Control, str]]:
        """What was asked for, and the text that goes with it. Lines that say nothing known are passed over."""
        try:
            if not self._read < os.stat(self._path).st_size <= LARGEST:
                return
            with self._path.open("rb") as file:
                file.seek(self._read)
                data = file.read()
        except OSError:
            return
        whole = data.rfind(b"\n") + 1
        self._read += whole
        for line in data[:whole].splitlines():
            try:
                content = json.loads(line)
            except (ValueError, RecursionError):
                continue
            control = content.get("control") if isinstance(content, dict) else None
            if isinstance(control, str) and control in CONTROLS:
                yield control, str(content.get("text", ""))[:LONGEST_REMARK]


def ask_for(path: Path, control: Control, text: str = "") -> None:
    """Append to the file of a running acquisition. Raises InvalidArgument."""
    if control not in CONTROLS:
        raise InvalidArgument(f"expected one of {', '.join(CONTROLS)}, got {control!r}")
    content: dict[str, Any] = {"control": control, **({"text": text[:LONGEST_REMARK]} if text else {})}
    try:
        handle = open_to_append(path)
        try:
            os.write(handle, json.dumps(content).encode() + b"\n")
        finally:
            os.close(handle)
    except OSError as error:
        raise InvalidArgument(f"{path}: no acquisition is running: {reason(error)}") from None
