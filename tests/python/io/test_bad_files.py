"""Malformed files: each reader refuses them by name and place; no reader crashes, hangs, or takes half for whole."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import RUNS
from truth import Setup

import stepdiag as sd

MEASUREMENT = "line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad\n"
TABLE = "parameter,position_mm,value,unit,standard_uncertainty\n"
HEADER = "# chain=[w X' b Y Z t]\n# volume_mm=800 600 500\n# tool_mm=0 0 0\n"
ROW = "ppp,0,0,0,0,100,0,0\n"

ERRORS = sd.ErrorMap()

Reader = Callable[[Path], Any]


def refused(reader: Reader, path: Path, *culprits: str) -> None:
    with pytest.raises(sd.InvalidArgument) as refusal:
        reader(path)
    for culprit in (path.name, *culprits):
        assert culprit in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "culprit"),
    [
        ("", "empty"),
        (MEASUREMENT, "no rows"),
        ("just some words\n", "line"),
        (ROW, '"line"'),
        (MEASUREMENT.replace("x_mm,", "") + "ppp,0,0,0,100,0,0\n", '"x_mm"'),
        (MEASUREMENT.replace("alpha_urad", "alpha_mrad") + ROW, '"alpha_mrad"'),
        (MEASUREMENT.replace("distance_mm", "distance_inch") + ROW, '"distance_inch"'),
        (MEASUREMENT.replace("beta_urad", "alpha_urad") + ROW, "twice"),
        (MEASUREMENT.replace(",beta_urad", "") + "ppp,0,0,0,0,100,0\n", "channels"),
        (MEASUREMENT + "ppp,0,0,0,0,100,0\n", "line 2"),
        (MEASUREMENT + ROW + "ppp,1,40,0,0,12", "line 3"),  # cut off
        (MEASUREMENT + ROW + "ppp,1,40,0,0,128,0,0,0\n", "line 3"),
        (MEASUREMENT + ROW + ROW, "line 3"),
        (MEASUREMENT + ROW.replace("ppp", "diagonal 1"), "diagonal 1"),
        (MEASUREMENT + ROW.replace("100", "nan"), "distance_mm"),
        (MEASUREMENT + ROW.replace("100", "-inf"), "distance_mm"),
        (MEASUREMENT + ROW.replace("100", "1e400"), "distance_mm"),
        (MEASUREMENT + ROW.replace("100", '"100,5"'), "distance_mm"),
        (MEASUREMENT + ROW.replace("ppp,0", "ppp,-3"), "point"),
        (MEASUREMENT + ROW.replace("ppp,0", "ppp,0.5"), "point"),
        (MEASUREMENT + ROW.replace("ppp,0,0", "ppp,0,"), "x_mm"),
        (MEASUREMENT + ROW.replace("100", '"100'), "line 2"),
        ("\xff\xfeline\0,point\0", "binary"),
    ],
)
def test_malformed_measurement_is_refused(tmp_path: Path, text: str, culprit: str) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(text.encode("latin-1"))
    refused(sd.read_measurement, path, culprit)


BAD_TABLES = [
    ("", "empty"),
    ("just some words\n", "line 1"),
    (TABLE.replace("unit,", "") + "EXX,0,0,\n", "line 1"),
    (TABLE.replace("unit", "value") + "EXX,0,0,0,\n", "line 1"),
    (TABLE.replace("\n", ",direction\n") + "EXX,0,0,um,,+\nEXX,0,0,um,,-\nEXX,0,1,um,,-\n", "must ascend"),
    (TABLE.replace("\n", ",direction\n") + "EXX,0,0,um,,+\nEXX,10,0,um,,\n", "direction"),
    (TABLE.replace("\n", ",direction\n") + "C0Y,,0,urad,,+\nC0Y,,0,urad,,-\n", "C0Y is given twice"),
    (TABLE + "EXX,0,0,um\n", "line 2"),
    (TABLE + "EXX,0,0,um,\nEXX,10,1.2", "line 3"),  # cut off
    (TABLE + "EXW,0,0,um,\n", "EXW"),
    (TABLE + "EXX,0,0,mm,\n", '"mm"'),
    (TABLE + "EXX,0,0,urad,\n", '"urad"'),
    (TABLE + "EAX,0,0,um,\n", '"um"'),
    (TABLE + "EXX,0,nan,um,\n", "value"),
    (TABLE + "EXX,0,1e400,um,\n", "value"),
    (TABLE + "EXX,0,,um,\n", "value"),
    (TABLE + "EXX,,0,um,\n", "position_mm"),
    (TABLE + "EXX,0,0,um,\nEXX,0,1,um,\n", "line 3"),
    (TABLE + "EXX,5,0,um,\nEXX,0,1,um,\n", "line 3"),
    (TABLE + "EXX,0,0,um,-0.1\n", "standard_uncertainty"),
    (TABLE + "EXX,0,0,um,inf\n", "standard_uncertainty"),
    (TABLE + "C0Y,,1,urad,\nC0Y,,1,urad,\n", "C0Y"),
    (TABLE + "C0Y,5,1,urad,\n", "position_mm"),
    (TABLE + 'EXX,0,"0,um,\n', "line 2"),
    ("\x7fELF\0\0\0", "binary"),
]


@pytest.mark.parametrize("call", [sd.read_measurement, sd.read_error_map, sd.read_calibration, ERRORS.write])
def test_name_with_a_nul_byte_is_refused(call: Callable[[str], Any]) -> None:
    with pytest.raises(sd.InvalidArgument, match=r"path: .*NUL"):
        call("one.csv\0two.csv")


@pytest.mark.parametrize(("text", "culprit"), BAD_TABLES)
def test_malformed_error_map_is_refused(tmp_path: Path, text: str, culprit: str) -> None:
    path = tmp_path / "map.csv"
    path.write_bytes(text.encode("latin-1"))
    refused(sd.read_error_map, path, culprit)


@pytest.mark.parametrize(
    ("text", "culprit"),
    [
        *[
            (HEADER + text, culprit.replace("line 3", "line 6").replace("line 2", "line 5").replace("line 1", "line 4"))
            for text, culprit in BAD_TABLES
            if text
        ],
        (TABLE + "EXX,0,0,um,\n", "chain"),
        (HEADER.replace("# chain=[w X' b Y Z t]\n", "") + TABLE + "EXX,0,0,um,\n", "chain"),
        (HEADER.replace("X'", "X") + TABLE + "EXX,0,0,um,\n", "chain"),
        (HEADER.replace("800 600 500", "800 600") + TABLE + "EXX,0,0,um,\n", "volume_mm"),
        (HEADER.replace("800 600 500", "wide") + TABLE + "EXX,0,0,um,\n", "volume_mm"),
        (HEADER.replace("800 600 500", "0 600 500") + TABLE + "EXX,0,0,um,\n", "volume_mm"),
        (HEADER.replace("800 600 500", "800 600 -500") + TABLE + "EXX,0,0,um,\n", "volume_mm"),
        (HEADER.replace("tool_mm=0 0 0", "tool_mm=0 0 nan") + TABLE + "EXX,0,0,um,\n", "tool_mm"),
        (HEADER + "# undetermined_slopes=EXX EXQ\n" + TABLE + "EXX,0,0,um,\n", "EXQ"),
    ],
)
def test_malformed_calibration_is_refused(tmp_path: Path, text: str, culprit: str) -> None:
    path = tmp_path / "calibration.csv"
    path.write_bytes(text.encode("latin-1"))
    refused(sd.read_calibration, path, culprit)


READERS: list[Reader] = [sd.read_measurement, sd.read_error_map, sd.read_calibration]


@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_file_is_refused(tmp_path: Path, reader: Reader) -> None:
    refused(reader, tmp_path / "absent.csv")
    refused(reader, tmp_path)
    refused(reader, tmp_path / ("x" * 300 + ".csv"))
    (tmp_path / "file").write_text("x")
    refused(reader, tmp_path / "file" / "below.csv")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no such device here")
@pytest.mark.parametrize("name", ["read_measurement", "read_error_map", "read_calibration"])
def test_file_without_end_is_refused(name: str) -> None:
    program = (
        "import resource, stepdiag as sd\n"
        "resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))\n"
        f"try: sd.{name}('/dev/zero')\n"
        "except sd.InvalidArgument as refusal: print('refused', refusal)\n"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert result.stdout.startswith("refused /dev/zero"), result.stderr


@pytest.mark.parametrize("reader", READERS)
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=400))
def test_random_bytes_are_read_or_refused(tmp_path: Path, reader: Reader, content: bytes) -> None:
    path = tmp_path / "random.csv"
    path.write_bytes(content)
    refused(reader, path)  # a file of ours by chance is out of the question


@st.composite
def spoiled(draw: st.DrawFn, text: str) -> bytes:
    """A good file with one thing wrong: bytes replaced, removed, doubled, or the end cut off."""
    content = bytearray(text.encode())
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(content) - 1))
        stop = min(len(content), start + draw(st.integers(0, 30)))
        change = draw(st.sampled_from(["replace", "remove", "double", "cut"]))
        if change == "replace":
            content[start:stop] = draw(st.binary(max_size=8)) or b","
        elif change == "remove":
            del content[start:stop]
        elif change == "double":
            content[start:start] = content[start:stop]
        else:
            del content[start:]
        if not content:
            break
    return bytes(content)


def sample(kind: str) -> str:
    path = RUNS / "misaligned" / ("measurement.csv" if kind == "measurement" else "truth.csv")
    text = "".join(path.read_text().splitlines(keepends=True)[:40])
    return HEADER + text if kind == "calibration" else text


@pytest.mark.parametrize("kind", ["measurement", "error_map", "calibration"])
@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_spoiled_files_are_read_whole_or_refused(tmp_path: Path, kind: str, data: st.DataObject) -> None:
    path = tmp_path / "spoiled.csv"
    path.write_bytes(data.draw(spoiled(sample(kind))))
    reader = {"measurement": sd.read_measurement, "error_map": sd.read_error_map, "calibration": sd.read_calibration}[
        kind
    ]
    try:
        found = reader(path)
    except sd.InvalidArgument as refusal:
        message = str(refusal)
    else:
        message = path.name
        if kind == "measurement":
            assert len(found) >= 1
            assert all(not np.any(np.isinf(values)) for values in found.channels.values())
    assert path.name in message


@pytest.mark.parametrize("kind", ["measurement", "error_map", "calibration"])
def test_files_of_spreadsheets_are_read(tmp_path: Path, kind: str) -> None:
    """A byte order mark, Windows line ends, blank lines and quotes do no harm."""
    reader: Reader = {
        "measurement": sd.read_measurement,
        "error_map": sd.read_error_map,
        "calibration": sd.read_calibration,
    }[kind]
    lines = sample(kind).splitlines()
    quoted = [line if line.startswith("#") else ",".join(f'"{field}"' for field in line.split(",")) for line in lines]
    plain, dressed = tmp_path / "plain.csv", tmp_path / "dressed.csv"
    plain.write_text("\n".join(lines) + "\n")
    dressed.write_bytes(b"\xef\xbb\xbf" + "\r\n".join([*quoted, "", ""]).encode())
    a, b = reader(plain), reader(dressed)
    a.write(tmp_path / "a.csv")
    b.write(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def writers() -> dict[str, Any]:
    setup = Setup(steps=3)
    errors = setup.errors(1)
    run = setup.simulate(errors)
    return {"measurement": run, "error_map": errors, "calibration": setup.evaluate(run)}


@pytest.mark.parametrize("kind", ["measurement", "error_map", "calibration"])
def test_path_that_cannot_be_written_is_refused_and_leaves_nothing(tmp_path: Path, kind: str) -> None:
    thing = writers()[kind]
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder").mkdir()
    for path in (
        tmp_path / "no" / "such.csv",
        tmp_path / "folder",
        tmp_path / "file" / "below.csv",
        Path("/proc/self/x.csv"),
    ):
        with pytest.raises(sd.InvalidArgument) as refusal:
            thing.write(path)
        assert str(path) in str(refusal.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]
    assert (tmp_path / "file").read_text() == "kept"
    assert list((tmp_path / "folder").iterdir()) == []


def test_write_that_fails_half_way_leaves_the_old_file(tmp_path: Path) -> None:
    """The disk is full: here, files may have 1,000 bytes at most."""
    path = tmp_path / "run.csv"
    path.write_text("the old file\n")
    program = (
        "import resource, sys, stepdiag as sd\n"
        f"run = sd.read_measurement({str(RUNS / 'clean' / 'measurement.csv')!r})\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try: run.write(sys.argv[1])\n"
        "except sd.InvalidArgument as refusal: print('refused', refusal)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.stdout.startswith(f"refused {path}"), result.stderr
    assert path.read_text() == "the old file\n"
    assert [p.name for p in tmp_path.iterdir()] == ["run.csv"]


def test_device_is_written_to_and_not_replaced() -> None:
    device = Path("/dev/null")
    if not device.is_char_device():
        pytest.skip("there is no such device here")
    before = device.stat()
    writers()["measurement"].write(device)
    assert device.is_char_device()
    assert device.stat().st_ino == before.st_ino


def test_symbolic_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "link.csv").symlink_to("target.csv")
    run = writers()["measurement"]
    run.write(tmp_path / "target.csv")
    run.write(tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert len(sd.read_measurement(tmp_path / "target.csv")) == len(run)
