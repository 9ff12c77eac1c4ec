"""Options of an acquisition: axes, settling, time limits."""

from dataclasses import dataclass, field
from typing import Literal

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.run_from_raw import TEMPERATURE_AGE, Zero
from stepdiag.acquisition.settling import Settling
from stepdiag.option_field import option

Resume = Literal["point", "line", "set-up"]  # what is read next, or once more


def axes_of(text: str) -> tuple[int, ...]:
    """Axes from their numbers with commas between them. Raises InvalidArgument."""
    words = [word.strip() for word in text.split(",")]
    if not all(word.isascii() and word.isdigit() and len(word) < 4 for word in words):
        raise InvalidArgument(f"`axes`: expected numbers with commas between them, such as 1,2,3, got {text!r}")
    return tuple(int(word) for word in words)


@dataclass(frozen=True)
class AcquireOptions:
    """Options of an acquisition. Times are in seconds. Raises InvalidArgument naming the option."""

    axes: tuple[int, ...] | None = option(
        None,
        "Axes of the IDS3010 that give d1, d2, d3 (or distance).  [default: 1,2,3]",
        metavar="N,N,N",
        parse=axes_of,
    )
    sign: Literal[1, -1] = option(
        1, "Use - if the instrument's positions decrease as the distance increases.", words={"+": 1, "-": -1}
    )
    settling: Settling = field(default_factory=Settling)
    zero: Zero = option(
        "none",
        "first: subtract a constant for each set-up and beam; its first reading becomes the nominal distance.",
    )
    uncertainties: bool = option(False, "Also write the standard deviation of each mean (u_d1_um ...).")
    start: Literal["auto", "never"] = option(
        "auto",
        "auto: restart the instrument's measurement at a set-up if it is stopped or reports a warning.",
    )
    start_timeout: float = 90.0
    timeout: float = option(2.0, "Seconds to wait for an answer of the instrument.", above=0.0)
    attempts: int = 3  # tries of a request that changes nothing
    wait_timeout: float = option(3600.0, "Seconds to wait for the next point.", above=0.0)
    temperature_age: float = option(
        TEMPERATURE_AGE, "Seconds that a row of this file may be away from a reading.", above=0.0
    )

    def __post_init__(self) -> None:
        if self.sign not in (1, -1):
            raise InvalidArgument(f"sign: expected 1 or -1, got {self.sign!r}")
        if self.attempts < 1:
            raise InvalidArgument(f"attempts: expected at least 1, got {self.attempts}")
        for name in ("start_timeout", "timeout", "wait_timeout", "temperature_age"):
            seconds = getattr(self, name)
            if not 0.0 < seconds < 1e7:
                raise InvalidArgument(f"{name}: expected seconds above 0, got {seconds!r}")
