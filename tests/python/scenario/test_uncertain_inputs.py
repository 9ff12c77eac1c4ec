"""[uncertainty]: what it means in native units, what it leaves certain, and what is refused by its key."""

# ruff: noqa: E501  a table of messages reads best with a case a line

from __future__ import annotations

import math

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag import _core
from stepdiag.config.distribution_keys import WIDTHS
from stepdiag.config.uncertainty_keys import ComponentUncertaintyKeys, SetupUncertaintyKeys, UncertaintySection
from stepdiag.scenario.description import parse_scenario
from stepdiag.scenario.uncertain_inputs import QUANTITIES, kind_of_channel

TIMED = SCENARIO.replace("[plan]", "[plan]\nseconds_per_reading = 2.0")
PSD = TIMED.replace('"ideal"', '"psd"\npsd_distance_mm = 50.0')
BEAMS = TIMED.replace('"ideal"', '"multi_beam"\nbeam_offsets_mm = [[0, 0], [20, 0], [0, 20]]')
WARM = """[temperature]
expansion_um_per_m_k = [11.5, 11.5, 8.0]
u_expansion_um_per_m_k = [1.0, 0.5, 0.0]
u_temperature_c = 0.1
axes_c = [23.0, 22.0, 21.0]
"""
TRACED = TIMED.replace('layout = "ideal"', 'description = "beam_and_psd"')


def uncertain(keys: str, text: str = TIMED) -> _core.UncertainInputs:
    return parse_scenario(f"{text}[uncertainty]\n{keys}\n").known.uncertain


def inputs_of(keys: str, text: str = TIMED) -> list[tuple[str, str, str, int]]:
    return [(one.quantity, one.line, one.part, one.component) for one in uncertain(keys, text).inputs]


# --- meaning ---------------------------------------------------------------------------------------------------------
def test_without_the_section_only_readings_are_uncertain() -> None:
    found = parse_scenario(TIMED).known.uncertain
    assert found.inputs == []
    assert {one.channel: one.distribution.spread for one in found.noise} == pytest.approx(
        {"distance": 1e-4, "alpha": 1e-6, "beta": 1e-6}, rel=1e-15
    )


def test_noise_is_the_section_s_else_that_of_the_simulation_else_the_weight() -> None:
    text = TIMED.replace("[noise]", "[noise]\ntilt_urad = 3.0\ncommon_um = 0.2")
    found = {one.channel or one.quantity: one.distribution.spread for one in uncertain("distance_um = 0.5", text).noise}
    assert found == pytest.approx({"distance": 5e-4, "alpha": 3e-6, "beta": 3e-6, "common": 2e-4}, rel=1e-15)


def test_noise_of_a_channel_takes_the_place_of_that_of_its_kind() -> None:
    found = uncertain("tilt_urad = 2.0\n[uncertainty.channel]\nbeta_urad = 5.0\ndistance_um = 0")
    assert {one.channel: one.distribution.spread for one in found.noise} == pytest.approx(
        {"alpha": 2e-6, "beta": 5e-6}, rel=1e-15
    )


@pytest.mark.parametrize(
    ("channel", "kind"),
    [("distance", "distance"), ("d1", "distance"), ("d12", "distance"), ("alpha", "tilt"), ("beta", "tilt"), ("spot_x", "spot")],
)  # fmt: skip
def test_every_channel_has_a_kind(channel: str, kind: str) -> None:
    assert kind_of_channel(channel) == kind


def test_weights_are_the_standard_uncertainties_of_their_distributions() -> None:
    text = TIMED + '[uncertainty]\ndistance_um = {distribution = "rectangular", half_width = 3.0}\ntilt_urad = 2\n'
    weights = parse_scenario(text).known.uncertainty
    assert weights.distance == pytest.approx(3e-3 / math.sqrt(3.0), rel=1e-15)
    assert weights.tilt == pytest.approx(2e-6, rel=1e-15)


@pytest.mark.parametrize("kind", WIDTHS)
def test_table_becomes_the_distribution_of_its_name(kind: str) -> None:
    more = {"t": "degrees_of_freedom = 5", "curvilinear_trapezoid": "edge = 0.25"}.get(kind, "degrees_of_freedom = 8")
    table = f'{{distribution = "{kind}", {WIDTHS[kind]} = 2.0, expectation = 1, {more}}}'
    (found,) = (one.distribution for one in uncertain(f"wavelength_ppm = {table}").inputs)
    assert found.kind == kind
    assert (found.spread, found.expectation) == pytest.approx((2e-6, 1e-6), rel=1e-15)
    assert found.degrees_of_freedom == {"t": 5.0, "curvilinear_trapezoid": math.inf}.get(kind, 8.0)
    assert found.edge == pytest.approx(0.25e-6 if kind == "curvilinear_trapezoid" else 0.0, rel=1e-15)


def test_set_up_is_uncertain_on_every_line_by_itself_but_not_on_scale_lines() -> None:
    assert inputs_of("reflector_urad = 300.0") == [
        ("reflector", line, "", component) for line in ("ppp", "npp", "pnp", "nnp") for component in (0, 1)
    ]


def test_table_of_a_line_replaces_only_the_keys_it_names() -> None:
    keys = "roll_urad = 100.0\nlaser_urad = 1.0\n[uncertainty.npp]\nroll_urad = 7.0\n[uncertainty.pnp]\nroll_urad = 0"
    found = {one.line: one.distribution.spread for one in uncertain(keys).inputs if one.quantity == "roll"}
    assert found == pytest.approx({"ppp": 1e-4, "npp": 7e-6, "nnp": 1e-4}, rel=1e-15)
    assert sum(one.quantity == "laser" for one in uncertain(keys).inputs) == 8


def test_scale_lines_have_the_scale_and_what_their_own_tables_name() -> None:
    found = inputs_of(
        "scale_um = 0.2\nlaser_urad = 1.0\n[uncertainty.p00]\nlaser_urad = 500\n[uncertainty.ppp]\nscale_ppm = 2"
    )
    assert {line for quantity, line, _, _ in found if quantity == "scale_length"} == {"p00", "0p0", "00p"}
    assert {line for quantity, line, _, _ in found if quantity == "scale_factor"} == {"ppp"}
    assert {line for quantity, line, _, _ in found if quantity == "laser"} == {"ppp", "npp", "pnp", "nnp", "p00"}


def test_each_beam_has_a_constant_and_a_place_of_its_own() -> None:
    found = inputs_of("beam_constants_um = 1.0\nbeam_offsets_um = 2.0", BEAMS)
    assert [component for quantity, line, _, component in found if (quantity, line) == ("beam_constants", "npp")] == [
        0,
        1,
        2,
    ]
    assert [component for quantity, *_, component in found if quantity == "beam_offset"] == list(range(6))


def test_components_of_a_described_head_shift_and_turn() -> None:
    found = uncertain("[uncertainty.head.window]\nshift_um = 10.0\nrotation_urad = 50.0", TRACED).inputs
    assert [(one.quantity, one.part, one.component) for one in found] == [
        (quantity, "window", component) for quantity in ("part_shift", "part_rotation") for component in range(3)
    ]
    assert (found[0].distribution.spread, found[3].distribution.spread) == pytest.approx((1e-2, 5e-5), rel=1e-15)


EVERYTHING = [key for key, quantity in QUANTITIES.items() if quantity.of != "part" and quantity.name != "common"]


@pytest.mark.parametrize("key", EVERYTHING)
def test_every_key_reaches_the_core_in_native_units(key: str) -> None:
    text = BEAMS if "beam" in key else PSD
    if QUANTITIES[key].of == "scale":
        text += WARM
    found = uncertain(f"{key} = 3.6", text)
    ours = [one for one in [*found.inputs, *found.noise] if one.quantity == QUANTITIES[key].name]
    assert ours
    unit = {  # written out, so that a wrong factor is not compared with itself
        "um": 1e-3, "mm": 1.0, "urad": 1e-6, "ppm": 1e-6, "c": 1.0, "hpa": 100.0, "percent": 0.01, "um_per_h": 1e-3 / 3600,
        "um_per_m_k": 1e-6, "c_per_h": 1.0 / 3600, "um_per_sqrt_h": 1e-3 / 60,
    }  # fmt: skip
    ending = next((e for e in sorted(unit, key=len, reverse=True) if key.endswith(f"_{e}")), None)
    assert (ending is None) == (key in ("gain", "reading_model"))
    assert ours[0].distribution.spread == pytest.approx(3.6 * unit.get(ending or "", 1.0), rel=1e-15)


def test_every_key_of_the_models_has_a_use() -> None:
    of = {place: {key for key, quantity in QUANTITIES.items() if quantity.of == place} for place in ("line", "part")}
    noise = {"distance_um", "tilt_urad", "spot_um", "channel"}
    used = QUANTITIES.keys() - of["part"] | noise | {"correlated", "head", "by_line", "between_nodes_um"}
    assert set(UncertaintySection.model_fields) == used
    assert set(SetupUncertaintyKeys.model_fields) == of["line"]
    assert set(ComponentUncertaintyKeys.model_fields) == of["part"]


def test_scales_are_as_uncertain_as_their_section_says_by_axis_or_in_common() -> None:
    of_axes = [(one.name, one.distribution.spread) for one in parse_scenario(TIMED + WARM).known.uncertain.inputs]
    assert of_axes == [
        ("expansion coefficient x", 1e-6),
        ("expansion coefficient y", 0.5e-6),
        ("temperature of the scale x", 0.1),
        ("temperature of the scale y", 0.1),
        ("temperature of the scale z", 0.1),
    ]
    one = "[temperature]\nexpansion_um_per_m_k = 11.5\nu_expansion_um_per_m_k = 1.0\nu_temperature_c = 0.1\n"
    found = parse_scenario(TIMED + one).known.uncertain.inputs
    assert [each.quantity for each in found] == ["common_expansion", "common_scale_temperature"]
    with pytest.raises(sd.InvalidArgument, match=r"uncertainty.scale_temperature_c: goes with \[temperature\]"):
        uncertain("scale_temperature_c = 0.2")


def test_correlated_inputs_are_found_by_their_names() -> None:
    found = uncertain("temperature_c = 0.2\nreflector_urad = 100.0")
    names = [one.name for one in found.inputs]
    chosen = [names[2], names[-1]]
    keys = (
        "temperature_c = 0.2\nreflector_urad = 100.0\n[[uncertainty.correlated]]\n"
        f'inputs = ["{chosen[0]}", "{chosen[1]}"]\ncorrelation = [[1, 0.5], [0.5, 1.0]]'
    )
    ((members, matrix),) = uncertain(keys).correlations
    assert list(members) == [2, len(names) - 1]
    assert np.asarray(matrix).tolist() == [[1.0, 0.5], [0.5, 1.0]]


def test_evaluation_sees_nothing_of_it_but_the_weights() -> None:
    scenario = parse_scenario(TIMED)
    run = sd.simulate(scenario)
    other = parse_scenario(TIMED + "[uncertainty]\nreflector_urad = 300.0\nrepeatability_um = 5.0\n")
    assert sd.simulate(other).channels["distance"].tobytes() == run.channels["distance"].tobytes()
    one, two = (sd.methods.evaluate_scenario(s, run).functions["EXX"] for s in (scenario, other))
    assert [a.tobytes() for a in one] == [a.tobytes() for a in two]


# --- what is refused -------------------------------------------------------------------------------------------------
TABLE = "roll_urad = {distribution = %s}"
REFUSED = [
    (TIMED, "reflektor_urad = 300.0", "reflektor_urad: unknown key; did you mean reflector_urad?"),
    (TIMED, 'reflektor_urad = {distribution = "t"}', "reflektor_urad: unknown key; did you mean reflector_urad?"),
    (TIMED, "reflector_urad = -1.0", "reflector_urad: expected a standard deviation or a distribution, got -1.0"),
    (TIMED, "reflector_urad = [1.0, 2.0]", "reflector_urad: expected a standard deviation or a distribution, got [1.0, 2.0]"),
    (TIMED, "reflector_urad = true", "reflector_urad: expected a standard deviation or a distribution, got true"),
    (TIMED, "reflector_urad = inf", "reflector_urad: expected a standard deviation or a distribution, got inf"),
    (TIMED, "distance_um = 0", "distance_um: expected a positive standard deviation or a distribution, got 0"),
    (TIMED, "roll_urad = {half_width = 3.0}", "roll_urad.distribution: missing; expected one of normal, rectangular,"),
    (TIMED, TABLE % '"rectangle", half_width = 3', 'roll_urad.distribution: no distribution; did you mean rectangular?; got "rectangle"'),
    (TIMED, TABLE % '3', "roll_urad.distribution: no distribution; expected one of normal, rectangular"),
    (TIMED, TABLE % '"rectangular", standard = 3', 'roll_urad.standard: unknown key of the distribution "rectangular"; expected one of half_width'),
    (TIMED, TABLE % '"rectangular", halfwidth = 3', 'roll_urad.halfwidth: unknown key of the distribution "rectangular"; did you mean half_width?'),
    (TIMED, TABLE % '"triangular"', 'roll_urad.half_width: missing; the distribution "triangular" needs it'),
    (TIMED, TABLE % '"normal", standard = -3', "roll_urad.standard: expected a number of at least 0, got -3"),
    (TIMED, TABLE % '"normal", standard = "3"', 'roll_urad.standard: expected a number of at least 0, got "3"'),
    (TIMED, TABLE % '"t", scale = 1.0', 'roll_urad.degrees_of_freedom: missing; the distribution "t" needs it'),
    (TIMED, TABLE % '"t", scale = 1.0, degrees_of_freedom = 2', "roll_urad.degrees_of_freedom: expected a number above 2"),
    (TIMED, TABLE % '"normal", standard = 1.0, degrees_of_freedom = 0', "roll_urad.degrees_of_freedom: expected a number above 0, got 0"),
    (TIMED, TABLE % '"curvilinear_trapezoid", half_width = 1.0, edge = 2.0', "roll_urad.edge: expected a number from 0 to half_width, got 2.0 beside 1.0"),
    (TIMED, "[uncertainty.nnn]\nroll_urad = 1.0", "nnn: not a line of the plan"),
    (TIMED, "[uncertainty.haed]\nwindow = 1", "haed.window: unknown key"),
    (TIMED, "[uncertainty.ppp]\nrole_urad = 1.0", "ppp.role_urad: unknown key; did you mean roll_urad?"),
    (TIMED, "[uncertainty.ppp]\nroll_urad = {distribution = 1}", "ppp.roll_urad.distribution: no distribution; expected one of"),
    (TIMED, "[uncertainty.channel]\nd1_um = 1.0", "channel.d1_um: no channel of the run; did you mean distance_um?"),
    (TIMED, "[uncertainty.channel]\nalpha_um = 1.0", "channel.alpha_um: no channel of the run; did you mean alpha_urad?"),
    (TIMED, '[uncertainty.channel]\nalpha_urad = {distribution = "t", scale = 1.0}', "channel.alpha_urad.degrees_of_freedom: missing"),
    (TIMED, "channel = 3.0", "channel: expected a table of distributions by channel, got 3.0"),
    (TIMED, "psd_zero_mm = 1.0", 'psd_zero_mm: goes with the layout "psd", got "ideal"'),
    (TIMED, "[uncertainty.npp]\npsd_zero_mm = 1.0", 'npp.psd_zero_mm: goes with the layout "psd", got "ideal"'),
    (PSD, "beam_offsets_um = 1.0", 'beam_offsets_um: goes with the layout "multi_beam", got "psd"'),
    (TRACED, "psd_distance_mm = 1.0", "psd_distance_mm: goes with a head by its layout"),
    (TIMED, "[uncertainty.head.window]\nshift_um = 1.0", "head.window: goes with a described head"),
    (TRACED, "[uncertainty.head.windov]\nshift_um = 1.0", "head.windov: no component of the head; did you mean window?"),
    (TRACED, "[uncertainty.head.window]\nshift_mm = 1.0", "head.window.shift_mm: unknown key; did you mean shift_um?"),
    (SCENARIO, "drift_um_per_h = 1.0", "drift_um_per_h: expected plan.seconds_per_reading as well, got none"),
    (SCENARIO, "machine_walk_um_per_sqrt_h = 1.0", "machine_walk_um_per_sqrt_h: expected plan.seconds_per_reading as well"),
    (TIMED, 'head_walk_um_per_sqrt_h = {distribution = "arcsine", half_width = 1}', 'head_walk_um_per_sqrt_h: a random walk is normal, got the distribution "arcsine"'),
    (TIMED.replace('scale_lines = ["p00", "0p0", "00p"]', ""), "scale_um = 1.0", "scale_um: goes with plan.scale_lines, got none"),
    (TIMED + "[environment]\nrefractive_index = 1.0003\n", "pressure_hpa = 1.0", "pressure_hpa: goes with a state of the air"),
    (TIMED, "correlated = 3", "correlated: expected tables such as"),
    (TIMED, '[[uncertainty.correlated]]\ninputs = ["a", "b"]\nmatrix = []', "correlated[0].matrix: unknown key; expected one of inputs, correlation"),
    (TIMED, '[[uncertainty.correlated]]\ninputs = ["a"]\ncorrelation = [[1.0]]', "correlated[0].inputs: expected a list of two or more names"),
    (TIMED, '[[uncertainty.correlated]]\ninputs = ["a", "b"]\ncorrelation = [[1.0, 0.5]]', "correlated[0].correlation: expected 2 rows of 2 numbers"),
    (TIMED, 'pressure_hpa = 1.0\n[[uncertainty.correlated]]\ninputs = ["presure", "x"]\ncorrelation = [[1, 0], [0, 1]]', 'correlated[0].inputs: "presure" is no uncertain input; did you mean pressure?'),
]  # fmt: skip


@pytest.mark.parametrize(("text", "keys", "message"), REFUSED, ids=[keys[:50] for _, keys, _ in REFUSED])
def test_what_makes_no_sense_is_refused_by_its_key(text: str, keys: str, message: str) -> None:
    with pytest.raises(sd.InvalidArgument) as error:
        parse_scenario(f"{text}[uncertainty]\n{keys}\n", "s.toml")
    assert str(error.value).startswith(f"s.toml: uncertainty.{message}")
    assert "\n" not in str(error.value)


def test_correlation_that_is_none_is_refused() -> None:
    keys = (
        "pressure_hpa = 1.0\ntemperature_c = 1.0\n[[uncertainty.correlated]]\n"
        'inputs = ["pressure", "temperature"]\ncorrelation = [[1.0, 0.5], [0.4, 1.0]]'
    )
    with pytest.raises(sd.InvalidArgument, match=r"scenario\.toml: uncertainty: "):
        uncertain(keys)
