"""A twin that sends lines, as an adapter does (docs/acquisition.md): on a socket, or on standard output."""

import contextlib
import json
import selectors
import threading
import time
from collections.abc import Callable
from typing import Any, Final, TypeGuard

from stepdiag._core import InvalidArgument, __version__
from stepdiag.instruments.ids3010 import TWIN
from stepdiag.instruments.ids3010_messages import JsonStream
from stepdiag.instruments.instrument import EXPONENTS
from stepdiag.instruments.line_instrument import VERSION
from stepdiag.twin.instrument import TwinInstrument

BETWEEN_SAMPLES: Final = 0.002  # s
DIGITS: Final = {"mm": 9, "urad": 6}  # after the point: 1 pm, 1e-12 rad


class LineSender:
    """What a twin sends."""

    def __init__(self, instrument: TwinInstrument) -> None:
        self._instrument = instrument
        self._own: dict[str, Callable[[Any], None]] = {
            "set_up": lambda number: instrument.set_up(int(number)),
            "move": instrument.move_to,
            "turn": instrument.turn,
            "block": instrument.block,
        }

    def header(self) -> dict[str, Any]:
        names = [column.name for column in self._instrument.columns]
        about = {"instrument": TWIN, "version": __version__}
        return {"stepdiag_lines": VERSION, **about, "channels": names, "visits": True}

    def sample(self) -> dict[str, Any]:
        now = time.time()  # before the values: they are not older
        sample: dict[str, Any] = {}
        for column, value in zip(self._instrument.columns, self._instrument.values(), strict=True):
            scaled = None if value is None else value / 10.0 ** EXPONENTS[column.unit]
            sample[column.name] = None if scaled is None else round(scaled, DIGITS[column.unit])
        if None in sample.values():
            sample["why"] = "the beam was interrupted"
        return sample | {"time": now, "signal": round(self._instrument.contrast(), 1)}

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """The answer to an object of the acquisition: go to a visit."""
        for name, act in self._own.items():
            if request.keys() == {name}:
                try:
                    act(request[name])
                except (InvalidArgument, TypeError, ValueError) as error:
                    return {"error": str(error)}
                return {"done": name}
        number, place, digest = request.get("visit"), request.get("place", 0), request.get("digest")
        if not _is_whole(number) or not _is_whole(place) or not (digest is None or isinstance(digest, str)):
            return {"error": 'expected {"visit": NUMBER, "place": NUMBER, "digest": TEXT}'}
        try:
            self._instrument.visit(number, place, digest)
        except InvalidArgument as error:
            return {"error": str(error)}
        return {"visit": number}


def send_lines(
    sender: LineSender,
    source: Any,
    send: Callable[[bytes], None],
    *,
    ended: threading.Event | None = None,
    goes_on: bool = False,
) -> None:
    """Send samples without end, and answer what comes from `source`, which has `fileno` and `read`.

    Stops when sending fails, when `ended` is set, and at the end of `source`, unless it `goes_on`."""

    def put(content: dict[str, Any]) -> None:
        send(json.dumps(content).encode() + b"\n")

    stream = JsonStream()
    with contextlib.suppress(OSError), selectors.DefaultSelector() as selector:  # the other side may go away
        with contextlib.suppress(PermissionError):  # of a file, by which nobody asks
            selector.register(source, selectors.EVENT_READ)
        put(sender.header())
        while ended is None or not ended.is_set():
            if not selector.get_map():
                time.sleep(BETWEEN_SAMPLES)
            elif selector.select(BETWEEN_SAMPLES):
                data = source.read(4096)
                if not data and not goes_on:
                    return
                if not data:
                    selector.unregister(source)
                try:
                    for request in stream.feed(data):
                        put(sender.answer(request))
                except ValueError as error:
                    put({"error": f"expected an object of JSON, got {error}"})
                    return
            put(sender.sample())


def _is_whole(value: Any) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)
