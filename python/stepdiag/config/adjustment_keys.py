"""The keys of a scenario that say what an adjustment takes for unknown: `[adjustment]`, `[smoothness]`."""

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from stepdiag.config.key_types import AMPLITUDE, Amplitude, Section, key, tables
from stepdiag.setup_quantities import SETUP_QUANTITIES
from stepdiag.units import unit_of


def _weighs(choice: str | float) -> str | float:
    if isinstance(choice, str) or 0.0 < choice <= 1e9:
        return choice
    raise ValueError("not positive")


Choice = Annotated[Literal["free", "fixed"] | float, AfterValidator(_weighs)]

Drift = Annotated[float, Field(ge=0.0, le=1e6)]

_choice = '"free", "fixed" or a positive standard uncertainty'


def _prior(name: str, but: str = "") -> Any:
    """The key of a set-up unknown, with the meaning and the default that the core's table gives it."""
    quantity = SETUP_QUANTITIES[name]
    number = float(f"{quantity.prior / unit_of(quantity.key).native:.12g}")
    default = {math.inf: "free", 0.0: "fixed"}.get(quantity.prior, number)
    where = f"Layout `{quantity.layout}`: " if quantity.layout else ""
    meaning = where + quantity.meaning if where else quantity.meaning[0].upper() + quantity.meaning[1:]
    shown = default if isinstance(default, str) else f"{default:g}"
    return key(_choice, f"{meaning}; by default {shown}{but}.", None, default)


class AdjustmentKeys(Section):
    """What an adjustment takes each unknown of a line's set-up for."""

    reflector_urad: Choice | None = _prior("reflector")
    laser_urad: Choice | None = _prior(
        "laser", ", but 2000 for a layout `multi_beam` whose `beam_constants_um` are not fixed"
    )
    distance_constant_mm: Choice | None = _prior("distance_constant")
    beam_constants_um: Choice | None = _prior("beam_constants")
    psd_zero_mm: Choice | None = _prior("psd_zero")
    lateral_mm: Choice | None = _prior("lateral")
    roll_urad: Choice | None = _prior("roll")
    gain: Choice | None = _prior("gain")
    drift_um_per_h: Choice | None = _prior(
        "drift", ", but fixed where a reading of the line has no time (column `time_s`)"
    )


class AdjustmentSection(AdjustmentKeys):
    """Priors of the set-up unknowns of the adjustment. Other methods do not use this section.

    Each value is "free", "fixed" at 0, or a number: the standard uncertainty with which the unknown is known to be 0.
    (Lateral offset, roll and gain act on tilts only; for them "free" means 1 m, 1 rad and 1.)
    `[adjustment.LINE]` replaces, for one line, the keys it names. Scale lines take `reflector_urad` and `laser_urad`
    from a table of their own only: by default their mirror is free, and their laser is along the axis to 500 (never
    "free"). Tilts determine the difference of both. What they leave open acts by its square, as an error of the
    distances proportional to the travel, which is part of the uncertainties. The same applies to single axes and faces,
    where distances alone are read, and where beams have constants; an angle that is "free" there counts as known to
    2000. On a scale line where no reading determines the difference, `reflector_urad` is that of the mirror against the
    beam, by default 500."""

    angles: Literal["free", "fixed"] = key(
        '"free" or "fixed"', "Rotations of the machine's axes; fixed: it has none.", "free"
    )
    machine_drift_um_per_h: Drift | tuple[Drift, Drift, Drift] = key(
        "a drift in µm/h of at least 0, or three for X, Y, Z",
        "Standard uncertainty of a drift of the functional point along X, Y, Z, linear in time since the run's first "
        "reading: of spindle, structure or mounts of the heads. Its rates are unknowns with this prior; 0: none. "
        "Needs the time of every reading; `plan.check_points` determine it.",
        0.0,
    )
    machine_drift_um_per_k: Drift | tuple[Drift, Drift, Drift] = key(
        "a drift in µm/K of at least 0, or three for X, Y, Z",
        "The same, linear in the temperature of `machine_drift_with`; one of the two.",
        0.0,
    )
    machine_drift_with: Literal["temperature", "temperature_x", "temperature_y", "temperature_z", "air_temperature"] = (
        key(
            "the column of a temperature without its unit",
            "What `machine_drift_um_per_k` goes with, a column of the run such as `air_temperature_c`.",
            "air_temperature",
        )
    )
    one_setup_per_line: bool = key(
        "true or false",
        "Head and mirror stay on a line for all of its runs; otherwise each run of a line has a set-up of its own, "
        "which its backward run shares.",
        False,
    )
    reversal: bool = key(
        "true or false", "Where there are backward runs: errors of their own for nodes approached backward.", True
    )
    outlier_probability: Annotated[float, Field(ge=0.0, le=0.5)] = key(
        "a probability from 0 to 0.5",
        "Faults of readings are found and corrected at this probability of a false alarm among a thousand tests, which "
        "is what a run of 20 steps has; 0: they are found and named, not corrected.",
        1.2e-4,
    )
    slips: Literal["report", "estimate"] = key(
        '"report" or "estimate"',
        "What becomes of slips: offsets of a channel from a point of a line on. Their sizes are unknowns in any case; "
        "report: the fit is rejected; estimate: it is judged with them.",
        "report",
    )
    scale_uncertainty: bool = key(
        "true or false",
        "Where the readings scatter more than stated (variance factor above 1) and no channel was weighed with its own "
        "scatter, all stated uncertainties are multiplied by the root of the variance factor, and the fit is doubtful "
        "at best.",
        False,
    )
    by_line: dict[str, AdjustmentKeys] = tables("LINE")


class SmoothnessSection(Section):
    """Smoothness of the errors in the adjustment: the standard deviation with which second differences of neighbouring
    nodes are known to be 0.

    Without this section nothing is smoothed. Use it for axes whose errors are known to be smooth over a step. It
    reduces noise and hides errors of fine pitch; docs/method.md shows both effects."""

    translation_um: Amplitude = key(AMPLITUDE, "Of positioning errors and straightnesses; 0: not smoothed.", 0.0, 0.5)
    rotation_urad: Amplitude = key(AMPLITUDE, "Of angular errors; 0: not smoothed.", 0.0, 1.0)
    cross_validated: bool = key(
        "true or false",
        "Finds the deviation of each function from the readings, by generalised cross-validation; the two above then "
        "are the smallest that it may find.",
        False,
    )
