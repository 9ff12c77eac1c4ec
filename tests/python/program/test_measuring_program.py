"""The measuring program goes through the plan's points, in its order, from the stated sides."""

import re
from pathlib import Path

import numpy as np
import pytest
from gcode import LETTERS, Trace, trace
from places import EXAMPLES

from stepdiag import InvalidArgument
from stepdiag.cli import main
from stepdiag.planning.measuring_time import measuring_time, times_of
from stepdiag.program.measuring_program import Program, measuring_program
from stepdiag.program.options import Options
from stepdiag.scenario.description import parse_scenario, read_scenario
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import visits_of

SCENARIO = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
tool_mm = [1.0, 2.0, -30.0]
[plan]
lines = {lines}
steps = {steps}
scale_lines = ["p00", "0n0"]
{plan}
[head]
layout = "ideal"
[plan_by_time]
settle_s = 0.5
measure_s = 0.25
"""
BODY, FACES, SINGLE = '["ppp", "npp", "nnp", "ppn"]', '["pp0", "n0p", "0np"]', '["00p", "n00"]'
PLANS = [
    (BODY, ""),
    (FACES, ""),
    (SINGLE, ""),
    (BODY, 'order = "ZXY"'),
    (BODY, 'order = ["XYZ", "YZX"]\nbackward = true'),
    (FACES, "backward = true\nrepeats = 2"),
    (BODY, "repeats = 3"),
    (BODY, "check_points = 3"),
    (BODY, 'scale_points = "steps"\nbackward = true'),
    (BODY, "block = 3\nbackward = true"),
    (FACES, "check_points = 2\ncheck_point = 1\nbackward = true"),
]
CASES = pytest.mark.parametrize(("lines", "plan"), PLANS)


def scenario_of(lines: str = BODY, plan: str = "", steps: int = 7) -> Known:
    return parse_scenario(SCENARIO.format(lines=lines, plan=plan, steps=steps)).known


def assert_is_the_plan(program: Program, traced: Trace, scenario: Known, origin: object, atol: float) -> None:
    visits = list(visits_of(scenario))
    expected = np.concatenate([visit.positions for visit in visits]) + np.asarray(origin)
    np.testing.assert_allclose([position for _, position in traced.readings], expected, rtol=0.0, atol=atol)
    assert program.readings == len(expected)


@CASES
def test_a_linuxcnc_program_reads_the_plans_points_in_order(lines: str, plan: str) -> None:
    scenario = scenario_of(lines, plan)
    program = measuring_program(scenario, Options())
    traced = trace(program.text, iso=False)
    # Half of the last of six decimals.
    assert_is_the_plan(program, traced, scenario, (0.0, 0.0, 0.0), 0.51e-6)
    numbers = [(visit.number, int(point)) for visit in visits_of(scenario) for point in visit.points]
    assert [name for name, _ in traced.readings] == numbers


@CASES
def test_an_iso_program_has_words_of_iso_6983_only_and_the_same_points(lines: str, plan: str) -> None:
    scenario, origin = scenario_of(lines, plan), (-10.0, 20.5, -500.0)
    program = measuring_program(scenario, Options(dialect="iso", origin=origin, line_numbers=True))
    traced = trace(program.text, iso=True, readings_by="G4")
    assert_is_the_plan(program, traced, scenario, origin, 0.51e-4)
    coded = measuring_program(scenario, Options(dialect="iso", origin=origin, trigger_code="M80"))
    again = trace(coded.text, iso=True, readings_by="M80", letters=LETTERS - {"N"})
    assert_is_the_plan(coded, again, scenario, origin, 0.51e-4)


SIEMENS = re.compile(
    r"; .*|MSG\(\"[^\"]*\"\)|MSG\(\)|M0|M5|M9|M30|M80|G54|F[\d.]+|G710 G90 G94 G17 G40 D0 G60 G601|G4 F[\d.]+"
    r"|G[01](?: [XYZ]-?\d+\.\d+)+|"
)
KLARTEXT = re.compile(
    r"; .*|STOP|M5|M9|M30|M80|CYCL DEF 9\.0 DWELL TIME|CYCL DEF 9\.1 DWELL [\d.]+|(?:BEGIN|END) PGM STEPDIAG MM"
    r"|L(?: [XYZ][+-]\d+\.\d+)+ R0 (?:FMAX|F\d+\.\d+)(?: M91)?"
)


@pytest.mark.parametrize("code", ["", "M80"])
@pytest.mark.parametrize("dialect", ["siemens", "heidenhain"])
@CASES
def test_other_dialects_read_the_same_points(lines: str, plan: str, dialect: str, code: str) -> None:
    """Every block is of a form that the language has; a reading is a dwell after a move at feed, or the code."""
    scenario, origin = scenario_of(lines, plan), (-10.0, 20.5, -500.0)
    program = measuring_program(scenario, Options(dialect=dialect, origin=origin, trigger_code=code))  # type: ignore[arg-type]
    form = SIEMENS if dialect == "siemens" else KLARTEXT
    place, readings, stops = np.zeros(3), [], 0
    blocks = program.text.splitlines()
    assert "%" not in program.text
    for number, block in enumerate(blocks):
        if dialect == "heidenhain":
            counted, _, block = block.partition(" ")
            assert counted == str(number)
        assert form.fullmatch(block), block
        moves = re.findall(r"([XYZ])([+-]?\d+\.\d+)", block) if block[0:1] in ("G", "L") else []
        for axis, value in moves:
            place["XYZ".index(axis)] = float(value)
        stops += block in ("M0", "STOP")
        if (code and block == code) or (not code and block.startswith(("G4 F", "CYCL DEF 9.1 DWELL"))):
            readings.append(place.copy())
            if not code:
                assert float(re.split(r"F|DWELL ", block)[-1]) == 0.75
    expected = np.concatenate([visit.positions for visit in visits_of(scenario)]) + np.asarray(origin)
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=0.51e-4)
    assert stops == 2 * len({visit.set_up for visit in visits_of(scenario)})
    last = "M30" if dialect == "siemens" else f"{len(blocks) - 1} END PGM STEPDIAG MM"
    assert blocks[-1] == last


def test_machine_coordinates_of_other_dialects() -> None:
    scenario = scenario_of()
    siemens = measuring_program(scenario, Options(dialect="siemens", coordinates="G53")).text
    assert all(line.startswith("G53 ") for line in siemens.splitlines() if " X" in line and not line.startswith(";"))
    klartext = measuring_program(scenario, Options(dialect="heidenhain", coordinates="G53")).text
    assert all(line.endswith(" M91") for line in klartext.splitlines() if " L " in line)
    for dialect, coordinates in (("siemens", "G58"), ("heidenhain", "G55")):
        with pytest.raises(InvalidArgument, match=f"coordinates: expected .* in {dialect}, got {coordinates}"):
            measuring_program(scenario, Options(dialect=dialect, coordinates=coordinates))  # type: ignore[arg-type]


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "siemens", "heidenhain"])
def test_program_may_be_written_again(dialect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.toml").write_text(SCENARIO.format(lines=BODY, plan="", steps=2))
    for _ in range(2):
        assert main(["nc", "a.toml", "-o", "a.txt", "--dialect", dialect]) == 0


@CASES
def test_every_axis_comes_to_every_point_from_the_side_that_the_visit_says(lines: str, plan: str) -> None:
    scenario = scenario_of(lines, plan)
    traced = trace(measuring_program(scenario, Options()).text, iso=False)
    expected = [visit.approach for visit in visits_of(scenario) for _ in visit.points]
    np.testing.assert_array_equal(traced.came, expected)


@CASES
def test_rapids_move_one_axis_at_a_time_within_the_volume(lines: str, plan: str) -> None:
    scenario = scenario_of(lines, plan)
    traced = trace(measuring_program(scenario, Options()).text, iso=False)
    for start, end in traced.rapids[3:]:  # the first three come from wherever the axes were
        assert np.count_nonzero(start != end) <= 1
        assert np.all(end >= 0.0)
        assert np.all(end <= scenario.plan.volume)
    ways = np.array(traced.ways[3:])
    assert ways.min() >= -1.0
    assert np.all(ways.max(axis=0) <= scenario.plan.volume + 1.0)


def test_there_are_two_stops_for_a_set_up_or_one_without_alignment() -> None:
    scenario = scenario_of(BODY, "repeats = 2\nbackward = true")
    assert trace(measuring_program(scenario, Options()).text, iso=False).stops == 2 * 6
    traced = trace(measuring_program(scenario, Options(align=False)).text, iso=False)
    assert traced.stops == 6
    stops = [message for message in traced.messages if message.startswith("MSG, set-up")]
    assert stops[1] == "MSG, set-up 2 of 6: head and mirror for line npp, then cycle start"


def test_the_head_is_where_the_conventions_put_the_beams_origin() -> None:
    scenario = scenario_of('["npp"]')
    text = measuring_program(scenario, Options(origin=(5.0, 0.0, 0.0))).text
    match = re.search(r"\(beam from (\S+) (\S+) (\S+),", text)
    assert match
    first = np.array([800.0 + 5.0 + 1.0, 2.0, -30.0])
    towards = np.array([-800.0, 600.0, 500.0]) / np.sqrt(800.0**2 + 600.0**2 + 500.0**2)
    np.testing.assert_allclose([float(value) for value in match.groups()], first - 100.0 * towards, atol=0.51e-3)


def test_travel_that_ends_at_the_volume_is_kept_and_every_point_not_approached_as_said_is_named() -> None:
    scenario = scenario_of('["ppp"]')
    program = measuring_program(scenario, Options(limits=(0.0, 800.0, -0.25, 601.0, -5.0, 505.0)))
    ways = np.array(trace(program.text, iso=False).ways)
    assert np.all(np.nanmin(ways, axis=0) == (0.0, -0.25, -1.0))
    # From the safe position, 400 300 500; Y waits one step, and X comes back for the scale lines.
    assert program.unapproached == [
        "visit 1, line ppp: X comes to point 0 from above; Y comes to points 0 to 1 from below by 0.25 mm only",
        "visit 2, line p00: X comes to point 0 from above; Y comes to points 0 to 1 from below by 0.25 mm only",
        "visit 3, line 0n0: X comes to points 0 to 1 from above",
    ]
    assert f"({program.unapproached[0][:60]}" in program.text
    assert not measuring_program(scenario, Options(limits=(-1.0, 801.0, -1.0, 601.0, -1.0, 501.0))).unapproached


def named_of(program: Program) -> dict[tuple[int, str, int], str]:
    """What the texts say: by visit, axis and point."""
    named = {}
    for text in program.unapproached:
        visit, parts = re.fullmatch(r"visit (\d+), line ...: (.*)", text).groups()  # type: ignore[union-attr]
        for part in parts.split("; "):
            axis, ranges, how = re.fullmatch(r"([XYZ]) comes to points? ([\d ,to]*\d) (from .*)", part).groups()  # type: ignore[union-attr]
            for one in ranges.split(", "):
                first, last = map(int, (one.split(" to ") * 2)[:2])
                way = 1 if last >= first else -1
                named |= {(int(visit), axis, point): how for point in range(first, last + way, way)}
    return named


@CASES
@pytest.mark.parametrize(
    "options", [Options(overrun=0.0), Options(limits=(0.0, 800.0, 0.0, 600.0, 0.0, 500.0), safe=(0.0, 300.0, 500.0))]
)
def test_the_points_named_are_those_that_a_trace_of_the_program_finds(lines: str, plan: str, options: Options) -> None:
    scenario = scenario_of(lines, plan)
    program = measuring_program(scenario, options)
    traced = trace(program.text, iso=False)
    named = named_of(program)
    for visit in visits_of(scenario):
        for point in visit.points:
            came = traced.came[[name for name, _ in traced.readings].index((visit.number, int(point)))]
            for axis, name in enumerate("XYZ"):
                said = named.pop((visit.number, name, int(point)), "")
                if came[axis] == 0.0:
                    assert said == "from where it stood before the program"
                elif came[axis] != visit.approach[axis]:
                    assert said == ("from below" if came[axis] > 0.0 else "from above")
                else:
                    assert said == ""
    assert not named
    assert program.unapproached
    for text in program.unapproached:
        assert text.split(": ")[1][:30] in re.sub(r"\)\n\(\.\.\. ", " ", program.text).split("\nG21")[1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (Options(limits=(0.0, 799.0, -1.0, 601.0, -1.0, 501.0)), "line ppp: X 800 is out of its limits, 0 to 799 mm"),
        (Options(limits=(5.0, 5.0, -1.0, 601.0, -1.0, 501.0)), "limits of X: expected the lower one first"),
        (Options(safe=(0.0, 0.0, 900.0), limits=(-1, 801, -1, 601, -1, 501)), "the safe position: Z 900 is out"),
        (Options(retreat="XXY"), "retreat: expected a permutation of XYZ"),
        (Options(overrun=-1.0), "overrun: expected a length of at least 0, got -1"),
        (Options(overrun=float("nan")), "overrun: expected a length of at least 0, got nan"),
        (Options(origin=(0.0, float("inf"), 0.0)), "origin: expected finite"),
        (Options(timeout=0.0), "timeout: expected a time above 0"),
        (Options(decimals=2), "decimals: expected 3 to 12"),
        (Options(coordinates="G60"), "coordinates: expected one of G53"),
        (Options(dialect="iso", trigger="handshake"), "trigger: handshake is LinuxCNC's"),
        (Options(trigger="dwell", trigger_code="M80"), "trigger: expected dwell or the code M80, got both"),
        (Options(trigger_code="80"), "trigger code: expected an M-code such as M80"),
        (Options(dwell_word="X"), "dwell word: expected P, or in the dialect iso"),
    ],
)
def test_options_that_make_no_program_are_refused(options: Options, message: str) -> None:
    with pytest.raises(InvalidArgument, match=re.escape(message)):
        measuring_program(scenario_of(), options)


def test_the_time_is_that_of_the_plan_with_the_ways_to_the_safe_position() -> None:
    scenario = scenario_of()
    program = measuring_program(scenario, Options())
    times = times_of(scenario.keys.plan_by_time, "")
    bare, _ = measuring_time(scenario.plan, times)
    # At most the diagonal three axes one by one, there and back, for each of the six set-ups, at 100 mm/s.
    assert bare - 6 * 12.0 < program.seconds < bare + 6 * 2 * 20.0
    assert program.set_up_seconds == 6 * 180.0


@pytest.mark.parametrize(
    ("word", "expected"), [("P", "G4 P0.5"), ("X", "G4 X0.5"), ("F", "G4 F0.5"), ("PMS", "G4 P500")]
)
def test_dwells_are_written_as_the_controller_takes_them(word: str, expected: str) -> None:
    options = Options(dialect="iso", trigger_code="M80", dwell_word=word)  # type: ignore[arg-type]
    assert f"\n{expected}\nM80\nG4 " in measuring_program(scenario_of(), options).text


def test_pulses_are_on_output_0_between_settling_and_reading() -> None:
    program = measuring_program(scenario_of(), Options(trigger="pulse"))
    assert "G4 P0.5\nM64 P0\nG4 P0.05\nM65 P0\nG4 P0.25\n" in program.text
    assert len(trace(program.text, iso=False, readings_by="M64").readings) == program.readings


def test_the_command_writes_the_program_and_tells_its_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, output = tmp_path / "scenario.toml", tmp_path / "run.ngc"
    path.write_text(SCENARIO.format(lines='["ppp"]', plan="", steps=3))
    assert main(["nc", str(path), "-o", str(output), "--limits", *["0", "800", "-1", "601", "-1", "501"]]) == 0
    out, err = capsys.readouterr()
    assert "14 readings, about" in out
    assert "positions are rounded, by up to 0.33 nm" in out
    assert "warning: visit 1, line ppp: X comes to point 0 from above\n" in err
    assert (
        output.read_text()
        == measuring_program(
            parse_scenario(path.read_text(), path).known, Options(limits=(0.0, 800.0, -1.0, 601.0, -1.0, 501.0))
        ).text
    )
    assert main(["nc", str(path), "-o", str(path)]) == 2
    assert main(["nc", str(path), "-o", str(output), "--trigger", "handshake", "--dialect", "iso"]) == 2


def test_a_file_name_cannot_leave_its_comment() -> None:
    name = "a)b(py,%\n" + "x" * 60 + " py,import os " + "y" * 60 + "µ.toml"
    scenario = parse_scenario(SCENARIO.format(lines='["ppp"]', plan="", steps=2), name).known
    program = measuring_program(scenario, Options())
    assert len(trace(program.text, iso=False).readings) == program.readings
    head = program.text.split("\nG21")[0].splitlines()
    assert all(line[0] == "(" and line[-1] == ")" and line.isascii() for line in head)
    assert not any(line.lower().startswith(("(py", "(msg", "(debug")) for line in head)
    iso = measuring_program(scenario, Options(dialect="iso")).text
    assert iso.count("%") == 2


def test_program_for_heads_that_stay_installed_never_stops() -> None:
    known = read_scenario(EXAMPLES / "scenario.toml").known
    program = measuring_program(known, Options(stops=False))
    blocks = program.text.splitlines()
    assert not [block for block in blocks if block in ("M0", "M1")]  # the handshake's own is where nobody answers
    assert program.set_up_seconds == 0.0
    stopping = measuring_program(known, Options())
    assert program.readings == stopping.readings
    assert program.seconds == pytest.approx(stopping.seconds - stopping.set_up_seconds)
    assert len([block for block in blocks if block.startswith("G53 G1")]) == len(
        [block for block in stopping.text.splitlines() if block.startswith("G53 G1")]
    )
