"""The machine book: nothing in it is replaced or lost, every result keeps its inputs, the index is only an index."""

import hashlib
import json
import os
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO, of_map

import stepdiag as sd
from stepdiag.book.book import Book, find_book
from stepdiag.book.layout import check_name, reserve, safe_name
from stepdiag.cli import main

MACHINE = Path("book/machines/VMC-1200")


def run(*arguments: str) -> int:
    return main(list(arguments))


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def simulate_with(seed: str, name: str) -> None:
    Path("again.toml").write_text(SCENARIO.replace("seed = 3", f"seed = {seed}"))
    assert run("simulate", "again.toml", "-o", name, "--overwrite") == 0


def records() -> list[dict[str, object]]:
    return [json.loads(path.read_text()) for path in sorted((MACHINE / "records").iterdir())]


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_whole_path_of_a_machine(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("evaluate", "--machine", "VMC-1200", "-o", "first.nc") == 0
    assert run("simulate", "--machine", "VMC-1200", "-o", "second.csv") == 0
    assert run("evaluate", "--machine", "VMC-1200", "second", "-o", "second.nc") == 0
    assert run("volume", "--machine", "VMC-1200") in (0, 3)
    assert "within 20 µm" in capsys.readouterr().out
    assert run("compare", "--machine", "VMC-1200") == 0
    assert run("nc", "--machine", "VMC-1200") == 0
    assert run("report", "--machine", "VMC-1200", "-o", "report.html") == 0
    assert run("export", "--machine", "VMC-1200", "--to", "linuxcnc-comp", "--accept-rejected") == 0
    assert run("export", "--machine", "VMC-1200", "--to", "squareness") == 0
    assert [path.name for path in sorted((MACHINE / "exports").iterdir())] == ["2026-11-21", "2026-11-21.csv"]
    assert (
        "VMC-1200" in (MACHINE / "reports/report.html").read_text()
        or "0815" in (MACHINE / "reports/report.html").read_text()
    )
    capsys.readouterr()
    assert run("book", "show", "VMC-1200") == 0
    said = capsys.readouterr().out
    assert said.splitlines()[0].startswith("machine: ")
    for file in ("first.nc", "second.nc", "runs/second.csv", "exports/2026-11-21"):
        assert file in said
    assert run("book", "list") == 0
    assert "VMC-1200" in capsys.readouterr().out


def test_results_are_those_of_the_files(book: Path) -> None:
    assert run("evaluate", "--machine", "vmc-1200") == 0
    assert run("evaluate", "scenario.toml", "run.csv", "-o", "own.nc") == 0
    of_book = sd.read_calibration(next((MACHINE / "calibrations").iterdir()))
    own = sd.read_calibration("own.nc")
    assert all((of_book.functions[name][1] == values).all() for name, (_, values, _) in own.functions.items())


def test_every_result_keeps_inputs_version_and_command(book: Path) -> None:
    assert run("evaluate", "--machine", "VMC-1200", "-m", "enhanced") in (0, 3)
    record = records()[-1]
    output = MACHINE / record["outputs"][0]["file"]  # type: ignore[index]
    assert record["command"] == ["stepdiag", "evaluate", "--machine", "VMC-1200", "-m", "enhanced"]
    assert record["version"] == sd.__version__
    assert record["outputs"][0]["sha256"] == sha256(output)  # type: ignore[index]
    assert {one["file"]: one["sha256"] for one in record["inputs"]} == {  # type: ignore[attr-defined]
        "scenarios/scenario.toml": sha256(Path("scenario.toml")),
        "runs/run.csv": sha256(Path("run.csv")),
    }


def test_nothing_is_replaced(book: Path) -> None:
    names = set()
    for _ in range(3):
        assert run("evaluate", "--machine", "VMC-1200") == 0
        names = {path.name for path in (MACHINE / "calibrations").iterdir()}
    assert names == {"2026-11-21.nc", "2026-11-21-2.nc", "2026-11-21-3.nc"}
    before = contents(MACHINE)
    assert run("evaluate", "--machine", "VMC-1200", "-o", "2026-11-21.NC") == 2
    assert run("simulate", "--machine", "VMC-1200", "-o", "run.csv", "--overwrite") == 2
    assert contents(MACHINE) == before


def test_bin_in_place_of_deletion(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = (MACHINE / "runs/run.csv").read_bytes()
    assert run("book", "remove", "--machine", "VMC-1200", "run.csv") == 0
    assert not (MACHINE / "runs/run.csv").exists()
    assert (MACHINE / "bin/runs/run.csv").read_bytes() == content
    assert run("evaluate", "--machine", "VMC-1200") == 2
    assert "expected a measurement in the book" in capsys.readouterr().err
    assert run("book", "restore", "--machine", "VMC-1200", "run") == 0
    assert (MACHINE / "runs/run.csv").read_bytes() == content
    assert run("evaluate", "--machine", "VMC-1200") == 0
    assert [one["command"][2] for one in records()[2:4]] == ["remove", "restore"]  # type: ignore[index]


def test_removed_beside_one_of_the_same_name(book: Path) -> None:
    for seed in "45":
        simulate_with(seed, "run.csv")
        assert run("book", "add", "--machine", "VMC-1200", "run.csv") == 0
    assert run("book", "remove", "--machine", "VMC-1200", "run-2.csv") == 0
    (MACHINE / "runs/run-3.csv").rename(MACHINE / "runs/run-2.csv")
    assert run("book", "remove", "--machine", "VMC-1200", "run-2.csv") == 0
    assert sorted(path.name for path in (MACHINE / "bin/runs").iterdir()) == ["run-2-2.csv", "run-2.csv"]


def test_a_file_is_taken_in_once(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copyfile("run.csv", "same.csv")
    assert run("book", "add", "--machine", "VMC-1200", "same.csv") == 0
    assert "already in the book as runs/run.csv" in capsys.readouterr().out
    assert [path.name for path in (MACHINE / "runs").iterdir()] == ["run.csv"]


def test_a_scenario_comes_with_what_it_names(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sd.read_scenario("scenario.toml").machine().errors.write("truth.csv")
    Path("mapped.toml").write_text(of_map("truth.csv"))
    assert run("book", "add", "--machine", "VMC-1200", "mapped.toml") == 0
    assert sorted(path.name for path in (MACHINE / "scenarios/mapped").iterdir()) == ["mapped.toml", "truth.csv"]
    assert run("simulate", "--machine", "VMC-1200", "mapped") == 0
    Path("below").mkdir()
    shutil.move("truth.csv", "below/truth.csv")
    Path("mapped.toml").write_text(of_map("below/truth.csv"))
    capsys.readouterr()
    assert run("book", "add", "--machine", "VMC-1200", "mapped.toml") == 2
    assert "expected a file in the scenario's own folder" in capsys.readouterr().err
    assert len([*(MACHINE / "scenarios").iterdir()]) == 2


@pytest.mark.parametrize("name", ["run.csv", "scenario.toml", "calibration.nc"])
def test_damaged_file_is_refused_and_the_others_come_in(
    book: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    run("evaluate", "scenario.toml", "run.csv", "-o", "calibration.nc")
    content = Path(name).read_bytes()
    Path(name).write_bytes(content[: len(content) // 3] + b"\n,,\x07")
    Path("certificate.pdf").write_bytes(b"%PDF-1.7 instrument")
    before = contents(MACHINE)
    assert run("book", "add", "--machine", "VMC-1200", name, "certificate.pdf") == 2
    assert "stepdiag: error: " in capsys.readouterr().err
    after = contents(MACHINE)
    assert {file: after[file] for file in before} == before
    assert [file for file in after if file not in before and "records" not in file] == ["documents/certificate.pdf"]


def test_index_is_made_again_from_the_files(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("evaluate", "--machine", "VMC-1200") == 0
    capsys.readouterr()
    run("book", "show", "VMC-1200")
    said = capsys.readouterr().out
    Path("book/book.sqlite").unlink()
    run("book", "show", "VMC-1200")
    assert said == capsys.readouterr().out
    assert run("book", "reindex") == 0
    assert "3 files of 1 machines" in capsys.readouterr().out
    run("book", "show", "VMC-1200")
    assert said == capsys.readouterr().out


def test_damaged_index_stops_nobody(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("book", "list")
    said = capsys.readouterr().out
    Path("book/book.sqlite").write_bytes(b"no database" * 100)
    assert run("book", "list") == 0
    captured = capsys.readouterr()
    assert captured.out in said
    assert "book.sqlite: cannot be used" in captured.err
    assert run("book", "reindex") == 0
    assert run("book", "list") == 0
    assert "cannot be used" not in capsys.readouterr().err


def test_index_that_another_program_holds_is_waited_for_and_then_done_without(
    book: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("book", "list")
    monkeypatch.setattr("stepdiag.book.index.PATIENCE", 0.1)
    other = sqlite3.connect("book/book.sqlite", isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    assert run("book", "list") == 0
    assert run("book", "add", "--machine", "VMC-1200", "scenario.toml") == 0
    other.execute("ROLLBACK")
    other.close()


def test_files_put_there_by_hand_are_found(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("evaluate", "scenario.toml", "run.csv", "-o", "calibration.nc")
    (MACHINE / "calibrations").mkdir()
    shutil.copyfile("calibration.nc", MACHINE / "calibrations/by hand.nc")
    (MACHINE / "calibrations/broken.nc").write_bytes(b"\x89HDF no more")
    capsys.readouterr()
    assert run("book", "show", "VMC-1200") == 0
    said = capsys.readouterr().out
    assert "by hand.nc" in said
    assert "damaged: " in said
    assert run("volume", "--machine", "VMC-1200") == 0


def test_two_programs_never_take_one_name(tmp_path: Path) -> None:
    code = "import sys; from pathlib import Path; from stepdiag.book.layout import reserve\n"
    code += "print(*(reserve(Path(sys.argv[1]), 'a.csv').name for _ in range(25)))"
    programs = [
        subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    names = [name for program in programs for name in program.communicate()[0].split()]
    assert len(names) == len(set(names)) == 100


def test_scenario_of_a_run_is_the_one_it_was_made_with(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", "--machine", "VMC-1200", "-o", "of_first.csv") == 0
    Path("other.toml").write_text(SCENARIO.replace("steps = 5", "steps = 4"))
    assert run("book", "add", "--machine", "VMC-1200", "other.toml") == 0
    assert run("evaluate", "--machine", "VMC-1200", "of_first") == 0
    assert "with scenarios/scenario.toml, runs/of_first.csv" in capsys.readouterr().err


def test_day_of_the_measurement_goes_with_its_calibrations(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, day in (("old", "2024-04-01"), ("older", "2023-05-01")):
        simulate_with(day[6], f"{name}.csv")
        assert run("book", "add", "--machine", "VMC-1200", f"{name}.csv", "--measured", day) == 0
        assert run("evaluate", "--machine", "VMC-1200", f"{name}.csv", "-o", f"{name}.nc") == 0
    calibrations = find_book(None).machine("VMC-1200").entries("calibrations")
    assert [(one.name, one.date) for one in calibrations] == [("older.nc", "2023-05-01"), ("old.nc", "2024-04-01")]
    assert run("book", "add", "--machine", "VMC-1200", "run.csv", "--measured", "March") == 2


def test_search_by_any_word(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("book", "new", "Lathe 3", "--customer", "Example Ltd", "--book", "book") == 0
    capsys.readouterr()
    for words, expected in (
        (["0815"], "VMC-1200: machine: 0815"),
        (["example", "lathe"], "Lathe 3: machine: Example Ltd"),
        (["run.csv"], "VMC-1200: runs/run.csv: measurement of "),
        (["0815", "scenario"], "VMC-1200: scenarios/scenario.toml: scenario of "),
    ):
        assert run("book", "find", *words) == 0
        assert capsys.readouterr().out.startswith(expected)
    assert run("book", "find", "nothing", "0815") == 0
    assert "nothing in the book has nothing and 0815" in capsys.readouterr().err


def test_refusals_name_what_there_is(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, expected in (
        (["evaluate", "--machine", "VMC-120"], "VMC-120: no machine of the book"),
        (["evaluate", "--machine", "VMC-1200", "../x.csv"], "../x.csv: no file of VMC-1200 in the book"),
        (["volume", "--machine", "VMC-1200"], "VMC-1200: expected a calibration in the book"),
        (["volume", "--machine", "VMC-1200", "run.csv"], "run.csv: is a measurement; this command takes a calibration"),
        (["simulate", "--machine", "VMC-1200", "-o", "../x.csv"], "expected a name without folders"),
        (["simulate", "--machine", "VMC-1200", "-o", "a:b.csv"], "expected a name of at most"),
        (["simulate", "scenario.toml", "-o", "x.csv", "--book", "book"], "--book: goes with --machine"),
        (["book", "new", "vmc-1200", "--book", "book"], "exists already"),
        (["book", "new", "..", "--book", "book"], "expected a name of at most"),
        (["book", "new", "X", "--book", "book", "--limit", "-1"], "limit_um: expected a positive number"),
        (["book", "new", "X", "--book", "."], "has other files"),
        (["book", "list", "--book", "."], "not a machine book"),
    ):
        assert run(*arguments) == 2, arguments
        assert expected in capsys.readouterr().err


def test_failed_command_leaves_nothing(book: Path) -> None:
    before = contents(MACHINE)
    assert run("evaluate", "--machine", "VMC-1200", "-o", "x.csv", "--covariance") == 2
    assert run("export", "--machine", "VMC-1200", "--to", "linuxcnc-comp") == 2
    assert contents(MACHINE) == before
    assert not (MACHINE / "exports").exists() or not [*(MACHINE / "exports").iterdir()]


def test_book_is_found_from_a_folder_in_it(book: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("STEPDIAG_BOOK")
    monkeypatch.chdir(MACHINE / "runs")
    assert find_book(None).folder == book / "book"
    monkeypatch.chdir(book.parent)
    with pytest.raises(sd.InvalidArgument, match="no machine book here"):
        find_book(None)


def test_book_can_be_copied(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("evaluate", "--machine", "VMC-1200") == 0
    run("book", "show", "VMC-1200")
    said = capsys.readouterr().out.splitlines()[-8:]
    shutil.copytree("book", "copy", copy_function=shutil.copyfile)  # with new times
    os.remove("copy/book.sqlite")
    assert run("book", "show", "VMC-1200", "--book", "copy") == 0
    assert capsys.readouterr().out.splitlines()[-8:] == said


def test_table_of_a_machine_can_be_edited(book: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = MACHINE / "machine.toml"
    path.write_text(path.read_text().replace("# place =", 'place = "hall \\"3\\""'))
    assert run("book", "show", "VMC-1200") == 0
    assert 'place: hall "3"' in capsys.readouterr().out
    path.write_text(path.read_text() + "colour = 3\n")
    assert run("book", "show", "VMC-1200") == 2
    assert "machine.toml" in capsys.readouterr().err


def test_names_are_those_that_every_system_takes(tmp_path: Path) -> None:
    for name in ("a", "VMC 1200", "Fräse (neu).csv", "a+b_c-d.nc"):
        assert check_name(name, "file") == name
    for name in ("", ".a", "a.", "a ", "a/b", "a\\b", "a:b", "con", "NUL.csv", "a\n", "x" * 81, "\u202ea"):
        with pytest.raises(sd.InvalidArgument, match="expected a name"):
            check_name(name, "file")
        check_name(safe_name(name), "file")
    assert reserve(tmp_path, "A.raw.jsonl").name == "A.raw.jsonl"
    assert reserve(tmp_path, "a.raw.jsonl").name == "a-2.raw.jsonl"


def test_empty_book_says_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Book.make(tmp_path / "book")
    assert run("book", "list", "--book", str(tmp_path / "book")) == 0
    assert "stepdiag book new" in capsys.readouterr().out


def test_heads_and_studies_are_no_scenarios(book: Path) -> None:
    from stepdiag.head.description import find_shipped_head

    shutil.copyfile(find_shipped_head("beam_and_psd"), "head.toml")
    assert run("book", "add", "--machine", "VMC-1200", "head.toml") == 0
    assert (MACHINE / "documents/head.toml").exists()
    assert run("simulate", "--machine", "VMC-1200") == 0
