"""What the readings so far say: evaluated after each line, in a process of its own."""

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from stepdiag.acquisition.conductor import Conductor

# Lines of the evaluation that say what to do while the machine is still set up.
_UNDETERMINED: Final = "undetermined:"
_TOLD: Final = ("fit:", "rejected because", "doubtful because", _UNDETERMINED, "repeat")
_MOST: Final = 6  # of these
_WRITTEN: Final = (0, 3)  # exit codes with which there is a result


class FitSoFar:
    """Inside a `with` block; pass `begin` as `after_visit`."""

    def __init__(self, scenario: Path, run: Path) -> None:
        self._scenario, self._run = scenario, run
        self._process: subprocess.Popen[str] | None = None
        self._folder = tempfile.TemporaryDirectory(prefix="stepdiag-fit-")

    def __enter__(self) -> "FitSoFar":
        return self

    def __exit__(self, *_: object) -> None:
        self._give_up()
        self._folder.cleanup()

    def _give_up(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def begin(self, conductor: Conductor) -> None:
        """Evaluate what there is now. Of a whole run the verdict is waited for."""
        state = conductor.state
        whole = state.readings == state.planned
        if self._process is not None and not whole:
            return  # the next line's will have these readings too
        self._give_up()
        command = [sys.executable, "-m", "stepdiag", "evaluate", str(self._scenario), str(self._run)]
        self._process = subprocess.Popen(
            [*command, "-o", str(Path(self._folder.name) / "so-far.csv")],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        conductor.meanwhile = lambda: self._look(conductor)
        if whole:
            self._end(conductor)

    def _look(self, conductor: Conductor) -> None:
        if self._process is not None and self._process.poll() is not None:
            self._end(conductor)

    def _end(self, conductor: Conductor) -> None:
        if self._process is None:
            return
        process, self._process = self._process, None
        said, wrong = process.communicate()
        written = process.returncode in _WRITTEN
        lines = said.splitlines() if written else [wrong.strip().split("\n")[-1].split(f"{self._run}: ")[-1]]
        found = [line for line in lines if not written or line.startswith(_TOLD)]
        if conductor.state.readings < conductor.state.planned:  # advice would be what comes anyway
            wanting = [line.split(": ")[1] for line in found if line.startswith(_UNDETERMINED)]
            found = [line for line in found if not line.startswith(_UNDETERMINED)]
            found += [f"not yet determined: {'; '.join(wanting)}"] if wanting else []
            for line in found[:_MOST]:
                conductor.tell(f"so far: {line}")
            return
        for line in found[:_MOST]:
            conductor.tell(line)
        if len(found) > _MOST:
            conductor.tell(f"and {len(found) - _MOST} more, which `stepdiag evaluate` says")
