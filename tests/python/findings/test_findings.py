"""What the readings leave open: records of the core, and the one text that is made of them."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from calibrations import PLAN, TOOL, VOLUME, simulate
from usual import CHAIN, DIAGONALS

import stepdiag as sd
from stepdiag import _core
from stepdiag.findings.error_map import frame_deviation_texts
from stepdiag.findings.undetermined import REASONS, REMEDIES, combination_text, undetermined_text

NO_SCALE_LINES = sd.Plan(VOLUME, DIAGONALS, 5)


def without(run: sd.Measurement, lost: list[bool]) -> sd.Measurement:
    channels = {name: np.where(lost, np.nan, values) for name, values in run.channels.items()}
    return sd.Measurement(run.line, run.point, run.position, channels)


def test_every_reason_and_remedy_has_its_words() -> None:
    assert list(REASONS) == sd.results.Undetermined.reasons()
    assert list(REMEDIES) == sd.results.Undetermined.all_remedies()


@pytest.mark.parametrize(("method", "remedy"), [("adjustment", "axis_line"), ("enhanced", "scale_line")])
def test_open_scales_are_records_with_the_line_that_helps(method: str, remedy: str) -> None:
    run = simulate(1, plan=NO_SCALE_LINES)
    calibration = sd.methods.evaluate(run, NO_SCALE_LINES, sd.Head(), CHAIN, TOOL, method=method)
    found = [(f.part, f.parameters, f.reason, f.remedies, f.line) for f in calibration.findings if f.part == "slope"]
    assert found == [
        ("slope", ["EXX"], "not_seen", [remedy], "p00"),
        ("slope", ["EYY"], "not_seen", [remedy], "0p0"),
        ("slope", ["EZZ"], "not_seen", [remedy], "00p"),
    ]
    assert calibration.undetermined == [undetermined_text(finding) for finding in calibration.findings]
    assert any("scale of Y (EYY): add the" in sentence for sentence in calibration.undetermined)


def test_a_step_that_was_read_on_too_few_lines_is_said_with_its_place() -> None:
    three = sd.Plan(VOLUME, DIAGONALS[:3], 5, scale_lines=PLAN.scale_lines)
    run = simulate(1, plan=three)
    lost = [(line, point) == ("npp", 4) for line, point in zip(run.line, run.point, strict=True)]
    calibration = sd.methods.evaluate(without(run, lost), three, sd.Head(), CHAIN, TOOL, method="conventional")
    finding = next(f for f in calibration.findings if f.step)
    assert (finding.part, finding.reason, finding.remedies) == ("whole", "few_diagonals", ["lost_points"])
    # The second step of npp, which comes from the end of X.
    assert (finding.step, finding.positions) == (4, [48.0, 64.0])
    assert (finding.lines_read, finding.lines_planned) == (2, 3)
    assert undetermined_text(finding).partition(": ")[::2] == (
        ", ".join(finding.parameters),
        "step 4 of X (48 to 64 mm) was read on 2 lines of 3 among the body diagonals; measure the lost points again",
    )


def test_what_nothing_determines_is_refused_in_the_words_of_its_first_finding() -> None:
    run = simulate(1)
    with pytest.raises(sd.InvalidArgument) as refusal:
        sd.methods.evaluate(without(run, list(run.point % 3 != 0)), PLAN, sd.Head(), CHAIN, TOOL, method="conventional")
    assert "conventional evaluation: nothing can be determined. EXX" in str(refusal.value)
    assert "measure the lost points again" in str(refusal.value)


def test_the_mean_of_open_scales_is_known_to_its_uncertainty() -> None:
    found = sd.methods.adjust(simulate(1, plan=NO_SCALE_LINES), NO_SCALE_LINES, sd.Head(), CHAIN, TOOL)
    mean = found.combinations[-1]
    errors = sd.random_error_map(VOLUME, seed=3, intervals=5)
    edges = dict(zip(("EXX", "EYY", "EZZ"), VOLUME, strict=True))
    assert [name for _, name in mean.terms] == list(edges)
    truth = sum(weight * float(errors.function(name, [edges[name]])[0]) / edges[name] for weight, name in mean.terms)
    assert abs(mean.value - truth) < 4.0 * mean.standard_uncertainty
    text = combination_text(mean)
    assert " scale of X + " in text
    assert text.endswith("µm/m")
    assert " ±" in text
    assert combination_text(mean, value=False).partition(", ±")[0] == text.partition(" = ")[0]


def test_files_keep_findings_in_words(tmp_path: Path) -> None:
    calibration = sd.methods.evaluate(simulate(1, plan=NO_SCALE_LINES), NO_SCALE_LINES, sd.Head(), CHAIN, TOOL)
    calibration.write(tmp_path / "open.csv")
    again = sd.read_calibration(tmp_path / "open.csv")
    assert again.undetermined == calibration.undetermined
    assert again.findings == []


def test_where_an_error_map_breaks_the_frame_choice_is_said_in_units_of_reports() -> None:
    errors = sd.ErrorMap({"EYX": ([0.0, 80.0], [1e-3, 2e-3]), "EAX": ([0.0, 80.0], [3e-6, 0.0])})
    assert errors.frame_deviations(VOLUME) == [("EYX", 0.0, 1e-3), ("EYX", 80.0, 2e-3), ("EAX", 0.0, 3e-6)]
    assert [text.partition(",")[0] for text in frame_deviation_texts(errors, VOLUME)] == [
        "EYX is 1 µm at home",
        "EYX is 2 µm at the end of travel",
        "EAX is 3 µrad at home",
    ]


def test_refusal_keeps_its_words_when_it_is_pickled() -> None:
    """As where a worker raises it."""
    run = simulate(1)
    with pytest.raises(sd.InvalidArgument) as refusal:
        sd.methods.evaluate(without(run, list(run.point % 3 != 0)), PLAN, sd.Head(), CHAIN, TOOL, method="conventional")
    again = pickle.loads(pickle.dumps(refusal.value))
    assert type(again) is sd.InvalidArgument
    assert str(again) == str(refusal.value)


def test_core_gives_data_and_takes_no_function_that_words_them() -> None:
    """But for calls with wrong arguments, which are refused before anything is found."""
    assert [name for name in dir(_core) if name.startswith("word_")] == ["word_wrong_arguments_with"]
    bare = _core.adjust(simulate(1, plan=NO_SCALE_LINES), NO_SCALE_LINES, sd.Head(), CHAIN, TOOL)
    assert bare.calibration.undetermined == bare.calibration.fit_reasons == []
    worded = sd.methods.adjust(simulate(1, plan=NO_SCALE_LINES), NO_SCALE_LINES, sd.Head(), CHAIN, TOOL)
    assert worded.calibration.undetermined == [undetermined_text(one) for one in bare.calibration.findings] != []
    assert worded.calibration.fit_codes == bare.calibration.fit_codes
