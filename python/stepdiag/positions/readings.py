"""Repeated readings of targets on an axis or a diagonal, and their CSV file (docs/positions.md)."""

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.display import Displayed, Facts
from stepdiag.io.csv_text import finite_number
from stepdiag.io.file_kind import head_of
from stepdiag.io.sheet_text import decode
from stepdiag.io.whole_files import read_bytes, read_text
from stepdiag.positions.rtl import is_rtl, readings_of_rtl
from stepdiag.units import MICROMETRE
from stepdiag.wrong_arguments import checked

_REQUIRED: Final = ("target_mm", "direction", "cycle")
_VALUES: Final = ("deviation_um", "position_mm")
# Targets that differ by less are one target, mm, also where no step says more.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True, repr=False)
class PositionReadings(Displayed):
    """Deviations, actual less target position (mm), of targets approached repeatedly on one line.

    `deviations`: (target in mm, direction "+" or "-", cycle) -> deviation. A lost reading is absent. `targets`: of all
    rows, ascending; also those without any reading. Raises InvalidArgument for fewer than two targets, and for
    numbers that are not finite."""

    targets: tuple[float, ...]
    deviations: Mapping[tuple[float, str, int], float]
    line: str = ""  # what was measured, in words
    lost: int = 0  # rows whose reading is missing
    apart: float = 0.0  # mm, how far set-points of a file were from the target that they were taken for

    def __post_init__(self) -> None:
        if len(self.targets) < 2 or list(self.targets) != sorted(set(self.targets)):
            raise InvalidArgument(f"targets: expected two or more different ones, ascending, got {self.targets}")
        for (target, direction, cycle), deviation in self.deviations.items():
            if target not in self.targets or direction not in ("+", "-") or not math.isfinite(deviation):
                raise InvalidArgument(
                    "deviations: expected a finite deviation at one of the targets, in direction + or -, "
                    f"got {deviation} at {target}, direction {direction!r}, cycle {cycle}"
                )

    def at(self, target: float, direction: str) -> list[float]:
        """The deviations of a target in one direction, by cycle."""
        return [
            self.deviations[key] for key in sorted(key for key in self.deviations if key[:2] == (target, direction))
        ]

    @property
    def cycles(self) -> tuple[int, ...]:
        """Numbers of the cycles that have a reading."""
        return tuple(sorted({cycle for _, _, cycle in self.deviations}))

    @property
    def directions(self) -> tuple[str, ...]:
        """Directions that have a reading: "+", "-"."""
        return tuple(sorted({direction for _, direction, _ in self.deviations}))

    def _facts(self) -> Facts:
        line = [("line", self.line)] if self.line else []
        return [
            *line,
            ("targets", f"{len(self.targets)}, {self.targets[0]:g} to {self.targets[-1]:g} mm"),
            ("cycles", str(len(self.cycles))),
            ("directions", " and ".join(self.directions) or "none"),
            ("readings", f"{len(self.deviations)}, {self.lost} lost"),
        ]


@checked
def read_positions(path: str | PathLike[str]) -> PositionReadings:
    """Read repeated readings of targets: CSV, or a linear test of Renishaw's (.rtl).

    Columns, in any order: target_mm, direction (+ or -), cycle (integer), and either deviation_um (actual less target)
    or position_mm (actual). An empty last field is a lost reading. Raises InvalidArgument naming file and line."""
    content = read_bytes(Path(path))
    if is_rtl(content):
        rows, line = readings_of_rtl(decode(content)[0], str(path))
        read = [(where, target, direction, cycle, um * MICROMETRE) for where, target, direction, cycle, um in rows]
        return readings_of(read, line, str(path))
    text = read_text(Path(path))
    comments, _ = head_of(text)
    leading = dict(re.findall(r"(?m)^#\s*(\w+)\s*=\s*(.*?)\s*$", "\n".join(comments)))
    return readings_of(_read(text, str(path)), leading.get("line", ""), str(path))


# Where, set-point (mm), direction, cycle, deviation (mm; None: lost).
PositionRow = tuple[str, float, str, int, float | None]


def _read(text: str, path: str) -> list[PositionRow]:
    rows = _rows(text, path)
    at_line, header = next(rows, (0, []))
    if not header:
        raise InvalidArgument(f"{path}: the file has no rows")
    columns = [name.strip() for name in header]
    value_column = _value_column(columns, f"{path}, line {at_line}")
    read: list[PositionRow] = []
    for at_line, fields in rows:
        where = f"{path}, line {at_line}"
        if len(fields) != len(columns):
            raise InvalidArgument(f"{where}: expected {len(columns)} fields, got {len(fields)}")
        row = {name: field.strip() for name, field in zip(columns, fields, strict=True)}
        target = finite_number(row["target_mm"], f"{where}: target_mm")
        if row["direction"] not in ("+", "-"):
            raise InvalidArgument(f"{where}: direction: expected + or -, got {row['direction']!r}")
        if not re.fullmatch(r"\d{1,9}", row["cycle"]):
            raise InvalidArgument(f"{where}: cycle: expected a whole number, got {row['cycle']!r}")
        deviation = None
        if row[value_column]:
            value = finite_number(row[value_column], f"{where}: {value_column}")
            deviation = value * MICROMETRE if value_column == "deviation_um" else value - target
        read.append((where, target, row["direction"], int(row["cycle"]), deviation))
    return read


def readings_of(read: Sequence[PositionRow], line: str, path: str) -> PositionReadings:
    """The readings of a file. Raises InvalidArgument for a reading that is given twice."""
    target_of = _targets([(target, direction, cycle) for _, target, direction, cycle, _ in read])
    deviations: dict[tuple[float, str, int], float] = {}
    keys: set[tuple[float, str, int]] = set()
    for where, set_point, direction, cycle, deviation in read:
        key = target_of[set_point], direction, cycle
        if key in keys:
            raise InvalidArgument(f"{where}: target {key[0]:g} mm, direction {direction}, cycle {cycle} is given twice")
        keys.add(key)
        if deviation is not None:
            deviations[key] = deviation
    apart = max((abs(set_point - target) for set_point, target in target_of.items()), default=0.0)
    try:
        return PositionReadings(
            tuple(sorted(set(target_of.values()))),
            deviations,
            line,
            len(keys) - len(deviations),
            apart if apart > _ROUNDING else 0.0,
        )
    except InvalidArgument as error:
        raise InvalidArgument(f"{path}: {error}") from None


def _targets(rows: list[tuple[float, str, int]]) -> dict[float, float]:
    """Of each set-point its target: controllers log what they read back, a little off.

    A cycle comes to each target once in a direction, so its smallest step is one between targets; steps of less than a
    hundredth of the usual one are targets given twice. What is closer than half of it is one target, the plainest
    number among them."""
    series: dict[tuple[str, int], list[float]] = {}
    for target, direction, cycle in rows:
        series.setdefault((direction, cycle), []).append(target)
    steps = sorted(b - a for own in series.values() for a, b in pairwise(sorted(own)))
    usual = steps[len(steps) // 2] if steps else 0.0
    near = 0.5 * min((step for step in steps if step >= 0.01 * usual), default=0.0)
    groups: list[list[float]] = []
    for target in sorted({target for target, _, _ in rows}):
        if groups and target - groups[-1][-1] < max(near, _ROUNDING):
            groups[-1].append(target)
        else:
            groups.append([target])
    return {target: _plainest(group) for group in groups for target in group}


def _plainest(group: list[float]) -> float:
    """Between the first and the last the number with the fewest decimals, else the median."""
    median = group[len(group) // 2]
    for decimals in range(7):
        rounded = round(median, decimals)
        if group[0] <= rounded <= group[-1]:
            return rounded
    return median


def _rows(text: str, path: str) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and fields; comments and empty lines left out."""
    try:
        for line, words in enumerate(csv.reader(text.splitlines(), strict=True), start=1):
            if words and not words[0].lstrip().startswith("#"):
                yield line, words
    except csv.Error as error:
        raise InvalidArgument(f"{path}: expected CSV: {error}") from None


def _value_column(columns: list[str], where: str) -> str:
    """The column that holds the readings; raises InvalidArgument for columns other than those of the format."""
    expected = f"expected the columns {', '.join(_REQUIRED)} and one of {' and '.join(_VALUES)}"
    values: list[str] = [name for name in _VALUES if name in columns]
    if len(values) != 1 or sorted(columns) != sorted([*_REQUIRED, *values]):
        raise InvalidArgument(f"{where}: {expected}, got {', '.join(columns)}")
    return values[0]
