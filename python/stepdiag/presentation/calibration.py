"""What a calibration says, in blocks; the straightness of the functional point beside the table's, as CSV."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from stepdiag._core import Calibration
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.calibration.largest_by_kind import LargestEntry, largest_entries
from stepdiag.findings.meaning import fit_words, provenance_rows, unverified_key
from stepdiag.findings.temperature import temperature_text
from stepdiag.io.csv_text import csv_text, lengths
from stepdiag.parameters import REPORT_UNIT, Kind, in_report_units
from stepdiag.presentation.blocks import Block, NoteBlock, RowBlock, TableBlock
from stepdiag.presentation.comparison import decimal
from stepdiag.presentation.evaluation import budget_rows, reversal_table, undetermined_rows, unseen_rows
from stepdiag.presentation.fit import fit_blocks

FUNCTIONAL_POINT_FORMAT: Final = "stepdiag functional point 1"


def calibration_blocks(calibration: Calibration) -> Iterator[Block]:
    """Verdict of the fit, method, provenance, machine, the largest values and uncertainties of each kind, and to which
    point straightness refers."""
    yield from fit_blocks(fit_words(calibration))
    yield RowBlock("method", f"{calibration.method or 'not known'}, date: {calibration.date or 'not known'}")
    yield from map(NoteBlock, provenance_rows(calibration) or ["made from: not known"])
    volume, tool = (
        " x ".join(f"{edge:g}" for edge in calibration.volume),
        " ".join(f"{t:g}" for t in calibration.tool),
    )
    yield RowBlock("machine", f"chain {calibration.chain}, volume {volume} mm, tool offset {tool} mm")
    yield RowBlock("temperature", temperature_text(calibration))
    yield from map(NoteBlock, calibration.conditions)
    yield _largest(calibration)
    yield from budget_rows(calibration)
    yield from unseen_rows(calibration)
    yield from reversal_table(calibration)
    yield RowBlock("signs", "actual less commanded; rotations and squarenesses by the right-hand rule")
    yield RowBlock("reference", calibration.straightness_reference)
    yield from _functional_point(calibration)
    yield from undetermined_rows(calibration)


def _largest(calibration: Calibration) -> TableBlock:
    uncertain = largest_entries(calibration, uncertainty=True)
    rows = []
    for kind, entry in largest_entries(calibration).items():
        u = ("not known", "", "")
        if kind in uncertain:
            u = _entry(calibration, kind, uncertain[kind], uncertain[kind].standard_uncertainty)
        rows.append((kind, *_entry(calibration, kind, entry, entry.value), *u))
    columns = ("", "largest value", "", "", "standard uncertainty", "", "")
    return TableBlock(tuple(rows), columns, left=(0, 2, 3, 5, 6))


def _entry(calibration: Calibration, kind: Kind, entry: LargestEntry, number: float) -> tuple[str, str, str]:
    shape = "'s shape" if entry.parameter in calibration.undetermined_slopes else ""
    place = entry.place.replace(entry.parameter, entry.parameter + shape)
    return f"{in_report_units(kind, number):.4g}", REPORT_UNIT[kind], f"({place})"


def _functional_point(calibration: Calibration) -> Iterator[RowBlock]:
    for name, (position, value, uncertainty) in functional_point_straightness(calibration).items():
        table = calibration.functions[name][1]
        k = int(np.argmax(np.abs(value)))
        yield RowBlock(
            "functional point",
            f"{name} {value[k] * 1e3:.4g} µm at {position[k]:g} mm (u {uncertainty[k] * 1e3:.2g} µm), where the table "
            f"has {table[k] * 1e3:.4g} µm",
        )


def functional_point_csv(calibration: Calibration) -> str:
    """Straightness of the table and of the functional point, with the latter's standard uncertainty, in µm."""
    counted = calibration.covariance is not None
    leading = {
        "format": FUNCTIONAL_POINT_FORMAT,
        "chain": calibration.chain.name,
        "volume_mm": lengths(calibration.volume),
        "tool_mm": lengths(calibration.tool),
        "method": calibration.method,
        "date": calibration.date,
        **unverified_key(calibration),
        **calibration.provenance,
        "straightness_reference": calibration.straightness_reference,
        "covariance": "counted" if counted else "not known: straightness and rotations are taken as independent",
    }
    columns = "parameter,position_mm,table,functional_point,unit,standard_uncertainty"
    rows = []
    for name, (position, value, uncertainty) in functional_point_straightness(calibration).items():
        for row in zip(position, calibration.functions[name][1], value, uncertainty, strict=True):
            p, table, there, u = (float(number) for number in row)
            rows.append([name, decimal(p), decimal(table, 3), decimal(there, 3), "um", decimal(u, 3)])
    return csv_text(columns.split(","), rows, leading)
