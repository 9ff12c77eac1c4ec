"""The commands `stepdiag head ...`, and the others where they meet head descriptions."""

# ruff: noqa: E501  a table of messages reads best with a case a line

import math
import re
from pathlib import Path

import numpy as np
import pytest

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.head.description import find_head, shipped_heads

HEADS = ("beam_and_camera", "beam_and_psd", "three_beams")


def run(*arguments: str) -> int:
    return main(list(arguments))


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_list_names_the_shipped_heads_and_their_files(capsys: pytest.CaptureFixture[str]) -> None:
    assert tuple(shipped_heads()) == HEADS
    assert run("head", "list") == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in said] == list(HEADS)
    assert all(Path(line.split(": ")[1]).is_file() for line in said)


# --- show ------------------------------------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize("head", HEADS)
def test_show_draws_the_same_bytes_again(head: str) -> None:
    for suffix in ("png", "svg"):
        for name in ("one", "two"):
            assert run("head", "show", head, "-o", f"{name}.{suffix}") == 0
        assert Path(f"one.{suffix}").read_bytes() == Path(f"two.{suffix}").read_bytes()
    assert Path("one.png").read_bytes().startswith(b"\x89PNG")


def test_figure_names_every_component() -> None:
    run("head", "show", "beam_and_psd", "-o", "head.svg")
    design = sd.optics.shipped_head("beam_and_psd")
    drawn = Path("head.svg").read_text()
    for part in [*design.bodies, *design.beams, *design.sensors]:
        assert f"<!-- {part.name} -->" in drawn  # matplotlib's remark on the outlines of a text


def test_figure_shows_the_ghosts_of_a_coated_window() -> None:
    text = find_head("beam_and_psd").read_text()
    Path("ghosts.toml").write_text(text.replace("# reflectance = 0.0025", "reflectance = 0.0025"))
    run("head", "show", "beam_and_psd", "-o", "plain.svg")
    run("head", "show", "ghosts.toml", "-o", "ghosts.svg")
    dashed = [Path(f"{name}.svg").read_text().count("stroke-dasharray: 3.2,1.6") for name in ("plain", "ghosts")]
    assert dashed[1] > dashed[0] > 0


def test_name_with_dollar_signs_is_drawn_as_it_is(tmp_path: Path) -> None:
    text = find_head("three_beams").read_text(encoding="utf-8")
    odd = tmp_path / "odd.toml"
    odd.write_text(re.sub(r'^name = ".*"', 'name = "costs $x^{$"', text, count=1, flags=re.M), encoding="utf-8")
    assert run("head", "show", str(odd), "-o", str(tmp_path / "odd.svg")) == 0


# --- check -----------------------------------------------------------------------------------------------------------
def numbers_after(text: str, label: str) -> list[float]:
    (line,) = [line for line in text.splitlines() if line.strip().startswith(label)]
    return [float(word) for word in re.findall(r"[-+]?\d+\.\d+", line.split(label)[1])]


def test_check_tells_the_nominal_calibration(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("head", "check", "beam_and_psd") == 0
    said = capsys.readouterr().out
    glass = 1.5151 / 1.00027 - 1.0  # N-BK7 at 635 nm over air
    thickness = numbers_after(said, "distance constant")[0]
    assert thickness == pytest.approx(5.0 * (1.5009 / 1.00027 - 1.0), abs=0.01)  # a window of 5 mm at 1530 nm
    # 20 mm to the splitter and 20 mm on, of which 20 mm are glass, and twice the window: t/n in place of t, and its
    # own 5 mm, which are on the way to the mirror as well.
    expected = 40.0 - (20.0 + 5.0) * (1.0 - 1.0 / (1.0 + glass))
    assert numbers_after(said, "PSD distance")[0] == pytest.approx(expected, abs=0.01)
    assert numbers_after(said, "its beam at (u, v)") == pytest.approx([25.0, 0.0], abs=1e-6)


def test_check_tells_spot_path_and_power_at_every_detector(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("head", "check", "beam_and_psd", "--distance", "300", "--distance", "500") == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if re.match(r"\s+\d+  [a-z]", line)]
    assert [(row[0], row[1], float(row[5])) for row in rows] == [
        ("300", "interferometer", 100.0),
        ("300", "psd", 25.0),
        ("500", "interferometer", 100.0),
        ("500", "psd", 25.0),
    ]
    # Twice the distance; for the laser from 40 mm behind the plane, and back over 20 + 20 mm to the PSD. Of it are glass
    # twice the window's 5 mm and, for the laser, twice the cube's 20 mm: N-BK7 relative to air of 1.00027.
    air, infrared, red = 1.00027, 1.5009 - 1.0, 1.5151 - 1.0
    expected = [air * (600.0 + 10.0 * infrared), air * (680.0 + 50.0 * red)]
    expected += [path + 2 * 200.0 * air for path in expected]
    assert [float(row[4]) for row in rows] == pytest.approx(expected, abs=0.01)


def test_check_tells_a_beam_that_is_out_of_square(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = find_head("three_beams").read_text(encoding="utf-8")
    turned = tmp_path / "turned.toml"
    turned.write_text(text.replace("[beam.right]", "[beam.right]\nrotation_mrad = [0.0, 0.5, 0.0]"), encoding="utf-8")
    assert run("head", "check", str(turned), "--distance", "300") == 0
    assert "right leaves 500 µrad out of square" in capsys.readouterr().out
    assert run("head", "check", "three_beams", "--distance", "300") == 0
    assert "out of square" not in capsys.readouterr().out


def test_limits_are_those_of_acceptance_and_aperture(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("head", "check", "three_beams", "--distance", "300", "--distance", "1200", "--mirror", "100", "80") == 0
    said = capsys.readouterr().out
    spans = [re.findall(r"([-+]\S+) \.\. ([-+]\S+)", line) for line in said.splitlines() if " .. " in line]
    near, far = ([(float(a), float(b)) for a, b in span] for span in spans)
    assert near[0] == near[1] == (-2.5, 2.5)  # the returned beam is turned by 5 mrad, twice the tilt
    # 5 mm of half aperture at the end of 1.2 m back; the window shortens that by t (1 - 1/n), twice 1.7 mm.
    assert far[0] == far[1] == pytest.approx((-2.083, 2.083), abs=0.01)
    assert near[2:] == far[2:] == [(-30.0, 50.0), (-20.0, 40.0)]  # the mirror's edges at the beams, 0 and 20 mm
    assert "Smallest mirror, its middle on the head's z: 40 x 40 mm" in said


def far_plates(count: int) -> str:
    """Plates of 1 mm, 2 mm apart from 20 mm on."""
    plate = '[body.p{0}]\nshape = "plate"\nwidth_mm = 60\nheight_mm = 60\nthickness_mm = 1\nmaterial = "N-BK7"\n'
    places = "".join(plate.format(k) + f"position_mm = [10, 10, {20 + 2 * k}]\n" for k in range(count))
    return find_head("three_beams").read_text() + "\n[limits]\nmost_hits = 1000\n" + places


@pytest.mark.slow
def test_head_that_reaches_far_is_looked_at_from_farther(capsys: pytest.CaptureFixture[str]) -> None:
    Path("far.toml").write_text(far_plates(60))
    assert run("head", "check", "far.toml") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines() if "centre  " in line] == [
        "300",
        "600",
        "1200",
    ]


def test_head_of_a_thousand_faces_works() -> None:
    around = [[30.0 * math.cos(k * math.pi / 500) + 10.0, 30.0 * math.sin(k * math.pi / 500)] for k in range(1000)]
    corners = [[x, y, z] for z in (0, 4) for x, y in around]
    rim = [[k, (k + 1) % 1000, (k + 1) % 1000 + 1000, k + 1000] for k in range(1000)]
    disc = (
        '[body.disc]\nshape = "polyhedron"\nposition_mm = [0.0, 10.0, 400.0]\nmaterial = 1.6\n'
        f"corners_mm = {corners}\nfaces = {[list(range(1000)), list(range(1000, 2000)), *rim]}\n"
    )
    design = sd.optics.parse_head_design(far_plates(170) + disc)
    assert sum(len(body.surfaces) for body in design.bodies) == 6 * 171 + 1002
    head = sd.Head.from_design(design, standoff=500.0)
    # 5 mm and 170 mm of N-BK7 (n = 1.5009 in vacuum) and 4 mm of index 1.6 over air, 1.0003.
    expected = 175.0 * (1.5009 / 1.0003 - 1.0) + 4.0 * (1.6 / 1.0003 - 1.0)
    assert head.calibration.head_constants.tolist() == pytest.approx([expected] * 3, abs=0.1)
    machine, plan = sd.Machine("[w X' b Y Z t]"), sd.Plan((80, 60, 50), ["ppp"], 5)
    assert not np.isnan(sd.simulate(machine, plan, head).channels["d3"]).any()


def test_check_says_what_cannot_be_traced(capsys: pytest.CaptureFixture[str]) -> None:
    text = (
        find_head("beam_and_psd")
        .read_text()
        .replace("position_mm = [45.0, 0.0, -20.0]", "position_mm = [45.0, 0.0, 40.0]")
    )
    Path("dark.toml").write_text(text)
    assert run("head", "show", "dark.toml", "-o", "dark.png") == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: dark.toml: ")
    assert "psd" in said
    assert not Path("dark.png").exists()


# --- sensitivity -----------------------------------------------------------------------------------------------------
def test_sensitivity_is_sorted_by_effect(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("head", "sensitivity", "beam_and_psd", "--distance", "600") == 0
    said = capsys.readouterr().out
    by_distance, by_tilt = said.split("By their effect on the tilts:")
    for table, columns in ((by_distance, slice(-3, -2)), (by_tilt, slice(-2, None))):
        rows = [
            line.split()
            for line in table.splitlines()
            if re.search(r"µm|µrad|ppm|K |hPa|%RH", line) and "per" not in line
        ]
        effects = [max(abs(float(value)) for value in row[columns]) for row in rows if not row[0].startswith("beam")]
        assert effects == sorted(effects, reverse=True)
        assert len(effects) > 5


@pytest.mark.parametrize("name", HEADS)
def test_sensitivity_says_first_that_it_is_of_the_axes(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("head", "sensitivity", name) == 0
    first, second, *table = capsys.readouterr().out.splitlines()
    assert "600 mm, tilts 300 and 300 µrad" in first
    assert second == "for readings by the beams' axes (chief rays), whatever the reading model of the head"
    assert any("index error   ppm" in row for row in table)
    widths = {row.index(" per ") for row in table if " per " in row} | {
        row.index(" ppm ") for row in table if " ppm " in row
    }
    assert len(widths) == 1


def test_sensitivity_knows_what_a_sensor_shift_does(capsys: pytest.CaptureFixture[str]) -> None:
    run("head", "sensitivity", "beam_and_psd", "--distance", "600", "--tilt", "0", "0")
    table = capsys.readouterr().out.split("By their effect on the tilts:")[1]
    (row,) = [line.split() for line in table.splitlines() if line.split()[:3] == ["psd", "shift", "y"]]
    # 1 µm of a spot whose arm is 2 (600 + 31.5) mm.
    assert abs(float(row[5])) == pytest.approx(1e6 / (2.0 * 631.5), rel=1e-3)


# --- other commands --------------------------------------------------------------------------------------------------
def test_check_knows_a_head_from_a_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("check", *(str(find_head(name)) for name in HEADS)) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1] for line in said] == ["head"] * len(HEADS)
    assert said[-1].endswith("three beams, layout multi_beam, 1 bodies, 3 beams, 0 sensors")


def test_init_with_a_head_makes_a_copy_to_edit() -> None:
    assert run("init", "-o", "machine", "--head", "three_beams") == 0
    assert sorted(path.name for path in Path("machine").iterdir()) == ["head.toml", "measurement.csv", "scenario.toml"]
    assert Path("machine/head.toml").read_bytes() == find_head("three_beams").read_bytes()
    assert sd.read_scenario("machine/scenario.toml").known.head.design.name == "three beams"
    assert set(sd.read_measurement("machine/measurement.csv").channels) == {"d1", "d2", "d3"}
    assert run("simulate", "machine/scenario.toml", "-o", "run.csv") == 0
    assert run("evaluate", "machine/scenario.toml", "run.csv", "-o", "calibration.csv") == 0


def test_replay_that_differs_from_its_trace_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def differs(_: object) -> None:
        raise sd.optics.ReplayMismatch("line ppp, point 3: replay and trace differ")

    run("init", "-o", "machine", "--head", "three_beams")
    monkeypatch.setattr("stepdiag.scenario.description.simulate_scenario", differs)
    capsys.readouterr()
    assert run("simulate", "machine/scenario.toml", "-o", "run.csv") == 1
    assert capsys.readouterr().err.startswith("stepdiag: error: line ppp, point 3: replay and trace differ; nothing")
    assert not Path("run.csv").exists()


MISTAKES: list[tuple[list[str], str]] = [
    (["head", "show", "beam_and_psd"], "Missing option '-o'"),
    (["head", "show", "four_beams", "-o", "h.png"], 'expected the name of a shipped head (beam_and_camera, beam_and_psd, three_beams) or the path of a TOML file, got "four_beams"'),
    (["head", "show", "no.toml", "-o", "h.png"], "no.toml: cannot be read"),
    (["head", "show", "three_beams", "-o", "h.jpg"], "h.jpg: expected a name that ends in .png, .svg or .pdf"),
    (["head", "show", "three_beams", "-o", "no/h.png"], "the folder no does not exist"),
    (["head", "show", "three_beams", "-o", "h.png", "--distance", "-3"], "--distance: expected more than the 15 mm that the head reaches to, got -3"),
    (["head", "show", "three_beams", "-o", "h.png", "--distance", "15"], "--distance: expected more than the 15 mm that the head reaches to, got 15"),
    (["head", "check", "three_beams", "--distance", "nan"], "--distance: expected more than the 15 mm that the head reaches to, got nan"),
    (["head", "check", "three_beams", "--mirror", "0", "10"], "--mirror: expected two positive lengths in mm, got 0 10"),
    (["head", "sensitivity", "three_beams", "--tilt", "inf", "0"], "--tilt: expected two angles"),
    (["head", "sensitivity", "three_beams", "--tilt", "9e4", "0"], ""),
    (["head", "draw", "three_beams"], "No such command 'draw'"),
    (["init", "-o", "new", "--head", "four_beams"], "expected the name of a shipped head"),
    (["init", "-o", "new", "--head", "three_beams", "--sheet-for", "s.toml"], "--head: goes with a new scenario"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), MISTAKES, ids=[" ".join(arguments) for arguments, _ in MISTAKES])
def test_mistake_gives_exit_code_2_and_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: ")
    assert message in said
    assert said.count("\n") == 1
    assert not list(Path().iterdir()), "files were left behind"


@pytest.mark.parametrize("command", ["list", "show", "check", "sensitivity"])
def test_help_of_every_command_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("head", command, "--help") == 0
    assert f"Example: stepdiag head {command}" in capsys.readouterr().out
