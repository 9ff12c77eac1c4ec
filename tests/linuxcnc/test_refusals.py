"""LinuxCNC does not start with a table or an argument that is wrong, and its output says why. Nothing hangs."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN

from stepdiag.linuxcnc.session import LinuxcncError, LinuxcncSession


def start(table: Path, **more: object) -> str:
    """What is said when it does not start; well within the session's own limit, 60 s."""
    given = {"chain": CHAIN, **more}
    with pytest.raises(LinuxcncError) as caught, LinuxcncSession(table=table, **given):  # type: ignore[arg-type]
        pass
    said = [line for line in str(caught.value).splitlines() if line.startswith("stepdiagkins: ")]
    assert said, str(caught.value)
    return said[0]


def replaced(pattern: str, by: str) -> Callable[[bytes], bytes]:
    def change(content: bytes) -> bytes:
        changed, count = re.subn(pattern.encode(), by.encode(), content, count=1, flags=re.MULTILINE)
        assert count == 1
        return changed

    return change


def unsorted(content: bytes) -> bytes:
    lines = content.split(b"\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(b"EXX,"))
    lines[first + 1], lines[first + 2] = lines[first + 2], lines[first + 1]
    return b"\n".join(lines)


def without_checksum(content: bytes) -> bytes:
    """As a table changed by hand: with its checksum, the checksum would be the reason."""
    return re.sub(rb"^# sha256=.*\n", b"", content, flags=re.MULTILINE)


def random_bytes(_: bytes) -> bytes:
    return np.random.default_rng(3).bytes(5000)


BAD = {
    "missing file": (None, "table.csv"),
    "empty file": (lambda _: b"", "table.csv"),
    "random bytes": (random_bytes, "table.csv"),
    "cut within a row": (lambda content: content[: content.rindex(b",") - 30], "table.csv"),
    "a digit less in its last number": (lambda content: re.sub(rb"\d(\D*)\Z", rb"\1", content), "sha256"),
    "not a number": (replaced(r"^EXY,([^,]*),[^,]*,", r"EXY,\1,nan,"), "EXY|value"),
    "no chain": (replaced(r"^# chain=.*\n", ""), "chain"),
    "no volume": (replaced(r"^# volume_mm=.*\n", ""), "volume_mm"),
    "no tool": (replaced(r"^# tool_mm=.*\n", ""), "tool_mm"),
    "other chain": (replaced(r"^# chain=.*", "# chain=[w b X Y Z t]"), r"chain.*\[w X' b Y Z t\].*\[w b X Y Z t\]"),
    "wrong unit": (replaced(r",um,", ",mm,"), "unit"),
    "positions not ascending": (unsorted, "EXX"),
    "an unknown parameter": (replaced(r"^EXX,", "EXQ,"), "EXQ"),
    "a rejected fit": (replaced(r"^# chain=", "# fit=rejected\n# chain="), "fit=rejected"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_table_is_refused_with_the_reason(name: str, table: Path, tmp_path: Path) -> None:
    spoil, reason = BAD[name]
    bad = tmp_path / "bad.csv"
    if spoil:
        content = spoil(table.read_bytes())
        bad.write_bytes(content if reason == "sha256" else without_checksum(content))
    assert re.search(reason, start(bad))


def test_a_calibration_without_its_checksum_is_refused_unless_told(table: Path, tmp_path: Path) -> None:
    """The other tables here are error maps, which need none."""
    unverified = tmp_path / "unverified.csv"
    calibration = replaced("^# format=stepdiag error map 1", "# format=stepdiag calibration 1")
    unverified.write_bytes(calibration(without_checksum(table.read_bytes())))
    said = start(unverified)
    assert "unverified: a checksum was absent when this calibration was read" in said
    assert "accept_unverified" in said
    with LinuxcncSession(table=unverified, chain=CHAIN, options={"accept_unverified": 1}):
        pass


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"outside": "extrapolate"}, 'outside: expected hold, linear or refuse, got "extrapolate"'),
        ({"origin": "0,0"}, 'origin: expected three numbers x,y,z, got "0,0"'),
        ({"margin": "5mm", "outside": "linear"}, 'margin: expected a number, got "5mm"'),
        ({"margin": 5}, "margin: expected 0 unless outside is linear"),
        ({"largest_correction": "nan"}, "largest_correction: expected a number"),
        ({"ramp": -1}, "ramp: expected 0 to 60 s"),
        ({"coordinates": "XYA"}, "coordinates: expected X, Y and Z among them"),
        ({"accept_unverified": "yes"}, 'accept_unverified: expected 0 or 1, got "yes"'),
        ({"units": "furlong"}, 'units: expected mm or inch, got "furlong"'),
    ],
)
def test_a_bad_argument_is_refused_with_the_reason(options: dict[str, str | float], reason: str, table: Path) -> None:
    assert reason in start(table, options=options)


def test_a_chain_is_asked_for(table: Path) -> None:
    assert "chain: expected the machine's kinematic chain" in start(table, chain=None)
