"""Described heads in scenarios: by name or path, several of them, out of place, in air; what evaluations see of it."""

from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.head.description import find_head
from stepdiag.scenario.description import parse_scenario
from stepdiag.scenario.planned_readings import empty_sheet

PLAIN = SCENARIO.split("[misalignment]")[0]
PERFECT = PLAIN.replace("[machine.random]\nseed = 7\n", "")
PSD = PLAIN.replace('layout = "ideal"', 'description = "beam_and_psd"')
BEAMS = PLAIN.replace('layout = "ideal"', 'description = "three_beams"')

# Everything that only a simulation may know, and then the same scenario without it.
TRUTH = """
verified_share = 1.0
[head.pose_errors.psd]
shift_mm = [0.0, -2.0, 1.5]
[head.pose_errors.window]
rotation_urad = [500.0, 300.0, 0.0]
[misalignment]
reflector_urad = [100.0, 300.0]
laser_urad = [50.0, -20.0]
distance_constant_mm = 0.5
[misalignment.npp]
psd_zero_mm = [0.1, 0.2]
[environment]
temperature_c = 25.0
pressure_hpa = 990.0
[environment.assumed]
temperature_c = 24.0
[noise]
common_um = 0.05
seed = 3
"""
CLOSED = '"psd"\npsd_distance_mm = 31.5'
BLIND = PSD.replace("[machine.random]\nseed = 7\n", "")


def run_of(text: str, path: str | Path = "scenario.toml") -> sd.Measurement:
    return sd.simulate(parse_scenario(text, path))


# --- which head ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "layout", "signals"),
    [(PSD, "psd", ["distance", "spot_x", "spot_y"]), (BEAMS, "multi_beam", ["d1", "d2", "d3"])],
)
def test_shipped_head_is_found_by_its_name(text: str, layout: str, signals: list[str]) -> None:
    head = parse_scenario(text).known.head
    assert (head.layout, head.signals) == (layout, signals)
    assert set(run_of(text).channels) == set(signals)


def test_description_of_ones_own_is_found_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(find_head("three_beams").read_text())
    file = tmp_path / "scenario.toml"
    file.write_text(BEAMS.replace('"three_beams"', '"mine.toml"'))
    ours, theirs = sd.simulate(sd.read_scenario(file)), run_of(BEAMS)
    assert all(ours.channels[name].tobytes() == theirs.channels[name].tobytes() for name in theirs.channels)


def test_named_head_has_what_it_does_not_name_from_head() -> None:
    text = PSD.replace('[head]\ndescription = "beam_and_psd"', HEADS)
    scenario = parse_scenario(text)
    near, far, closed = scenario.known.heads["ppp"], scenario.known.heads["npp"], scenario.known.heads["pnp"]
    assert (near.standoff, far.standoff, closed.standoff) == (150.0, 400.0, 150.0)
    assert near.design.name == far.design.name == "beam and PSD"
    assert closed.design is None
    assert closed.psd_distance == 30.0
    errors = scenario.truth.pose_errors
    assert {place: set(own) for place, own in errors.items()} == {
        "head": {"psd"},
        "head.far": {"psd", "window"},
        "head.closed": set(),
    }


HEADS = """[head]
description = "beam_and_psd"
standoff_mm = 150.0
[head.pose_errors.psd]
shift_mm = [0.0, 0.0, 0.1]
[head.far]
standoff_mm = 400.0
[head.far.pose_errors.window]
rotation_urad = [1.0, 0.0, 0.0]
[head.closed]
layout = "psd"
psd_distance_mm = 30.0
[line.npp]
head = "far"
[line.pnp]
head = "closed"
"""


def test_line_reads_what_its_own_head_reads() -> None:
    mixed = run_of(PSD.replace('[head]\ndescription = "beam_and_psd"', HEADS))
    alone = run_of(PSD.replace('"beam_and_psd"', '"beam_and_psd"\nstandoff_mm = 400.0\n[head.pose_errors]'
                   "\npsd.shift_mm = [0.0, 0.0, 0.1]\nwindow.rotation_urad = [1.0, 0.0, 0.0]"))  # fmt: skip
    rows = np.array(mixed.line) == "npp"
    for name in ("distance", "spot_x", "spot_y"):
        assert mixed.channels[name][rows].tobytes() == alone.channels[name][rows].tobytes()
        assert mixed.channels[name][~rows].tobytes() != alone.channels[name][~rows].tobytes()


# --- what happens to the readings ------------------------------------------------------------------------------------
def test_displaced_sensor_shows_as_its_zero() -> None:
    moved = PSD + "[head.pose_errors.psd]\nshift_mm = [0.0, -2.0, 1.5]\n"
    difference = {name: run_of(moved).channels[name] - run_of(PSD).channels[name] for name in ("spot_x", "spot_y")}
    # The shift is along the sensor's plane; what else there is comes from rounding, 1e-13 of a path of 1 m.
    assert difference["spot_x"] == pytest.approx(1.5, abs=1e-9)
    assert difference["spot_y"] == pytest.approx(2.0, abs=1e-9)


def test_air_that_is_taken_for_another_scales_distances() -> None:
    air = "[environment]\ntemperature_c = 30.0\n"
    true = run_of(BEAMS + air).channels["d1"]
    wrong = run_of(BEAMS + air + "[environment.assumed]\ntemperature_c = 20.0\n").channels["d1"]
    truth = parse_scenario(BEAMS + air + "[environment.assumed]\ntemperature_c = 20.0\n").truth
    ratio = truth.environment.refractive_index(1530.0) / truth.assumed_environment.refractive_index(1530.0)
    assert ratio - 1.0 == pytest.approx(-9.2e-6, abs=0.3e-6)  # -0.94 ppm/K at 20 °C, less in warmer air
    # The glass in the path, 2.5 mm of the distance beyond its length, scales too: 1e-5 of it at most.
    assert wrong == pytest.approx(true * ratio, abs=1e-4)
    assert np.all(wrong < true)


def test_assumed_air_is_as_the_true_one_where_it_says_nothing_else() -> None:
    air = "[environment]\ntemperature_c = 30.0\npressure_hpa = 900.0\n[environment.assumed]\n"

    def ratio(text: str) -> float:
        truth = parse_scenario(BEAMS + text).truth
        return float(truth.assumed_environment.refractive_index(633.0) / truth.environment.refractive_index(633.0))

    assert ratio(air) == 1.0
    # Dry instead of half humid: 1 ppm at 30 °C; the pressure would be 30 ppm.
    assert abs(ratio(air + "humidity_percent = 0\n") - 1.0) < 2e-6
    index = parse_scenario(
        BEAMS + "[environment]\ntemperature_c = 30.0\n[environment.assumed]\nrefractive_index = 1.0\n"
    )
    assert index.truth.assumed_environment.refractive_index(633.0) == 1.0


@pytest.mark.parametrize("text", [PERFECT, PERFECT.replace('"ideal"', CLOSED), PSD, BEAMS])
def test_assumed_air_alone_is_taken_for_air_of_20_degrees(text: str) -> None:
    assumed = "[environment.assumed]\ntemperature_c = 21.0\n"
    scenario = parse_scenario(text + assumed)
    assert scenario.truth.environment is None
    alone, both = run_of(text + assumed), run_of(text + "[environment]\ntemperature_c = 20.0\n" + assumed)
    for name, values in both.channels.items():
        assert alone.channels[name].tobytes() == values.tobytes(), name
    name = next(iter(both.channels))
    right = run_of(text + "[environment]\ntemperature_c = 20.0\n").channels[name]
    # 0.93 ppm/K, of which the windows, up to 5 mm of glass in 100 mm, take 5 %; a true index of 1 would be -268 ppm.
    assert alone.channels[name] / right - 1.0 == pytest.approx(0.92e-6, abs=0.04e-6)


def test_common_noise_is_the_same_for_all_beams_of_a_point() -> None:
    quiet, noisy = run_of(BEAMS), run_of(BEAMS + "[noise]\ncommon_um = 5.0\nseed = 1\n")
    moved = np.array([noisy.channels[name] - quiet.channels[name] for name in ("d1", "d2", "d3")])
    assert np.std(moved[0]) == pytest.approx(5e-3, rel=0.35)  # of some seventy draws: 8 %, four times that
    assert np.ptp(moved, axis=0) == pytest.approx(0.0, abs=1e-12)  # rounding of a distance of 200 mm


def test_constants_are_added_to_the_distances() -> None:
    constants = "[misalignment]\ndistance_constant_mm = 0.5\nbeam_constants_um = [0.0, 10.0, -20.0]\n"
    plain, shifted = run_of(BEAMS), run_of(BEAMS + constants)
    body = np.array([line not in ("p00", "0p0", "00p") for line in plain.line])
    for name, constant in (("d1", 0.5), ("d2", 0.51), ("d3", 0.48)):
        difference = shifted.channels[name] - plain.channels[name]
        assert difference[body] == pytest.approx(constant, abs=1e-12)  # rounding of a distance of 200 mm
        assert difference[~body] == pytest.approx(0.0, abs=0.0)  # scale lines are aligned


def test_coupled_mode_reads_a_tilted_mirror_short_and_the_axis_long() -> None:
    head = 'description = "three_beams"\nreading_model = "{}"'
    change = {}
    for model in ("chief_ray", "coupled_mode"):
        text = PERFECT.replace('layout = "ideal"', head.format(model))
        tilted, straight = (run_of(text + tilt) for tilt in ("[misalignment.p00]\nreflector_urad = [0.0, 300.0]\n", ""))
        rows = np.array(straight.line) == "p00"
        change[model] = (tilted.channels["d1"] - straight.channels["d1"])[rows]
    # The mirror turns about the point that the beam meets, 100 mm and 180 mm away, less what the window shortens.
    second_order = 300e-6**2 * (np.array([100.0, 180.0]) - 5.0 / 3.0)
    # Of fourth order there is nothing; 1e-12 mm is rounding of the distance, 1 % of it the window's own share.
    assert change["chief_ray"] == pytest.approx(second_order, rel=0.01, abs=1e-12)
    assert change["coupled_mode"] == pytest.approx(-0.5 * second_order, rel=0.03, abs=1e-12)


# --- an evaluator sees no truth --------------------------------------------------------------------------------------
@pytest.mark.parametrize("head", ["beam_and_psd", "three_beams"])
@pytest.mark.parametrize("method", ["conventional", "enhanced", "adjustment"])
def test_calibration_has_the_same_bits_when_the_truth_is_deleted(head: str, method: str) -> None:
    truth = TRUTH
    if head == "three_beams":
        truth = truth.replace("pose_errors.psd", "pose_errors.centre").replace("psd_zero_mm = [0.1, 0.2]", "")
        truth = truth.replace("laser_urad", "beam_constants_um = [1.0, 2.0, 3.0]\nlaser_urad")
    # A centre beam 2 mm out of its place is read as tilts of 0.1 rad, which spoils the enhanced evaluation.
    any_machine = "[plausible]\npositioning_um_per_m = 1e6\ntranslation_um = 1e6\nrotation_urad = 1e6\n"
    seeing, blind = (
        parse_scenario(text.replace("beam_and_psd", head) + any_machine)
        for text in (PSD.rstrip() + "\n" + truth, BLIND.rstrip() + "\n")
    )
    run = sd.simulate(seeing)
    assert not any(np.isnan(values).any() for values in run.channels.values())
    one, other = (sd.methods.evaluate_scenario(scenario, run, method=method) for scenario in (seeing, blind))  # type: ignore[arg-type]
    assert one.functions.keys() == other.functions.keys()
    for name in one.functions:
        for mine, theirs in zip(one.functions[name], other.functions[name], strict=True):
            assert mine.tobytes() == theirs.tobytes(), name
    assert one.squareness == other.squareness


# --- distances only --------------------------------------------------------------------------------------------------
NO_TILTS = PLAIN.replace('layout = "ideal"', 'layout = "ideal"\ntilts = false')


@pytest.mark.parametrize("head", ['"ideal"', CLOSED])
def test_run_without_tilts_has_the_distances_of_the_one_with_them(head: str) -> None:
    run, whole = (run_of(text.replace('"ideal"', head)) for text in (NO_TILTS, PLAIN))
    assert run.channels.keys() == {"distance"}
    assert run.channels["distance"].tobytes() == whole.channels["distance"].tobytes()


def test_evaluation_without_tilts_does_not_look_at_those_of_a_run() -> None:
    scenario = parse_scenario(NO_TILTS)
    whole = run_of(PLAIN)
    assert empty_sheet(scenario.known.plan, scenario.known.signals).channels.keys() == {"distance"}
    with pytest.raises(sd.InvalidArgument, match="nothing can be determined"):
        sd.methods.evaluate_scenario(scenario, whole, method="enhanced")
    calibration = sd.methods.evaluate_scenario(scenario, whole, method="conventional")
    assert (
        calibration.functions.keys()
        == sd.methods.evaluate_scenario(parse_scenario(PLAIN), whole, method="conventional").functions.keys()
    )


def test_beams_are_distances_all() -> None:
    with pytest.raises(sd.InvalidArgument, match=r's\.toml: head\.tilts: goes with the layouts "ideal" and "psd"'):
        parse_scenario(BEAMS.replace("[head]", "[head]\ntilts = false"), "s.toml")
