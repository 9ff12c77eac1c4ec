"""Options of a measuring program, with defaults and checks."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, get_args

import numpy as np

from stepdiag._core import InvalidArgument
from stepdiag.option_field import option
from stepdiag.program.gcode import Dialect, DwellWord, Trigger, Writer
from stepdiag.program.path import Space

if TYPE_CHECKING:
    from stepdiag.scenario.known import Known

Triple = tuple[float, float, float]
COORDINATES: Final = ("G53", "G54", "G55", "G56", "G57", "G58", "G59")


@dataclass(frozen=True)
class Options:
    """Options of a program. Lengths in mm, in the controller's coordinates. None has a default."""

    dialect: Dialect = option(
        "linuxcnc",
        "LinuxCNC's G-code, words of ISO 6983 that most controllers understand, Siemens' G-code, or Heidenhain's "
        "Klartext.",
    )
    origin: Triple = option((0.0, 0.0, 0.0), "Coordinates of home, mm.", metavar="X Y Z")
    coordinates: str | None = option(
        None,
        "Machine coordinates G53, or a work offset G54 to G59 (siemens: to G57; heidenhain: G54, the active preset).  "
        "[default: G53 for linuxcnc, else G54]",
        metavar="G5x",
    )
    limits: tuple[float, float, float, float, float, float] | None = option(
        None,
        "Limits of travel of X, Y, Z, mm; no move exceeds them.  [default: unlimited]",
        metavar="X X Y Y Z Z",
    )
    overrun: float = option(1.0, "Overrun before the first point of a line, mm.", metavar="MM")
    safe: Triple | None = option(
        None,
        "Position of the axes for a set-up.  [default: the middle of X and Y, the far end of Z]",
        metavar="X Y Z",
    )
    retreat: str = option("ZXY", "Order in which the axes move to the safe position, one at a time.", metavar="ORDER")
    trigger: Trigger | None = option(
        None,
        "How the program requests a reading (docs/measuring.md); code: by --trigger-code.  "
        "[default: handshake for linuxcnc, else dwell]",
    )
    trigger_code: str = option("", "Your own M-code that requests a reading.", metavar="M80")
    timeout: float = option(300.0, "Seconds that a handshake waits for a reading.", metavar="S")
    dwell_word: DwellWord = option("P", "G4 of iso takes seconds as P, X or F, or milliseconds as P (PMS).")
    decimals: int | None = option(
        None, "Decimal places of positions in mm.  [default: 6 for linuxcnc, else 4]", metavar="N"
    )
    align: bool = option(True, "Stop at the first point of a line to align the beam.")
    stops: bool = option(True, "Stop before each line to set up head and mirror; not where all heads stay installed.")
    line_numbers: bool = option(False, "Number the blocks (heidenhain: always).")


def writer_of(options: Options) -> Writer:
    linuxcnc = options.dialect == "linuxcnc"
    coordinates = options.coordinates or ("G53" if linuxcnc else "G54")
    decimals = options.decimals if options.decimals is not None else 6 if linuxcnc else 4
    if coordinates not in COORDINATES:
        raise InvalidArgument(f"coordinates: expected one of {', '.join(COORDINATES)}, got {coordinates}")
    if not 3 <= decimals <= 12:
        raise InvalidArgument(f"decimals: expected 3 to 12 of a millimetre, got {decimals}")
    offsets = {"siemens": COORDINATES[:5], "heidenhain": COORDINATES[:2]}.get(options.dialect, COORDINATES)
    if coordinates not in offsets:
        raise InvalidArgument(
            f"coordinates: expected {' to '.join(offsets[:: len(offsets) - 1])} in {options.dialect}, got {coordinates}"
        )
    if options.dwell_word not in get_args(DwellWord) or (options.dialect != "iso" and options.dwell_word != "P"):
        raise InvalidArgument("dwell word: expected P, or in the dialect iso X, F or PMS")
    return Writer(options.dialect, decimals, coordinates, options.dwell_word)


def trigger_of(options: Options) -> Trigger:
    if options.trigger_code and options.trigger not in (None, "code"):
        raise InvalidArgument(f"trigger: expected {options.trigger} or the code {options.trigger_code}, got both")
    trigger = options.trigger or ("code" if options.trigger_code else None)
    trigger = trigger or ("handshake" if options.dialect == "linuxcnc" else "dwell")
    if trigger == "code" and not (options.trigger_code[:1] == "M" and options.trigger_code[1:].isdecimal()):
        raise InvalidArgument(f'trigger code: expected an M-code such as M80, got "{options.trigger_code}"')
    if not 0.0 < options.timeout < np.inf:
        raise InvalidArgument(f"timeout: expected a time above 0, got {options.timeout:g}")
    if trigger in ("handshake", "pulse") and options.dialect != "linuxcnc":
        raise InvalidArgument(f"trigger: {trigger} is LinuxCNC's; {options.dialect} has dwell, or a trigger code")
    return trigger


def space_of(known: "Known", options: Options) -> Space:
    for name in ("origin", "safe", "limits"):
        if not np.all(np.isfinite(getattr(options, name) or 0.0)):
            raise InvalidArgument(f"{name}: expected finite lengths, got {getattr(options, name)}")
    origin, volume = np.asarray(options.origin), known.plan.volume
    # The far end of Z: on most machines up, away from the table.
    safe = origin + volume * (0.5, 0.5, 1.0) if options.safe is None else np.asarray(options.safe)
    lowest, highest = np.full(3, -np.inf), np.full(3, np.inf)
    if options.limits is not None:
        lowest, highest = np.asarray(options.limits[::2]), np.asarray(options.limits[1::2])
    if not 0.0 <= options.overrun < np.inf:
        raise InvalidArgument(f"overrun: expected a length of at least 0, got {options.overrun:g}")
    return Space(origin, safe, options.retreat.upper(), options.overrun, lowest, highest)
