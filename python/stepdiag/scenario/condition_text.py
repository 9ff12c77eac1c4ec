"""The conditions that an evaluation used, as lines of text."""

from collections.abc import Iterator

import numpy as np

from stepdiag.scenario.conditions import AIR, AXES, Conditions, Range
from stepdiag.scenario.instrument import CHANNELS
from stepdiag.scenario.known import Known
from stepdiag.units import HECTOPASCAL, HOUR, PERCENT, PPM

AIR_UNITS = dict(zip(AIR, (("°C", 1.0), ("hPa", HECTOPASCAL), ("%", PERCENT)), strict=True))


def condition_rows(conditions: Conditions, known: Known) -> Iterator[str]:
    """Temperatures of the scales, their expansion, the air and its index, the instrument, the time; what was not
    recorded or stated has no line."""
    scales = [
        f"{axis.upper()} {_range(scale.range, '°C')} ({scale.origin})"
        for axis, scale in zip(AXES, conditions.scales, strict=True)
        if scale is not None
    ]
    if scales:
        yield f"scales: {', '.join(scales)}"
    if known.expansion is not None:
        expansion = known.expansion.expansion
        pairs = zip(expansion.coefficient, known.expansion.standard_uncertainty, strict=True)
        texts = [f"{coefficient / PPM:.4g} ± {u / PPM:.2g}" for coefficient, u in pairs]
        stated = texts[0] if len(set(texts)) == 1 else f"X, Y, Z {', '.join(texts)}"
        text = f"expansion stated: {stated} µm/(m·K), each sensor ± {known.expansion.sensor_uncertainty:.2g} K"
        if np.any(np.asarray(expansion.fixed_point)):
            text += f", from {', '.join(f'{p:g}' for p in expansion.fixed_point)} mm"
        yield text
    if conditions.air:
        recorded = ", ".join(
            _range((low / AIR_UNITS[name][1], high / AIR_UNITS[name][1]), AIR_UNITS[name][0])
            for name, (low, high) in conditions.air.items()
        )
        kind = "not used: the instrument compensates" if known.assumed_air is None else "used for the index"
        yield f"air recorded: {recorded} ({kind})"
    if conditions.index is not None:
        low, high = (f"{index:.8f}" for index in conditions.index)
        yield f"index of that air: {low if low == high else f'{low} to {high}'}, counted with {conditions.counted:.8f}"
    yield from _instrument(known)
    if conditions.span is not None:
        yield f"time from first to last reading: {conditions.span / HOUR:.2f} h"


def _instrument(known: Known) -> Iterator[str]:
    instrument, parts = known.instrument, []
    if instrument.scale != 0.0 or instrument.scale_uncertainty is not None:
        u = instrument.scale_uncertainty
        corrected = f"corrected by {instrument.scale / PPM:g} ppm" if instrument.scale else "not corrected"
        parts.append(f"distance scale {corrected}, {'u not stated' if u is None else f'± {u / PPM:.3g} ppm'}")
    if instrument.air:
        units = dict(zip(CHANNELS, ("K", "hPa", "%"), strict=True))
        factors = dict(zip(CHANNELS, (factor for _, factor in AIR_UNITS.values()), strict=True))
        stated = ", ".join(f"± {u / factors[name]:.3g} {units[name]}" for name, u in instrument.air.items())
        parts.append(f"sensors of the air {stated}")
    if parts:
        yield f"instrument stated: {'; '.join(parts)}"


def _range(values: Range, unit: str) -> str:
    low, high = (f"{value:.1f}" for value in values)
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"
