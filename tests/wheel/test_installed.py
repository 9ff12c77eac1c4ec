"""A wheel in a bare Debian (wheel/test): what it brings, and what it needs."""

import csv
import os
import subprocess
import sys
import sysconfig
from importlib.metadata import files
from pathlib import Path

import pytest
from places import EXAMPLES

import stepdiag as sd

PACKAGE = Path(sd.__file__).parent
SITE = Path(sysconfig.get_path("platlib"))
SOURCE_BUILD = Path("/root/source_build.csv")  # by wheel/test, from the same scenario

# Rays through the bodies of a head: Embree's work.
TRACE = """
import stepdiag as sd
head = sd.Head.from_design(sd.optics.shipped_head("beam_and_psd"))
print([s.end.tolist() for s in sd.optics.trace_beams(head, distance=700.0, environment=sd.Environment())])
"""
OTHERS = {
    "embreex": """
import numpy as np
from embreex import mesh_construction, rtcore_scene
scene = rtcore_scene.EmbreeScene()
corners = np.array([[[0, 0, 1], [1, 0, 1], [0, 1, 1]]], np.float32)
mesh = mesh_construction.TriangleMesh(scene, corners)
rays = np.array([[0.2, 0.2, 0.0], [0.9, 0.9, 0.0]], np.float32)
assert scene.run(rays, np.array([[0, 0, 1], [0, 0, 1]], np.float32)).tolist() == [0, -1]
""",
    "numba": """
import numba, numpy as np
numba.config.THREADING_LAYER = "tbb"
@numba.njit(parallel=True)
def total(x):
    s = 0.0
    for i in numba.prange(len(x)):
        s += x[i]
    return s
assert total(np.ones(100_000)) == 100_000
assert numba.threading_layer() == "tbb"
""",
}


def output_of(code: str) -> str:
    # There numba finds the TBB that came from PyPI, and so would anybody else.
    environment = os.environ | {"LD_LIBRARY_PATH": f"{sys.prefix}/lib"}
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def libraries_loaded_by(code: str) -> set[Path]:
    maps = output_of(code + "\nprint(open('/proc/self/maps').read())")
    return {Path(place) for place in maps.split() if ".so" in place}


def test_the_package_is_the_installed_one() -> None:
    assert PACKAGE == SITE / "stepdiag"


def test_every_file_of_the_package_is_there() -> None:
    source = Path(__file__).parents[2] / "python" / "stepdiag"
    wanted = {
        file.relative_to(source) for file in source.rglob("*") if file.is_file() and "__pycache__" not in file.parts
    }
    assert wanted <= {file.relative_to(PACKAGE) for file in PACKAGE.rglob("*")}


def test_only_the_wheel_the_interpreter_and_libraries_of_every_linux_are_loaded() -> None:
    everywhere = {
        "ld-linux-x86-64",
        "ld-linux-aarch64",
        "libc",
        "libm",
        "libstdc++",
        "libgcc_s",
        "libpthread",
        "libdl",
        "librt",
        "libutil",
    }
    system = {path for path in libraries_loaded_by("import stepdiag._core") if SITE not in path.parents}
    names = {path.name.split(".")[0] for path in system - libraries_loaded_by("import numpy")}
    assert names <= everywhere


def test_licences_of_all_libraries_are_there() -> None:
    listed = {file.parts[2] for file in files("stepdiag") or () if file.parts[1:2] == ("licenses",)}
    assert listed == {"LICENSE", "embree", "highway", "libcsv", "libmd", "eigen", "boost", "random123", "pybind11"}
    bundled = {path.name.split("-")[0] for path in (SITE / "stepdiag.libs").iterdir()}
    assert bundled == {"libcsv", "libhwy", "libmd"}  # a new one needs its licence in wheel/build


def test_readings_are_those_of_the_source_build(tmp_path: Path) -> None:
    sd.simulate(sd.read_scenario(EXAMPLES / "uncertainty.toml")).write(tmp_path / "run.csv")
    ours, theirs = ([*csv.reader(path.open())] for path in (tmp_path / "run.csv", SOURCE_BUILD))
    assert len(ours) == len(theirs)
    for our, their in zip(ours, theirs, strict=True):
        for a, b in zip(our, their, strict=True):
            # Rounding of 1 m and 1 rad, some operations after one another.
            assert a == b or abs(float(a) - float(b)) < 1e-9


@pytest.mark.parametrize("other", OTHERS)
def test_it_works_beside_another_embree_and_tbb(other: str) -> None:
    pytest.importorskip(other)  # not made for every processor
    alone = output_of(TRACE)
    assert alone
    assert output_of(OTHERS[other] + "\n" + TRACE) == alone
    assert output_of(TRACE + "\n" + OTHERS[other] + "\n" + TRACE) == alone + alone


def test_linuxcnc_demo_says_in_one_line_what_it_lacks(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-P", "-m", "stepdiag", "demo", "--controller", "linuxcnc"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "install stepdiag's Debian package stepdiag-linuxcnc" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())
