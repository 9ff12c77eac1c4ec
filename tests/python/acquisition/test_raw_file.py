"""Records are on the disk when they are said to be, whole or not at all."""

import errno
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from acquiring import Listener, acquire_through, scenario

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_file import RawFile, read_raw
from stepdiag.acquisition.raw_records import Again, Header, RawReading
from stepdiag.twin.server import Twin

NOW = datetime(2026, 11, 22, 1, 2, 3, 4, UTC)
HEADER = Header(created=NOW, scenario="s.toml", digest="", columns=["d1_pm"], axes=[1], sign=1, plan=[])


def test_every_reading_is_flushed_to_the_disk_by_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flushed: list[int] = []
    real = os.fsync

    def counted(handle: int) -> None:
        real(handle)
        name = os.readlink(f"/proc/self/fd/{handle}")
        if name.endswith(".raw.jsonl"):
            flushed.append(len(read_raw(Path(name)).readings()))

    monkeypatch.setattr(os, "fsync", counted)
    described = scenario()
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv", operator=Listener())
    assert flushed == [0, 0, *range(1, 29)]  # header, session, readings


def test_disk_that_is_full_leaves_no_half_of_a_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.raw.jsonl"
    real = os.write
    with RawFile.create(path, HEADER) as file:

        def full(handle: int, data: bytes) -> int:
            if len(data) < 20:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return real(handle, data[:10])

        monkeypatch.setattr(os, "write", full)
        with pytest.raises(InvalidArgument, match=r"run.raw.jsonl: cannot be written: No space left on device"):
            file.append([Again(time=NOW, visit=1)])
        monkeypatch.setattr(os, "write", real)
        assert (read_raw(path).records, read_raw(path).torn) == ((), None)
        file.append([Again(time=NOW, visit=2)])
    assert read_raw(path).records == (Again(time=NOW, visit=2),)


def test_full_disk_fails_the_reading_that_was_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = RawFile.append
    described = scenario()

    def full(file: RawFile, records: Any) -> None:
        if any(isinstance(record, RawReading) and record.point == 3 for record in records):
            raise InvalidArgument(f"{file.path}: cannot be written: No space left on device")
        real(file, records)

    monkeypatch.setattr(RawFile, "append", full)
    with Twin(described) as twin, pytest.raises(AssertionError, match=r"FAIL .*No space left on device"):
        acquire_through(described, twin, tmp_path / "run.csv")
    assert len(read_raw(tmp_path / "run.raw.jsonl").readings()) == 3


def test_records_are_read_back_as_they_were(tmp_path: Path) -> None:
    reading = RawReading(
        visit=1,
        line="ppp",
        run=0,
        direction="forward",
        point=0,
        position_mm=(0.1, 1e-17, -2.5),
        time=NOW,
        read=[2**63 - 1, None],
        sd=[0.1 + 0.2, None],
        values=3,
        lost={"d2": "no beam \u00b5"},
    )
    with RawFile.create(tmp_path / "a.raw.jsonl", HEADER) as file:
        file.append([reading])
    content = read_raw(tmp_path / "a.raw.jsonl")
    assert content.header == HEADER
    assert content.records == (reading,)


@pytest.mark.parametrize("name", ["folder", "missing/run.raw.jsonl", "link.raw.jsonl"])
def test_raw_files_begin_only_where_nothing_is(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.raw.jsonl").symlink_to("nowhere")
    with pytest.raises(InvalidArgument, match=name):
        RawFile.create(tmp_path / name, HEADER)
    with pytest.raises(InvalidArgument, match=name):
        RawFile.resume(tmp_path / name)


@pytest.mark.parametrize("torn", [b"", b'{"record":"hea', b'{"record":"header","format":"stepdiag raw'])
def test_raw_file_without_its_header_is_begun_anew(tmp_path: Path, torn: bytes) -> None:
    """A power cut or a full disk came before the first reading: nothing is lost, and nobody has to delete it."""
    path = tmp_path / "run.raw.jsonl"
    path.write_bytes(torn)
    with pytest.raises(InvalidArgument, match="nothing was read yet: begin without `resume`"):
        RawFile.resume(path)
    with RawFile.create(path, HEADER):
        pass
    assert read_raw(path).header == HEADER
    with pytest.raises(InvalidArgument, match="exists already"):
        RawFile.create(path, HEADER)


def test_other_text_without_a_line_end_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "run.raw.jsonl"
    path.write_bytes(b"my notes")
    with pytest.raises(InvalidArgument, match="exists already"):
        RawFile.create(path, HEADER)
    assert path.read_bytes() == b"my notes"
