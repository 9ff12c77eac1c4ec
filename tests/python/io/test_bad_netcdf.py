"""netCDF files that are damaged, incomplete or of something else: refused by file and variable, and never believed."""

from __future__ import annotations

import hashlib
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from calibrations import calibrate, full_run, same_calibration, same_run
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusal import refused

import stepdiag as sd
from stepdiag.cli import main

Change = Callable[[xr.Dataset], xr.Dataset]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a sound measurement and a sound calibration."""
    folder = tmp_path_factory.mktemp("sound")
    full_run().write(folder / "measurement.nc")
    calibrate(1, full_covariance=True).write(folder / "calibration.nc")
    return folder


READERS: dict[str, Callable[[Path], Any]] = {
    "measurement": sd.read_measurement,
    "calibration": sd.read_calibration,
}


def changed(file: Path, change: Change, target: Path) -> Path:
    with xr.open_dataset(file) as table:
        without_checksum = attribute(None, "sha256", None)(table.load())
        change(without_checksum).to_netcdf(target, engine="netcdf4")
    return target


def values(name: str, change: Callable[[Any], Any]) -> Change:
    def apply(table: xr.Dataset) -> xr.Dataset:
        variable = table[name]
        return table.assign({name: variable.copy(data=change(variable.values.copy()))})

    return apply


def put(name: str, index: Any, value: Any) -> Change:
    def change(content: Any) -> Any:
        content[index] = value
        return content

    return values(name, change)


def attribute(variable: str | None, name: str, value: Any) -> Change:
    def apply(table: xr.Dataset) -> xr.Dataset:
        attributes = table.attrs if variable is None else table[variable].attrs
        attributes.pop(name, None)
        if value is not None:
            attributes[name] = value
        return table

    return apply


def without(name: str) -> Change:
    return lambda table: table.drop_vars(name)


def of_type(name: str, dtype: Any) -> Change:
    return lambda table: table.assign({name: table[name].astype(dtype)})


def on(name: str, *dimensions: str) -> Change:
    """The variable with other dimensions, of its own."""
    return lambda table: table.drop_vars(name).assign({name: (dimensions, np.zeros((2,) * len(dimensions)))})


BAD_MEASUREMENTS: list[tuple[str, Change, str]] = [
    *[(f"without {name}", without(name), f"{name}: ") for name in ("line", "point", "x", "y", "z")],
    ("without distance", without("distance"), "distance"),
    ("units of x", attribute("x", "units", "m"), 'x: units: expected "mm", got "m"'),
    ("units of alpha", attribute("alpha", "units", "urad"), 'alpha: units: expected "rad", got "urad"'),
    ("no units", attribute("distance", "units", None), 'distance: units: expected "mm", got none'),
    ("units that are a number", attribute("distance", "units", 1.0), 'distance: units: expected "mm"'),
    ("other dimension", on("distance", "elsewhere"), "distance: expected the dimensions (reading), got (elsewhere)"),
    ("two dimensions", on("beta", "one", "two"), "beta: expected the dimensions (reading), got (one, two)"),
    ("scalar", lambda t: t.assign(alpha=0.0), "alpha: expected the dimensions (reading), got ()"),
    ("missing position", put("y", 5, np.nan), "y: expected finite numbers, but value 5 is missing"),
    ("infinite reading", put("distance", 5, np.inf), "distance: expected finite numbers, got an infinite one"),
    ("negative point", put("point", 5, -1), "row 6"),
    ("point twice", put("point", 5, 4), "row 6"),
    ("broken point", of_type("point", float), "point: expected whole numbers"),
    ("run in words", of_type("run", str), "run: expected whole numbers"),
    ("huge run", lambda t: t.assign(run=t["run"].astype(np.int64) + 2**40), "run"),
    ("line in numbers", lambda t: t.assign(line=t["point"]), "line: expected texts"),
    ("no line", put("line", 5, "xyz"), "xyz"),
    ("no direction", put("direction", 5, "up"), "direction"),
    ("distance in words", of_type("distance", str), "distance: expected numbers"),
    ("weight of nothing", put("distance_u", 5, 0.0), "row 6"),
    ("negative weight", put("alpha_u", 5, -1.0), "row 6"),
    ("unknown channel", lambda t: t.rename(alpha="tilt"), "tilt: expected a channel"),
    ("weight without channel", lambda t: t.assign(d1_u=t["distance_u"]), "d1"),
    ("half a layout", without("beta"), "channels"),
    ("another format", attribute(None, "format", "stepdiag calibration 1"), "attribute format"),
    ("a later format", attribute(None, "format", "stepdiag measurement 2"), "attribute format"),
    ("format in numbers", attribute(None, "format", 1), "attribute format: expected a text"),
]

BAD_CALIBRATIONS: list[tuple[str, Change, str]] = [
    *[(f"without {a}", attribute(None, a, None), f"attribute {a}: missing") for a in ("chain", "volume_mm", "tool_mm")],
    ("no chain", attribute(None, "chain", "[w X b Y Z t]"), "[w X b Y Z t]"),
    ("two edges", attribute(None, "volume_mm", [800.0, 600.0]), "attribute volume_mm: expected three numbers"),
    ("edges in words", attribute(None, "volume_mm", "800 600 500"), "attribute volume_mm: expected three numbers"),
    ("no volume", attribute(None, "volume_mm", [80.0, 0.0, 50.0]), "volume"),
    ("endless tool", attribute(None, "tool_mm", [0.0, np.inf, 0.0]), "tool"),
    ("no positions", lambda t: t.drop_vars("x"), "x: the variable is missing"),
    ("positions that fall", values("y", lambda y: y[::-1]), "ascend"),
    ("a position missing", put("z", 2, np.nan), "z: expected finite numbers, but value 2 is missing"),
    ("a value missing", put("EBY", 2, np.nan), "EBY: expected finite numbers, but value 2 is missing"),
    ("infinite value", put("EXX", 2, -np.inf), "EXX: expected finite numbers"),
    ("infinite uncertainty", put("EXX_u", 2, np.inf), "EXX_u: expected finite numbers"),
    ("negative uncertainty", put("EXX_u", 2, -1.0), "EXX"),
    ("units of a length", attribute("EXX", "units", "um"), 'EXX: units: expected "mm", got "um"'),
    ("units of a rotation", attribute("ECZ", "units", "mm"), 'ECZ: units: expected "rad", got "mm"'),
    ("units of a squareness", attribute("C0Y", "units", "arcsec"), 'C0Y: units: expected "rad", got "arcsec"'),
    ("units of positions", attribute("x", "units", None), 'x: units: expected "mm", got none'),
    ("units of uncertainty", attribute("EXX_u", "units", "m"), 'EXX_u: units: expected "mm", got "m"'),
    ("a function of two", on("EXX", "one", "two"), "EXX: expected one dimension"),
    ("a function of nothing", lambda t: t.assign(EXX=1.0), "EXX: expected one dimension"),
    ("squareness of x", lambda t: t.assign(C0Y=t["EAX"]), "C0Y: expected the dimensions (), got (x)"),
    ("uncertainty elsewhere", on("EXX_u", "elsewhere"), "EXX_u: expected the dimensions (x), got (elsewhere)"),
    ("perhaps a slope", attribute("EXX", "slope_determined", "perhaps"), 'expected "true" or "false"'),
    ("a slope in numbers", attribute("EXX", "slope_determined", 1), "attribute slope_determined: expected a text"),
    ("covariance of others", put("covariance_parameter", 3, "EYY"), "covariance_parameter"),
    ("covariance elsewhere", put("covariance_position", 3, 1.0), "covariance_position"),
    ("covariance without labels", without("covariance_parameter"), "covariance_parameter: the variable is missing"),
    ("covariance of one dimension", on("covariance", "one"), "covariance: expected two dimensions"),
    ("half a covariance", lambda t: t.isel(entry_2=slice(0, 7)), "covariance"),
    ("a hole in the covariance", put("covariance", (3, 4), np.nan), "covariance: expected finite numbers"),
    ("a skew covariance", put("covariance", (1, 2), 0.0), "symmetric"),
    ("a covariance of other variances", put("covariance", (4, 4), 1.0), "square of the standard uncertainty"),
    ("a large covariance", put("covariance", (1, 2), 1e3), "product"),
    ("another format", attribute(None, "format", "stepdiag measurement 1"), "attribute format"),
    ("a date in numbers", attribute(None, "date", 2026), "attribute date: expected a text"),
]


@pytest.mark.parametrize(
    ("change", "names"), [case[1:] for case in BAD_MEASUREMENTS], ids=[c[0] for c in BAD_MEASUREMENTS]
)
def test_measurement_with_one_thing_wrong_is_refused(folder: Path, tmp_path: Path, change: Change, names: str) -> None:
    bad = changed(folder / "measurement.nc", change, tmp_path / "bad.nc")
    refused(sd.read_measurement, bad, names=f"{bad}: ")
    refused(sd.read_measurement, bad, names=names)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "names"), [case[1:] for case in BAD_CALIBRATIONS], ids=[c[0] for c in BAD_CALIBRATIONS]
)
def test_calibration_with_one_thing_wrong_is_refused(folder: Path, tmp_path: Path, change: Change, names: str) -> None:
    bad = changed(folder / "calibration.nc", change, tmp_path / "bad.nc")
    refused(sd.read_calibration, bad, names=f"{bad}: ")
    refused(sd.read_calibration, bad, names=names)


@pytest.mark.parametrize("kind", READERS)
def test_what_is_no_netcdf_file_is_refused(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "file.nc"
    for content in (b"", b"line,point\n", b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x01" + b"\xff" * 64, bytes(1000)):
        file.write_bytes(content)
        refused(READERS[kind], file, names=str(file))
    for path in (tmp_path, tmp_path / "absent.nc", file / "below.nc", tmp_path / ("x" * 300 + ".nc"), "a\0b.nc"):
        (tmp_path / "folder.nc").mkdir(exist_ok=True)
        refused(READERS[kind], tmp_path / "folder.nc" if path == tmp_path else path, names=".nc")


@pytest.mark.parametrize("kind", READERS)
def test_device_is_refused(tmp_path: Path, kind: str) -> None:
    (tmp_path / "zero.nc").symlink_to("/dev/zero")
    refused(READERS[kind], tmp_path / "zero.nc", names="zero.nc")


@pytest.mark.parametrize("kind", READERS)
def test_file_that_was_cut_off_is_refused(folder: Path, tmp_path: Path, kind: str) -> None:
    content = (folder / f"{kind}.nc").read_bytes()
    for size in np.linspace(1, len(content) - 1, 40).astype(int):
        (tmp_path / "cut.nc").write_bytes(content[:size])
        refused(READERS[kind], tmp_path / "cut.nc", names="cut.nc")


def test_damaged_number_is_noticed(folder: Path, tmp_path: Path) -> None:
    """One bit of one number: its check sum no longer fits."""
    content = bytearray((folder / "measurement.nc").read_bytes())
    distances = sd.read_measurement(folder / "measurement.nc").channels["distance"]
    content[content.index(distances[30:33].tobytes())] ^= 1
    (tmp_path / "damaged.nc").write_bytes(content)
    refused(sd.read_measurement, tmp_path / "damaged.nc", names="damaged.nc: distance: cannot be read")


def test_damaged_squareness_is_noticed(folder: Path, tmp_path: Path) -> None:
    """A scalar has no checksum of the netCDF library; the file's own covers it."""
    content = bytearray((folder / "calibration.nc").read_bytes())
    value, _ = sd.read_calibration(folder / "calibration.nc").squareness["C0Y"]
    content[content.index(np.float64(value).tobytes())] ^= 1
    (tmp_path / "damaged.nc").write_bytes(content)
    refused(sd.read_calibration, tmp_path / "damaged.nc", names="damaged.nc: attribute sha256: expected ")


def test_file_without_its_checksum_is_read_as_it_is(folder: Path, tmp_path: Path) -> None:
    file = changed(folder / "calibration.nc", put("EXX", 3, 0.001), tmp_path / "changed.nc")
    assert sd.read_calibration(file).functions["EXX"][1][3] == 0.001


def test_checksum_is_what_the_documentation_says(folder: Path) -> None:
    with xr.open_dataset(folder / "calibration.nc") as table:
        parts = [(f":{key}", value) for key, value in table.attrs.items() if key not in ("sha256", "history")]
        names = sorted(map(str, table.variables))
        ordered = [(name, value) for name, value in sorted(parts)]
        for name in names:
            variable = table.variables[name]
            ordered.append((f"{name}({','.join(map(str, variable.dims))})", variable.values))
            ordered += [(f"{name}:{key}", value) for key, value in sorted(variable.attrs.items())]
        digest = hashlib.sha256()
        for name, value in ordered:
            digest.update(name.encode() + b"\0")
            for one in np.ravel(value):
                is_text = isinstance(one, str | bytes)
                text = one if isinstance(one, bytes) else str(one).encode()
                digest.update(text + b"\0" if is_text else struct.pack("<d", one))
        assert table.attrs["sha256"] == digest.hexdigest()


@pytest.mark.slow
def test_damaged_heap_does_not_hang_the_reader(folder: Path, tmp_path: Path) -> None:
    """An object of a heap gets a length, or a free space of a length, with which HDF5 may search forever."""
    content = bytearray((folder / "calibration.nc").read_bytes())
    heap = content.index(b"GCOL\x01\0\0\0")
    index_and_length = slice(heap + 16, heap + 32)
    first = bytes(content[index_and_length])
    free = bytes(8)
    for damage in (
        *(first[:8] + length.to_bytes(8, "little") for length in (2**64 - 16, 2**64 - 1, 2**40)),
        *(free + length.to_bytes(8, "little") for length in (0, 8, 2**64 - 16)),
    ):
        content[index_and_length] = damage
        (tmp_path / "damaged.nc").write_bytes(content)
        program = "import sys, stepdiag as sd\ntry: sd.read_calibration(sys.argv[1])\nexcept ValueError as e: print(e)"
        result = subprocess.run(
            [sys.executable, "-c", program, str(tmp_path / "damaged.nc")],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert "damaged.nc: expected a netCDF file: a heap in it is damaged" in result.stdout, result.stderr


@pytest.mark.parametrize("kind", READERS)
def test_header_of_a_hundred_million_rows_fills_no_memory(tmp_path: Path, kind: str) -> None:
    with netCDF4.Dataset(tmp_path / "huge.nc", "w") as file:
        for name in ("reading", "x"):
            file.createDimension(name, 100_000_000)
        for name in ("line", "point", "y", "z", "distance"):
            file.createVariable(name, "f8", ("reading",), chunksizes=[1000]).units = "mm"
        for name in ("x", "EXX"):
            file.createVariable(name, "f8", ("x",), chunksizes=[1000]).units = "mm"
        file.setncatts({"chain": "[w b X Y Z t]", "volume_mm": [1.0, 1.0, 1.0], "tool_mm": [0.0, 0.0, 0.0]})
    assert (tmp_path / "huge.nc").stat().st_size < 1e6
    refused(READERS[kind], tmp_path / "huge.nc", names="declares")


def test_values_that_were_never_written_are_lost_readings(folder: Path, tmp_path: Path) -> None:
    """netCDF's own fill value, 9.97e36, is no distance."""
    bad = changed(folder / "measurement.nc", put("distance", 7, netCDF4.default_fillvals["f8"]), tmp_path / "run.nc")
    assert np.isnan(sd.read_measurement(bad).channels["distance"][7])


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=100, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files_are_refused_or_read_as_written(
    folder: Path, tmp_path: Path, kind: str, data: st.DataObject
) -> None:
    """Wherever bytes change: check sums cover numbers, texts and headers; the rest is not read."""
    content = bytearray((folder / f"{kind}.nc").read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    (tmp_path / "damaged.nc").write_bytes(content)
    try:
        read, message = READERS[kind](tmp_path / "damaged.nc"), ""
    except sd.InvalidArgument as refusal:
        read, message = None, str(refusal)
    same = same_run if kind == "measurement" else same_calibration
    assert "damaged.nc" in message if read is None else same(read, READERS[kind](folder / f"{kind}.nc"))


def test_check_tells_netcdf_files_apart(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(folder / "measurement.nc"), str(folder / "calibration.nc")]) == 0
    said = capsys.readouterr().out.splitlines()
    assert ": measurement: " in said[0]
    assert any(": calibration: adjustment, [w X' b Y Z t], 21 of 21" in line for line in said)
    (tmp_path / "run.csv").write_bytes((folder / "measurement.nc").read_bytes())
    xr.Dataset({"wind": ("t", [1.0])}).to_netcdf(tmp_path / "wind.nc", engine="netcdf4")
    (tmp_path / "table.nc").write_text("line,point\n")
    assert main(["check", *(str(tmp_path / name) for name in ("run.csv", "wind.nc", "table.nc"))]) == 2
    said = capsys.readouterr().err.splitlines()
    assert "run.csv: is a netCDF file; the names of such files must end in .nc" in said[0]
    assert "wind.nc: expected a measurement" in said[1]
    assert "table.nc: expected a netCDF file" in said[2]
