"""What public types show in a console and in a notebook, and a calibration's parameters by name."""

import inspect
from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from calibrations import CHAIN, PLAN, calibrate, parts_of, simulate
from places import DATA
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.display import LONGEST_LINE, html_table, one_line

READINGS = DATA / "positions" / "stepper_stage.csv"
# Options, verbs, errors and open connections: they are not results.
SHOW_NOTHING = {
    *("AcquireOptions", "AdjustmentOptions", "ExportOptions", "SimulationOptions", "StatisticsOptions"),
    *("SetupPriors", "Settling", "UncertaintyRequest", "KeyTrigger", "SettleTrigger", "TcpTrigger", "Twin"),
    *("BatchEvaluator", "FinishedCells", "FunctionModel", "ModelSource", "RangeModel", "SampleModel", "VirtualReadout"),
    *("InvalidArgument", "LinuxcncError", "LinuxcncSession", "Progress", "ReplayMismatch"),
    "Environment",  # a function of the wavelength
}
RESULTS = [
    name for name in sd.__all__ if inspect.isclass(getattr(sd, name)) and name not in SHOW_NOTHING and name != "Any"
]


@pytest.fixture(scope="module")
def values() -> Mapping[str, Any]:
    scenario = sd.parse_scenario(SCENARIO)
    run = simulate(1)
    a, b = calibrate(1, full_covariance=True), calibrate(2, method="enhanced")
    found = sd.methods.adjust(run, PLAN, sd.Head(), CHAIN, reliability=True)
    comparison = sd.compare(a, b)
    described = sd.optics.shipped_head("beam_and_psd")
    made = [
        *(scenario, scenario.known, scenario.truth, scenario.machine(), scenario.known.plan, scenario.known.head),
        *(run, a, found, found.verdict, *found.setup[:1], *found.reliability[:1], *found.calibration.findings[:1]),
        *(comparison, comparison.differences[0], a.to_error_map(), a.chain),
        *(described, described.bodies[0], described.beams[0], *described.sensors[:1]),
        *(sd._core.volumetric_accuracy(a), sd._core.error_at_point(a, (1, 2, 3)), sd.volume(a, limit=0.02)),
        *(sd.volume_change(comparison), sd.positions.predict_positions(a, *sd.positions.axis_line(a, "X"))),
        *(
            sd.positions.read_positions(READINGS),
            sd.positions.evaluate_positions(sd.positions.read_positions(READINGS)),
        ),
        sd.montecarlo.evaluate_uncertainty(scenario, sd.montecarlo.UncertaintyRequest(samples=10_000)),
        *(sd.Noise(), sd.Misalignment(), sd.montecarlo.Distribution(spread=1.0), sd.methods.ReadingUncertainty()),
    ]
    return {type(value).__name__: value for value in made}


def texts(html: str) -> list[str]:
    """Texts of the cells of a table; fails for HTML that is not well formed."""
    return ["".join(cell.itertext()) for cell in ElementTree.fromstring(html).iter() if cell.tag in ("td", "th")]


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_has_a_table_or_is_a_small_record(name: str) -> None:
    kind = getattr(sd, name)
    assert hasattr(kind, "_repr_html_") or is_dataclass(kind)
    assert kind.__repr__ is not object.__repr__


def test_line_is_short_and_table_is_well_formed_for_every_value(values: Mapping[str, Any]) -> None:
    assert {
        "Adjustment",
        "Calibration",
        "Comparison",
        "ErrorMap",
        "Head",
        "Known",
        "Machine",
        "Measurement",
        "Plan",
    } <= {*values}
    for name, value in values.items():
        line = repr(value)
        assert len(line) <= LONGEST_LINE, line
        assert "\n" not in line
        assert name in line
        assert " object at 0x" not in line
        shown = texts(value._repr_html_())
        assert shown
        assert len(value._repr_html_()) < 10_000


def test_calibration_shows_verdict_volume_and_largest_values(values: Mapping[str, Any]) -> None:
    calibration = values["Calibration"]
    assert f"fit {calibration.fit}" in repr(calibration)
    shown = texts(calibration._repr_html_())
    position, value, _ = calibration.functions["EXX"]
    largest = max(
        (float(np.abs(v).max()), name) for name, (_, v, _) in calibration.functions.items() if name in "EXX EYY EZZ"
    )
    assert any(f"({largest[1]} at" in text and f"{largest[0] * 1e3:.4g}" in text.lstrip("-") for text in shown)
    assert len(position) == len(value)


def test_rejected_calibration_says_so_first(values: Mapping[str, Any]) -> None:
    rejected = values["Calibration"].judged("rejected", ["<b>it was dropped</b>"])
    assert repr(rejected).startswith("<Calibration: fit rejected")
    html = rejected._repr_html_()
    assert "&lt;b&gt;it was dropped" in html
    assert "<b>it" not in html


def test_texts_are_escaped() -> None:
    html = html_table("<T>", [("a & b", '<script>"x"</script>')])
    assert texts(html) == ["a & b", '<script>"x"</script>']
    assert "<script>" not in html


@pytest.mark.parametrize("length", [10, 170, 185, 199, 500])
def test_line_is_cut_at_facts(length: int) -> None:
    line = one_line("T", [("a", "x" * length), ("b", "y")])
    assert len(line) <= LONGEST_LINE
    assert line in (f"<T: a {'x' * length}; b y>", f"<T: a {'x' * length}; ...>", "<T: ...>")


def test_parameter_by_name_gives_its_entries(values: Mapping[str, Any]) -> None:
    calibration = values["Calibration"]
    for name, table in calibration.functions.items():
        for own, expected in zip(calibration[name], table, strict=True):
            np.testing.assert_array_equal(own, expected)
    for name, (angle, u) in calibration.squareness.items():
        assert calibration[name] == (None, angle, u)
        assert calibration[name].value == angle
    assert [*calibration] == [*[n for n in calibration if n[0] == "E"], "C0Y", "B0Z", "A0Z"]
    assert {*calibration} == {*calibration.functions, *calibration.squareness}
    assert "EXX" in calibration
    assert "EXQ" not in calibration


def test_reversal_error_by_name() -> None:
    run = simulate(1, repeats=1, backward=True)
    calibration = sd.methods.evaluate(run, PLAN, sd.Head(), CHAIN)
    assert calibration.reversal
    for name, table in calibration.reversal.items():
        np.testing.assert_array_equal(calibration[f"{name}_reversal"].value, table[1])


def test_unknown_parameter_is_a_key_error_that_names_those_that_there_are() -> None:
    parts = parts_of(calibrate(1))
    del parts["functions"]["EXX"]
    calibration = sd.Calibration(**parts)
    with pytest.raises(KeyError, match=r"no parameter 'EXX' in this calibration; it has EYX, .*C0Y, B0Z, A0Z"):
        calibration["EXX"]
