"""How an acquisition reads: axes, settling, time limits."""

from dataclasses import dataclass, field
from typing import Literal

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.run_from_raw import Zero
from stepdiag.acquisition.settling import Settling


@dataclass(frozen=True)
class AcquireOptions:
    """How an acquisition reads. Times in seconds."""

    axes: tuple[int, ...] | None = None  # of the instrument, from 1, one for each channel; none: 1, 2, ...
    sign: Literal[1, -1] = 1  # -1: its positions fall where the distance grows
    settling: Settling = field(default_factory=Settling)
    zero: Zero = "none"
    uncertainties: bool = False
    start: Literal["auto", "never"] = "auto"  # the instrument's measurement, at every set-up
    start_timeout: float = 90.0
    timeout: float = 2.0  # of one request
    attempts: int = 3  # of a request that only asks
    wait_timeout: float = 3600.0  # for a reading to be wanted

    def __post_init__(self) -> None:
        if self.sign not in (1, -1):
            raise InvalidArgument(f"sign: expected 1 or -1, got {self.sign!r}")
        if self.attempts < 1:
            raise InvalidArgument(f"attempts: expected at least 1, got {self.attempts}")
        for name in ("start_timeout", "timeout", "wait_timeout"):
            seconds = getattr(self, name)
            if not 0.0 < seconds < 1e7:
                raise InvalidArgument(f"{name}: expected seconds above 0, got {seconds!r}")
