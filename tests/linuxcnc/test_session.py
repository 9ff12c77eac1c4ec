"""A session starts and ends whatever happens, tells why it could not, and leaves nothing behind."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from stepdiag.linuxcnc.processes import PROCESSES, processes
from stepdiag.linuxcnc.session import LinuxcncError, LinuxcncSession

CRASH = """
from stepdiag.linuxcnc.session import LinuxcncSession
with LinuxcncSession() as session:
    print("started", session.folder, flush=True)
    session.mdi("G4 P100", timeout=200)
"""


def running() -> set[str]:
    return {name for _, name in processes() if name in PROCESSES}


def test_without_linuxcnc_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nonexistent")
    with pytest.raises(LinuxcncError, match="apt-get install linuxcnc-uspace linuxcnc-uspace-dev"), LinuxcncSession():
        pass


def test_nothing_is_left_after_an_orderly_end() -> None:
    with LinuxcncSession() as session:
        folder = session.folder
        session.mdi("G0 X1")
        assert running() == set(PROCESSES)
    assert not running()
    assert not folder.exists()
    assert "Shutting down" in session.log


def test_what_linuxcnc_refuses_is_an_error_with_its_words() -> None:
    with LinuxcncSession() as session:
        with pytest.raises(LinuxcncError, match="Unknown word"):
            session.mdi("G1 Xfoo")
        with pytest.raises(LinuxcncError, match="would exceed X's positive limit"):
            session.mdi("G53 G0 X10001")
        with pytest.raises(LinuxcncError, match="no_such_pin"):
            session.pin("no_such_pin")
        session.mdi("G0 X7")
        assert session.joints()[0] == pytest.approx(7.0, abs=1e-9)


def test_a_second_session_of_the_same_program_is_refused_at_once() -> None:
    with LinuxcncSession(), pytest.raises(LinuxcncError, match="only one session can run"), LinuxcncSession():
        pass


def test_a_start_that_hangs_is_ended() -> None:
    begun = time.monotonic()
    with (
        pytest.raises(LinuxcncError, match="did not start within 4 s"),
        LinuxcncSession(hal=["loadusr -w sleep 1000"], start_timeout=4.0),
    ):
        pass
    assert time.monotonic() - begun < 120.0  # it ends; how soon is the machine's load
    assert not running()


def test_a_program_that_is_killed_takes_linuxcnc_with_it() -> None:
    with subprocess.Popen([sys.executable, "-c", CRASH], stdout=subprocess.PIPE, text=True) as crashing:
        assert crashing.stdout is not None
        word, folder = crashing.stdout.readline().split()
        assert word == "started"
        os.kill(crashing.pid, signal.SIGKILL)
    with LinuxcncSession() as session:  # waits for the end of what was left, or ends it
        session.mdi("G0 X1")
        assert str(session.folder) != folder
    assert not running()
    shutil.rmtree(folder, ignore_errors=True)  # which the dead could not


def test_an_exception_ends_the_session() -> None:
    def fail() -> None:
        with LinuxcncSession() as session:
            session.mdi("G0 X1")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not running()
