"""What lists, trends and searches need to know of a file, so that they need not read it again."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument
from stepdiag.book.layout import kind_of_entry, main_file
from stepdiag.calibration.volume import Verdict, decided, volume
from stepdiag.config.key_types import Section
from stepdiag.io.comp_set import check_set
from stepdiag.io.data_files import read_calibration, read_measurement
from stepdiag.units import MICROMETRE, MICRORADIAN

FACTS: Final = 1  # of this module: changes where facts of an earlier program must be made again
# Endings of files that stepdiag reads: one of another content is damaged.
READ: Final = (".csv", ".nc", ".toml", ".jsonl")

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

    def verdict(self, limit: float | None) -> Verdict | None:
        """Whether the machine is within the limit, µm; none where that cannot be said."""
        if limit is None or self.fit == "rejected" or self.largest is None or self.largest.bounds is None:
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
    kind = None
    try:
        kind = kind_of_entry(entry)
        return _read(entry, kind)
    except InvalidArgument as error:
        return Facts(kind=kind, damaged=str(error).replace(f"{main_file(entry)}: ", "").replace(f"{entry}", entry.name))


def _read(entry: Path, kind: str | None) -> Facts:
    path = main_file(entry)
    if kind is None and path.suffix.lower() in READ:
        raise InvalidArgument(f"{path}: is not a file that stepdiag recognises")
    if kind == "calibration":
        return _of_calibration(read_calibration(path))
    if kind == "measurement":
        run = read_measurement(path)
        lines = dict.fromkeys(run.line)
        lost = int(np.count_nonzero(np.any([np.isnan(values) for values in run.channels.values()], axis=0)))
        said = f"{len(run)} points on {', '.join(lines)}" + (f"; {lost} lack a reading" if lost else "")
        return Facts(kind=kind, summary=said)
    if kind == "scenario":
        from stepdiag.display import lengths_text, lines_text
        from stepdiag.scenario.description import read_scenario

        scenario = read_scenario(path)
        known = scenario.known
        said = f"{lengths_text(known.plan.volume)}, {known.chain.name}, {lines_text(known.plan)}"
        return Facts(kind=kind, summary=said, warnings=tuple(known.implausible))
    if kind == "compensation.ini":
        tables, _ = check_set(path)
        return Facts(kind=kind, summary=f"{tables} tables")
    return Facts(kind=kind)


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
