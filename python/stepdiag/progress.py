"""Progress of long computations, in a terminal and in a notebook (tqdm)."""

import os
import sys
import time
from threading import Event, Thread
from typing import Any, Final, Self

DELAY: Final = 1.0  # s; what ends sooner shows nothing
_TICK: Final = 0.5  # s
VARIABLE: Final = "STEPDIAG_PROGRESS"  # of the environment: "lines" for programs that show progress themselves


class Progress:
    """Show how far a computation is; pass it as `progress` to what computes.

        with sd.montecarlo.Progress("virtual calibrations") as progress:
            result = sd.montecarlo.evaluate_uncertainty(scenario, request, progress)

    Shows a bar in a notebook, or on standard error if that is a terminal, from the first second on. What does not call
    it shows the time that has passed. The bar disappears at the end. Elsewhere nothing is shown. If STEPDIAG_PROGRESS
    in the environment is "lines", lines such as "stepdiag: progress: plans 3/10" go to standard error."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._done: tuple[int, int] | None = None
        self._bar: Any = None
        self._in_notebook = "ipykernel" in sys.modules
        self._in_lines = os.environ.get(VARIABLE) == "lines"
        self._start = 0.0
        self._ended = Event()
        self._ticking: Thread | None = None

    def __enter__(self) -> Self:
        self._start = time.monotonic()
        if (sys.stderr.isatty() or self._in_lines) and not self._in_notebook:  # where widgets belong to the main thread
            self._ticking = Thread(target=self._tick, daemon=True)
            self._ticking.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        if self._ticking is not None:
            self._ticking.join()
        if self._bar is not None:
            self._bar.close()

    def __call__(self, done: int, total: int) -> None:
        """`done` of `total` are done."""
        self._done = (done, total)
        if self._in_notebook:
            self._draw()

    def _tick(self) -> None:
        while not self._ended.wait(_TICK):
            self._draw()

    def _draw(self) -> None:
        passed = time.monotonic() - self._start
        if passed < DELAY:
            return
        if self._in_lines:
            share = "" if self._done is None else f" {self._done[0]}/{self._done[1]}"
            print(f"stepdiag: progress: {self._label}{share}", file=sys.stderr, flush=True)
            return
        if self._bar is None:
            from tqdm.auto import tqdm  # type: ignore[import-untyped]  # slow; most computations end before

            done = self._done[0] if self._done is not None else 0
            self._bar = tqdm(
                desc=self._label,
                initial=done,
                leave=False,
                dynamic_ncols=True,
                file=sys.stderr,
                unit="",
                unit_scale=True,
            )
            self._bar.start_t -= passed
        if self._done is None:
            self._bar.bar_format = "{desc}: {elapsed}"
        else:
            self._bar.bar_format = None
            self._bar.n, self._bar.total = self._done
        self._bar.refresh()
