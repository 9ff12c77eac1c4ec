"""[adjustment] and [smoothness]: what they mean in native units, their defaults, and what is refused."""

import math

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.scenario.description import Scenario, adjustment_options, parse_scenario
from stepdiag.setup_quantities import ADJUSTED, SETUP_QUANTITIES
from stepdiag.units import native

PSD = SCENARIO.replace('"ideal"', '"psd"\npsd_distance_mm = 50.0')
BEAMS = SCENARIO.replace('"ideal"', '"multi_beam"\nbeam_offsets_mm = [[0, 0], [20, 0], [0, 20]]')


def adjusted(text: str) -> sd.Adjustment:
    scenario = parse_scenario(text)
    return sd.methods.adjust_scenario(scenario, sd.simulate(scenario))


def priors(text: str, line: str) -> dict[str, float]:
    """Of a line's unknowns, by quantity; one that is fixed is absent."""
    return {e.quantity: e.prior for e in adjusted(text).setup if e.line == line}


# --- units and defaults ----------------------------------------------------------------------------------------------
def test_choices_become_native_units() -> None:
    assert (native("reflector_urad", "free"), native("gain", "fixed")) == ("free", "fixed")
    assert (native("lateral_mm", 2.0), native("gain", 0.5)) == (2.0, 0.5)
    numbers = [native("laser_urad", 500), native("beam_constants_um", 3.0), native("drift_um_per_h", 3.6)]
    assert numbers == pytest.approx([500e-6, 3e-3, 1e-6], rel=1e-15)  # a product of two rounded numbers


def test_every_key_reaches_the_core() -> None:
    stated = [quantity for quantity in ADJUSTED if quantity.name != "beam_constants"]
    numbers = "\n".join(f"{quantity.key} = 0.5" for quantity in stated)
    text = (
        PSD.split("[misalignment]")[0].replace("[plan]", "[plan]\nseconds_per_reading = 1.0")
        + f"[adjustment]\n{numbers}\n"
    )
    assert priors(text, "npp") == pytest.approx({q.name: native(q.key, 0.5) for q in stated}, rel=1e-15)
    assert priors(BEAMS + "[adjustment]\nbeam_constants_um = 7.0\n", "npp")["beam_constants"] == pytest.approx(7e-3)


@pytest.mark.parametrize(
    ("text", "line", "expected"),
    [
        (PSD, "ppp", {"reflector": math.inf, "laser": math.inf, "distance_constant": math.inf, "psd_zero": math.inf,
                      "lateral": 1.0, "roll": 0.02, "gain": 0.01}),
        (BEAMS, "ppp", {"reflector": math.inf, "laser": 0.002, "distance_constant": math.inf,
                        "beam_constants": math.inf, "lateral": 1.0, "roll": 0.02, "gain": 0.01}),
        (BEAMS + '[adjustment]\nbeam_constants_um = "fixed"', "ppp",
         {"reflector": math.inf, "laser": math.inf, "distance_constant": math.inf, "lateral": 1.0, "roll": 0.02,
          "gain": 0.01}),
        (PSD, "p00", {"reflector": math.inf, "distance_constant": math.inf, "psd_zero": math.inf,
                      "lateral": 1.0, "roll": 0.02, "gain": 0.01}),
        (BEAMS, "p00", {"reflector": 500e-6, "distance_constant": math.inf, "beam_constants": math.inf, "lateral": 1.0,
                        "roll": 0.02, "gain": 0.01}),
    ],
)  # fmt: skip
def test_defaults_are_the_documented_ones(text: str, line: str, expected: dict[str, float]) -> None:
    assert priors(text, line) == expected


def test_stated_default_of_scale_lines_is_that_of_the_core() -> None:
    angle = f"{SETUP_QUANTITIES['laser'].scale_line_prior * 1e6}"
    stated = "".join(f"[adjustment.{line}]\nlaser_urad = {angle}\n" for line in ("p00", "0p0", "00p"))
    one, other = (adjusted(text).calibration for text in (SCENARIO, SCENARIO + stated))
    assert one.functions["EXX"][2].tobytes() == other.functions["EXX"][2].tobytes()
    tight = adjusted(SCENARIO + stated.replace(angle, '"fixed"')).calibration
    # The cosine error of 500 µrad over 80 mm is 20 nm, beside 0.1 µm a reading.
    assert tight.functions["EXX"][2][-1] < one.functions["EXX"][2][-1]


def test_table_for_a_line_replaces_only_the_keys_it_names() -> None:
    text = PSD + '[adjustment]\nlateral_mm = 3.0\ngain = "fixed"\n[adjustment.npp]\ngain = 0.5\n'
    assert priors(text, "npp")["gain"] == 0.5
    assert priors(text, "npp")["lateral"] == 3.0
    assert "gain" not in priors(text, "ppp")


# --- what an adjustment is told beside them --------------------------------------------------------------------------
def test_switches_reach_the_core() -> None:
    names = ("one_setup_per_line", "reversal", "rotations", "outlier_probability", "slips", "smoothness")
    usual = adjustment_options(parse_scenario(SCENARIO).known)
    assert [getattr(usual, name) for name in names] == [False, True, True, 1.2e-4, "report", None]
    switches = (
        '[adjustment]\nangles = "fixed"\none_setup_per_line = true\nreversal = false\noutlier_probability = 0.0\n'
        'slips = "estimate"\n'
    )
    scaled = adjustment_options(parse_scenario(SCENARIO + "[adjustment]\nscale_uncertainty = true\n").known)
    assert (usual.scale_uncertainty, scaled.scale_uncertainty) == (False, True)
    other = adjustment_options(parse_scenario(SCENARIO + switches).known)
    assert [getattr(other, name) for name in names] == [True, False, False, 0.0, "estimate", None]


def test_smoothness_becomes_native_units() -> None:
    smooth = parse_scenario(SCENARIO + "[smoothness]\ntranslation_um = 0.5\nrotation_urad = 2.0\n").known.smoothness
    assert smooth is not None
    assert (smooth.translation, smooth.rotation) == pytest.approx((0.5e-3, 2e-6), rel=1e-15)
    assert not smooth.cross_validated
    assert parse_scenario(SCENARIO + "[smoothness]\n").known.smoothness is None
    found = parse_scenario(SCENARIO + "[smoothness]\ncross_validated = true\n").known.smoothness
    assert found is not None
    assert found.cross_validated


def test_machine_without_angles_has_no_angles_in_its_calibration() -> None:
    calibration = adjusted(SCENARIO + '[adjustment]\nangles = "fixed"\n').calibration
    assert not [name for name in calibration.functions if name[1] in "ABC"]
    assert "EXX" in calibration.functions


# --- what is refused -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SCENARIO + '[adjustment]\npsd_zero_mm = "free"', 'adjustment.psd_zero_mm: goes with the layout "psd"; '
         'a head "ideal" has no spot, got "free"'),
        (BEAMS + "[adjustment.npp]\npsd_zero_mm = 2.0", 'adjustment.npp.psd_zero_mm: goes with the layout "psd"'),
        (PSD + "[adjustment]\nbeam_constants_um = 2.0",
         'adjustment.beam_constants_um: goes with the layout "multi_beam"; a head "psd" has no beams'),
        (PSD + '[adjustment.p00]\nlaser_urad = "free"', 'adjustment.p00.laser_urad: expected "fixed" or a positive'),
        (PSD + "[adjustment]\noutlier_probability = 0.6",
         "adjustment.outlier_probability: expected a probability from 0 to 0.5, got 0.6"),
        (PSD + '[adjustment]\nangles = "none"', 'adjustment.angles: expected "free" or "fixed", got "none"'),
        (PSD + "[smoothness]\ntranslation_um = -1",
         "smoothness.translation_um: expected a number of at least 0, got -1"),
        (PSD + '[adjustment]\nreflector = "free"', "adjustment.reflector: unknown key; did you mean reflector_urad?"),
        (PSD + "[adjustment.nnn]\ngain = 1.0", "adjustment.nnn: not a line of the plan"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_by_its_key(text: str, message: str) -> None:
    with pytest.raises(sd.InvalidArgument) as error:
        parse_scenario(text, "s.toml")
    assert str(error.value).startswith(f"s.toml: {message}")


def test_fixed_goes_with_every_head() -> None:
    text = SCENARIO + '[adjustment]\npsd_zero_mm = "fixed"\nbeam_constants_um = "fixed"\n'
    assert isinstance(parse_scenario(text), Scenario)


def test_free_drift_needs_the_time_of_the_readings() -> None:
    text = SCENARIO + '[adjustment]\ndrift_um_per_h = "free"\n'
    with pytest.raises(sd.InvalidArgument, match="time_s"):
        adjusted(text)
    timed = adjusted(text.replace("[plan]", "[plan]\nseconds_per_reading = 10.0"))
    assert {e.quantity for e in timed.setup} >= {"drift"}


# --- several orders --------------------------------------------------------------------------------------------------
ORDERS = SCENARIO.replace("steps = 5", 'steps = 5\norder = ["XYZ", "YZX"]')


def test_runs_of_several_orders_are_simulated_and_evaluated() -> None:
    scenario = parse_scenario(ORDERS.split("[noise]")[0])
    run = sd.simulate(scenario)
    assert sorted(set(run.run.tolist())) == [0, 1]
    second = (run.run == 1) & (np.array(run.line) == "ppp")
    assert run.position[second].tolist() == scenario.known.plan.points("ppp", 1).tolist()
    largest = sd.largest_deviations(sd.methods.evaluate_scenario(scenario, run), scenario.machine().errors)
    # The floor of double precision at distances of half a metre is some 1e-12 mm; scale lines are of two orders too.
    assert abs(largest["positioning"].value) < 1e-10


def test_backward_run_goes_the_way_of_its_forward_run() -> None:
    scenario = parse_scenario(ORDERS.replace("[plan]", "[plan]\nbackward = true"))
    assert scenario.known.plan.orders == ["XYZ", "XYZ", "YZX", "YZX"]
    run = sd.simulate(scenario)
    assert sorted(set(run.run.tolist())) == [0, 1, 2, 3]
    of_line = np.array(run.line) == "ppp"
    there, back = (run.position[of_line & (run.run == number)] for number in (2, 3))
    assert there.tolist() == back[::-1].tolist()
