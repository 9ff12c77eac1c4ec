"""Commands that read an instrument, and that simulate it."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.options import AcquireOptions, Resume
from stepdiag.acquisition.settling import Settling
from stepdiag.cli.at_machine.fit_so_far import FitSoFar
from stepdiag.cli.at_machine.operators import Terminal, Watched
from stepdiag.cli.in_book import Kept, OfMachine
from stepdiag.cli.interrupts import unwinding
from stepdiag.cli.options import PATH, Writes, made_of, options_of, out_file, say_of_output, tell, tell_inputs
from stepdiag.interruption import at_end
from stepdiag.io.outputs import MEASUREMENT, RAW, OutputFile

if TYPE_CHECKING:
    from stepdiag.acquisition.triggers import Trigger
    from stepdiag.twin.server import Twin

SECONDS = click.FloatRange(min=0.0, min_open=True)


@click.command(
    cls=OfMachine,
    makes={"output": Kept("runs", ".csv")},
    groups={
        "Instrument": ["source", "axes", "sign", "zero", "timeout"],
        "When to read": ["trigger", "start", "wait_timeout", "retries"],
        "Settling": [
            *("settle_count", "settle_limit_um", "settle_spot_um", "settle_tilt_urad"),
            *("settle_timeout", "average", "interval_ms"),
        ],
        "Temperatures": ["temperatures", "temperature_age"],
        "Output": ["output", "uncertainties", "raw"],
        "Continue": ["resume", "restart_line", "restart_set_up", "from_raw", "watched"],
    },
    epilog="\b\nExample: stepdiag acquire scenario.toml --source ids3010://192.168.1.1 -o run.csv",
)
@click.argument("scenario", type=PATH, required=False)
@click.option(
    "--source",
    metavar="URL",
    help="The instrument: ids3010://HOST[:PORT], or JSON lines by lines://127.0.0.1:PORT, serial:PORT or "
    "'program:COMMAND ARGS'; 'ids3010://... + ...' for a distance of the first and a spot of the second.",
)
@click.option(
    "--trigger",
    default="key",
    show_default=True,
    metavar="WHAT",
    help="When to read: key (at Enter), settle (at rest one step on), or tcp://HOST:PORT (at a controller's request).",
)
@options_of(AcquireOptions, Settling)
@click.option(
    "--temperatures",
    type=PATH,
    metavar="FILE",
    help="CSV file that another program appends to: time, temperature_c or temperature_x_c ..., air_temperature_c ...",
)
@click.option(
    "--raw", type=Writes(RAW), metavar="FILE", help="Raw file (.jsonl).  [default: beside the output, run.raw.jsonl]"
)
@click.option(
    "--watched", is_flag=True, help="Questions are answered by whoever watches (stepdiag app), not at standard input."
)
@click.option("--resume", is_flag=True, help="Continue the raw file at the point where it stopped.")
@click.option("--restart-line", is_flag=True, help="Continue the raw file, but read its last line again.")
@click.option("--restart-set-up", is_flag=True, help="Continue the raw file, but read its last set-up again.")
@click.option("--from-raw", type=PATH, metavar="FILE", help="Do not measure; make the output from this raw file.")
@out_file("Measurement to write, CSV or netCDF (.nc).", MEASUREMENT)
def acquire(scenario: Path | None, output: OutputFile, from_raw: Path | None, **given: Any) -> None:
    """Record the readings of SCENARIO's plan from an instrument.

    The instrument is an attocube IDS3010, or anything with an adapter that sends lines.

    Before every set-up the command states where head and mirror belong. At every point it waits
    until the distances have settled, then averages. Each value is written to the raw file on disk
    before the next point is read. The output is made from the raw file after every visit and at the
    end. A missing beam is a lost reading: an empty field.
    """
    if from_raw is not None:
        if scenario is not None or given["source"] is not None:
            raise InvalidArgument("--from-raw: reads no scenario and no --source")
        if given["temperatures"] is not None:
            raise InvalidArgument("--from-raw: has the temperatures that were read, and reads no --temperatures")
        _convert(from_raw, output, _options(given))
        return
    if scenario is None or given["source"] is None:
        raise InvalidArgument("expected SCENARIO and --source, or --from-raw")
    _take(scenario, output, given)


def _take(scenario: Path, output: OutputFile, given: dict[str, Any]) -> None:
    from stepdiag.acquisition.acquire import acquire, raw_path
    from stepdiag.acquisition.raw_file import is_begun
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    tell_inputs(described)
    raw: OutputFile = given["raw"] or OutputFile(raw_path(output.path), (RAW,))
    # acquire() refuses outputs made from other raw files, and raw files that are not resumed.
    inputs = [scenario] if given["temperatures"] is None else [scenario, given["temperatures"]]
    path = output.claim(*inputs, raw.path, error_map=described.truth.error_map, overwrite=True)
    raw.claim(*inputs, error_map=described.truth.error_map, overwrite=True)
    options, resume = _options(given), _resume(given)
    trigger = _trigger(given["trigger"])

    def continuation() -> str | None:
        return f"{raw.path} has the readings so far: repeat the command with --resume" if is_begun(raw.path) else None

    with FitSoFar(scenario, path) as fits, at_end(continuation), unwinding():
        result = acquire(
            described.known,
            given["source"],
            path,
            trigger=trigger,
            options=options,
            resume=resume,
            raw=raw.path,
            operator=Watched() if given["watched"] else Terminal(),
            temperatures=given["temperatures"],
            watched=True,
            after_visit=fits.begin,
        )
    say_of_output(output.path, f": {result.readings} of {result.planned} readings, {result.lost} lost")


def _convert(raw: Path, output: OutputFile, options: AcquireOptions) -> None:
    from stepdiag.acquisition.acquire import raw_path
    from stepdiag.acquisition.raw_file import read_raw
    from stepdiag.acquisition.run_from_raw import set_back, write_run

    path = output.claim(raw, overwrite=True)
    if path.exists() and raw_path(path).resolve() != raw.resolve():
        raise InvalidArgument(f"{path}: exists, and is not beside {raw}: move it away, or name another -o")
    content = read_raw(raw)
    for warning in filter(None, (content.torn, set_back(content))):
        tell("warning", warning)
    write_run(
        raw,
        path,
        zero=options.zero,
        uncertainties=options.uncertainties,
        temperature_age=options.temperature_age,
    )
    say_of_output(output.path, f": {len(content.readings())} of {content.planned} readings")


def _options(given: dict[str, Any]) -> AcquireOptions:
    return made_of(AcquireOptions, given, settling=made_of(Settling, given))


def _resume(given: dict[str, Any]) -> Resume | None:
    flags: dict[str, Resume] = {"resume": "point", "restart_line": "line", "restart_set_up": "set-up"}
    chosen = [way for flag, way in flags.items() if given[flag]]
    if len(chosen) > 1:
        raise InvalidArgument("expected one of --resume, --restart-line and --restart-set-up")
    return chosen[0] if chosen else None


def _trigger(text: str) -> "Trigger":
    from stepdiag.acquisition.settle_trigger import SettleTrigger
    from stepdiag.acquisition.tcp_trigger import TcpTrigger
    from stepdiag.acquisition.triggers import KeyTrigger

    simple: dict[str, Callable[[], Trigger]] = {"key": KeyTrigger, "settle": SettleTrigger}
    if text in simple:
        return simple[text]()
    trigger = TcpTrigger(*_address(text))
    click.echo(f"listening on {trigger.address[0]}:{trigger.address[1]} for READ <visit> <point>")
    sys.stdout.flush()
    return trigger


def _address(text: str) -> tuple[str, int]:
    from urllib.parse import urlsplit

    try:
        parts = urlsplit(text)
        if parts.scheme == "tcp" and parts.hostname and parts.port is not None and not parts.path:
            return parts.hostname, parts.port
    except ValueError:
        pass
    raise InvalidArgument(f"--trigger: expected key, settle or tcp://HOST:PORT, got {text!r}")


def _point(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> frozenset[tuple[int, int]]:
    points = set()
    for text in texts:
        visit, colon, point = text.partition(":")
        if not colon or not visit.isdecimal() or not point.isdecimal():
            raise click.BadParameter(f"expected VISIT:POINT such as 2:5, got {text!r}")
        points.add((int(visit), int(point)))
    return frozenset(points)


@click.command(epilog="\b\nExample: stepdiag twin scenario.toml --port 9090 --play 1")
@click.argument("scenario", type=PATH)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=9090,
    show_default=True,
    help="Port to listen on; 0: any free port.",
)
@click.option(
    "--play",
    type=SECONDS,
    metavar="SECONDS",
    help="Move through the plan without a client, with this rest at each point.",
)
@click.option(
    "--settling-ms",
    type=click.FloatRange(min=0.0),
    default=0.0,
    show_default=True,
    help="Time that a move takes to settle.",
)
@click.option(
    "--sampling-noise-um", type=click.FloatRange(min=0.0), default=0.0, show_default=True, help="Noise of every value."
)
@click.option(
    "--lose", multiple=True, callback=_point, metavar="VISIT:POINT", help="Interrupt the beams at this point."
)
@click.option(
    "--latch/--no-latch", default=True, show_default=True, help="Beams stay lost until the measurement is restarted."
)
@click.option(
    "--temperatures",
    type=PATH,
    metavar="FILE",
    help="CSV file to which to append the temperatures of the scales every second.",
)
@click.option("--interrupt", is_flag=True, help="Interrupt the beams whenever the head moves to another line.")
@click.option(
    "--protocol",
    type=click.Choice(["ids3010", "lines"]),
    default="ids3010",
    show_default=True,
    help="What it is: an IDS3010, or an adapter that sends JSON lines, with the channels of any head.",
)
@click.option("--stdout", is_flag=True, help="Do not listen; send the lines to standard output.")
def twin(
    scenario: Path,
    host: str,
    port: int,
    play: float | None,
    settling_ms: float,
    sampling_noise_um: float,
    lose: frozenset[tuple[int, int]],
    latch: bool,
    interrupt: bool,
    temperatures: Path | None,
    protocol: Literal["ids3010", "lines"],
    stdout: bool,
) -> None:
    """Simulate the instrument: it reads SCENARIO's virtual machine.

    The program that moves the machine reports its moves by stepdiag.twin.moveTo. With --play the
    machine moves by itself, through each visit that a client begins. Ctrl-C ends the command.
    """
    import threading

    from stepdiag.twin.instrument import TwinBehaviour
    from stepdiag.twin.server import Twin

    behaviour = TwinBehaviour(
        settling=settling_ms * 1e-3, sampling_noise_um=sampling_noise_um, latch=latch, lost=lose, interrupt=interrupt
    )
    if interrupt and protocol == "lines":
        raise InvalidArgument("--interrupt: goes with --protocol ids3010; nobody starts a measurement by lines")
    if stdout and protocol != "lines":
        raise InvalidArgument("--stdout: goes with --protocol lines")
    with Twin(
        scenario,
        host=host,
        port=None if stdout else port,
        behaviour=behaviour,
        play=play,
        temperatures=temperatures,
        protocol=protocol,
    ) as running:
        if stdout:
            _to_standard_output(running)
            return
        click.echo(f"listening on {running.address[0]}:{running.address[1]} (Ctrl-C ends)")
        sys.stdout.flush()
        threading.Event().wait()


def _to_standard_output(running: "Twin") -> None:
    from stepdiag.platform import of_standard_input
    from stepdiag.twin.lines import LineSender, send_lines

    def send(line: bytes) -> None:
        sys.stdout.buffer.write(line)
        sys.stdout.buffer.flush()

    send_lines(LineSender(running.instrument), of_standard_input(sys.stdin.fileno()), send, goes_on=True)
