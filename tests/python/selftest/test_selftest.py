"""The self-test passes here, and fails for each truth that is changed."""

import hashlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import exact_indices
import numpy as np
import pytest
from compensator_oracle import Oracle
from json_objects import printed
from places import KNOWN

import stepdiag as sd
from stepdiag import _core
from stepdiag.cli import main
from stepdiag.selftest import cases
from stepdiag.selftest.cases import run_selftest
from stepdiag.selftest.table import SelfTest, sha256_of_files


@pytest.fixture(scope="module")
def found() -> SelfTest:
    return run_selftest()


@pytest.fixture
def known(tmp_path: Path) -> Path:
    return Path(shutil.copytree(KNOWN, tmp_path / "known"))


def test_every_case_passes(found: SelfTest) -> None:
    assert [row for row in found.rows if not row.passed] == []
    assert len(found.rows) == 95


# A file of the known truth, a pattern in it, what it becomes, and the case that must fail.
WRONG = [
    ("air.csv", "1.000267394,", "1.000267397,", "index of air"),
    ("air.csv", "1.000286579\n", "1.000286577\n", "index of air"),
    ("glass.csv", "1.515089", "1.515091", "index of glass"),
    ("statistics.csv", "-0.1712", "-0.1713", "GUM H.3"),
    ("statistics.csv", ",838,", ",840,", "JCGM 101 9.5"),
    ("statistics.csv", ",-3.88,", ",-3.90,", "JCGM 101 9.2.3"),
    ("compensator.csv", "0.043597623579983334", "0.043597623579983934", "compensator"),
    ("compensator_table.csv", "[w Y' b X Z t]", "[w X' b Y Z t]", "compensator"),
    *(
        (f"runs/{case}/scenario.toml", "standoff_mm = 100.0", "standoff_mm = 101.0", f"run {case}")
        for case in ("misaligned", "displaced_psd", "reversed_order", "three_beams")
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "right", "wrong", "case"), WRONG, ids=lambda text: text[-20:])
def test_a_changed_truth_fails(known: Path, name: str, right: str, wrong: str, case: str) -> None:
    text = (known / name).read_text()
    assert right in text
    (known / name).write_text(text.replace(right, wrong))
    again = run_selftest(known)
    assert not again.passed
    assert {row.case for row in again.rows if not row.passed} == {case}


@pytest.mark.slow
@pytest.mark.parametrize("case", sorted(path.name for path in (KNOWN / "runs").iterdir() if path.is_dir()))
def test_a_changed_error_of_a_machine_fails(known: Path, case: str) -> None:
    path = known / "runs" / case / "truth.csv"
    rows = path.read_text().splitlines()
    k = next(k for k, row in enumerate(rows) if row.startswith("EXX") and float(row.split(",")[1]) > 300.0)
    parameter, position, value, *rest = rows[k].split(",")
    rows[k] = ",".join([parameter, position, repr(float(value) + (50.0 if case == "noisy" else 1e-6)), *rest])
    path.write_text("\n".join(rows) + "\n")
    assert f"run {case}" in {row.case for row in run_selftest(known).rows if not row.passed}


def test_exact_indices_are_those_of_the_separate_program() -> None:
    for name, text in exact_indices.files().items():
        assert (KNOWN / name).read_text(encoding="utf-8") == text


def test_a_case_that_ends_with_an_error_fails(known: Path) -> None:
    (known / "air.csv").unlink()
    again = run_selftest(known)
    (row,) = [row for row in again.rows if not row.passed]
    assert (row.case, row.deviation) == ("air", None)
    assert "air.csv" in row.error
    assert row.error in again.text
    assert f"{len(again.rows) - 1} of {len(again.rows)} passed\n" in again.text


def test_file_that_is_not_refused_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "_is_refused", lambda *_: False)
    assert {row.case for row in run_selftest().rows if not row.passed} == {"refused files"}


@pytest.fixture
def chosen() -> Iterator[None]:
    before = _core.instruction_set()
    yield
    _core.choose_instruction_set(before)


@pytest.mark.slow
@pytest.mark.parametrize("name", _core.instruction_sets())
@pytest.mark.usefixtures("chosen")
def test_every_instruction_set_passes(name: str) -> None:
    _core.choose_instruction_set(name)
    again = run_selftest()
    assert again.passed, again.text
    assert again.installation.instruction_set == name


def test_compensator_table_is_that_of_forty_digits() -> None:
    oracle = Oracle((KNOWN / "compensator_table.csv").read_text())
    numbers = np.loadtxt(KNOWN / "compensator.csv", delimiter=",", skiprows=1)
    for row in numbers:
        answer = oracle.error(row[:3].tolist())
        assert [float(x) for x in (*answer.position, *answer.orientation)] == row[3:].tolist()


def test_record_is_tied_to_itself_and_to_the_installation(found: SelfTest, known: Path) -> None:
    *above, last = found.text.splitlines(keepends=True)
    assert last == f"sha256 of the lines above: {hashlib.sha256(''.join(above).encode()).hexdigest()}\n"
    assert f"stepdiag {sd.__version__}\n" in found.text
    assert found.installation.sha256 in found.text
    before = sha256_of_files(known)
    (known / "__pycache__").mkdir()
    (known / "__pycache__" / "a.pyc").write_bytes(b"1")
    assert sha256_of_files(known) == before
    (known / "glass.csv").rename(known / "glas.csv")
    assert sha256_of_files(known) != before


def test_command_writes_what_it_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["selftest", "-o", "record.txt"]) == 0
    out, err = capsys.readouterr()
    assert out == Path("record.txt").read_text() + "wrote record.txt\n"
    assert err == ""
    assert "95 of 95 passed" in out
    assert max(map(len, out.splitlines())) <= 100


def test_a_failure_ends_the_command_with_status_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cases, "AIR", 1e-13)
    assert main(["selftest"]) == 3
    out, err = capsys.readouterr()
    assert "93 of 95 passed" in out
    assert len(re.findall(r"^FAILED  index of air", out, re.M)) == 2
    assert err == "warning: the self-test failed (index of air): do not use this installation\n"


def test_object_has_the_rows_of_the_table(found: SelfTest, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("selftest", capsys, "selftest")
    assert said["passed"] is True
    assert [(one["case"], one["compared"], one["allowed"]["value"]) for one in said["cases"]] == [
        (row.case, row.compared, row.allowed) for row in found.rows
    ]
    assert said["installation"]["sha256"] == found.installation.sha256


def test_object_of_a_failure(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(cases, "CASES", (lambda known: 1 / 0,))
    said = printed("selftest", capsys, "selftest", status=3)
    assert said["passed"] is False
    assert said["cases"][0]["deviation"]["value"] is None
    assert "ZeroDivisionError" in said["cases"][0]["error"]
