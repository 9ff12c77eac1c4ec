"""A hostile instrument: PROTOCOL (lines, program or ids3010) BEHAVIOUR SEED. It prints its port unless it is a program.

Without imports of other packages, so that it starts at once."""

import contextlib
import json
import random
import socket
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

HEADER = b'{"stepdiag_lines": 1, "instrument": "hostile", "channels": ["distance_mm", "alpha_urad", "beta_urad"]}\n'
SAMPLE = b'{"distance_mm": 100.125, "alpha_urad": 12.5, "beta_urad": -3.25}\n'
LONG = 50 * 2**20


def with_value(text: bytes) -> bytes:
    return SAMPLE.replace(b"100.125", text)


def sound() -> Iterator[bytes]:
    while True:
        time.sleep(0.004)
        yield SAMPLE


def silent() -> Iterator[bytes]:
    time.sleep(60)
    yield b""


def then(*pieces: bytes, rest: Callable[[], Iterator[bytes]] = lambda: iter(())) -> Iterator[bytes]:
    yield from pieces
    yield from rest()


def restless(chance: random.Random) -> Iterator[bytes]:
    yield HEADER
    while True:
        time.sleep(0.004)
        yield with_value(repr(chance.uniform(0, 1000)).encode())


def garbage(chance: random.Random) -> Iterator[bytes]:
    while True:
        yield chance.randbytes(1000)


def flood() -> Iterator[bytes]:
    yield HEADER
    while True:
        yield SAMPLE * 1000


def repeated(line: bytes, seconds: float = 0.004) -> Iterator[bytes]:
    yield HEADER
    while True:
        time.sleep(seconds)
        yield line


def mutated_stream(seed: int) -> Iterator[bytes]:
    from mutation import mutated

    yield mutated(HEADER + SAMPLE * 20, seed)
    yield from sound()


def lines(behaviour: str, seed: int) -> Iterator[bytes]:
    chance = random.Random(seed)
    made: dict[str, Callable[[], Iterator[bytes]]] = {
        "sound": lambda: then(HEADER, rest=sound),
        "silent": silent,
        "closes at once": lambda: then(),
        "header only": lambda: then(HEADER, rest=silent),
        "half a header": lambda: then(HEADER[:40]),
        "half a line": lambda: then(HEADER, SAMPLE * 3, SAMPLE[:30]),
        "garbage": lambda: garbage(chance),
        "garbage after the header": lambda: then(HEADER, rest=lambda: garbage(chance)),
        "a line of 50 MB": lambda: then(HEADER, b"x" * LONG, b"\n"),
        "a header of 50 MB": lambda: then(b'{"' + b"x" * LONG, b"\n"),
        "a number of 1 MB": lambda: then(HEADER, with_value(b"9" * 2**20)),
        "NaN": lambda: repeated(with_value(b"NaN")),
        "infinite": lambda: repeated(with_value(b"1e999")),
        "huge": lambda: repeated(with_value(b"1e12")),
        "a text": lambda: repeated(with_value(b'"100.125"')),
        "nested": lambda: repeated(with_value(b"[" * 30000)),
        "no value": lambda: repeated(with_value(b"null")),
        "flood": flood,
        "other order": lambda: then(
            HEADER.replace(b'"distance_mm", "alpha_urad"', b'"alpha_urad", "distance_mm"'), rest=sound
        ),
        "other channels": lambda: then(HEADER.replace(b"alpha_urad", b"d1_mm"), rest=sound),
        "header twice": lambda: then(HEADER, HEADER, rest=sound),
        "restless": lambda: restless(chance),
        "an error": lambda: then(HEADER, SAMPLE, b'{"error": "\\u001b[2J\\u001b]0;owned\\u0007 port closed"}\n'),
        "old times": lambda: repeated(SAMPLE.replace(b"}", b', "time": 1000.0}')),
        "future times": lambda: repeated(SAMPLE.replace(b"}", b', "time": 9e9}')),
        "slow": lambda: repeated(SAMPLE, 1.0),
        "UTF-16": lambda: then((HEADER + SAMPLE * 10).decode().encode("utf-16")),
        "visits without an answer": lambda: then(HEADER.replace(b"1,", b'1, "visits": true,'), rest=sound),
        "mutated": lambda: mutated_stream(seed),
    }
    return made[behaviour]()


LINES = (
    *("sound", "silent", "closes at once", "header only", "half a header", "half a line", "garbage"),
    *("garbage after the header", "a line of 50 MB", "a header of 50 MB", "a number of 1 MB", "NaN", "infinite"),
    *("huge", "a text", "nested", "no value", "flood", "other order", "other channels", "header twice", "restless"),
    *("an error", "old times", "future times", "slow", "UTF-16", "visits without an answer"),
)
IDS3010 = (
    *("sound", "silent", "closes", "half a reply", "garbage", "a reply of 50 MB", "NaN", "a text", "too few"),
    *("another id", "no id", "an error", "huge", "warnings", "restless", "flood", "twice", "a list", "nested"),
)
ENDLESS = ("garbage", "garbage after the header", "flood", "silent", "header only")
MUTATED = "mutated"


def result(method: str, request: dict[str, object], chance: random.Random, behaviour: str) -> list[object]:
    method = method.rsplit(".", 1)[-1]
    if method == "getCurrentMode":
        return [0, "measurement running"]
    if method not in ("getAbsolutePositions", "getAbsolutePosition"):
        return [0, "a text"]
    value: object = 100_000_000_001
    if behaviour == "restless":
        value = chance.randrange(10**12)
    value = {"NaN": float("nan"), "a text": "100", "huge": 10**30}.get(behaviour, value)
    warning = 7 if behaviour == "warnings" else 0
    many = {"too few": 1}.get(behaviour, 3 if method.endswith("s") else 1)
    return [warning, *[value] * many]


def reply(request: dict[str, object], chance: random.Random, behaviour: str) -> bytes | None:
    """None: hang up."""
    content: dict[str, object] = {"jsonrpc": "2.0", "id": request["id"]}
    content["result"] = result(str(request["method"]), request, chance, behaviour)
    if behaviour == "another id":
        content["id"] = 987654
    if behaviour == "no id":
        del content["id"]
    if behaviour == "an error":
        del content["result"]
        content["error"] = {"code": -32000, "message": "\x1b[2J broken" + "x" * 10000}
    text = json.dumps(content).encode() + b"\r\n"
    if behaviour == MUTATED and chance.random() < 0.3:
        from mutation import mutated

        return mutated(text, chance.randrange(10**6))
    special = {
        "closes": None,
        "silent": b"",
        "half a reply": text[: len(text) // 2],
        "garbage": chance.randbytes(2000),
        "a reply of 50 MB": b'{"result": "' + b"x" * LONG,
        "flood": text * 20000,
        "twice": text * 2,
        "a list": b"[" + text + b"]",
        "nested": b"[" * 100000,
    }
    return special.get(behaviour, text)


def serve_ids3010(client: socket.socket, behaviour: str, chance: random.Random) -> None:
    decoder, text = json.JSONDecoder(), ""
    while data := client.recv(4096):
        text += data.decode()
        while text:
            request, end = decoder.raw_decode(text)
            text = text[end:].lstrip()
            answer = reply(request, chance, behaviour)
            if answer is None:
                return
            client.sendall(answer)


def main() -> None:
    protocol, behaviour, seed = sys.argv[1], sys.argv[2], int(sys.argv[3])
    if protocol == "program":
        with contextlib.suppress(OSError):
            for piece in lines(behaviour, seed):
                sys.stdout.buffer.write(piece)
                sys.stdout.buffer.flush()
        sys.stdout = None  # type: ignore[assignment]
        return
    server = socket.create_server(("127.0.0.1", 0))
    print(server.getsockname()[1], flush=True)
    chance = random.Random(seed)
    while True:
        client, _ = server.accept()
        with client, contextlib.suppress(OSError):
            if protocol == "ids3010":
                serve_ids3010(client, behaviour, chance)
            else:
                for piece in lines(behaviour, seed):
                    client.sendall(piece)


if __name__ == "__main__":
    main()
