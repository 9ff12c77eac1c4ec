"""What lists, trends and searches need to know of a file, so that they need not read it again."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from stepdiag._core import Calibration, InvalidArgument
from stepdiag.book.layout import main_file
from stepdiag.calibration.volume import Verdict, decided, volume
from stepdiag.config.key_types import Section
from stepdiag.io.file_kind import kind_of_file
from stepdiag.presentation.file_check import examine
from stepdiag.units import MICROMETRE, MICRORADIAN

FACTS: Final = 1  # of this module: changes where facts of an earlier program must be made again
# Endings of files that stepdiag reads: one of another content is damaged.
READ: Final = (".csv", ".nc", ".toml", ".jsonl")
# Kinds that `stepdiag check` reads.
EXAMINED: Final = (
    "TOML file",
    "measurement",
    "calibration",
    "error map",
    "raw readings",
    "table of target readings",
    "compensation.ini",
)

# A value with its standard uncertainty (none: not known).
Value = tuple[float, float | None]


class LargestError(Section):
    """The largest error in the volume of a calibration, µm, see `stepdiag.calibration.volume.VolumeErrors`."""

    value: float
    interval: tuple[float, float] | None = None  # 95 %
    bounds: tuple[float, float] | None = None  # above the first, below the second, with 95 % each
    at: tuple[float, float, float]  # commanded, mm


class CalibrationFacts(Section):
    """Of a calibration that is not damaged."""

    method: str
    chain: str
    volume: tuple[float, float, float]  # mm
    fit: str | None = None
    reasons: tuple[str, ...] = ()  # of the fit's verdict
    unverified: bool = False
    undetermined: tuple[str, ...] = ()
    largest: LargestError | None = None  # none: a parameter that acts in it is not determined
    squareness: Mapping[str, Value] = {}  # µrad
    slopes: Mapping[str, Value] = {}  # of the positioning errors EXX, EYY, EZZ, µm/m
    temperatures: tuple[float, ...] = ()  # of the scales, °C: of X, Y, Z as found, or the one they are referred to
    referred: bool = False

    @property
    def not_counted(self) -> str:
        """Why it says nothing of the machine; empty if it does."""
        return "rejected" if self.fit == "rejected" else "unverified" if self.unverified else ""

    def verdict(self, limit: float | None) -> Verdict | None:
        """Whether the machine is within the limit, µm; none where that cannot be said."""
        if limit is None or self.not_counted or self.largest is None or self.largest.bounds is None:
            return None
        return decided(self.largest.bounds, limit)


class Facts(Section):
    """Of any file of the book."""

    made: int = FACTS
    kind: str | None = None  # as in file_kind.py
    summary: str = ""
    date: str = ""  # that the file states
    warnings: tuple[str, ...] = ()
    damaged: str = ""  # why the file cannot be read
    calibration: CalibrationFacts | None = None


def facts_of(entry: Path) -> Facts:
    """Read a file, or the main file of a folder. A damaged file has facts that say so; nothing is raised."""
    path, kind = main_file(entry), None
    try:
        kind = kind_of_file(path)
        if kind not in EXAMINED and (kind is not None or path.suffix.lower() not in READ):
            return Facts(kind=kind)
        found = examine(path)
        if found.calibration is not None:
            return _of_calibration(found.calibration)
        return Facts(kind=found.kind, summary=found.summary, warnings=found.warnings)
    except InvalidArgument as error:
        return Facts(kind=kind, damaged=str(error).replace(f"{path}: ", "").replace(f"{path}", path.name))


def _of_calibration(calibration: Calibration) -> Facts:
    if calibration.temperature_reference is not None:
        temperatures: tuple[float, ...] = (calibration.temperature_reference,)
    else:
        found = calibration.temperature_as_found
        temperatures = () if found is None else tuple(map(float, found))
    x, y, z = map(float, calibration.volume)
    facts = CalibrationFacts(
        method=calibration.method,
        chain=calibration.chain.name,
        volume=(x, y, z),
        fit=calibration.fit,
        reasons=tuple(calibration.fit_reasons),
        unverified=calibration.unverified,
        undetermined=tuple(calibration.undetermined),
        largest=_largest(calibration),
        squareness={
            name: _value(angle / MICRORADIAN, u / MICRORADIAN) for name, (angle, u) in calibration.squareness.items()
        },
        slopes=_slopes(calibration),
        temperatures=temperatures,
        referred=calibration.temperature_reference is not None,
    )
    return Facts(kind="calibration", summary=f"{facts.method}, {facts.chain}", date=calibration.date, calibration=facts)


def _largest(calibration: Calibration) -> LargestError | None:
    found = volume(calibration, ranking=False)
    if math.isnan(found.largest):
        return None
    x, y, z = map(float, found.largest_at)
    return LargestError(
        value=found.largest / MICROMETRE,
        interval=_in_micrometres(found.largest_interval),
        bounds=_in_micrometres(found.bounds),
        at=(x, y, z),
    )


def _in_micrometres(interval: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if interval is None else (interval[0] / MICROMETRE, interval[1] / MICROMETRE)


def _slopes(calibration: Calibration) -> dict[str, Value]:
    """Positioning at the end of travel, which is 0 at home, by the travel."""
    found: dict[str, Value] = {}
    for name in ("EXX", "EYY", "EZZ"):
        if name in calibration.functions and name not in calibration.undetermined_slopes:
            position, value, u = calibration.functions[name]
            metres = float(position[-1]) * 1e-3
            found[name] = _value(value[-1] / MICROMETRE / metres, u[-1] / MICROMETRE / metres)
    return found


def _value(value: float, u: float) -> Value:
    return float(value), None if math.isnan(u) else float(u)
