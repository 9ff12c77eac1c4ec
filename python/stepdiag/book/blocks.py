"""What is said of a book and of a machine in it, as presentation blocks."""

from collections.abc import Iterator, Sequence
from typing import Final

from stepdiag.book.book import Entry
from stepdiag.book.facts import CalibrationFacts, Value
from stepdiag.book.layout import FOLDERS
from stepdiag.book.overview import Overview
from stepdiag.book.trend import FEWEST, Due, Trend
from stepdiag.parameters import SQUARENESSES
from stepdiag.presentation.blocks import Block, HeadingBlock, NoteBlock, RowBlock, TableBlock, VerdictBlock

_NOT_KNOWN: Final = "-"


def machines_blocks(rows: Sequence[Overview]) -> Iterator[Block]:
    """The register: a row a machine."""
    if not rows:
        yield NoteBlock("no machine yet: `stepdiag book new NAME` adds one")
        return
    columns = ("machine", "serial number", "calibrated", "fit", "largest, µm", "limit, µm", "verdict", "due")
    cells = []
    for row in rows:
        facts = row.last.facts.calibration if row.last else None
        cells.append(
            (
                row.name,
                row.about.serial_number or _NOT_KNOWN,
                row.last.date[:10] if row.last else "never",
                (facts.fit or "not judged") if facts else _NOT_KNOWN,
                _largest(facts),
                _number(row.about.limit_um),
                row.verdict or _NOT_KNOWN,
                row.due.day.isoformat() if row.due.day else _NOT_KNOWN,
            )
        )
    yield TableBlock(tuple(cells), columns, left=(0, 1, 2, 3, 6, 7))
    yield from (NoteBlock(f"{row.name}: do not rely on its verdict: {row.caution}") for row in rows if row.caution)


def machine_blocks(row: Overview, entries: Sequence[Entry]) -> Iterator[Block]:
    """A machine: what it is, its verdict, its calibrations in the order of time, its other files."""
    facts = row.last.facts.calibration if row.last else None
    if row.last is None:
        yield NoteBlock(f"{row.name}: no calibration yet")
    elif row.about.limit_um is None:
        yield NoteBlock(f"{row.name}: largest error {_largest(facts)} µm on {row.last.date[:10]}; no limit is stated")
    else:
        why = f"largest error {_largest(facts)} µm on {row.last.date[:10]}, limit {_number(row.about.limit_um)} µm"
        yield VerdictBlock("machine", row.verdict or "unknown", row.verdict or "verdict not possible", why)
    if row.caution:
        yield NoteBlock(f"do not rely on this: {row.caution}")
    for label, text in (
        ("machine type", row.about.title),
        ("serial number", row.about.serial_number),
        ("customer", row.about.customer),
        ("place", row.about.place),
        ("notes", row.about.notes),
        ("due", due_text(row.due)),
    ):
        if text:
            yield RowBlock(label, text)
    calibrations = [one for one in entries if one.folder == "calibrations" and one.facts.calibration is not None]
    if calibrations:
        yield HeadingBlock("Calibrations")
        yield TableBlock(
            tuple(_calibration_cells(one, row) for one in calibrations),
            ("date", "file", "fit", "largest, µm", "verdict", *(f"{name}, µrad" for name in SQUARENESSES)),
            left=(0, 1, 2, 4),
        )
    others = [one for folder in FOLDERS for one in entries if one.folder == folder and one not in calibrations]
    if others:
        yield HeadingBlock("Other files")
        yield from (RowBlock(one.file, f"{one.date[:10]}, {_said(one)}") for one in others)


def due_text(found: Due) -> str:
    """When to calibrate again, and why then."""
    day = found.day.isoformat() if found.day else ""
    return {
        "limit": f"{day}: the trend may reach the limit",
        "interval": f"{day}: the stated interval ends",
        "not enough to say": f"not enough to say: a trend needs {FEWEST} calibrations with uncertainties",
        "no limit": "",
        "not in sight": "the trend does not reach the limit within 20 years",
    }[found.why]


def trend_blocks(found: Sequence[Trend], due: Due) -> Iterator[Block]:
    """The trend of each quantity, and its values."""
    if not found:
        yield NoteBlock("no calibration that can be used")
        return
    if due_text(due):
        yield RowBlock("due", due_text(due))
    yield HeadingBlock("Trends")
    yield TableBlock(
        tuple((one.name, one.unit, str(len(one.points)), *_drift_cells(one)) for one in found),
        ("quantity", "unit", "values", "a year", "trend", "changed"),
        left=(0, 1, 4, 5),
    )
    yield HeadingBlock("Values")
    for one in found:
        rows = [
            (point.day.isoformat(), _value((point.value, point.u)), point.entry.name, point.unlike)
            for point in one.points
        ]
        yield TableBlock(tuple(rows), ("day", one.unit, "file", "not compared"), f"{one.name}", left=(0, 2, 3))


def _drift_cells(found: Trend) -> tuple[str, str, str]:
    changed = ", ".join(one.day.isoformat() for one in found.changed) or "no"
    if found.drift is None:
        return _NOT_KNOWN, "not enough to say", changed if len(found.points) > 1 else _NOT_KNOWN
    line = found.drift
    said = "significant" if line.is_significant else "not significant"
    return f"{line.per_year:.2g} ± {2.0 * line.u_per_year:.2g}", said, changed


def _calibration_cells(entry: Entry, row: Overview) -> tuple[str, ...]:
    facts = entry.facts.calibration
    assert facts is not None
    return (
        entry.date[:10],
        entry.name,
        facts.fit or "not judged",
        _largest(facts),
        facts.verdict(row.about.limit_um) or _NOT_KNOWN,
        *(_value(facts.squareness.get(name)) for name in SQUARENESSES),
    )


def _said(entry: Entry) -> str:
    return (
        f"damaged: {entry.facts.damaged}"
        if entry.facts.damaged
        else entry.facts.summary or entry.facts.kind or "document"
    )


def _largest(facts: CalibrationFacts | None) -> str:
    """With its 95 % interval, where there is one."""
    if facts is None or facts.largest is None:
        return _NOT_KNOWN
    found = facts.largest
    return f"{found.value:.1f}" + (
        "" if found.interval is None else f" ({found.interval[0]:.1f} … {found.interval[1]:.1f})"
    )


def _number(value: float | None) -> str:
    return _NOT_KNOWN if value is None else f"{value:g}"


def _value(value: Value | None) -> str:
    """With its expanded uncertainty, k = 2."""
    if value is None:
        return _NOT_KNOWN
    return f"{value[0]:.1f}" + ("" if value[1] is None else f" ± {2.0 * value[1]:.1f}")
