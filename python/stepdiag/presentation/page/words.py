"""The parts of a report that are words: verdict, summary, what is open, method, provenance, commands."""

import math
from collections.abc import Iterator
from typing import Any, Final

from stepdiag._core import Calibration
from stepdiag.calibration.largest_by_kind import largest_entries, largest_uncertainties
from stepdiag.calibration.volume import VolumeErrors
from stepdiag.findings.meaning import PROVENANCE, UNVERIFIED, fit_words, headline, is_valid
from stepdiag.findings.temperature import temperature_text
from stepdiag.parameters import FUNCTIONS, REPORT_UNIT, SQUARENESSES, in_report_units
from stepdiag.platform import command_line, fingerprint_commands
from stepdiag.presentation.blocks import NoteBlock
from stepdiag.presentation.comparison import comparison_blocks
from stepdiag.presentation.fit import fit_blocks
from stepdiag.presentation.page.contents import Contents
from stepdiag.presentation.page.header import TITLES
from stepdiag.presentation.page.html import (
    Markup,
    as_given,
    definitions,
    element,
    html_of,
    listed,
    markup,
    section,
    sentence,
    table,
)
from stepdiag.presentation.page.numbers import COVERAGE_FACTOR, NBSP, moment, position, shown, with_interval
from stepdiag.presentation.page.volume import ErrorInVolume
from stepdiag.presentation.volume import length_text, limit_verdict, place_of_largest, why_not_known

_IS_VALID: Final = {
    "accepted": "Yes. The readings agree with each other and with the described set-up. This does not say how "
    "accurate the machine is.",
    "doubtful": "Doubtful. The values are the best fit, but the stated uncertainties are not to be relied on.",
    "rejected": "No. The readings contradict each other. Do not correct the machine with these values.",
    "unchecked": "Unchecked. The readings do not test this calibration; the reason is above.",
    None: "Not known. The file does not say how well the readings agree.",
}
# What an answer about the machine rests on, where its calibration is not accepted.
_RESTS_ON: Final = {
    "doubtful": "The calibration is doubtful: do not rely on this answer.",
    "rejected": "The calibration is rejected: do not use this answer.",
    "unchecked": "The calibration is unchecked: nothing controls the readings behind this answer.",
    None: "Whether the calibration is valid is not known.",
}
EARLIER: Final = "The earlier calibration is"
SYMBOL: Final = {"accepted": "✓", "doubtful": "!", "rejected": "✕", "unchecked": "?", None: "?"}


def header_block(contents: Contents) -> Markup:
    """Title, logo, and who, which machine, with what."""
    calibration, words = contents.calibration, contents.header.words
    pairs: list[tuple[str, object]] = [
        (title, as_given(words[key])) for key, title in TITLES.items() if key in words and key != "signatures"
    ]
    pairs += [
        ("Calibrated volume", f"{' × '.join(position(edge) for edge in calibration.volume)} mm"),
        ("Kinematic chain", as_given(calibration.chain.name)),
        ("Evaluated", moment(calibration.date) or "date not known"),
        ("Report made", moment(contents.date)),
    ]
    logo = element("img", src=contents.header.logo, alt="Logo", class_="logo") if contents.header.logo else None
    named: list[object] = [as_given(words["machine"])] if "machine" in words else []
    if "serial_number" in words:
        named += [", "] if named else []
        named += ["no. ", as_given(words["serial_number"])]
    return element(
        "header",
        element(
            "div",
            element("p", "Calibration report", class_="kind"),
            element("h1", *(named or ["Three-axis machine tool"])),
            element("p", "Geometric errors by the laser step-diagonal method", class_="subject"),
        ),
        logo,
        definitions(pairs, "facts"),
        id="top",
    )


def signatures_block(contents: Contents) -> Markup | None:
    """A line for each who signs."""
    names = [name.strip() for name in contents.header.words.get("signatures", "").split(";") if name.strip()]
    if not names:
        return None
    lines = [element("p", element("span", class_="line"), "Date, signature: ", as_given(name)) for name in names]
    return section("signatures", "Signatures", element("div", *lines, class_="signatures"))


def verdict_block(contents: Contents) -> Markup:
    """The verdict of the fit with its reasons and the mistake that would explain it, before anything else."""
    calibration = contents.calibration
    fit = calibration.fit
    is_open = calibration.unverified and fit == "accepted"  # it was valid, and may have been changed since
    parts: list[Any] = [
        element(
            "h2",
            element("span", SYMBOL[None if is_open else fit], class_="symbol", aria_hidden="true"),
            f" {headline(calibration)}",
            id="verdict-heading",
        )
    ]
    parts.append(html_of(fit_blocks(fit_words(calibration), contents.mistakes)))
    about = [
        temperature_text(calibration),
        "all this is about the readings; the summary says how accurate the machine is",
    ]
    parts.append(html_of(map(NoteBlock, about)))
    return element(
        "section",
        *parts,
        id="verdict",
        class_=f"verdict {'unknown' if fit is None or is_open else fit}",
        aria_labelledby="verdict-heading",
    )


def summary_section(contents: Contents, found: ErrorInVolume) -> Markup:
    """A few lines that a customer understands."""
    calibration = contents.calibration
    machine = [
        _within(found.figures),
        ("Error in the volume", _volume(contents, found.figures)),
        ("Largest errors", sentence("; ".join(_largest(calibration)))),
    ]
    lines: list[tuple[str, object]] = [
        ("Is this calibration valid?", _is_valid(calibration)),
        ("How well known", _how_well(calibration)),
        *([("Uncertainty budget", sentence(calibration.budget))] if calibration.budget else []),
        *([("Conditions used", listed(map(sentence, calibration.conditions)))] if calibration.conditions else []),
        ("Not determined", _open(calibration)),
    ]
    warning = {
        "rejected": "This calibration is rejected: the figures below are not to be used.",
        "doubtful": "This calibration is doubtful: the intervals below are not to be relied on.",
    }.get(calibration.fit or "")
    return section(
        "summary",
        "Summary",
        element("p", element("strong", warning)) if warning else None,
        element("h3", "The machine"),
        definitions(machine, "lines"),
        element("h3", "The calibration"),
        definitions(lines, "lines"),
    )


def _is_valid(calibration: Calibration) -> Markup:
    """Whether the readings agree, which is no answer about the machine."""
    answer, rest = _IS_VALID[calibration.fit].split(". ", 1)
    if calibration.unverified:
        answer = "Not known" if calibration.fit == "accepted" else answer
        rest += f" {sentence(UNVERIFIED)}"
    return markup(element("strong", f"{answer}."), f" {rest}")


def _volume(contents: Contents, figures: VolumeErrors) -> Markup:
    if math.isnan(figures.largest):
        return markup(f"The largest error is {why_not_known(figures)}.")
    parts: list[object] = [
        "The largest distance of the tool from its commanded position is ",
        element("strong", length_text(figures.largest, figures.largest_interval)),
        f", at {place_of_largest(figures)}; ",
        f"{length_text(figures.rms, figures.rms_interval)} rms over the volume.",
    ]
    if contents.change is not None and not math.isnan(contents.change.largest.a):
        parts.append(f" Before: {length_text(contents.change.largest.a, contents.change.largest.a_interval)}.")
    return markup(*parts)


def _within(figures: VolumeErrors) -> tuple[str, object]:
    """The machine against the limit that was given, and what the answer rests on."""
    verdict = limit_verdict(figures)
    if verdict is None:
        return "Is the machine within its limit?", "Not asked: the report was made without a limit."
    notes = [sentence(figures.interval_note)] if figures.interval_note else []
    if figures.verdict is not None and figures.fit != "accepted":
        notes.append(_RESTS_ON[figures.fit])
    return f"Is the machine within {1e3 * (figures.limit or 0.0):.4g} µm?", markup(
        element("strong", sentence(verdict.headline)), f" {' '.join([sentence(verdict.why), *notes])}"
    )


def _largest(calibration: Calibration) -> Iterator[str]:
    for kind, entry in largest_entries(calibration).items():
        figure, wide = (in_report_units(kind, number) for number in (entry.value, entry.standard_uncertainty))
        yield f"{kind} {with_interval(figure, wide, REPORT_UNIT[kind])} ({entry.place})"


def _how_well(calibration: Calibration) -> str:
    uncertain = [
        f"{kind} {shown(in_report_units(kind, COVERAGE_FACTOR * u))}{NBSP}{REPORT_UNIT[kind]}"
        for kind, (u, _) in largest_uncertainties(calibration).items()
    ]
    if not uncertain:
        return "The file has no uncertainties."
    said = f"Every value to within (95 %): {', '.join(uncertain)}, or better."
    if calibration.fit in ("rejected", "doubtful"):
        said += " The fit is " + calibration.fit + ": these figures are not to be relied on."
    return said


def _open(calibration: Calibration) -> str:
    count = len(calibration.functions) + len(calibration.squareness)
    if not calibration.undetermined:
        return (
            f"Nothing: all {count} parameters are determined."
            if count == 21
            else f"{21 - count} of 21 parameters have no values."
        )
    open_ = [f"the slope of {name}" for name in calibration.undetermined_slopes] + _missing(calibration)
    parts = [
        f"{', '.join(open_)}." if open_ else f"All {count} parameters are determined, parts of the set-up are not."
    ]
    return " ".join([*(part[0].upper() + part[1:] for part in parts), "See “What was not determined”."])


def open_section(calibration: Calibration) -> Markup:
    """What was not determined, and why."""
    title = "What was not determined"
    missing = _missing(calibration)
    parts: list[Any] = []
    if not calibration.undetermined and not missing:
        parts.append(element("p", "Nothing: the readings determine all 21 parameters."))
    if calibration.undetermined:
        parts.append(listed([f"{text[0].upper()}{text[1:]}." for text in calibration.undetermined]))
    if missing:
        parts.append(element("p", f"Without values: {', '.join(missing)}."))
    if calibration.undetermined_slopes:
        parts.append(
            element(
                "p",
                f"Of {', '.join(calibration.undetermined_slopes)} only the shape is known, given with 0 at both ends.",
            )
        )
    if calibration.unseen_faults:
        parts.append(element("h3", "Faults of readings that no fit would show"))
        parts.append(listed([f"{text[0].upper()}{text[1:]}." for text in calibration.unseen_faults]))
    return section("open", title, *parts)


def _missing(calibration: Calibration) -> list[str]:
    """Parameters without values."""
    return [
        name for name in (*FUNCTIONS, *SQUARENESSES) if name not in {*calibration.functions, *calibration.squareness}
    ]


def method_section(contents: Contents) -> Markup:
    """How it was measured and evaluated, and how the signs are."""
    calibration = contents.calibration
    ways = {
        "adjustment": "Least squares over all readings at once, with the exact pose of the machine. Unknowns are the "
        "21 error parameters, and how head and mirror stood on each line.",
        "enhanced": "Distances, tilts and scale lines, to first order.",
        "conventional": "Distances of body diagonals, to first order.",
    }
    rows: list[tuple[str, object]] = [
        (
            "Measurement",
            "The machine moves a mirror along diagonals of its volume, in steps of one axis after the other. A laser "
            "head that stands still reads its distance, and with most heads its tilts, at every point.",
        ),
        ("Evaluation", f"{calibration.method or 'not known'}. {ways.get(calibration.method, '')}"),
    ]
    if contents.lines:
        rows.append(("Lines", ", ".join(contents.lines)))
    if contents.details is not None:
        rows.append(("Readings", f"{len(contents.details.line)} points, {', '.join(contents.details.channels)}"))
    rows += [
        ("Tool offset", f"{', '.join(position(t) for t in calibration.tool)} mm"),
        (
            "Signs",
            "Actual less commanded. Rotations and squarenesses by the right-hand rule. Errors are those of the tool "
            "relative to the workpiece.",
        ),
        ("Reference", f"{calibration.straightness_reference[0].upper()}{calibration.straightness_reference[1:]}."),
        ("Uncertainties", "95 % intervals are ± 1.96 standard uncertainties (GUM), of each value by itself."),
        (
            "Error in the volume",
            "Actual less commanded position of the functional point, by the exact pose of the machine, at the nodes of "
            "the tables (of more than 201, at 201 of them).",
        ),
    ]
    return section("method", "Method", definitions(rows, "lines"))


def provenance_section(contents: Contents) -> Markup:
    """Fingerprints of what the calibration was made from, and what does not fit."""
    made = contents.calibration.provenance
    rows = [[words, element("code", made[key])] for key, words in PROVENANCE.items() if key in made]
    parts: list[Any] = []
    if rows:
        parts.append(table("What the calibration was made from", ["What", "Fingerprint or version"], rows, "prints"))
    else:
        parts.append(element("p", "The file does not say what it was made from."))
    parts += [element("p", note, class_="note") for note in contents.notes]
    files = [
        ("Calibration", contents.request.calibration),
        ("Before", contents.request.before),
        ("Scenario", contents.request.scenario),
        ("Run", contents.request.run),
        ("Uncertainty", contents.request.uncertainty),
    ]
    named: list[object] = ["Files of this report: "]
    for what, path in files:
        if path is not None:
            named += ["; " if len(named) > 1 else None, what.lower(), " ", element("code", path.name)]
    parts.append(element("p", *named))
    return section("provenance", "Provenance", *parts)


def commands_section(contents: Contents, command: str) -> Markup:
    """The commands that repeat all of it."""
    request, method = contents.request, contents.calibration.method
    names = [request.scenario.name if request.scenario else "SCENARIO", request.run.name if request.run else "RUN"]
    scenario, run = (command_line([name]) for name in names)
    calibration = command_line([request.calibration.name])
    option = "" if method in ("adjustment", "") else f" -m {method}"
    covariance = " --covariance" if contents.calibration.covariance is not None else ""
    lines = [
        *fingerprint_commands(names),
        f"stepdiag check {scenario} {run}",
        f"stepdiag evaluate {scenario} {run}{option}{covariance} -o {calibration}",
        command,
    ]
    return section(
        "commands",
        "Commands that repeat it",
        element(
            "p",
            "The fingerprints above show whether the files are the same. Words in capitals stand for files that were "
            "not given.",
        ),
        element("pre", element("code", "\n".join(lines))),
    )


def comparison_section(contents: Contents) -> Markup | None:
    """Before and after: in the volume, and parameter by parameter."""
    comparison, change = contents.comparison, contents.change
    if comparison is None or change is None:
        return None
    return section(
        "comparison",
        "Before and after",
        element("p", "A is the earlier calibration, B this one. The curves above show the earlier one dashed."),
        None if is_valid(comparison.a) else element("p", f"{headline(comparison.a, EARLIER)}.", class_="note"),
        html_of(comparison_blocks(comparison, change, "the earlier calibration", "this calibration")),
    )
