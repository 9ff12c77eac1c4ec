"""The proof of a sign: the program moves the virtual machine, with the table read by an interpreter of the tests."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from controllers import INTERPRETERS
from exported import TOOL, VOLUME, calibration_of, export, machine_of, random_calibration
from refusal import refused
from usual import ALL_CHAINS

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.exporting.formats import FORMATS
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.write import write_export
from stepdiag.program.proof import proof_of, proof_program

ORIGIN = (-100.0, 25.0, 7.5)
SHOWN = 1e-4  # mm: half of the last digit of what is told, and positions of four digits times a slope


def stops_of(text: str) -> np.ndarray:
    """Where the program stops to let somebody read, in the controller's coordinates."""
    place, found = np.full(3, np.nan), []
    for line in text.splitlines():
        words = dict(re.findall(r"([XYZ])\+?(-?\d+\.\d+)", line)) if re.search(r"\bG1 X|\bL X", line) else {}
        for n, axis in enumerate("XYZ"):
            place[n] = float(words[axis]) if axis in words else place[n]
        if re.fullmatch(r"(\d+ )?(M0|STOP)", line) and not np.isnan(place[0]):
            found.append(place.copy())
    return np.array(found)


@pytest.mark.parametrize("chain", ALL_CHAINS[::4])
@pytest.mark.parametrize("to", ["siemens-cec", "heidenhain-com", "etalon", "marlin"])
def test_what_is_expected_is_what_the_machine_does(tmp_path: Path, to: str, chain: str) -> None:
    calibration, output = random_calibration(ALL_CHAINS.index(chain), chain), tmp_path / "table"
    origin = (0.0, 0.0, 0.0) if to == "marlin" else ORIGIN
    options = ExportOptions(origin=origin)
    done = write_export(calibration, to, output, options)
    proof = proof_of(calibration, done, options)
    text, said = proof_program(calibration, done, options, FORMATS[to].maker)
    machine, axis = machine_of(calibration), "XYZ".index(proof.axis)
    stops = stops_of(text)
    assert stops.shape == (6, 3)
    assert np.all((stops - origin >= 0.0) & (stops - origin <= VOLUME))

    def shown(motors: np.ndarray) -> float:
        error = motors + machine.error(motors) - (stops - origin)
        assert np.ptp(error[::2, axis]) == np.ptp(error[1::2, axis]) == 0.0
        return float(error[1, axis] - error[0, axis])

    with_it, turned = (shown(INTERPRETERS[to](output, stops, 1, sign) - origin) for sign in (1.0, -1.0))
    assert shown(stops - origin) == pytest.approx(proof.without, abs=SHOWN)
    assert with_it == pytest.approx(proof.with_it, abs=SHOWN + 2e-4)  # of first order, in a steep small machine
    assert turned == pytest.approx(proof.turned, abs=SHOWN + 2e-4)
    assert (with_it - proof.without) * (turned - proof.without) < 0.0
    assert f"{(proof.with_it - proof.without) * 1e3:+.1f} µm" in said[-1]


def test_command_writes_the_program_and_says_what_to_expect(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    random_calibration(4).write("c.csv")
    assert main(["export", "c.csv", "--to", "siemens-cec", "-o", "cec.ini", "--proof", "proof.mpf"]) == 0
    said = capsys.readouterr().out
    assert "proof of the sign: " in said
    assert "wrote proof.mpf" in said
    program = Path("proof.mpf").read_text(encoding="ascii")
    assert program.startswith("; Measuring program to prove a sign\n")
    assert program.count("M0\n") == 7
    assert main(["export", "c.csv", "--to", "siemens-cec", "-o", "cec.ini", "--proof", "proof.mpf"]) == 0, "again"


def test_a_table_that_nobody_could_see_is_refused(tmp_path: Path) -> None:
    functions = {f"E{c}{a}": ([0.0, e], [0.0, 0.0]) for a, e in zip("XYZ", VOLUME, strict=True) for c in "XYZABC"}
    calibration = calibration_of(
        sd.ErrorMap(functions | {"EXX": ([0.0, 80.0], [0.0, 0.001])}, dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0)),
        tool=TOOL,
    )
    export(calibration, "siemens-cec", tmp_path / "cec.ini")
    done = write_export(calibration, "siemens-cec", tmp_path / "cec.ini", ExportOptions())
    refused(proof_of, calibration, done, ExportOptions(), names="no dial gauge shows that")
