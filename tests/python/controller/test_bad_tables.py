"""Files that are no calibration for a controller are refused at load, for the reason stated; what a spreadsheet or
another editor does to a good one is no reason. tests/cpp/controller/bad_tables_test.cpp reads the same bad files."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from error_tables import COLUMNS, leading_lines
from places import DATA
from refusal import refused
from usual import CHAIN, VOLUME

import stepdiag as sd

FOLDER = DATA / "bad_tables"
REASONS = dict(line.split(": ", 1) for line in (FOLDER / "refusals.txt").read_text("utf-8").splitlines())
ROWS = "EXX,0.0,0.0,um,0.1\nEXX,800.0,40.0,um,0.1\nEAY,0.0,0.0,urad,\nEAY,600.0,30.0,urad,\nC0Y,,-12.0,urad,0.5\n"
GOOD = "\n".join([*leading_lines(CHAIN, VOLUME, (0.0, 0.0, 80.0)), COLUMNS, ROWS])


def test_every_bad_table_has_a_reason() -> None:
    assert set(REASONS) == {path.name for path in FOLDER.iterdir()} - {"refusals.txt"}
    assert len(REASONS) >= 40


@pytest.mark.parametrize("name", sorted(REASONS))
def test_bad_table_is_refused_with_the_reason(name: str) -> None:
    refused(sd.Compensator, FOLDER / name, CHAIN, names=REASONS[name])
    refused(sd.Compensator, FOLDER / name, CHAIN, names=name)


DRESSES = {
    "as it is": GOOD.encode(),
    "windows line ends": GOOD.replace("\n", "\r\n").encode(),
    "byte order mark": ("\ufeff" + GOOD).encode(),
    "blank lines": GOOD.replace("\n", "\n\n").encode(),
    "no last line end": GOOD.rstrip("\n").encode(),
    "quotes": GOOD.replace("EXX,", '"EXX",').encode(),
    "spaces beside the fields": GOOD.replace(",um", " , um").encode(),
    "remarks": ("# by hand, 21 °C\n#\n" + GOOD).encode(),
    "columns in another order": GOOD.replace(COLUMNS + "\n" + ROWS, "").encode()
    + "".join(",".join(reversed(row.split(","))) + "\n" for row in (COLUMNS + "\n" + ROWS).splitlines()).encode(),
}


@pytest.mark.parametrize("dress", DRESSES)
def test_good_table_in_another_dress_is_the_same(tmp_path: Path, dress: str) -> None:
    (tmp_path / "good.csv").write_bytes(GOOD.encode())
    (tmp_path / "dressed.csv").write_bytes(DRESSES[dress])
    good, dressed = (sd.Compensator(tmp_path / name, CHAIN) for name in ("good.csv", "dressed.csv"))
    assert dressed.fingerprint == good.fingerprint
    np.testing.assert_array_equal(dressed.error([[400.0, 300.0, 250.0]]), good.error([[400.0, 300.0, 250.0]]))


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file.csv").write_text(GOOD)
    refused(sd.Compensator, tmp_path, CHAIN, names="expected a file, got a folder")
    refused(sd.Compensator, tmp_path / "absent.csv", CHAIN, names="absent.csv: cannot be read")
    refused(sd.Compensator, tmp_path / ("x" * 300), CHAIN, names="cannot be read")
    refused(sd.Compensator, tmp_path / "file.csv" / "below.csv", CHAIN, names="cannot be read")
    refused(sd.Compensator, "", CHAIN, names="cannot be read")
    refused(sd.Compensator, "/dev/zero", CHAIN, names="/dev/zero: expected a file, got a folder or a device")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every file")
def test_unreadable_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "secret.csv"
    path.write_text(GOOD)
    path.chmod(0)
    refused(sd.Compensator, path, CHAIN, names="Permission denied")


@pytest.mark.parametrize(
    ("options", "culprit"),
    [
        ({"outside": "extrapolate"}, "outside"),
        ({"approach": "sideways"}, "approach"),
        ({"margin": -1.0, "outside": "linear"}, "margin"),
        ({"margin": np.nan, "outside": "linear"}, "margin"),
        ({"margin": np.inf, "outside": "linear"}, "margin"),
        ({"largest_correction": -0.1}, "largest_correction"),
        ({"largest_correction": np.nan}, "largest_correction"),
        ({"origin": (0.0, np.inf, 0.0)}, "origin"),
        ({"origin": (0.0, 0.0)}, "origin"),
    ],
)
def test_options_that_make_no_sense_are_refused(tmp_path: Path, options: dict[str, Any], culprit: str) -> None:
    (tmp_path / "good.csv").write_text(GOOD)
    refused(sd.Compensator, tmp_path / "good.csv", CHAIN, names=culprit, **options)


@pytest.mark.parametrize("chain", ["", "XYZ", "[w X b Y Z t]", "[w X' b Y t]", "[w A b Y Z t]", "[w X' b Y Z t", "w"])
def test_chain_of_a_controller_that_is_none_is_refused(tmp_path: Path, chain: str) -> None:
    (tmp_path / "good.csv").write_text(GOOD)
    refused(sd.Compensator, tmp_path / "good.csv", chain, names="chain")


def many_rows(path: Path, count: int) -> Path:
    """EXX at `count` nodes 1 um apart; slopes stay below 0.001."""
    rows = [f"EXX,{k / 1000.0},{k % 2 / 1000.0},um,\n" for k in range(count)]
    lines = leading_lines(CHAIN, (count / 1000.0, 600.0, 500.0), (0.0, 0.0, 0.0))
    path.write_text("\n".join([*lines, COLUMNS]) + "\n" + "".join(rows))
    return path


def test_a_million_rows_are_refused_within_memory_and_time(tmp_path: Path) -> None:
    """1 GiB of address space is enough to say no."""
    path = many_rows(tmp_path / "many.csv", 1_000_000)
    program = (
        "import resource, sys, stepdiag as sd\n"
        "before = int(open('/proc/self/statm').read().split()[0]) * 4096\n"
        "resource.setrlimit(resource.RLIMIT_AS, (before + (1 << 30),) * 2)\n"
        'try: sd.Compensator(sys.argv[1], "[w X\' b Y Z t]")\n'
        "except sd.InvalidArgument as refusal: print('refused', refusal)\n"
    )
    start = time.monotonic()
    result = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, timeout=120, check=False
    )
    assert result.stdout.startswith(f"refused {path}"), result.stderr
    assert "nodes" in result.stdout
    print(f"refused in {time.monotonic() - start:.1f} s, the start of Python included")


def test_many_rows_that_a_controller_can_hold_are_loaded(tmp_path: Path) -> None:
    compensator = sd.Compensator(many_rows(tmp_path / "table.csv", 10_001), CHAIN)
    # Node 5001 is odd: 1 nm; halfway to it half of that.
    np.testing.assert_allclose(
        compensator.error([[5.001, 0.0, 0.0], [5.0005, 0.0, 0.0]])[:, 0], [1e-6, 0.5e-6], rtol=0.0, atol=1e-15
    )
