"""An export: its files, what it tells, and which of the 21 parameters it compensates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from stepdiag._core import Calibration
from stepdiag.exporting.common import (
    APPROACH_WORDS,
    in_ascii,
    origin_of,
    temperature_row,
    tool_of,
    undetermined_of,
    words,
)
from stepdiag.exporting.left_in_volume import LeftInVolume, Motors
from stepdiag.exporting.options import ExportOptions
from stepdiag.findings.meaning import trust_rows, unverified_key
from stepdiag.io.csv_text import lengths
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

# Sentences of the report that a CSV file has as leading lines.
LEADING: Final = ("sign: ", "model: ", "left out: ", "fitted: ")


@dataclass(frozen=True)
class Coverage:
    """Parameters that an export compensates, wholly or in part. The others of the 21 are left out."""

    whole: Sequence[str] = ()
    in_part: Sequence[str] = ()

    @property
    def left_out(self) -> list[str]:
        """The parameters of which nothing is compensated."""
        return [name for name in (*FUNCTIONS, *SQUARENESSES) if name not in (*self.whole, *self.in_part)]


def coverage_of(calibration: Calibration, whole: Sequence[str], in_part: Sequence[str] = ()) -> Coverage:
    """The coverage, but for what the calibration does not determine."""
    missing = list(undetermined_of(calibration, [*whole, *in_part]))
    slopes = [name for name in whole if any(text.startswith(f"{name} (") for text in missing)]
    return Coverage(
        [name for name in whole if name not in missing and name not in slopes],
        [name for name in (*in_part, *slopes) if name not in missing],
    )


@dataclass(frozen=True)
class Export:
    """Contents of files by path, notes for the user, and what is compensated."""

    files: Mapping[Path, str]
    report: Sequence[str]
    coverage: Coverage
    left: LeftInVolume | None = None  # None: not known, or not computed (all 21 are compensated)
    values: Mapping[str, Any] = field(default_factory=dict)  # the numbers of a format of few numbers
    motors: Motors | None = None  # where its controller sends the motors; None: to the exact inverse

    @property
    def told(self) -> list[str]:
        """All notes, with the files that were written."""
        return [*self.report, *(f"wrote {path}" for path in self.files)]


def heading(
    calibration: Calibration, options: ExportOptions, *, approach: bool = True, directions: str = ""
) -> list[str]:
    """Sentences that every export begins with. `approach`: whether it says a direction of approach, which is that of
    the options unless `directions` has it in words."""
    said = directions or APPROACH_WORDS[options.approach or "mean"]
    direction = f", direction of approach {said}" if approach else ""
    return [
        *trust_rows(calibration),
        temperature_row(calibration),
        f"chain {calibration.chain}, volume {words(calibration.volume)} mm, tool offset "
        f"{words(tool_of(calibration, options))} mm, home at {words(origin_of(options))} mm in the controller's "
        f"coordinates{direction}",
    ]


def csv_leading(
    format_: str,
    calibration: Calibration,
    options: ExportOptions,
    lines: Sequence[str],
    more: Mapping[str, str] | None = None,
) -> dict[str, str]:
    """Leading lines of a CSV file: its format, the machine, and of the report what a table needs beside it."""
    said = dict(line.split(": ", 1) for line in lines if line.startswith(LEADING))
    figures = [line for line in lines if "error in the volume" in line or line.startswith("the remaining error")]
    return {
        "format": format_,
        "fit": calibration.fit or "",
        **unverified_key(calibration),
        "chain": calibration.chain.name,
        "volume_mm": lengths(calibration.volume),
        "tool_mm": lengths(tool_of(calibration, options)),
        "home_mm": lengths(origin_of(options)),
        **(more or {}),
        **{key.replace(" ", "_"): in_ascii(text) for key, text in said.items()},
        "left_in_volume": in_ascii("; ".join(figures)),
        "temperature": in_ascii(temperature_row(calibration).removeprefix("temperature: ")),
        "not_compensated": "; ".join(line for line in lines if line.startswith("NOT COMPENSATED")),
        "calibrated": calibration.date,
        **calibration.provenance,
    }
