"""Acquisitions from hostile instruments, with hostile clients, and through faults of files.

An instrument may be refused with one line, or its readings are lost; what it sent before stays.
"""

import io
import os
import random
import resource
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from instrument import ENDLESS, IDS3010, LINES, MUTATED
from processes import Outcome, in_child

INSTRUMENT = Path(__file__).resolve().parent / "instrument.py"
SCENARIO = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp"]
steps = 1
[head]
layout = "{layout}"
"""
BEAMS = 'multi_beam"\nbeam_offsets_mm = [[15.0, 0.0], [-7.5, 13.0], [-7.5, -13.0]]\n#"'
POINTS = 4
QUICK = (
    "--timeout 0.4 --settle-count 2 --average 1 --interval-ms 0 --settle-timeout 0.5 --retries 1 --wait-timeout 15 "
    "--start never"
)
PATIENT = ("--timeout", "10", "--settle-timeout", "10")  # where the instrument is sound and the computer busy
MUTATIONS = {"program": 150, "ids3010": 100, "lines": 0}
LONGEST_SAID = 1500  # bytes of standard error
LONGEST_TOLD = 100  # lines of standard output
CLIENTS = ("flood", "many", "no line end", "hangs up", "wrong points", "binary")
FEW_FILES = 40  # that may be open beside the 60 connections of "many"


def instruments(short: bool) -> Iterator[tuple[str, str, int]]:
    """Protocol, behaviour, seed."""
    for protocol, behaviours in (("program", LINES), ("lines", LINES), ("ids3010", IDS3010)):
        chosen = [b for b in behaviours if b != "silent"][:: 5 if short else 1]
        yield from ((protocol, behaviour, 1) for behaviour in (chosen if short else behaviours))
        yield from ((protocol, MUTATED, seed) for seed in range(MUTATIONS[protocol] // (50 if short else 1)))


@contextmanager
def serving(protocol: str, behaviour: str, seed: int) -> Iterator[str]:
    """What --source says of the instrument."""
    words = [sys.executable, "-S", str(INSTRUMENT), protocol, behaviour, str(seed)]
    if protocol == "program":
        yield f"program:{shlex.join(words)}"
        return
    environment = {key: value for key, value in os.environ.items() if key != "LD_PRELOAD"}
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment) as server:
        assert server.stdout is not None
        try:
            yield f"{protocol}://127.0.0.1:{server.stdout.readline().strip()}"
        finally:
            server.kill()


def make_place(place: Path, layout: str = "ideal") -> None:
    place.mkdir()
    (place / "scenario.toml").write_text(SCENARIO.format(layout=layout))


def acquiring(place: Path, source: str, *more: str, before: Callable[[], None] = lambda: None) -> Callable[[], int]:
    """The program, with someone who presses Enter for ever."""
    from stepdiag.cli import main

    def work() -> int:
        os.chdir(place)
        sys.argv = ["stepdiag", "acquire", "scenario.toml", "--source", source, "-o", "out.csv", *QUICK.split(), *more]
        sys.stdin = io.StringIO("\n" * 1000)
        handle = os.open(place.with_suffix(".told"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(handle, 1)
        os.close(handle)
        before()
        status = main()
        sys.stdout.flush()
        return status

    return work


def unsound_files(place: Path, killed: bool = False) -> str:
    """What is wrong with the files of an acquisition; empty if nothing is."""
    from stepdiag._core import InvalidArgument
    from stepdiag.acquisition.raw_file import read_raw
    from stepdiag.io.data_files import read_measurement

    own = {"scenario.toml", "out.csv", "out.raw.jsonl", ".out.live.json", ".out.control.jsonl"}
    names = {path.name for path in place.iterdir()} - own
    if names and not killed:
        return f"left {sorted(names)}"
    raw, out = place / "out.raw.jsonl", place / "out.csv"
    try:
        if raw.exists() and (raw.stat().st_size or not killed) and b"\n" in raw.read_bytes():
            read_raw(raw)
        if out.exists():
            read_measurement(out)
    except InvalidArgument as error:
        return str(error)
    return ""


def unsound_end(outcome: Outcome, place: Path) -> str:
    if outcome.hung:
        return "hung"
    if outcome.crashed or outcome.status not in (0, 2):
        return f"status {outcome.status}"
    said = outcome.said
    if outcome.status == 2 and not outcome.is_one_line:
        return "not one line"
    if len(said) > LONGEST_SAID or not said.replace("\n", "").isprintable():
        return f"a message of {len(said)} characters, or not plain"
    told = place.with_suffix(".told").read_text(errors="replace")
    if told.count("\n") > LONGEST_TOLD or not told.replace("\n", "").isprintable():
        return f"{told.count(chr(10))} lines told, or not plain"
    return ""


def with_instrument(place: Path, protocol: str, behaviour: str, seed: int) -> tuple[str, str]:
    make_place(place, BEAMS if protocol == "ids3010" else "ideal")
    with serving(protocol, behaviour, seed) as source:
        is_sound = behaviour in ("sound", "other order")
        work = acquiring(place, source, *(PATIENT if is_sound else ()))
        outcome = in_child(work, place.with_suffix(".said"))
    wrong = unsound_end(outcome, place) or unsound_files(place)
    if is_sound and outcome.status != 0:
        wrong = wrong or "a sound instrument was refused"
    if protocol != "ids3010" and behaviour in ENDLESS and outcome.status != 2:  # repeated replies are dropped
        wrong = wrong or "was taken for an instrument"
    verdict = "recovered" if outcome.status == 0 else "refused"
    what = f"{protocol} {behaviour} {seed}: {outcome.status} {outcome.seconds:.1f} s {outcome.said[-300:]!r}"
    return f"lost: {wrong}" if wrong else verdict, what


# --- clients --------------------------------------------------------------------------------------------------------
def hostile_client(behaviour: str, port: int, seed: int) -> None:
    chance = random.Random(seed)
    clients = [connected(port) for _ in range(60 if behaviour == "many" else 1)]
    end = time.monotonic() + 1.0
    sent = {
        "flood": b"READ 99 99\n" * 1000,
        "no line end": b"x" * 2**20,
        "hangs up": b"READ 1 0\n",
        "wrong points": b"READ 0 -1\nREAD 1 999999999999999999999\nREAD\n\n",
        "binary": chance.randbytes(10000),
        "many": b"",
    }[behaviour]
    while time.monotonic() < end:
        with suppress(OSError):
            clients[-1].sendall(sent)
        if behaviour in ("hangs up", "many", "no line end"):
            clients.pop(0).close()
            clients.append(connected(port))
        time.sleep(0.001)


def connected(port: int) -> socket.socket:
    end = time.monotonic() + 10.0
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), 1.0)
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.01)


def controller(port: int) -> int:
    """Asks for all points as a controller does, and again where it is not answered; how many it got."""
    got, end = 0, time.monotonic() + 12.0
    while got < POINTS and time.monotonic() < end:
        with suppress(OSError), connected(port) as client, client.makefile("rw") as file:
            client.settimeout(3.0)
            while got < POINTS:
                file.write(f"READ 1 {got}\n")
                file.flush()
                if file.readline() != f"DONE 1 {got}\n":
                    break
                got += 1
        time.sleep(0.02)
    return got


def in_background(work: Callable[[], object]) -> int:
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            os._exit(int(bool(work())))
        os._exit(1)
    return child


def with_client(place: Path, behaviour: str, seed: int) -> tuple[str, str]:
    make_place(place)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    limit = (FEW_FILES, FEW_FILES) if behaviour == "many" else None

    def before() -> None:
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_NOFILE, limit)

    clients = [
        in_background(lambda: hostile_client(behaviour, port, seed)),
        in_background(lambda: controller(port) != POINTS),
    ]
    with serving("program", "sound", seed) as source:
        trigger = f"tcp://127.0.0.1:{port}"
        work = acquiring(place, source, "--trigger", trigger, *PATIENT, before=before)
        outcome = in_child(work, place.with_suffix(".said"))
    ends = [os.waitstatus_to_exitcode(os.waitpid(client, 0)[1]) for client in clients]
    wrong = unsound_end(outcome, place) or unsound_files(place)
    if outcome.status != 0 or ends[1] != 0:
        wrong = wrong or "the controller was not served"
    what = f"{behaviour} {seed}: {outcome.status} {outcome.seconds:.1f} s, clients {ends} {outcome.said[-300:]!r}"
    return f"lost: {wrong}" if wrong else "recovered", what


# --- faults of files ------------------------------------------------------------------------------------------------
def continued(place: Path, outcome: Outcome, interrupted: bool) -> str:
    """Goes on with a stopped acquisition to its end. What is wrong; empty if nothing is."""
    from stepdiag.acquisition.raw_file import read_raw
    from stepdiag.io.data_files import read_measurement

    killed = outcome.status < 0
    if outcome.hung or outcome.crashed:
        return f"ended with {outcome.status}"
    if not killed and outcome.status != 0 and not outcome.is_one_line:
        return f"not one line: {outcome.said[-300:]!r}"
    if interrupted and outcome.status not in (0, 130):
        return f"status {outcome.status}"
    wrong = unsound_files(place, killed)
    if wrong:
        return wrong
    raw = place / "out.raw.jsonl"
    before = raw.read_bytes() if raw.exists() else b""
    begun = b"\n" in before
    if outcome.status != 0:
        with serving("program", "sound", 1) as source:
            more = ["--resume"] if begun else []
            again = in_child(acquiring(place, source, *more, *PATIENT), place.with_suffix(".said"))
        if again.status != 0:
            return f"does not go on: {again.status} {again.said[-300:]!r}"
    if not raw.read_bytes().startswith(before[: before.rfind(b"\n") + 1]):
        return "readings are gone"
    if len(read_raw(raw).readings()) != POINTS or len(read_measurement(place / "out.csv").line) != POINTS:
        return "not all points"
    return ""
