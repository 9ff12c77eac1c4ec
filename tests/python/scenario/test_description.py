"""Scenario files: what they mean, and one clear line for each way to get one wrong."""

# ruff: noqa: E501  a table of messages reads best with a case a line

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st
from scenario_refusals import GOOD, changed, refusal

import stepdiag as sd
from stepdiag.scenario.description import parse_scenario


# --- what a file means -----------------------------------------------------------------------------------------------
def test_file_becomes_the_types_of_the_core() -> None:
    scenario = parse_scenario(GOOD)
    assert scenario.known.chain == sd.Chain("[w X' b Y Z t]")
    assert scenario.known.tool == (1.0, 2.0, 3.0)
    assert scenario.known.plan.steps == 50
    assert scenario.known.plan.order == "XYZ"
    assert scenario.known.plan.scale_lines == ["p00", "0p0"]
    assert scenario.known.plan.volume.tolist() == [800.0, 600.0, 500.0]
    assert scenario.known.head.layout == "ideal"
    assert scenario.known.head.standoff == 100.0
    assert scenario.truth.environment is None
    assert scenario.truth.noise.distance == pytest.approx(0.2e-3, rel=1e-15)  # one product of two rounded numbers
    assert (scenario.truth.noise.tilt, scenario.truth.noise.seed) == (0.0, 1)


def test_scenario_cannot_be_changed() -> None:
    scenario = parse_scenario(GOOD)
    with pytest.raises(AttributeError):
        scenario.known.tool = (0.0, 0.0, 0.0)  # type: ignore[misc]
    with pytest.raises(TypeError):
        scenario.truth.misalignment["ppp"] = sd.Misalignment()  # type: ignore[index]
    with pytest.raises(ValueError, match="frozen"):
        scenario.known.keys.plan.steps = 3


def test_section_for_a_line_replaces_only_the_keys_it_names() -> None:
    misalignment = parse_scenario(GOOD).truth.misalignment
    assert misalignment["ppp"].reflector.tolist() == pytest.approx([100e-6, 300e-6], rel=1e-15)
    assert misalignment["ppp"].laser.tolist() == [0.0, 0.0]
    assert misalignment["npp"].reflector.tolist() == misalignment["ppp"].reflector.tolist()
    assert misalignment["npp"].psd_zero.tolist() == [1.5, 2.0]
    assert misalignment["npp"].laser.tolist() == pytest.approx([700e-6, 1000e-6], rel=1e-15)


def test_scale_line_is_aligned_except_for_what_its_own_section_names() -> None:
    misalignment = parse_scenario(GOOD).truth.misalignment
    assert "0p0" not in misalignment
    assert misalignment["p00"].reflector.tolist() == [0.0, 0.0]
    assert misalignment["p00"].psd_zero.tolist() == [0.0, 0.0]
    assert misalignment["p00"].laser.tolist() == pytest.approx([10e-6, 20e-6], rel=1e-15)


@pytest.mark.parametrize(
    ("sections_text", "expected"),
    [
        ("", (0.1e-3, 1e-6, 1e-3)),
        ("[noise]\ndistance_um = 0.0\ntilt_urad = 3.0", (0.1e-3, 3e-6, 1e-3)),
        ("[noise]\ndistance_um = 0.5\n[uncertainty]\ndistance_um = 0.2\nspot_um = 4.0", (0.2e-3, 1e-6, 4e-3)),
    ],
)
def test_weights_are_those_stated_else_the_noise_else_the_defaults(
    sections_text: str, expected: tuple[float, float, float]
) -> None:
    weights = parse_scenario(GOOD.split("[noise]")[0] + sections_text).known.uncertainty
    assert (weights.distance, weights.tilt, weights.spot) == pytest.approx(expected, rel=1e-15)


def test_machine_without_errors_is_perfect() -> None:
    machine = parse_scenario(changed("[machine.random]\nseed = 7\n", "")).machine()
    assert np.all(machine.error([[800.0, 600.0, 500.0]]) == 0.0)


def test_random_machine_has_its_nodes_at_the_steps_unless_told_otherwise() -> None:
    assert len(parse_scenario(GOOD).machine().errors.functions["EXX"][0]) == 51
    finer = parse_scenario(changed("seed = 7", "seed = 7\nintervals = 400")).machine()
    assert len(finer.errors.functions["EXX"][0]) == 401
    one_step = parse_scenario(changed("steps = 50", "steps = 1")).machine()
    assert len(one_step.errors.functions["EXX"][0]) == 3  # a map needs two intervals


def test_error_map_is_found_beside_the_scenario(tmp_path: Path) -> None:
    errors = sd.ErrorMap(squareness={"C0Y": 1e-5})
    errors.write(tmp_path / "truth.csv")
    file = tmp_path / "scenario.toml"
    file.write_text(changed("[machine.random]\nseed = 7\n", 'errors = "truth.csv"\n'))
    assert sd.read_scenario(file).machine().errors.squareness == {"C0Y": 1e-5}


def test_missing_error_map_is_no_concern_of_an_evaluation(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(changed("[machine.random]\nseed = 7\n", 'errors = "truth.csv"\n'))
    scenario = sd.read_scenario(file)
    assert scenario.known.plan.steps == 50
    with pytest.raises(sd.InvalidArgument, match=r"scenario\.toml: machine\.errors: .*truth\.csv: cannot be read"):
        scenario.machine()


def test_byte_order_mark_is_passed_over(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_bytes(b"\xef\xbb\xbf" + GOOD.encode())
    assert sd.read_scenario(file).known.plan.steps == 50


# --- what is wrong with a file ---------------------------------------------------------------------------------------
EDGE = "expected a length in mm from 0.001 to 1e6, got "
STEPS = "plan.steps: expected an integer from 1 to 2000, got "

MALFORMED = [
    # keys
    ("[plan]", "[instrument]\nscale = 1.0\n[plan]", "instrument.scale: unknown key; did you mean scale_ppm?"),
    (
        "[plan]",
        "[instrument]\nu_scale_ppm = -0.1\n[plan]",
        "instrument.u_scale_ppm: expected a number from 0 to 100, in ppm, got -0.1",
    ),
    ("x_mm = 800.0", "", "volume.x_mm: missing; expected a length in mm from 0.001 to 1e6"),
    ("steps = 50", "step = 50", "plan.step: unknown key; did you mean steps? (and 1 more)"),
    ("[noise]", "[noises]", "noises: unknown section; did you mean noise?"),
    ("laser_urad = [700, 1000]", "lasr_urad = [1, 2]", "misalignment.npp.lasr_urad: unknown key; did you mean laser_urad?"),
    ("[misalignment.npp]", "[misalignment.by_line]", "misalignment.by_line: unknown key"),
    ("[plan]", "[[plan]]", "plan: expected a section [plan], got [{"),
    ("[machine.random]\nseed = 7", "random = 3", "machine.random: expected a section [machine.random], got 3"),
    # types
    ("x_mm = 800.0", 'x_mm = "800"', f'volume.x_mm: {EDGE}"800"'),
    ("x_mm = 800.0", "x_mm = true", f"volume.x_mm: {EDGE}true"),
    ("x_mm = 800.0", "x_mm = 2020-01-01", f"volume.x_mm: {EDGE}2020-01-01"),
    ("steps = 50", "steps = 50.0", STEPS + "50.0"),
    ("steps = 50", 'steps = "ten"', STEPS + '"ten"'),
    ('["ppp", "npp", "pnp", "nnp"]', '"ppp"', 'plan.lines: expected a list of lines such as "ppp" (three of p, n, 0), got "ppp"'),
    ("laser_urad = [700, 1000]", "laser_urad = [700]", "misalignment.npp.laser_urad: expected two angles below 0.1 rad, in µrad, got [700]"),
    ("[noise]", "[report]\ncustomer = 3\n[noise]", "report.customer: expected a text of 1 to 400 characters, got 3"),
    ("[noise]", '[uncertainty]\nbetween_nodes_um = {distribution = "normal", standard = 1.0}\n[noise]', "uncertainty.between_nodes_um: expected a standard deviation of at least 0, got {"),
    # ranges
    ("[noise]", "[uncertainty]\nbetween_nodes_um = -1\n[noise]", "uncertainty.between_nodes_um: expected a standard deviation of at least 0, got -1"),
    ("[noise]", '[report]\noperator = ""\n[noise]', 'report.operator: expected a text of 1 to 400 characters, got ""'),
    ("x_mm = 800.0", "x_mm = 0", f"volume.x_mm: {EDGE}0"),
    ("x_mm = 800.0", "x_mm = -800.0", f"volume.x_mm: {EDGE}-800.0"),
    ("x_mm = 800.0", "x_mm = nan", f"volume.x_mm: {EDGE}nan"),
    ("x_mm = 800.0", "x_mm = -inf", f"volume.x_mm: {EDGE}-inf"),
    ("x_mm = 800.0", "x_mm = 1e999", f"volume.x_mm: {EDGE}inf"),
    ("x_mm = 800.0", "x_mm = 1" + 400 * "0", f"volume.x_mm: {EDGE}1000"),
    ("steps = 50", "steps = 0", STEPS + "0"),
    ("steps = 50", "steps = -5", STEPS + "-5"),
    ("steps = 50", "steps = 1_000_000_000", STEPS + "1000000000"),
    ("seed = 7", "seed = -1", "machine.random.seed: expected an integer from 0 to 2^64 - 1, got -1"),
    ("seed = 7", "seed = 18446744073709551616", "machine.random.seed: expected an integer from 0 to 2^64 - 1, got 18446744073709551616"),
    ("seed = 7", "seed = 7\nintervals = 1", "machine.random.intervals: expected an integer from 2 to 1000000, got 1"),
    ("laser_urad = [700, 1000]", "laser_urad = [0, 1e5]", "misalignment.npp.laser_urad: expected two angles below 0.1 rad, in µrad, got [0, 100000.0]"),
    ("distance_um = 0.2", "distance_um = -0.2", "noise.distance_um: expected a standard deviation of at least 0, got -0.2"),
    ("[noise]", "[uncertainty]\ntilt_urad = 0\n[noise]", "uncertainty.tilt_urad: expected a positive standard deviation or a distribution, got 0"),
    ("[noise]", "[environment]\nrefractive_index = 0.9\n[noise]", "environment.refractive_index: expected a refractive index from 1 to 2, got 0.9"),
    ("[noise]", '[adjustment]\ngain = "fre"\n[noise]', 'adjustment.gain: expected "free", "fixed" or a positive standard uncertainty, got "fre"'),
    ("[noise]", "[adjustment.ppp]\ngain = -1\n[noise]", 'adjustment.ppp.gain: expected "free", "fixed" or a positive standard uncertainty, got -1'),
    # chains
    ("[w X' b Y Z t]", "[w X b Y Z t]", 'machine.chain: chain "[w X b Y Z t]": X comes before b, so it needs a prime'),
    ("[w X' b Y Z t]", "[w X' b Y Y t]", "machine.chain: chain \"[w X' b Y Y t]\": Y is given twice"),
    ("[w X' b Y Z t]", "", 'machine.chain: chain "": brackets'),
    ("[machine.random]", 'errors = "truth.csv"\n[machine.random]', "machine: expected errors or [machine.random], got both"),
    # lines
    ('["ppp", "npp", "pnp", "nnp"]', '["ppp", "pqp", "npp"]', 'plan: line "pqp": expected three of p, n, 0'),
    ('["ppp", "npp", "pnp", "nnp"]', '["ppp", "npp", "ppp"]', 'plan: lines: "ppp" is given twice'),
    ('["p00", "0p0"]', '["p00", "pp0"]', 'plan: scale_lines: expected single-axis lines such as "p00", got "pp0"'),
    ("steps = 50", 'steps = 50\norder = "XYX"', 'plan: order "XYX": expected a permutation of XYZ'),
    ("[misalignment.npp]", "[misalignment.ppn]", "misalignment.ppn: not a line of the plan; did you mean ppp?"),
    ("[noise]", "[adjustment.pp0]\n[noise]", "adjustment.pp0: not a line of the plan; did you mean ppp?"),
    # heads
    ('"ideal"', '"psb"', 'head.layout: expected "ideal", "psd" or "multi_beam", got "psb"'),
    ('"ideal"', '"psd"', 'head.psd_distance_mm: missing; the layout "psd" needs it'),
    ('"ideal"', '"psd"\npsd_distance_mm = -100', "head: head psd_distance: expected"),
    ('"ideal"', '"multi_beam"', 'head.beam_offsets_mm: missing; the layout "multi_beam" needs it'),
    ('"ideal"', '"multi_beam"\nbeam_offsets_mm = [[0, 0], [1, 1], [2, 2]]', "head: head beam_offsets: expected three or more beams that are not on one line"),
    ('"ideal"', '"ideal"\nchannels = [""]', "head.channels: expected a list of names"),
    ('"ideal"', '"ideal"\nmirror_mm = [10, 10]', "head.mirror_mm: too small for this plan: expected at least [19.2, 17.9], got [10.0, 10.0]"),
    # TOML
    ("[noise]", "[noise", "not valid TOML: expected ']' at the end of a table declaration (at line 24, column 7)"),
    ("distance_um = 0.2", "seed = 2", "not valid TOML: cannot overwrite a value (at line 26, column 9)"),
    ("[noise]", "x = " + 5000 * "[", "not valid TOML: nested too deeply"),
    ("x_mm = 800.0", "x_mm = " + 5000 * "1", "not valid TOML: a number has too many digits"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), MALFORMED, ids=[new[:40] or old for old, new, _ in MALFORMED])
def test_malformed_scenario_is_refused_in_one_line_that_names_the_key(old: str, new: str, message: str) -> None:
    said = refusal(changed(old, new))
    assert said.startswith(f"s.toml: {message}")
    assert "\n" not in said


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b" \n\n", "the file is empty"),
        (b"# only words\n", "has no sections"),
        (b"\x7fELF\x00\x01", "expected a text file, got binary data"),
        (GOOD.encode() + b"# \xff\n", ", line 27: expected UTF-8 text"),
        (GOOD.encode()[:100], "not valid TOML"),
    ],
)
def test_unreadable_content_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    file = tmp_path / "s.toml"
    file.write_bytes(content)
    with pytest.raises(sd.InvalidArgument) as error:
        sd.read_scenario(file)
    assert str(error.value).startswith(str(file))
    assert message in str(error.value)


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
        sd.read_scenario(path)


def test_random_map_that_makes_no_sense_is_refused_when_it_is_made() -> None:
    scenario = parse_scenario(changed("seed = 7", "seed = 7\nscrew_amplitude_um = 3"), "s.toml")
    with pytest.raises(sd.InvalidArgument, match=r"s\.toml: machine\.random: .*screw_pitch"):
        scenario.machine()


def test_every_truncation_is_read_or_refused() -> None:
    for end in range(1, len(GOOD)):
        assert "\n" not in refusal(GOOD[:end])


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
values = st.one_of(scalars, st.lists(scalars, max_size=4), st.lists(st.lists(numbers, max_size=3), max_size=4),
                   st.dictionaries(st.sampled_from(["ppp", "p00", "seed", "x"]), scalars, max_size=2))  # fmt: skip


@pytest.mark.slow
@settings(max_examples=300)
@given(path=st.sampled_from(paths_of(tomlkit.parse(GOOD).unwrap())), value=values)
def test_whatever_stands_at_a_key_is_read_or_refused(path: tuple[str, ...], value: Any) -> None:
    content = tomlkit.parse(GOOD).unwrap()
    section = content
    for name in path[:-1]:
        section = section[name]
    section[path[-1]] = value
    said = refusal(tomlkit.dumps(content))
    assert said == "" or said.startswith("s.toml: ")
    assert "\n" not in said
