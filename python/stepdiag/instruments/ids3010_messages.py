"""JSON objects on a stream, as the attocube IDS3010 and its clients send them.

The instrument ends a reply with a newline. The manufacturer's Python client sends requests without
one, the MATLAB client with one. JsonStream accepts both: an object is complete at its closing
brace.
"""

import json
from typing import Any, Final

LARGEST: Final = 2**16  # bytes of one object; the instrument's have a few hundred


class JsonStream:
    """Splits a stream of bytes into JSON objects."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[dict[str, Any]]:
        """Return the objects that are now complete.

        Raises ValueError with the beginning of invalid input."""
        self._rest = (self._rest + data).lstrip()
        objects = []
        while self._rest:
            line, end, rest = self._rest.partition(b"\n")
            if not end and not line.rstrip().endswith(b"}"):  # the object may be incomplete
                if not line.startswith(b"{") or len(line) > LARGEST:
                    raise ValueError(shown(line))
                break
            try:
                content, used = _first_object(line)
            except ValueError:
                if end or len(line) > LARGEST or not line.startswith(b"{"):
                    raise ValueError(shown(line)) from None
                break  # this brace ends an inner object
            objects.append(content)
            self._rest = (line[used:] + end + rest).lstrip()
        return objects


def encoded(content: dict[str, Any]) -> bytes:
    """Encode an object as one line of text without its newline."""
    return json.dumps(content).encode()


def shown(data: bytes) -> str:
    """The beginning of received bytes, shortened and escaped for a message."""
    return ascii(data[:60].decode("utf-8", errors="replace")) + ("..." if len(data) > 60 else "")


def _first_object(line: bytes) -> tuple[dict[str, Any], int]:
    text = line.decode()
    try:
        content, end = _DECODER.raw_decode(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(content, dict):
        raise ValueError("not an object")
    return content, len(text[:end].encode())


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


_DECODER: Final = json.JSONDecoder(parse_constant=_no_number)
