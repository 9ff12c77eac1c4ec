"""At which temperature a calibration holds, in words: referred to one, as found, or not known."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from stepdiag._core import Calibration, Measurement
from stepdiag.units import PPM

REFERENCE: Final = 20.0  # °C, ISO 1
STEEL: Final = 11.5  # µm/(m K)
MATTERS: Final = 0.1  # K: below it nothing is worth a warning


def temperature_text(calibration: Calibration) -> str:
    """To which temperature positioning errors belong; without a full stop."""
    if calibration.temperature_reference is not None:
        said = f"positioning errors are referred to {calibration.temperature_reference:g} °C"
        if calibration.expansion is None:
            return said
        numbers = [f"{coefficient / PPM:.4g}" for coefficient in calibration.expansion]
        numbers = numbers[:1] if len(set(numbers)) == 1 else numbers
        return f"{said}, with scales that expand by {', '.join(numbers)} µm/(m·K)"
    found = calibration.temperature_as_found
    if found is not None:
        return (
            f"positioning errors are as found, with the scales of X, Y, Z at {', '.join(f'{t:.1f}' for t in found)} °C"
        )
    edge = max(calibration.volume)
    grows = f"{STEEL * edge * 1e-3:.2g} µm a kelvin on {edge:g} mm"
    return f"no temperature was recorded; errors are as found (steel: {grows})"


def reference_mark(reference: float | None) -> str:
    """Whether positioning errors are as found or referred to a temperature, °C."""
    return "as found" if reference is None else f"referred to {reference:g} °C"


def temperature_mark(calibration: Calibration) -> str:
    """The same in few words, for figures and comparisons."""
    if calibration.temperature_reference is not None:
        return reference_mark(calibration.temperature_reference)
    found = calibration.temperature_as_found
    if found is None:
        return "temperature not recorded"
    if np.ptp(found) < MATTERS:
        return f"as found at {np.mean(found):.1f} °C"
    return f"as found at X {found[0]:.1f}, Y {found[1]:.1f}, Z {found[2]:.1f} °C"


def temperature_warnings(calibration: Calibration, measurement: Measurement) -> list[str]:
    """Of a run with temperatures that no [temperature] refers to a reference: how much is at stake."""
    if calibration.temperature_reference is not None or calibration.temperature_as_found is None:
        return []
    columns = [values for name, values in measurement.channels.items() if name.startswith("temperature")]
    warmth = np.concatenate(columns) - REFERENCE
    farthest = float(warmth[np.nanargmax(np.abs(warmth))])
    if abs(farthest) < MATTERS:
        return []
    edge = max(calibration.volume)
    return [
        f"temperatures of the run are up to {abs(farthest):.2g} K from {REFERENCE:g} °C, and the scenario has no "
        f"[temperature]: positioning errors are as found, up to {STEEL * abs(farthest) * edge * 1e-3:.2g} µm on "
        f"{edge:g} mm of steel"
    ]


def workpiece_rows(calibration: Calibration, expansion: float, temperature: float) -> Iterator[str]:
    """What parts as long as each axis travels will measure at 20 °C.

    expansion: of the workpiece, µm/(m K); temperature: at which it is machined or measured, °C. With ISO 1, a part is
    as long as it is at 20 °C."""
    reference = calibration.temperature_reference
    scales = "as they were" if reference is None else f"at {reference:g} °C"
    yield (
        f"a part of {expansion:g} µm/(m·K) that is machined at {temperature:g} °C, with the scales {scales}, at 20 °C"
    )
    for axis, name in (("X", "EXX"), ("Y", "EYY"), ("Z", "EZZ")):
        if name not in calibration.functions or name in calibration.undetermined_slopes:
            yield f"  along {axis}: not known, as the slope of {name} is not determined"
            continue
        position, value, _ = calibration.functions[name]
        length = float(position[-1])
        moved, shrunk = float(value[-1]) * 1e3, expansion * (temperature - REFERENCE) * length * 1e-3
        yield (
            f"  along {axis}: {moved - shrunk:+.3g} µm on {length:g} mm "
            f"({moved:+.3g} by the machine, {-shrunk:+.3g} by its own temperature)"
        )
