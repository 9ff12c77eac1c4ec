"""Options of an acquisition: axes, settling, time limits."""

from dataclasses import dataclass, field
from typing import Literal

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.run_from_raw import TEMPERATURE_AGE, Zero
from stepdiag.acquisition.settling import Settling


@dataclass(frozen=True)
class AcquireOptions:
    """Options of an acquisition. Times are in seconds. Raises InvalidArgument naming the option."""

    axes: tuple[int, ...] | None = None  # instrument axis (from 1) of each channel; None: 1, 2, ...
    sign: Literal[1, -1] = 1  # -1: positions decrease as the distance increases
    settling: Settling = field(default_factory=Settling)
    zero: Zero = "none"
    uncertainties: bool = False
    start: Literal["auto", "never"] = "auto"  # whether to restart its measurement at a set-up
    start_timeout: float = 90.0
    timeout: float = 2.0  # answer to one request
    attempts: int = 3  # tries of a request that changes nothing
    wait_timeout: float = 3600.0  # until the trigger wants the next reading
    temperature_age: float = TEMPERATURE_AGE  # how far from a reading a row of temperatures may be

    def __post_init__(self) -> None:
        if self.sign not in (1, -1):
            raise InvalidArgument(f"sign: expected 1 or -1, got {self.sign!r}")
        if self.attempts < 1:
            raise InvalidArgument(f"attempts: expected at least 1, got {self.attempts}")
        for name in ("start_timeout", "timeout", "wait_timeout", "temperature_age"):
            seconds = getattr(self, name)
            if not 0.0 < seconds < 1e7:
                raise InvalidArgument(f"{name}: expected seconds above 0, got {seconds!r}")
