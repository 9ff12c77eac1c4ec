"""The report as one HTML document that opens no connection."""

import base64
import gzip
import hashlib
import importlib.util
import json
import tempfile
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np

from stepdiag._core import Adjustment, Calibration, InvalidArgument, __version__
from stepdiag.calibration.volume import judged
from stepdiag.findings.meaning import headline, is_valid
from stepdiag.io.file_kind import PAGE_BEGINS
from stepdiag.io.whole_files import write_whole
from stepdiag.presentation.objects.evaluation import mistake_of
from stepdiag.presentation.objects.report import report_object
from stepdiag.presentation.objects.volume import volume_object
from stepdiag.presentation.page.budget import budget_section
from stepdiag.presentation.page.contents import Contents, ReportRequest, read_contents
from stepdiag.presentation.page.curves import curves_section, squareness_section
from stepdiag.presentation.page.figure import Figures
from stepdiag.presentation.page.header import TITLES
from stepdiag.presentation.page.html import Markup, as_given, element, markup
from stepdiag.presentation.page.language import LANGUAGES, figure_in_language, in_language, said
from stepdiag.presentation.page.language import language as language_of_page
from stepdiag.presentation.page.look import BAND, LAYOUT
from stepdiag.presentation.page.numbers import moment
from stepdiag.presentation.page.pdf import find_browser, write_pdf
from stepdiag.presentation.page.residuals import residuals_section, setup_section, temperature_section
from stepdiag.presentation.page.volume import ErrorInVolume, drawing_of, error_grid, error_in_volume, volume_section
from stepdiag.presentation.page.words import (
    EARLIER,
    commands_section,
    comparison_section,
    header_block,
    method_section,
    open_section,
    provenance_section,
    signatures_block,
    summary_section,
    verdict_block,
)
from stepdiag.style import COLOUR
from stepdiag.wrong_arguments import checked

# What report.js says. Numbers stand for {0}, {1}.
_SCRIPT_WORDS: Final = (
    "error (µm)",
    "largest: {0} µm",
    "10 µm are drawn as {0} mm",
    "The grid as the tool really moves; {0}. Grey: the commanded volume.",
    "From commanded to actual position; {0}.",
    "Length of the error in the plane {0} = {1} mm.",
    "This browser is too old to draw it; the values are in the table below.",
)


@checked
def report(
    calibration: Calibration | Adjustment | str | PathLike[str],
    output: str | PathLike[str],
    *,
    before: str | PathLike[str] | None = None,
    scenario: str | PathLike[str] | None = None,
    run: str | PathLike[str] | None = None,
    uncertainty: str | PathLike[str] | None = None,
    limit: float | None = None,
    logo: str | PathLike[str] | None = None,
    language: str = "en",
    **header: str,
) -> list[str]:
    """Write the report of a calibration, as `stepdiag report -o` does: one HTML file, or a PDF. Returns notes.

    Args:
        calibration: what was found, or its file. An Adjustment, and its netCDF file, has set-up and residuals.
        output: the file to write, .html or .pdf (which needs Chromium).
        before: file of an earlier calibration of the machine.
        scenario: its file: header ([report]) and measured lines.
        run: file of the measurement: temperatures, and residuals where the calibration has none.
        uncertainty: file of an uncertainty result (.nc): the budget.
        limit: of the largest error in the volume, mm.
        logo: PNG or SVG picture.
        language: of the page, "en" or "de". Sentences without a translation stay English.
        header: what its header says: number, customer, machine, serial_number, operator, instrument, certificate,
            conditions; signatures: who signs, with semicolons between them.

    Raises:
        InvalidArgument: files are not sound or do not belong together; the header has other keys; Plotly or Chromium
            is missing.
    """
    if language not in LANGUAGES:
        raise InvalidArgument(f"`language`: expected one of {', '.join(LANGUAGES)}, got {language}")
    for key in header:
        if key not in TITLES:
            raise InvalidArgument(f"`{key}`: expected one of {', '.join(TITLES)}")
    with tempfile.TemporaryDirectory(prefix="stepdiag-") as folder:
        if isinstance(calibration, Calibration | Adjustment):
            file = Path(folder) / "calibration.nc"
            calibration.write(file)
        else:
            file = Path(calibration)
        of = {"before": before, "scenario": scenario, "run": run, "uncertainty": uncertainty, "logo": logo}
        given = {name: Path(path) for name, path in of.items() if path is not None}
        request = ReportRequest(file, limit=limit, words=header, language=language, **given)
        return list(write_report(request, Path(output)).notes)


def write_report(request: ReportRequest, output: Path) -> Contents:
    """Write a page, or the PDF of it, by the name's end. Returns what it was made from."""
    is_pdf = output.suffix.lower() == ".pdf"
    if is_pdf:
        find_browser()
    page, contents = report_page(request, output)
    if is_pdf:
        write_pdf(page, output)
    else:
        write_whole(output, page.encode())  # its own texts are escaped; Plotly's is left as it is
    return contents


def report_page(request: ReportRequest, output: Path) -> tuple[str, Contents]:
    """The page, and what it is made from. `output`: its file, which the page names.

    Raises InvalidArgument without Plotly, and for files that are not sound or do not belong together."""
    plotly = _plotly()
    contents = read_contents(request)
    with in_language(request.language):
        return _page(contents, output, plotly), contents


def _page(contents: Contents, output: Path, plotly: str) -> str:
    request = contents.request
    calibration, figures = contents.calibration, Figures()
    change, before = contents.change, None
    if contents.before is not None and change is not None:
        before = ErrorInVolume(change.a, *error_grid(contents.before))
    if change is not None and np.array_equal(change.tool, calibration.tool):  # there already; without its ranking
        figures_after = judged(change.b, limit=request.limit)
        found = ErrorInVolume(figures_after, *error_grid(calibration))
    else:
        found = error_in_volume(calibration, request.limit)
    sections = [
        summary_section(contents, found),
        curves_section(calibration, contents.before, figures),
        squareness_section(calibration, contents.before),
        volume_section(contents, found, before),
        comparison_section(contents),
        residuals_section(contents, figures),
        setup_section(contents),
        budget_section(contents.budget, figures),
        temperature_section(contents, figures),
        open_section(calibration),
        method_section(contents),
        provenance_section(contents),
        commands_section(contents, request.command(output)),
        signatures_block(contents),
    ]
    drawings = figure_in_language(figures.drawings)
    data = [
        _json("stepdiag-words", {text: said(text) for text in _SCRIPT_WORDS}),
        _json("stepdiag-figures", {"layout": dict(LAYOUT), "figures": drawings, "colours": dict(COLOUR)}),
        _json("stepdiag-volume", drawing_of(contents, found, before)),
        _json("stepdiag-values", report_values(contents, found, before)),
    ]
    body = [
        element("a", "Skip to the verdict", href="#verdict", class_="skip"),
        _stamp(calibration),
        element("div", header_block(contents), verdict_block(contents), class_="opening"),
        _contents_list(contents),
        element("main", *sections, id="main"),
        element("footer", element("p", f"Made by stepdiag {__version__}, ", moment(contents.date), ".")),
        element(
            "noscript",
            element(
                "p",
                "Without JavaScript curves are still pictures; volume and budget are in their tables alone.",
            ),
        ),
        *data,
    ]
    return _whole(_title(contents), _running_words(contents), body, plotly)


def report_values(contents: Contents, found: ErrorInVolume, before: ErrorInVolume | None) -> dict[str, Any]:
    """The values of the report at full precision: the object of `report --json`, and what the page has beside it."""
    request = contents.request
    values: dict[str, Any] = {
        **report_object(contents.calibration, Path(request.calibration.name), contents.notes),
        "format": {"name": "stepdiag report page", "version": 2},
        "mistakes": [mistake_of(mistake) for mistake in contents.mistakes],
        "volume": volume_object(found.figures, Path(request.calibration.name), []),
    }
    if request.before is not None and contents.before is not None and before is not None:
        values["before"] = {
            **report_object(contents.before, Path(request.before.name), []),
            "volume": volume_object(before.figures, Path(request.before.name), []),
        }
    return values


def _title(contents: Contents) -> Markup:
    given = {key: as_given(text) for key, text in contents.header.words.items()}
    words: list[object] = [] if is_valid(contents.calibration) else [headline(contents.calibration), ". "]
    words += ["Calibration report", *([" ", given["number"]] if "number" in given else []), ": "]
    words.append(given.get("machine", "three-axis machine tool"))
    words += [", no. ", given["serial_number"]] if "serial_number" in given else []
    words += [", ", as_given(contents.calibration.date[:10])] if contents.calibration.date else []
    return markup(*words)


def _stamp(calibration: Calibration) -> Markup | None:
    """Always in sight, and across every printed page, also from browsers without margin boxes."""
    if is_valid(calibration):
        return None
    words, colon, rest = headline(calibration).partition(":")
    content = markup(words, element("span", colon + rest))  # paper has the rest in its margin
    return element("p", content, class_=f"stamp {calibration.fit or 'unknown'}", aria_hidden="true")


def _contents_list(contents: Contents) -> Markup:
    entries = [
        ("summary", "Summary"),
        ("curves", "Error functions"),
        ("squareness", "Squareness"),
        ("volume", "Volume"),
        *([("comparison", "Before and after")] if contents.comparison is not None else []),
        ("residuals", "Residuals"),
        ("setup", "Set-up"),
        ("budget", "Uncertainty"),
        ("temperatures", "Temperatures"),
        ("open", "Not determined"),
        ("method", "Method"),
        ("provenance", "Provenance"),
        ("commands", "Commands"),
    ]
    links = [element("li", element("a", words, href=f"#{name}")) for name, words in entries]
    return element("nav", element("ul", *links), aria_label="Contents", class_="screen-only")


def _whole(title: Markup, running: str, body: list[Markup | None], plotly: str) -> str:
    own = _own("report.js")
    policy = (
        "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; "
        f"script-src {_fingerprint(plotly)} {_fingerprint(own)}; base-uri 'none'; form-action 'none'"
    )
    colours = "".join(
        f"--{name}: {COLOUR[name]}; " for name in ("accepted", "rejected", "doubtful", "after", "before", "backward")
    )
    style = f":root {{ {colours}--band: {BAND}; }}\n{_own('report.css')}{running}"
    head = markup(
        element("meta", http_equiv="Content-Security-Policy", content=policy),
        Markup("\n"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        Markup("\n"),
        element("title", title),
        Markup(f"\n<style>\n{style}</style>\n"),
    )
    packed = base64.b64encode(gzip.compress(plotly.encode(), 4, mtime=0)).decode()
    scripts = Markup(
        f'<script type="application/gzip" id="stepdiag-plotly">{packed}</script>\n<script>{own}</script>\n'
    )
    inside = Markup("\n").join(part for part in body if part)
    begins = PAGE_BEGINS.replace('lang="en"', f'lang="{language_of_page()}"')
    return f"{begins}{head}</head>\n<body>\n{inside}\n{scripts}</body>\n</html>\n"


def _running_words(contents: Contents) -> str:
    """On every printed page, of a calibration that is not to be relied on: in words, as paper may have no colours."""
    calibration, before = contents.calibration, contents.before
    words = [] if is_valid(calibration) else [said(headline(calibration))]
    words += [] if before is None or is_valid(before) else [said(headline(before, EARLIER))]
    if not words:
        return ""
    look = "width: 100%; text-align: center; color: #000; border: solid #000; border-width: 1.5pt 0; font: 700 10pt"
    family = 'system-ui, "Liberation Sans", sans-serif'
    band = f"content: '{'. '.join(words)}'; {look} {family}; margin: 4mm 0"
    return f"@page {{ margin-top: 20mm; @top-center {{ {band}; }} }}\n"


def _json(identifier: str, content: Any) -> Markup:
    """Data for the script; nothing in it can end the element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(f'<script type="application/json" id="{identifier}">{text}</script>')


def _fingerprint(script: str) -> str:
    """By which the policy allows a script, and no other."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _own(name: str) -> str:
    return (files("stepdiag.presentation.page") / name).read_text(encoding="utf-8")


def _plotly() -> str:
    """The text of plotly.js as Plotly's Python package brings it."""
    found = importlib.util.find_spec("plotly")
    if found is None or found.origin is None:
        raise InvalidArgument("a report as a page needs Plotly: pip install 'stepdiag[report]'")
    path = Path(found.origin).parent / "package_data" / "plotly.min.js"
    if not path.is_file():
        raise InvalidArgument(f"{path}: is missing in this Plotly: pip install 'stepdiag[report]'")
    return path.read_text(encoding="utf-8")
