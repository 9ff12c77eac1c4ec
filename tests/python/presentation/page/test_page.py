"""The report as a page: one file, its values those of the calibration, everything of files escaped."""

import importlib.util
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mistaken import changed
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag._core import InvalidArgument
from stepdiag.cli import main
from stepdiag.io.file_kind import kind_of_file
from stepdiag.presentation.page.contents import ReportRequest
from stepdiag.presentation.page.document import report_page
from stepdiag.presentation.page.html import Markup, element, table
from stepdiag.presentation.page.numbers import shown, with_interval

VOID = {"meta", "img", "input", "br", "hr", "link"}


class Page(HTMLParser):
    """Elements of a page in their order, with attributes and text; open elements must be closed in their order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.scripts: dict[str, str] = {}
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts[self.elements[-1][1].get("id") or ""] = data
        elif self.open and self.open[-1] not in ("style",):
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]

    def values(self) -> Any:
        return json.loads(self.scripts["stepdiag-values"])


def page_of(**request: Any) -> Page:
    return Page(report_page(ReportRequest(**request), Path("report.html"))[0])


@pytest.fixture
def evaluated(here: Path) -> Path:
    """The folder of a scenario and its run, with the calibration in both formats."""
    for name in ("calibration.nc", "calibration.csv"):
        assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 0
    return here


def test_command_writes_one_page_of_at_most_six_megabytes(evaluated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "calibration.nc", "-o", "report.html"]) == 0
    text = Path("report.html").read_text()
    assert kind_of_file(Path("report.html")) == "report page"
    assert len(text.encode()) <= 6_000_000
    assert capsys.readouterr().out.startswith("fit: ")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    assert policy[1].startswith("default-src &#x27;none&#x27;;")
    assert "connect-src" not in policy[1], "nothing loosens the default"
    assert "unsafe-eval" not in policy[1]
    page = Page(text)
    for tag, attributes in page.elements:
        for name in ("src", "href"):
            if name in attributes:
                assert re.match("#|data:", attributes[name] or ""), (tag, attributes)


def test_values_on_the_page_are_those_of_the_file_bit_by_bit(evaluated: Path) -> None:
    calibration = sd.read_calibration("calibration.nc")
    said = page_of(calibration=Path("calibration.nc")).values()
    found = {one["parameter"]: one for one in said["calibration"]["functions"]}
    assert found.keys() == calibration.functions.keys()
    for name, (position, value, u) in calibration.functions.items():
        said_value = found[name]["value"]
        power = {"um": 3, "urad": 6}[said_value["unit"]]
        native = [[float(f"{one!r}e-{power}") for one in said_value[key]] for key in ("value", "standard_uncertainty")]
        # The decimal point is moved in the text of the number: back it gives the same number but for one rounding.
        np.testing.assert_allclose(native[0], value, rtol=3e-16, atol=0.0)
        np.testing.assert_allclose(native[1], u, rtol=3e-16, atol=0.0)
        assert found[name]["position"]["value"] == position.tolist()
    assert said["fit"]["verdict"] == calibration.fit


def test_curves_are_drawn_with_the_values_of_the_file(evaluated: Path) -> None:
    calibration = sd.read_calibration("calibration.nc")
    drawn = json.loads(page_of(calibration=Path("calibration.nc")).scripts["stepdiag-figures"])["figures"]
    for name, (position, value, u) in calibration.functions.items():
        factor = sd.in_report_units(sd.kind_of(name), 1.0)
        low, high, curve = drawn[f"figure-{name}"]["data"]
        assert curve["x"] == position.tolist()
        # Drawings are rounded to 0.1 nm or 0.1 nrad. 1.96: half of a 95 % interval of a normal distribution.
        np.testing.assert_allclose(curve["y"], factor * value, rtol=0.0, atol=5.1e-5)
        np.testing.assert_allclose(high["y"], factor * (value + 1.959963984540054 * u), rtol=0.0, atol=5.1e-5)
        np.testing.assert_allclose(low["y"], factor * (value - 1.959963984540054 * u), rtol=0.0, atol=5.1e-5)


def test_drawings_are_those_that_plotly_knows(evaluated: Path) -> None:
    """Plotly's own check of every key and value."""
    import plotly.graph_objects as go

    content = json.loads(page_of(calibration=Path("calibration.nc")).scripts["stepdiag-figures"])
    assert len(content["figures"]) == 21, "18 functions and three channels"
    for drawing in content["figures"].values():
        go.Figure(data=drawing["data"], layout={**content["layout"], **drawing["layout"]})


def test_curves_and_volume_say_for_which_temperature_they_are(evaluated: Path) -> None:
    lines = Path("calibration.csv").read_text().splitlines(keepends=True)
    Path("found.csv").write_text("".join([lines[0], "# temperature_as_found_c=23.1 23.0 22.8\n", *lines[1:]]))
    Path("referred.csv").write_text("".join([lines[0], "# temperature_reference_c=20.0\n", *lines[1:]]))
    page = page_of(calibration=Path("referred.csv"), before=Path("found.csv"))
    assert "Positioning errors: referred to 20 °C; before: as found at X 23.1, Y 23.0, Z 22.8 °C." in page.text
    assert "Temperature Positioning errors are referred to 20 °C." in page.text
    assert page.values()["volume"]["temperature_reference"]["value"] == 20.0
    assert page_of(calibration=Path("calibration.csv")).text.count("Temperature No temperature was recorded") == 1


def test_temperatures_are_those_of_the_run(here: Path) -> None:
    header, *rows = Path("run.csv").read_text().splitlines()
    temperature = [f"{20.0 + 0.25 * k}" for k in range(len(rows))]
    temperature[3] = ""  # a lost reading
    lines = [f"{header},temperature_c", *(f"{row},{t}" for row, t in zip(rows, temperature, strict=True))]
    Path("warm.csv").write_text("\n".join(lines) + "\n")
    assert main(["evaluate", "scenario.toml", "warm.csv", "-o", "warm.nc"]) == 0
    page = page_of(calibration=Path("warm.nc"), run=Path("warm.csv"))
    (trace,) = json.loads(page.scripts["stepdiag-figures"])["figures"]["figure-temperatures"]["data"]
    assert trace["y"] == [float(t) if t else None for t in temperature]
    assert trace["x"] == list(range(1, len(rows) + 1))
    known = [float(t) for t in temperature if t]
    figures = [f"{f(known):.2f} °C" for f in (np.mean, np.min, np.max)]
    assert " ".join(["temperature", *figures]) in page.text.replace("\u00a0", " ")
    without = page_of(calibration=Path("warm.nc"))
    assert "No run was given with this report (--run), so its temperatures are not shown." in without.text


def test_both_directions_of_approach_are_drawn_and_told(here: Path) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace("steps = 5", "steps = 5\nbackward = true"))
    assert main(["simulate", "scenario.toml", "-o", "both.csv"]) == 0
    assert main(["evaluate", "scenario.toml", "both.csv", "-o", "both.nc"]) == 0
    calibration, page = sd.read_calibration("both.nc"), page_of(calibration=Path("both.nc"))
    assert "approached in − direction" in {word.strip() for word in page.words}, "the legend"
    drawn = json.loads(page.scripts["stepdiag-figures"])["figures"]
    for name, (position, value, _) in calibration.negative_functions.items():
        (trace,) = [trace for trace in drawn[f"figure-{name}"]["data"] if trace["name"] == "− direction"]
        assert trace["x"] == position.tolist()
        factor = sd.in_report_units(sd.kind_of(name), 1.0)
        np.testing.assert_allclose(trace["y"], factor * value, rtol=0.0, atol=5.1e-5)  # rounded to 0.1 nm
    found = sd.volume(calibration)
    if calibration.undetermined_reversal_constants:
        assert "Not known, as not all reversal errors are." in page.text
    else:
        largest = f"{1e3 * max(found.other_approaches.values()):.4g}"
        assert re.search(rf"Approached in X[+-] Y[+-] Z[+-], the largest error is {largest} µm", page.text)
    assert page.values()["volume"]["other_approaches"].keys() == found.other_approaches.keys()


def test_page_can_be_read_without_seeing_it(evaluated: Path) -> None:
    page = page_of(calibration=Path("calibration.nc"))
    assert page.all("html")[0]["lang"] == "en"
    assert [tag for tag, _ in page.elements if tag in ("header", "main", "nav", "footer")] == [
        "header",
        "nav",
        "main",
        "footer",
    ]
    first_link = page.all("a")[0]
    assert first_link["href"] == "#verdict"
    identifiers = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(identifiers) == len(set(identifiers))
    for _, attributes in page.elements:
        for reference in ("aria-labelledby", "aria-describedby", "for"):
            if attributes.get(reference):
                assert attributes[reference] in identifiers
    for attributes in [*page.all("div"), *page.all("svg")]:
        if attributes.get("role") == "img":
            assert len(attributes["aria-label"] or "") > 10
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert all(attributes.get("scope") in ("col", "row") for attributes in page.all("th"))
    assert len(page.all("table")) == len(page.all("caption"))
    labels = {attributes.get("for") for attributes in page.all("label")}
    assert all(one["id"] in labels for one in page.all("input") if one["type"] == "range")


@pytest.mark.parametrize("fit", ["rejected", "doubtful", "unchecked", "accepted"])
def test_verdict_is_the_first_thing_that_is_said(fit: str, evaluated: Path) -> None:
    calibration = sd.read_calibration("calibration.nc")
    calibration.judged(fit, ["the <first> reason", "the second reason"]).write("judged.csv")
    page = page_of(calibration=Path("judged.csv"))
    (section,) = [attributes for attributes in page.all("section") if attributes.get("id") == "verdict"]
    assert section["class"] == f"verdict {fit}"
    first = page.text.index("Calibration valid" if fit == "accepted" else f"Calibration {fit.upper()}")
    assert first < page.text.index("Summary")
    assert page.text.index("the <first> reason") < page.text.index("Summary")
    if fit == "rejected":
        assert page.text.startswith("Calibration REJECTED: do not use it"), "the title"
        assert "the figures below are not to be used" in page.text


@pytest.mark.parametrize(
    ("fit", "is_valid", "of_machine"),
    [
        ("accepted", "Yes.", "Not within 1 µm. The largest error is above"),
        ("doubtful", "Doubtful.", "Not within 1 µm. The largest error is above"),
        ("unchecked", "Unchecked.", "Not within 1 µm. The largest error is above"),
        ("rejected", "No.", "No verdict on the limit of 1 µm."),
    ],
)
def test_calibration_and_machine_are_asked_about_by_name(
    fit: str, is_valid: str, of_machine: str, evaluated: Path
) -> None:
    """An answer about the readings is none about the machine, and rests on it."""
    sd.read_calibration("calibration.nc").judged(fit, ["x"]).write("judged.nc")
    text = page_of(calibration=Path("judged.nc"), limit=0.001).text
    assert f"The machine Is the machine within 1 µm? {of_machine}" in text
    assert (f"The calibration is {fit}: do not rely on this answer." in text) == (fit == "doubtful")
    assert f"The calibration Is this calibration valid? {is_valid}" in text
    assert ("This does not say how accurate the machine is." in text) == (fit == "accepted")
    without = page_of(calibration=Path("judged.nc")).text
    assert "Is the machine within its limit? Not asked: the report was made without a limit." in without


def test_unverified_calibration_is_not_called_valid(evaluated: Path) -> None:
    sd.read_calibration("calibration.nc").judged("accepted", []).write("sound.csv")
    lines = Path("sound.csv").read_text().splitlines(keepends=True)
    Path("old.csv").write_text("".join(line for line in lines if "sha256=" not in line or "_sha256" in line))
    page = page_of(calibration=Path("old.csv"))
    assert page.text.startswith("Calibration UNVERIFIED: its values may have been changed")
    assert "Calibration valid" not in page.text
    assert "Is this calibration valid? Not known. The readings agree" in page.text


@pytest.mark.slow
@pytest.mark.parametrize("fit", ["accepted", "doubtful", "unchecked", "rejected"])
def test_what_is_not_valid_is_stamped_on_screen_and_on_paper(fit: str, evaluated: Path) -> None:
    sd.read_calibration("calibration.nc").judged(fit, ["x"]).write("judged.nc")
    text = report_page(ReportRequest(calibration=Path("judged.nc")), Path("report.html"))[0]
    is_valid = fit == "accepted"
    assert (f'<p class="stamp {fit}"' in text) != is_valid
    assert (f"@top-center {{ content: 'Calibration {fit.upper()}: " in text) != is_valid
    sd.read_calibration("calibration.nc").judged("accepted", []).write("sound.nc")
    earlier = ReportRequest(calibration=Path("sound.nc"), before=Path("judged.nc"))
    said = f"@top-center {{ content: 'The earlier calibration is {fit.upper()}: "
    assert (said in report_page(earlier, Path("report.html"))[0]) != is_valid


def test_mistake_is_said_beside_the_verdict(here: Path) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace("seed = 3", "tilt_urad = 1.0\nseed = 3"))
    run = sd.simulate(sd.read_scenario("scenario.toml"))
    changed(run, {name: -run.channels[name] for name in ("alpha", "beta")}).write("run.csv")
    for name in ("calibration.nc", "calibration.csv"):
        assert main(["evaluate", "scenario.toml", "run.csv", "-o", name]) == 3
        page = page_of(calibration=Path(name), scenario=Path("scenario.toml"), run=Path("run.csv"))
        said = page.text.index("mistake explains the readings: the head is turned by 180° about its beam")
        assert page.text.index("Calibration REJECTED") < said < page.text.index("Summary")
        assert page.text.count("mistake explains the readings") == 1, "of the file's reasons"
        assert "Turn the head, or in the run multiply alpha_urad, beta_urad by -1." in page.text


def test_words_of_files_and_flags_are_escaped(evaluated: Path) -> None:
    bad = '<script>alert("&")</script>'
    Path("scenario.toml").write_text(SCENARIO + f"[report]\ncustomer = '{bad}'\nmachine = '</title>{bad}'\n")
    Path("<b>&.nc").write_bytes(Path("calibration.nc").read_bytes())
    page = page_of(calibration=Path("<b>&.nc"), scenario=Path("scenario.toml"), words={"operator": bad})
    assert page.text.count(bad) == 6, "customer, operator and its flag, and the machine thrice: title, heading, header"
    assert "<b>&.nc" in page.text
    assert len([one for one in page.all("script") if "type" not in one]) == 1, "ours; Plotly's is packed"
    assert not page.all("b")


def test_scenario_that_changed_is_noted_and_another_run_is_refused(evaluated: Path) -> None:
    request = {"calibration": Path("calibration.nc"), "scenario": Path("scenario.toml"), "run": Path("run.csv")}
    assert "has changed since the evaluation" not in page_of(**request).text
    Path("scenario.toml").write_text(SCENARIO + '[report]\ncustomer = "Example"\n')
    assert "scenario.toml has changed since the evaluation" in page_of(**request).text
    Path("other.csv").write_text(Path("run.csv").read_text() + "\n")
    with pytest.raises(InvalidArgument, match=r"other.csv: is not the run of calibration.nc: its SHA-256 is"):
        page_of(**request | {"run": Path("other.csv")})


def test_residuals_of_a_csv_calibration_are_computed_again(evaluated: Path) -> None:
    without = page_of(calibration=Path("calibration.csv"))
    assert "calibration.csv has no residuals (a CSV file has none)" in without.text
    given = {"scenario": Path("scenario.toml"), "run": Path("run.csv")}
    again, direct = (
        json.loads(page_of(calibration=Path(name), **given).scripts["stepdiag-figures"])["figures"]
        for name in ("calibration.csv", "calibration.nc")
    )
    assert again == direct
    assert "figure-residual-distance" in again


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("seed = 3", "seed = 3\n[adjustment]\nlateral_mm = 3.0"), "does not give calibration.csv: E.. differs by"),
        (
            ("x_mm = 80.0", "x_mm = 90.0"),
            "scenario.toml: does not belong to calibration.csv: its volume is 90 60 50 mm",
        ),
        (("[w X' b Y Z t]", "[w Y' b X Z t]"), "does not belong to calibration.csv: its chain is"),
    ],
)
def test_scenario_of_another_evaluation_is_refused(change: tuple[str, str], message: str, evaluated: Path) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace(*change))
    with pytest.raises(InvalidArgument, match=re.escape(message).replace(r"E\.\.", "E..")):
        page_of(calibration=Path("calibration.csv"), scenario=Path("scenario.toml"), run=Path("run.csv"))


def test_before_and_after_stand_side_by_side(evaluated: Path) -> None:
    Path("later.toml").write_text(SCENARIO.replace("seed = 7", "seed = 8"))
    assert main(["simulate", "later.toml", "-o", "later.csv"]) == 0
    assert main(["evaluate", "later.toml", "later.csv", "-o", "later.nc"]) == 0
    page = page_of(calibration=Path("later.nc"), before=Path("calibration.nc"))
    drawn = json.loads(page.scripts["stepdiag-figures"])["figures"]
    before = sd.read_calibration("calibration.nc").functions["EXX"][1]
    (old,) = [trace for trace in drawn["figure-EXX"]["data"] if trace["name"] == "before"]
    np.testing.assert_allclose(old["y"], 1e3 * before, rtol=0.0, atol=5.1e-5)  # rounded to 0.1 nm
    assert {"Before and after", "B - A"} <= {word.strip() for word in page.words}
    assert (
        page.values()["before"]["calibration"]["provenance"]["run_sha256"]
        != page.values()["calibration"]["provenance"]["run_sha256"]
    )
    assert main(["report", "calibration.nc", "later.nc"]) == 2, "as text there is one"


def test_what_is_not_determined_is_said_where_it_counts(here: Path) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace('scale_lines = ["p00", "0p0", "00p"]\n', ""))
    assert main(["simulate", "scenario.toml", "-o", "short.csv"]) == 0
    assert main(["evaluate", "scenario.toml", "short.csv", "-o", "short.nc"]) == 0
    page = page_of(calibration=Path("short.nc"))
    for sentence in sd.read_calibration("short.nc").undetermined:
        assert sentence[1:] in page.text
    assert (
        "The largest error is not known, because it needs parameters that are not determined: slope of EXX" in page.text
    )
    assert "The slope of EXX, the slope of EYY, the slope of EZZ." in page.text


def test_error_in_the_volume_is_that_of_the_volume_command(evaluated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sd.read_calibration("calibration.nc").judged("accepted", []).write("calibration.nc")
    page = page_of(calibration=Path("calibration.nc"), limit=0.02)
    found = sd.volume(sd.read_calibration("calibration.nc"))
    assert main(["volume", "calibration.nc", "--limit", "20", "--json"]) == 0
    assert page.values()["volume"] == json.loads(capsys.readouterr().out.splitlines()[-1]) | {"warnings": []}
    drawn = json.loads(page.scripts["stepdiag-volume"])
    # Drawings are rounded to 0.1 nm.
    np.testing.assert_allclose(drawn["worst"]["error_um"], 1e3 * found.largest_components, rtol=0.0, atol=5.1e-5)
    assert re.search(
        r"Is the machine within 20 µm\? Not within 20 µm\. The largest error is above \d+\.\d+ µm \(95 %\)", page.text
    )
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(InvalidArgument, match="`limit`: expected a length "):
            page_of(calibration=Path("calibration.nc"), limit=wrong)


def test_budget_is_that_of_the_uncertainty_result(evaluated: Path) -> None:
    assert main(["uncertainty", "scenario.toml", "-o", "uncertainty.nc"]) == 0
    page = page_of(calibration=Path("calibration.nc"), uncertainty=Path("uncertainty.nc"))
    bars = json.loads(page.scripts["stepdiag-figures"])["figures"]["figure-budget"]["data"]
    # Shares of a variance, with those of correlations and of the rest: they add up but for roundings to 1e-4 %.
    np.testing.assert_allclose(np.sum([bar["x"] for bar in bars], axis=0), 100.0, atol=1e-3)
    Path("longer.toml").write_text(SCENARIO.replace("steps = 5", "steps = 4"))
    assert main(["uncertainty", "longer.toml", "-o", "other.nc"]) == 0
    with pytest.raises(InvalidArgument, match=r"other.nc: E.. has other positions than the calibration"):
        page_of(calibration=Path("calibration.nc"), uncertainty=Path("other.nc"))
    with pytest.raises(InvalidArgument, match=r"calibration.nc: expected a result of `stepdiag uncertainty`"):
        page_of(calibration=Path("calibration.nc"), uncertainty=Path("calibration.nc"))


def test_header_is_that_of_the_scenario_unless_a_flag_says_otherwise(evaluated: Path) -> None:
    Path("logo.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>')
    Path("scenario.toml").write_text(SCENARIO + '[report]\ncustomer = "A"\noperator = "B"\nlogo = "logo.svg"\n')
    page = page_of(calibration=Path("calibration.nc"), scenario=Path("scenario.toml"), words={"operator": "C"})
    assert "Customer A Operator C" in page.text
    assert (page.all("img")[0]["src"] or "").startswith("data:image/svg+xml;base64,")
    for content in ("<html><svg></svg></html>", "text"):
        Path("logo.svg").write_text(content)
        with pytest.raises(InvalidArgument, match=r"logo.svg: expected a PNG or SVG picture"):
            page_of(calibration=Path("calibration.nc"), scenario=Path("scenario.toml"))


def test_certificate_has_number_date_and_lines_for_signatures(evaluated: Path) -> None:
    words = {
        "number": "2026-0042",
        "machine_type": "VMC 800",
        "serial_number": "0815",
        "signatures": "A. Engineer; B <i>",
    }
    page = page_of(calibration=Path("calibration.nc"), words=words)
    assert "Number 2026-0042" in page.text
    assert "Date, signature: A. Engineer Date, signature: B <i>" in page.text
    day = sd.read_calibration("calibration.nc").date[:10]
    assert f"Calibration report 2026-0042: VMC 800, no. 0815, {day}" in page.text


def test_damaged_details_of_a_file_are_refused_by_name(evaluated: Path) -> None:
    import xarray as xr

    with xr.open_dataset("calibration.nc") as file:
        table = file.load()
    del table.attrs["sha256"]
    for name, value, message in (
        ("setup_quantity", "other", "setup_quantity: expected one of reflector"),
        ("setup_component", 7, "setup_component: expected a component of "),
        ("reading_line", "<b>", ""),
    ):
        changed = table.copy(deep=True)
        changed[name][...] = value
        changed[name].encoding.clear()
        changed.to_netcdf("changed.nc")
        if message:
            with pytest.raises(InvalidArgument, match=f"changed.nc: {message}"):
                page_of(calibration=Path("changed.nc"))
        else:
            assert not page_of(calibration=Path("changed.nc")).all("b")


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    return said


def test_without_plotly_one_line_says_how_to_install_it(
    evaluated: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name, *of: None if name == "plotly" else find(name, *of))
    said = refused(["report", "calibration.nc", "-o", "report.html"], capsys)
    assert said == "stepdiag: error: a report as a page needs Plotly: pip install 'stepdiag[report]'\n"
    assert not Path("report.html").exists()
    assert main(["report", "calibration.nc"]) == 0, "the text needs none"


def test_pdf_without_chromium_is_refused(
    evaluated: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", "")
    said = refused(["report", "calibration.nc", "-o", "report.pdf"], capsys)
    assert "a PDF needs Chromium, and none of chromium, " in said
    assert not Path("report.pdf").exists()


def test_options_of_the_page_are_refused_without_one(evaluated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--customer: goes with a page (-o report.html)" in refused(
        ["report", "calibration.nc", "--customer", "A"], capsys
    )
    assert "at most" not in refused(["report", "a.nc", "b.nc", "c.nc", "-o", "report.html"], capsys)


def test_rejected_calibration_ends_with_status_three_and_is_written(evaluated: Path) -> None:
    sd.read_calibration("calibration.nc").judged("rejected", ["x"]).write("judged.csv")
    for calibrations in (["judged.csv"], ["judged.csv", "calibration.nc"], ["calibration.nc", "judged.csv"]):
        assert main(["report", *calibrations, "-o", "report.html"]) == 3
        page = Page(Path("report.html").read_text())
        if len(calibrations) == 2:
            assert "A fit is rejected, so that these figures do not show whether the machine has changed." in page.text
            assert "Improved" not in page.text
            assert "Worse" not in page.text


def test_content_is_escaped_and_markup_is_not() -> None:
    assert element("p", "a < b & c", title='"x"') == '<p title="&quot;x&quot;">a &lt; b &amp; c</p>'
    assert element("p", element("br"), Markup("<i>")) == "<p><br><i></p>"
    assert "&lt;td&gt;" in table("<caption>", ["<th>"], [["<td>"]])


NUMBERS: list[tuple[Callable[[], str], str]] = [
    (lambda: shown(1234.4), "1234"),
    (lambda: shown(-12.345), "−12.3"),
    (lambda: shown(123.45), "123.5"),
    (lambda: shown(0.0), "0.00"),
    (lambda: shown(0.00012), "0.00012"),
    (lambda: shown(9.999), "10.0"),
    (lambda: with_interval(21.04, 0.7, "µm"), "21.0 ± 1.4 µm"),
    (lambda: with_interval(-1234.4, 60.0, "µm"), "−1234 ± 118 µm"),
    (lambda: with_interval(1.0, float("nan"), "µm"), "1.00 µm (uncertainty not known)"),
    (lambda: with_interval(1.0, 0.0, "µm"), "1.00 µm"),
]


@pytest.mark.parametrize(("write", "text"), NUMBERS)
def test_numbers_have_the_digits_that_count(write: Callable[[], str], text: str) -> None:
    assert write().replace("\u00a0", " ") == text
