"""Which of our files is this, and is it sound?"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepdiag import _core
from stepdiag._core import Calibration, InvalidArgument
from stepdiag.display import lines_text
from stepdiag.findings.error_map import check_angles, frame_deviation_texts, implausible_texts
from stepdiag.findings.meaning import UNVERIFIED
from stepdiag.io.data_files import is_netcdf, read_calibration, read_measurement
from stepdiag.io.file_kind import NETCDF_BEGINS, head_of, kind_of_text
from stepdiag.io.refused_files import import_hint
from stepdiag.io.whole_files import check_input, read_beginning
from stepdiag.positions.readings import read_positions
from stepdiag.scenario.plausible_inputs import odd_columns


@dataclass(frozen=True)
class Finding:
    """What a sound file is, in a few words, and what is odd about it all the same.

    `unverified`: it is an unverified calibration, or was made from one."""

    kind: str
    summary: str
    warnings: tuple[str, ...] = ()
    calibration: Calibration | None = None
    unverified: bool = False

    @property
    def fit(self) -> str | None:
        """Verdict of a calibration."""
        return None if self.calibration is None else self.calibration.fit


def examine(path: Path) -> Finding:
    """Reads a file as the kind that its first lines show. Raises InvalidArgument where it is not sound."""
    check_input(path)
    if path.suffix.lower() == ".toml":
        return _toml(path)
    if is_netcdf(path):
        return _netcdf(path)
    text = read_beginning(path)
    _, header = head_of(text)
    readers = {
        "calibration": _calibration,
        "error map": _error_map,
        "raw readings": _raw,
        "measurement": _measurement,
        "table of target readings": _positions,
        "TOML file": _toml,
        "compensation.ini": _compensation,
    }
    kind = kind_of_text(text)
    if kind in readers:
        return readers[kind](path)
    if not header.strip():
        raise InvalidArgument(f"{path}: the file is empty, or has only comments")
    if header.startswith(NETCDF_BEGINS):
        raise InvalidArgument(f"{path}: is a netCDF file; the names of such files must end in .nc")
    raise InvalidArgument(
        f"{path}: expected a scenario or a head (TOML), a measurement, an error map or a calibration (CSV or .nc); "
        f'a CSV file begins with "line,point,..." or "parameter,position_mm,..."'
        f"{import_hint(path, 'measurement')}"
    )


def _toml(path: Path) -> Finding:
    """A head or a study where nothing but such a file has its sections, else a scenario."""
    from stepdiag.config.toml_text import parse_toml
    from stepdiag.io.whole_files import read_text

    content = parse_toml(read_text(path), str(path))
    if "study" in content:
        return _study(path)
    return _head(path) if {"beam", "body", "sensor"} & content.keys() else _scenario(path)


def _head(path: Path) -> Finding:
    from stepdiag.head.description import read_head_design

    design = read_head_design(path)
    counts = f"{len(design.bodies)} bodies, {len(design.beams)} beams, {len(design.sensors)} sensors"
    return Finding("head", f"{design.name}, layout {design.layout}, {counts}")


def _study(path: Path) -> Finding:
    from stepdiag.uncertainty.study_keys import read_study

    study = read_study(path)
    return Finding("study", f"{' x '.join(map(str, study.shape))} cells of {study.settings.samples} samples")


def _scenario(path: Path) -> Finding:
    from stepdiag.scenario.description import read_scenario
    from stepdiag.scenario.map_warnings import scenario_warnings

    scenario = read_scenario(path)
    known, plan = scenario.known, scenario.known.plan
    summary = f"{known.chain.name}, {lines_text(plan)}"
    scenario.machine()  # refuses an error map that is not sound
    scenario.actual_heads()  # and pose errors that push components into each other
    return Finding("scenario", summary, tuple(scenario_warnings(scenario)))


def _netcdf(path: Path) -> Finding:
    from stepdiag.io.netcdf_read import kind_of_netcdf

    return _measurement(path) if kind_of_netcdf(path) == "measurement" else _calibration(path)


def _measurement(path: Path) -> Finding:
    measurement = read_measurement(path)
    channels = measurement.channels
    lost = int(np.count_nonzero(np.any([np.isnan(values) for values in channels.values()], axis=0))) if channels else 0
    summary = f"{len(measurement)} points on {len(set(measurement.line))} lines, {', '.join(channels)}"
    of_readings = (f"{lost} points lack a reading",) if lost else ()
    return Finding("measurement", summary, (*of_readings, *odd_columns(measurement)))


def _positions(path: Path) -> Finding:
    readings = read_positions(path)
    summary = f"{len(readings.deviations)} readings of {len(readings.targets)} targets, {readings.lost} lost"
    return Finding("table of target readings", summary)


def _raw(path: Path) -> Finding:
    from stepdiag.acquisition.raw_file import read_raw

    content = read_raw(path)
    readings = content.readings().values()
    lost = sum(1 for reading in readings if reading.is_lost)
    summary = f"{len(readings)} of {content.planned} readings of {', '.join(content.header.channels)}, {lost} lost"
    rows = sum(1 for record in content.records if record.record == "temperatures")
    if rows:
        summary += f"; {rows} rows of temperatures"
    return Finding("raw readings", summary, () if content.torn is None else (content.torn,))


def _error_map(path: Path) -> Finding:
    errors = _core.read_error_map(path)
    check_angles(errors, str(path))
    count = len(errors.functions) + len(errors.squareness)
    unverified = "unverified" in errors.header  # made from such a calibration
    warnings = (*_warnings(errors), *([UNVERIFIED] if unverified else []))
    return Finding("error map", f"{count} of 21 parameters", warnings, unverified=unverified)


def _calibration(path: Path) -> Finding:
    calibration = read_calibration(path)
    count = len(calibration.functions) + len(calibration.squareness)
    slopes = calibration.undetermined_slopes
    summary = f"{calibration.method}, {calibration.chain.name}, {count} of 21 parameters"
    summary += f", slopes of {', '.join(slopes)} open" if slopes else " determined"
    if calibration.fit is not None:
        summary += f", fit {calibration.fit}"
    warnings = (*calibration.undetermined, *([UNVERIFIED] if calibration.unverified else []))
    return Finding("calibration", summary, warnings, calibration, calibration.unverified)


def _compensation(path: Path) -> Finding:
    from stepdiag.io.comp_set import check_set

    tables, unverified = check_set(path)
    known = [] if tables else ["no fingerprints of its tables: an export of an earlier version"]
    warnings = (*known, *([UNVERIFIED] if unverified else []))
    return Finding("compensation.ini", f"{tables} tables of the same export", warnings, unverified=unverified)


def _warnings(errors: _core.ErrorMap) -> Iterator[str]:
    """Against the volume that the map's header names, else against the ends of its own tables."""
    try:
        volume = [float(number) for number in errors.header.get("volume_mm", "").split()]
    except ValueError:
        volume = []
    if len(volume) != 3 or not all(map(math.isfinite, volume)):
        ends = {
            axis: max((p[-1] for name, (p, _) in errors.functions.items() if name[2] == axis), default=1.0)
            for axis in "XYZ"
        }
        volume = [float(ends[axis]) for axis in "XYZ"]
    yield from frame_deviation_texts(errors, volume)
    yield from implausible_texts(errors, volume, _core.PlausibleLimits())
