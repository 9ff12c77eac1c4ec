"""What the commands tell about their results, as lines of text."""

from collections.abc import Iterator

import numpy as np

from stepdiag._core import Calibration, Measurement
from stepdiag.comparison import KINDS, kind_of
from stepdiag.scenario import Scenario
from stepdiag.sheet import lost_readings

MICRO = 1e6
UNIT = {"positioning": "µm", "straightness": "µm", "angle": "µrad", "squareness": "µrad"}


def in_report_units(kind: str, value: float) -> float:
    """mm to µm, rad to µrad."""
    return value * (1e3 if UNIT[kind] == "µm" else MICRO)


def evaluation_report(calibration: Calibration, measurement: Measurement, scenario: Scenario) -> Iterator[str]:
    """Method, largest standard uncertainty of each kind, lost readings, and what is not determined."""
    yield f"method: {calibration.method}, chain {calibration.chain.name}"
    yield f"readings: {len(measurement)} points on {len(set(measurement.line))} lines"
    incomplete, missing = lost_readings(measurement, scenario.plan, scenario.signals)
    if incomplete or missing:
        yield f"lost: {incomplete} rows without a complete reading, {missing} points of the plan without a row"
    yield "largest standard uncertainties:"
    yield from _largest_uncertainties(calibration)
    for sentence in calibration.undetermined:
        yield f"undetermined: {sentence}"
    if calibration.undetermined_slopes:
        yield "note: a function of undetermined slope is given by its shape, with both ends at 0"
    if scenario.keys.adjustment.model_fields_set:
        yield f"note: [adjustment] is not used by the method {calibration.method}"


def _largest_uncertainties(calibration: Calibration) -> Iterator[str]:
    largest: dict[str, tuple[float, str]] = {}

    def note(name: str, uncertainty: float, where: str) -> None:
        kind = kind_of(name)
        if np.isfinite(uncertainty) and uncertainty > largest.get(kind, (-1.0, ""))[0]:
            largest[kind] = uncertainty, f"{name}{where}"

    for name, (position, _, uncertainty) in calibration.functions.items():
        worst = int(np.argmax(uncertainty))
        note(name, float(uncertainty[worst]), f" at {position[worst]:g} mm")
    for name, (_, angle_uncertainty) in calibration.squareness.items():
        note(name, angle_uncertainty, "")
    for kind in KINDS:
        if kind in largest:
            worst_of_kind, where = largest[kind]
            yield f"  {kind:<13}{in_report_units(kind, worst_of_kind):9.3g} {UNIT[kind]:<5} ({where})"
