"""Runs, calibrations and adjustments that the tests of files and comparisons share."""

from __future__ import annotations

from typing import Any

import numpy as np
from usual import CHAIN, small_plan
from usual import SMALL_VOLUME as VOLUME

import stepdiag as sd

TOOL = (1.0, -2.0, 30.0)
PLAN = small_plan()


def simulate(seed: int, *, plan: sd.Plan = PLAN, head: sd.Head | None = None, **options: Any) -> sd.Measurement:
    """A noisy run of always the same machine."""
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=3, intervals=5), TOOL)
    noise = sd.Noise(distance=1e-4, tilt=1e-6, seed=seed)
    return sd.simulate(machine, plan, head or sd.Head(), noise=noise, **options)


def calibrate(seed: int, *, plan: sd.Plan = PLAN, **options: Any) -> sd.Calibration:
    return sd.methods.evaluate(simulate(seed, plan=plan), plan, sd.Head(), CHAIN, TOOL, **options)


def full_run() -> sd.Measurement:
    """A run with everything that a run can have: two directions, times, temperatures, weights, lost readings."""
    run = simulate(1, repeats=2, backward=True, seconds_per_reading=3.25)
    rows = np.arange(len(run))
    channels = run.channels | {"temperature": 20.0 + 0.01 * np.sin(rows)}
    channels["distance"][17] = channels["alpha"][18] = channels["temperature"][19] = np.nan
    uncertainty = {"distance": 1e-4 * (1.0 + rows), "alpha": np.where(rows == 3, np.nan, 1e-6 / 3.0)}
    return sd.Measurement(
        run.line,
        run.point,
        run.position,
        channels,
        run=run.run,
        direction=run.direction,
        standard_uncertainty=uncertainty,
    )


def same_run(one: sd.Measurement, other: sd.Measurement) -> bool:
    """Whether two runs have the same rows, channels and bits."""
    return (
        (one.line, one.direction) == (other.line, other.direction)
        and same_bits(one.point, other.point)
        and same_bits(one.run, other.run)
        and same_bits(one.position, other.position)
        and same_arrays(one.channels, other.channels)
        and same_arrays(one.standard_uncertainty, other.standard_uncertainty)
    )


def same_calibration(one: sd.Calibration, other: sd.Calibration) -> bool:
    """Whether two calibrations say the same, to the last bit; their dates do not matter."""
    return (
        (one.method, one.chain, one.undetermined) == (other.method, other.chain, other.undetermined)
        and one.provenance == other.provenance
        and one.undetermined_slopes == other.undetermined_slopes
        and one.undetermined_reversal_constants == other.undetermined_reversal_constants
        and same_bits(one.volume, other.volume)
        and same_bits(one.tool, other.tool)
        and all(
            same_arrays(tables_of(one, part), tables_of(other, part))
            for part in ("functions", "squareness", "reversal", "negative_functions")
        )
        and (one.covariance is None) == (other.covariance is None)
        and (one.covariance is None or same_bits(one.covariance, other.covariance))
    )


def tables_of(calibration: sd.Calibration, part: str) -> dict[str, Any]:
    tables: dict[str, Any] = getattr(calibration, part)
    return {f"{name} {i}": values for name, table in tables.items() for i, values in enumerate(table)}


def same_arrays(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return list(one) == list(other) and all(same_bits(one[name], other[name]) for name in one)


def same_bits(one: Any, other: Any) -> bool:
    """Equal, with NaN equal to NaN and the sign of zero counted."""
    a, b = np.asarray(one), np.asarray(other)
    if a.shape != b.shape or a.dtype != b.dtype:
        return False
    return bool(np.all((a == b) & (np.signbit(a) == np.signbit(b)) | (np.isnan(a) & np.isnan(b))))


def parts_of(calibration: sd.Calibration) -> dict[str, Any]:
    """What the constructor takes to make this calibration again."""
    return {
        "method": calibration.method,
        "chain": calibration.chain,
        "volume": calibration.volume,
        "tool": calibration.tool,
        "functions": calibration.functions,
        "squareness": calibration.squareness,
        "undetermined_slopes": calibration.undetermined_slopes,
        "undetermined": calibration.undetermined,
        "covariance": calibration.covariance,
        "reversal": calibration.reversal,
        "reversal_negative_uncertainty": {
            name: calibration.negative_functions[name][2] for name in calibration.reversal
        },
        "undetermined_reversal_constants": calibration.undetermined_reversal_constants,
        "date": calibration.date,
        "provenance": calibration.provenance,
    }
