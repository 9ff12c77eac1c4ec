"""Progress of long computations: in a terminal, in a notebook, and nowhere else."""

import contextlib
import io
import subprocess
import sys
import time
from types import ModuleType

import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def wait_for(terminal: Terminal, text: str) -> None:
    """Fails where a minute does not show it; half a second does as a rule."""
    end = time.monotonic() + 60.0
    while text not in terminal.getvalue():
        assert time.monotonic() < end, terminal.getvalue()
        time.sleep(0.01)


def terminal_of(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Not a fixture: pytest puts its own standard error in place between fixtures and the test."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress, "DELAY", 0.0)
    monkeypatch.setattr(progress, "_TICK", 0.01)
    return terminal


def test_terminal_shows_label_and_share_and_is_clean_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)
    with sd.montecarlo.Progress("virtual calibrations") as show:
        show(250, 1000)
        wait_for(terminal, " 25%")
        show(1000, 1000)
        wait_for(terminal, "100%")
    assert "virtual calibrations" in terminal.getvalue()
    assert terminal.getvalue().endswith("\r")
    assert not terminal.getvalue().split("\r")[-2].strip(), "the bar is wiped out"


def test_what_makes_no_call_shows_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)
    with sd.montecarlo.Progress("evaluate"):
        wait_for(terminal, "evaluate: 00:00")


def test_bar_ends_with_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)
    with contextlib.suppress(ValueError), sd.montecarlo.Progress("plans") as show:
        show(1, 2)
        wait_for(terminal, " 50%")
        raise ValueError("broken")
    assert not terminal.getvalue().split("\r")[-2].strip()


def test_short_computation_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_of(monkeypatch)
    monkeypatch.setattr(progress, "DELAY", 1e9)
    with sd.montecarlo.Progress("plans") as show:
        show(1, 2)
    assert terminal.getvalue() == ""


def test_file_gets_nothing_and_tqdm_is_not_imported() -> None:
    code = (
        "import sys, stepdiag as sd; from stepdiag import progress; progress.DELAY = 0.0\n"
        "with sd.montecarlo.Progress('plans') as show: show(1, 2)\n"
        "assert 'tqdm' not in sys.modules"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stderr == ended.stdout == ""


def test_notebook_draws_from_the_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel's standard error is no terminal, and its widgets belong to the main thread."""
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    monkeypatch.setattr(progress, "DELAY", 0.0)
    with sd.montecarlo.Progress("samples") as show:
        assert show._ticking is None
        show(1, 2)
        assert " 50%" in stream.getvalue()


def test_uncertainty_tells_its_progress() -> None:
    calls: list[tuple[int, int]] = []
    scenario = sd.parse_scenario(SCENARIO)
    request = sd.montecarlo.UncertaintyRequest(samples=20_000, method="enhanced")
    sd.montecarlo.evaluate_uncertainty(scenario, request, lambda done, total: calls.append((done, total)))
    assert calls[-1] == (20_000, 20_000)
