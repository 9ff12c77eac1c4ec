"""A calibration names its run, its scenario, the program and the options, by bytes and not by names or times."""

import hashlib
import os
import subprocess
from pathlib import Path

import pytest
from small_scenario import SCENARIO, of_map

import stepdiag as sd
from stepdiag.cli import main

# FIPS 180-4, of the three bytes "abc".
SHA_OF_ABC = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def sha256(path: str | Path) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def scenario(text: str = SCENARIO, name: str = "scenario.toml") -> sd.Scenario:
    Path(name).write_text(text)
    return sd.read_scenario(name)


def test_fingerprints_are_those_of_the_bytes_under_any_name(here: Path) -> None:
    Path("abc").write_bytes(b"abc")
    Path("elsewhere.csv").write_bytes(b"abc")
    found = sd.methods.provenance_of(scenario(), "abc")
    assert found == {
        "program": f"stepdiag {sd.__version__}",
        "run_sha256": SHA_OF_ABC,
        "scenario_sha256": sha256("scenario.toml"),
        "options": "default",
    }
    assert sd.methods.provenance_of(scenario(name="other.toml").known, "elsewhere.csv") == found
    assert sd.methods.provenance_of(scenario(SCENARIO + "\n"), "abc")["scenario_sha256"] != found["scenario_sha256"]


def test_heads_count_and_the_error_map_does_not(here: Path) -> None:
    shipped = Path(sd.__file__).parent / "head" / "shipped" / "beam_and_psd.toml"
    Path("mine.toml").write_bytes(shipped.read_bytes() + b"\n")
    heads = '[head.left]\ndescription = "mine.toml"\n[head.right]\ndescription = "beam_and_psd"\n'
    lines = "".join(f'[line.{line}]\nhead = "left"\n' for line in ("ppp", "npp", "p00"))
    others = "".join(f'[line.{line}]\nhead = "right"\n' for line in ("pnp", "nnp", "0p0", "00p"))
    described = SCENARIO.replace('[head]\nlayout = "ideal"\n', heads + lines + others)
    found = sd.methods.provenance_of(scenario(described), "run.csv")
    assert found["heads_sha256"] == f"{sha256('mine.toml')} {sha256(shipped)}"

    maps = []
    for error in "0", "1":
        Path("map.csv").write_text(f"parameter,position_mm,value,unit,standard_uncertainty\nEXX,80,{error},um,\n")
        maps.append(sd.methods.provenance_of(scenario(of_map("map.csv")), "run.csv"))
    assert maps[0] == maps[1]


def test_options_are_what_differs_from_the_defaults_in_one_order(here: Path) -> None:
    keys = {
        "adjustment": "outlier_probability = 0.001\nreversal = true\nlaser_urad = 100\nangles = 'fixed'\n",
        "adjustment.ppp": "reflector_urad = 'fixed'\n",
        "adjustment.npp": "roll_urad = 5.0\n",
        "plausible": "rotation_urad = 9000\ntranslation_um = 2000\n",
        "smoothness": "cross_validated = true\n",
    }
    for order in list(keys), list(reversed(keys)):
        text = SCENARIO + "".join(f"[{name}]\n{keys[name]}" for name in order)
        options = {m: sd.methods.provenance_of(scenario(text), "run.csv", method=m)["options"] for m in METHODS}
        assert options["adjustment"] == (
            'adjustment.laser_urad=100.0; adjustment.angles="fixed"; adjustment.outlier_probability=0.001; '
            'adjustment.npp.roll_urad=5.0; adjustment.ppp.reflector_urad="fixed"; '
            "smoothness.cross_validated=true; plausible.rotation_urad=9000.0"
        )
        assert options["enhanced"] == options["conventional"] == "plausible.rotation_urad=9000.0"


METHODS = ("adjustment", "enhanced", "conventional")


@pytest.mark.parametrize("ending", ["csv", "nc"])
def test_provenance_comes_back_from_files_with_the_same_bytes(here: Path, ending: str) -> None:
    contents = set()
    for name in f"one.{ending}", f"two.{ending}":
        assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 0
        assert sd.read_calibration(name).provenance == sd.methods.provenance_of(
            sd.read_scenario("scenario.toml"), "run.csv"
        )
        contents.add(Path(name).read_bytes())
    assert len(contents) == 1


def test_files_without_provenance_or_with_other_keys_are_read(here: Path) -> None:
    main(["evaluate", "scenario.toml", "run.csv", "-o", "all.csv"])
    lines = Path("all.csv").read_text().splitlines(keepends=True)
    mine = [line for line in lines if "_sha256" not in line and not line.startswith(("# program", "# options"))]
    Path("none.csv").write_text("# author=me\n" + "".join(mine))
    assert sd.read_calibration("none.csv").provenance == {}
    assert len(lines) - len(mine) == len(sd.read_calibration("all.csv").provenance) == 4


def test_report_exports_and_comparisons_show_it(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = sha256("run.csv")
    main(["evaluate", "scenario.toml", "run.csv", "-o", "all.csv"])
    capsys.readouterr()
    assert main(["report", "all.csv"]) == 0
    assert f"run, SHA-256: {run}\n" in capsys.readouterr().out
    for kind, name in (("isg", "isg.csv"), ("csv-grid", "grid.csv"), ("linuxcnc-kins", "kins.csv")):
        assert main(["export", "all.csv", "--to", kind, "-o", name, "--tool", "0", "0", "-100"]) == 0
        assert run in Path(name).read_text()
    assert main(["export", "all.csv", "--to", "linuxcnc-comp", "-o", "comp"]) == 0
    assert run in Path("comp/compensation.ini").read_text()

    main(["evaluate", "scenario.toml", "run.csv", "-m", "enhanced", "-o", "enhanced.nc"])
    main(["simulate", "scenario.toml", "-o", "later.nc"])
    main(["evaluate", "scenario.toml", "later.nc", "-o", "later.csv"])
    capsys.readouterr()
    note = "A and B are evaluations of the same run"
    assert main(["compare", "all.csv", "enhanced.nc", "-o", "differences.csv"]) == 0
    assert note in capsys.readouterr().out
    assert f"# run_sha256_b={run}\n" in Path("differences.csv").read_text()
    assert main(["compare", "all.csv", "later.csv"]) == 0
    assert note not in capsys.readouterr().out


def test_run_that_came_through_a_pipe_has_no_fingerprint(here: Path) -> None:
    os.mkfifo("pipe.csv")
    with subprocess.Popen(["sh", "-c", "cat run.csv > pipe.csv"]):
        assert main(["evaluate", "scenario.toml", "pipe.csv", "-o", "piped.csv"]) == 0
    assert sd.read_calibration("piped.csv").provenance.keys() == {"program", "scenario_sha256", "options"}
