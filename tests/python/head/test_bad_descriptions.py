"""Malformed heads: one line that names file, key, what was expected and what came."""

# ruff: noqa: E501  a table of messages reads best with a case a line

import re
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.head.description import find_head, parse_head_design, read_head_design
from stepdiag.presentation.file_check import examine
from stepdiag.scenario.description import parse_scenario

PSD = find_head("beam_and_psd").read_text(encoding="utf-8")
BEAMS = find_head("three_beams").read_text(encoding="utf-8")

# A small cube of glass that no beam meets, and an L-shaped body.
CORNERS = "[[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]"
FACES = "[[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]"
CUBE = f"""
[body.block]
shape = "polyhedron"
position_mm = [12.5, 0.0, 40.0]
material = 1.5
corners_mm = {CORNERS}
faces = {FACES}
"""
L_CORNERS = [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))]
L_FACES = [list(range(6)), list(range(6, 12)), *([k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6] for k in range(6))]
BLOCK = PSD + CUBE


def put(text: str, old: str, new: str) -> str:
    assert text.count(old) == 1, old
    return text.replace(old, new)


def refusal(text: str) -> str:
    """What is said about a head that is refused; nothing about a sound one. Other exceptions pass through."""
    try:
        parse_head_design(text, "h.toml")
    except sd.InvalidArgument as error:
        return str(error)
    return ""


def test_heads_that_the_table_spoils_are_sound() -> None:
    assert [refusal(text) for text in (PSD, BEAMS, BLOCK)] == ["", "", ""]


LENGTH = "expected a positive length in mm"
WINDOW = "thickness_mm = 5.0"
TURN = "rotation_deg = [0.0, 0.0, 180.0]"
LASER = "wavelength_nm = 635.0"


SIZE = "size_mm = [20.0, 20.0]"


def camera(keys: str) -> str:
    """The PSD's head with a camera in its place."""
    return put(put(PSD, '"lateral_effect"', '"camera"'), SIZE, keys)


MALFORMED = {
    # keys
    "unknown shape": (put(PSD, 'shape = "plate"', 'shape = "plat"'), 'body.window.shape: expected a shape: "plate" or "wedge"'),
    "no shape": (put(PSD, 'shape = "plate"', ""), "body.window.shape: missing; expected a shape"),
    "missing size": (put(PSD, WINDOW, ""), f"body.window.thickness_mm: missing; {LENGTH}"),
    "misspelt size": (put(PSD, WINDOW, "thicknes_mm = 5.0"), "body.window.thicknes_mm: unknown key; did you mean thickness_mm? (and 1 more)"),
    "size of another shape": (put(PSD, WINDOW, f"{WINDOW}\nedge_mm = 3.0"), "body.window.edge_mm: unknown key; "),
    "negative thickness": (put(PSD, WINDOW, "thickness_mm = -5.0"), f"body.window.thickness_mm: {LENGTH}, got -5.0"),
    "thickness NaN": (put(PSD, WINDOW, "thickness_mm = nan"), f"body.window.thickness_mm: {LENGTH}, got nan"),
    "infinite position": (put(PSD, "position_mm = [45.0, 0.0, -20.0]", "position_mm = [inf, 0.0, 0.0]"), "sensor.psd.position_mm: expected three lengths in mm, got [inf, 0.0, 0.0]"),
    "bad rotation": (put(PSD, TURN, "rotation_deg = 180.0"), "body.splitter.rotation_deg: expected three angles from -360 to 360, got 180.0"),
    "rotation in two units": (put(PSD, TURN, f"{TURN}\nrotation_mrad = [0, 0, 1]"), "body.splitter: expected rotation_deg or rotation_mrad, got both"),
    "index below 1": (put(BLOCK, "material = 1.5", "material = 0.9"), 'body.block.material: expected the name of a glass such as "N-BK7", or a refractive index from 1 to 5, got 0.9'),
    "unknown glass": (put(BLOCK, "material = 1.5", 'material = "N-BK8"'), 'body.block: glass: expected one of N-BK7, K7, N-SK4, F2, N-SF11, fused silica, got "N-BK8"'),
    "body that is no section": (put(PSD, "[body.splitter]", "[body]\nblock = 3\n[body.splitter]"), "body.block: expected a section [body.block], got 3"),
    "unknown section": (put(PSD, "[sensor.psd]", "[sensors.psd]"), "sensors: unknown section; did you mean sensor?"),
    "unknown key at the top": (put(PSD, "layout = ", "layuot = "), "layuot: unknown key; did you mean layout? (and 1 more)"),
    "unknown layout": (put(PSD, 'layout = "psd"', 'layout = "ideal"'), 'layout: expected "psd" or "multi_beam", got "ideal"'),
    "unknown kind of sensor": (put(PSD, '"lateral_effect"', '"lateral"'), 'sensor.psd.kind: expected "lateral_effect" or "camera", got "lateral"'),
    "interferometer's key of a laser": (put(PSD, "housing_mm = 10.0", "aperture_mm = 10.0"), "beam.laser.aperture_mm: is a key of an interferometer"),
    "laser's key of an interferometer": (put(BEAMS, "[beam.above]", "[beam.above]\nhousing_mm = 3.0"), "beam.above.housing_mm: is a key of a laser with a sensor"),
    "beam to an unknown sensor": (put(PSD, 'sensor = "psd"', 'sensor = "pds"'), 'beam.laser.sensor: expected the name of a sensor, got "pds"; did you mean psd?'),
    "name given twice": (put(PSD, "[body.window]", "[body.psd]"), "sensor.psd: the name is taken by body.psd"),
    "section given twice": (put(PSD, "[body.window]", "[body.splitter]"), "not valid TOML: cannot declare"),
    "empty name": (put(PSD, "[body.window]", '[body.""]'), 'body: expected a name, got ""'),
    "missing wavelength": (put(PSD, LASER, ""), "beam.laser.wavelength_nm: missing; expected a positive number"),
    "no hits": (PSD + "[limits]\nmost_hits = 0\n", "limits.most_hits: expected an integer from 1 to 1000, got 0"),
    "too many faces": (put(BLOCK, FACES, str([[0, 1, 2, 3]] * 10001)), "body.block.faces: expected a list of up to 10000 faces, each a list of numbers of corners, got [[0, 1, 2, 3]"),
    "acceptance of a right angle": (put(PSD, "acceptance_mrad = 5.0", "acceptance_mrad = 1571.0"), "beam.interferometer.acceptance_mrad: expected a positive angle up to 1570 mrad, got 1571.0"),
    "camera of three columns": (camera("columns = 3"), "sensor.psd.columns: expected an integer from 4 to 16384, got 3"),
    "camera too large": (camera("columns = 16384\nrows = 1025"), "sensor.psd: expected columns times rows of at most 16777216 pixels, got 16384 x 1025"),
    "threshold of all light": (camera("threshold = 1.0"), "sensor.psd.threshold: expected a share from 0 to 0.99, got 1.0"),
    # bodies
    "reflectance and absorptance above 1": (put(PSD, "reflectance = 0.5", "reflectance = 0.7\nabsorptance = 0.4"), "body.splitter: splitter: expected reflectance and absorptance of 0 to 1, together at most 1"),
    "faces of a wedge that meet": (put(put(PSD, 'shape = "plate"', 'shape = "wedge"'), WINDOW, f"{WINDOW}\nangle_deg = 80.0"), "body.window: wedge angle: too large"),
    "open polyhedron": (put(BLOCK, ", [3, 0, 4, 7]]", "]"), "body.block: body: not closed: the edge between corners 0 and 3 belongs to 1 face(s), expected 2"),
    "face that is not planar": (put(BLOCK, "[1, 1, 1]", "[1, 1, 1.2]"), "body.block: body: face 1: is not planar"),
    "body that is not convex": (put(put(BLOCK, CORNERS, str(L_CORNERS)), FACES, str(L_FACES)), "body.block: body: not convex: corners on both sides of "),
    "face of two corners": (put(BLOCK, "[3, 0, 4, 7]", "[3, 0]"), "body.block: body: face 5: expected three corners or more"),
    "corner that is not there": (put(BLOCK, "[3, 0, 4, 7]", "[3, 0, 4, 8]"), "body.block: body: face 5: there is no corner 8"),
    "plate too thin": (put(PSD, WINDOW, "thickness_mm = 0.009"), "window: too thin; expected at least 0.01 mm, got 0.009 mm"),
    # the whole
    "laser's wavelength out of range": (put(PSD, LASER, "wavelength_nm = 200.0"), "beam.laser: N-BK7, wavelength in nm: expected 334.000000 to 2325.000000, got 200.000000"),
    "interferometer beside the origin": (put(PSD, "position_mm = [0.0, 0.0, 0.0]", "position_mm = [0.5, 0.0, 0.0]"), "beam interferometer: a psd head measures its distance at x = 0, y = 0, got 0.5, 0 mm; move the beam by -0.5, 0 mm (position_mm)"),
    "overlapping bodies": (put(BLOCK, "position_mm = [12.5, 0.0, 40.0]", "position_mm = [12.5, 0.0, 15.5]"), "window and block: overlap or touch; expected a gap of at least 0.01 mm, got 0 mm"),
    "bodies that touch": (put(BLOCK, "position_mm = [12.5, 0.0, 40.0]", "position_mm = [12.5, 0.0, 16.0]"), "window and block: overlap or touch; expected a gap of at least 0.01 mm, got 0 mm"),
    "body inside another": (put(BLOCK, "position_mm = [12.5, 0.0, 40.0]", "position_mm = [12.5, 0.0, 12.5]"), "window and block: overlap or touch; expected a gap of at least 0.01 mm, got 0 mm"),
    "sensor inside glass": (put(PSD, "position_mm = [45.0, 0.0, -20.0]", "position_mm = [30.0, 0.0, -20.0]"), "splitter and psd: overlap or touch; expected a gap"),
    "source in glass": (put(PSD, "position_mm = [25.0, 0.0, -40.0]", "position_mm = [25.0, 0.0, -28.0]"), "splitter and laser: overlap or touch; expected a gap"),
    "head that sees no mirror": (put(PSD, "[body.window]", '[body.lid]\nshape = "screen"\nposition_mm = [0.0, 0.0, 5.0]\nwidth_mm = 8.0\nheight_mm = 8.0\n[body.window]'), "beam interferometer: does not meet a mirror square to the beam"),
    "sensor without light": (put(PSD, "position_mm = [45.0, 0.0, -20.0]", "position_mm = [45.0, 0.0, 40.0]"), "beam laser: does not come back from a mirror square to the beam at 150 mm to its sensor psd"),
    "layout without its beams": (put(BEAMS, 'layout = "multi_beam"', 'layout = "psd"'), "layout psd: expected one interferometer beam"),
    "layout with a sensor too many": (put(PSD, 'layout = "psd"', 'layout = "multi_beam"'), "layout multi_beam: expected three or more interferometer beams"),
    "beams on a line": (put(BEAMS, "position_mm = [0.0, 20.0, 0.0]", "position_mm = [-20.0, 0.0, 0.0]"), "head beam_offsets: expected three or more beams that are not on one line, got 3 beam(s)"),
    # the file
    "table in 20,000 others": ("[" + ".".join("a" * 20_000) + "]", "not valid TOML: nested too deeply"),
    "nothing": ("# only words\n", "has no keys"),
    "bad TOML": (put(PSD, "[body.window]", "[body.window"), "not valid TOML: expected ']'"),
    "cut off": (PSD[: PSD.index("[body.splitter]")], 'beam.laser.sensor: expected the name of a sensor, got "psd"; there is no [sensor.NAME]'),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_head_is_refused_in_one_line_that_names_the_key(case: str) -> None:
    text, message = MALFORMED[case]
    said = refusal(text)
    assert said.startswith(f"h.toml: {message}")
    assert "\n" not in said


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("no.toml", "no.toml: cannot be read: No such file or directory"),
        (".", ".: expected a file, got a folder"),
        ("a\0b.toml", "cannot be read"),
        ("/dev/zero", "/dev/zero: expected a file, got a device"),
    ],
)
def test_path_that_is_no_file_is_refused(path: str, message: str) -> None:
    with pytest.raises(sd.InvalidArgument, match=message):
        read_head_design(path)


# --- heads of a scenario ---------------------------------------------------------------------------------------------
DESCRIBED = put(SCENARIO, 'layout = "ideal"', 'description = "beam_and_psd"')
SEVERAL = put(
    put(SCENARIO, '[head]\nlayout = "ideal"', '[head.left]\ndescription = "beam_and_psd"\n[head.right]\ndescription = "beam_and_psd"'),
    "[noise]",
    "\n".join(f'[line.{line}]\nhead = "left"' for line in ("ppp", "npp", "pnp", "nnp", "p00", "0p0", "00p")) + "\n[noise]",
)  # fmt: skip
PPP = '[line.ppp]\nhead = "left"'

MALFORMED_IN_SCENARIO = {
    "layout and description": (put(DESCRIBED, "[misalignment]", 'layout = "psd"\n[misalignment]'), "head: expected layout or description, got both"),
    "neither of them": (put(SCENARIO, 'layout = "ideal"', ""), 'head.layout: missing; expected "ideal", "psd" or "multi_beam", or a description'),
    "unknown shipped head": (put(DESCRIBED, '"beam_and_psd"', '"four_beams"'), 'head.description: expected the name of a shipped head (beam_and_camera, beam_and_psd, three_beams) or the path of a TOML file, got "four_beams"'),
    "description that is not there": (put(DESCRIBED, '"beam_and_psd"', '"no.toml"'), "head.description: no.toml: cannot be read"),
    "key of a layout": (put(DESCRIBED, "[misalignment]", "psd_distance_mm = 3.0\n[misalignment]"), "head.psd_distance_mm: goes with a layout; a description has its own"),
    "key of a description": (put(SCENARIO, "[misalignment]", 'reading_model = "chief_ray"\n[misalignment]'), "head.reading_model: goes with a description"),
    "share without a description": (put(SCENARIO, "[misalignment]", "verified_share = 0.5\n[misalignment]"), "head.verified_share: goes with a description"),
    "unknown reading model": (put(DESCRIBED, "[misalignment]", 'reading_model = "ray"\n[misalignment]'), 'head.reading_model: expected "chief_ray" or "coupled_mode", got "ray"'),
    "share above 1": (put(DESCRIBED, "[misalignment]", "verified_share = 2\n[misalignment]"), "head.verified_share: expected a share from 0 to 1, got 2"),
    "pose error of an unknown component": (put(DESCRIBED, "[misalignment]", "[head.pose_errors.windw]\nshift_mm = [0, 0, 1]\n[misalignment]"), 'head.pose_errors.windw: no component of the head "beam and PSD"; expected one of splitter, dump, window, interferometer, laser, psd'),
    "pose error NaN": (put(DESCRIBED, "[misalignment]", "[head.pose_errors.psd]\nshift_mm = [0, nan, 1]\n[misalignment]"), "head.pose_errors.psd.shift_mm: expected three lengths in mm, got [0, nan, 1]"),
    "pose error too large": (put(DESCRIBED, "[misalignment]", "[head.pose_errors.psd]\nrotation_urad = [0, 1e6, 0]\n[misalignment]"), "head.pose_errors.psd.rotation_urad: expected three angles below 0.1 rad, in µrad, got [0, 1000000.0, 0]"),
    "line without head": (put(SEVERAL, PPP, ""), "line.ppp.head: missing; expected one of left, right"),
    "unknown head": (put(SEVERAL, PPP, PPP.replace("left", "lft")), 'line.ppp.head: no head of this scenario; expected one of left, right, got "lft"'),
    "head of an unknown line": (put(SEVERAL, PPP, PPP.replace("ppp", "ppn")), "line.ppn: not a line of the plan; did you mean"),
    "line without the key": (put(SEVERAL, PPP, "[line.ppp]"), "line.ppp.head: missing; expected the name of a head"),
    "mixed layouts": (put(put(SEVERAL, '[head.right]\ndescription = "beam_and_psd"', '[head.right]\ndescription = "three_beams"'), PPP, PPP.replace("left", "right")), "head.left: expected heads of one layout and number of beams: that of ppp reads d1, d2, d3 (multi_beam), got one that reads distance, spot_x, spot_y (psd) for npp"),
    "unknown key of one head": (put(SEVERAL, "[head.right]", "[head.right]\nstandof_mm = 3"), "head.right.standof_mm: unknown key; did you mean standoff_mm?"),
    "share of one head": (put(SEVERAL, "[head.right]", "[head.right]\nverified_share = 1"), "head.right.verified_share: unknown key"),
    "constants for other beams": (put(DESCRIBED, "[noise]", "beam_constants_um = [1.0, 2.0, 3.0]\n[noise]"), 'misalignment.beam_constants_um: expected none, for the layout "psd", got [1.0, 2.0, 3.0]'),
    "constants of a line for other beams": (put(DESCRIBED.replace("beam_and_psd", "three_beams"), "[noise]", "[misalignment.npp]\nbeam_constants_um = [1.0, 2.0]\n[noise]"), "misalignment.npp.beam_constants_um: expected 3 constants, one for each beam, got [1.0, 2.0]"),
    "index and air": (put(DESCRIBED, "[noise]", "[environment]\nrefractive_index = 1.0\ntemperature_c = 20\n[noise]"), "environment: expected refractive_index or a state of the air, got both (temperature_c)"),
    "air too hot": (put(DESCRIBED, "[noise]", "[environment]\ntemperature_c = 120\n[noise]"), "environment.temperature_c: expected a temperature from -40 to 100, got 120"),
    "assumed air too thin": (put(DESCRIBED, "[noise]", "[environment.assumed]\npressure_hpa = 1.0\n[noise]"), "environment.assumed.pressure_hpa: expected a pressure from 100 to 1400, got 1.0"),
    "unknown equation": (put(DESCRIBED, "[noise]", '[environment]\nequation = "edlen"\n[noise]'), 'environment.equation: expected "ciddor", "modified_edlen" or "edlen_1966", got "edlen"'),
    "table in 20,000 others": (put(DESCRIBED, "[noise]", "[noise." + ".".join("a" * 20_000) + "]"), "not valid TOML: nested too deeply"),
    "mirror too small": (put(DESCRIBED, "[misalignment]", "mirror_mm = [1, 1]\n[misalignment]"), "head.mirror_mm: too small for this plan: expected at least"),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED_IN_SCENARIO)
def test_malformed_head_of_a_scenario_is_refused_in_one_line_that_names_the_key(case: str) -> None:
    text, message = MALFORMED_IN_SCENARIO[case]
    with pytest.raises(sd.InvalidArgument) as error:
        parse_scenario(text, "s.toml")
    assert str(error.value).startswith(f"s.toml: {message}")
    assert "\n" not in str(error.value)


def test_pose_error_that_pushes_a_component_into_another_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    error = "[head.pose_errors.psd]\nshift_mm = [-15, 0, 0]\n[misalignment]"
    file.write_text(put(DESCRIBED, "[misalignment]", error), encoding="utf-8")
    scenario = sd.read_scenario(file)  # an evaluation of it does not ask for pose errors
    said = (
        "s.toml: head: splitter and psd: overlap or touch, with their pose errors; expected a gap of at least 0.01 mm"
    )
    for call in (lambda: sd.simulate(scenario), lambda: examine(file)):
        with pytest.raises(sd.InvalidArgument, match=re.escape(said)):
            call()


def test_scenarios_that_the_table_spoils_are_sound() -> None:
    for text in (DESCRIBED, SEVERAL):
        assert parse_scenario(text).known.head.layout == "psd"


# --- whatever a file holds ---------------------------------------------------------------------------------------------
def paths_of(table: dict[str, Any], prefix: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    paths = []
    for name, value in table.items():
        paths.append((*prefix, name))
        if isinstance(value, dict):
            paths += paths_of(value, (*prefix, name))
    return paths


numbers = st.one_of(st.floats(), st.integers(-(2**63), 2**63 - 1))
texts = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=8)
scalars = st.one_of(numbers, st.booleans(), texts)
values = st.one_of(scalars, st.lists(scalars, max_size=4), st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
                   st.dictionaries(st.sampled_from(["shape", "sensor", "x"]), scalars, max_size=2))  # fmt: skip


@pytest.mark.slow
@settings(max_examples=200)
@given(path=st.sampled_from(paths_of(tomlkit.parse(BLOCK).unwrap())), value=values)
def test_whatever_stands_at_a_key_is_read_or_refused(path: tuple[str, ...], value: Any) -> None:
    content = tomlkit.parse(BLOCK).unwrap()
    section = content
    for name in path[:-1]:
        section = section[name]
    section[path[-1]] = value
    said = refusal(tomlkit.dumps(content))
    assert said == "" or said.startswith("h.toml: ")
    assert "\n" not in said


def test_every_truncation_is_read_or_refused(tmp_path: Path) -> None:
    for end in range(1, len(BLOCK), 7):
        assert "\n" not in refusal(BLOCK[:end])
