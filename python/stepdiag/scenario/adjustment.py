"""A scenario's `[adjustment]` and `[smoothness]` in native units (mm, rad, s): what an adjustment takes for unknown."""

import math
from pathlib import Path
from typing import Final

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.adjustment_keys import AdjustmentKeys, AdjustmentSection, SmoothnessSection
from stepdiag.config.key_errors import show
from stepdiag.config.scenario_keys import ChangeSection, KnownKeys, PlausibleSection
from stepdiag.config.toml_text import located
from stepdiag.scenario.temperature import three
from stepdiag.setup_quantities import ADJUSTED, SETUP_QUANTITIES
from stepdiag.units import MICROMETRE, MICRORADIAN, native

METRE: Final = 1000.0  # mm

# What heads of other layouts lack.
LACKING: Final = {"psd": "no spot", "multi_beam": "no beams d1, d2, ..."}


def setup_priors(keys: KnownKeys, layout: str, path: Path) -> tuple[_core.SetupPriors, dict[str, _core.SetupPriors]]:
    """Of all lines, and of the lines that have a table of their own."""
    shared = _priors(keys.adjustment, layout, f"{path}: adjustment")
    by_line = {}
    for line, own in keys.adjustment.by_line.items():
        place = f"{path}: adjustment.{line}"
        by_line[line] = _priors(own, layout, place)
        if line in keys.plan.scale_lines and own.laser_urad == "free":
            raise InvalidArgument(
                f'{place}.laser_urad: expected "fixed" or a positive standard uncertainty: the angle of a scale '
                'line acts at second order only, got "free"'
            )
    return shared, by_line


def _priors(keys: AdjustmentKeys, layout: str, place: str) -> _core.SetupPriors:
    choices = {q.name: getattr(keys, q.key) for q in ADJUSTED if q.key in keys.model_fields_set}
    for quantity in ADJUSTED:
        choice, needed = choices.get(quantity.name, "fixed"), quantity.layout
        if needed not in (None, layout) and choice != "fixed":
            raise InvalidArgument(
                f"{place}.{quantity.key}: goes with the layout {show(needed)}; a head {show(layout)} has "
                f"{LACKING[needed]}, got {show(choice)}"
            )
    with located(place):
        return _core.SetupPriors(**{q.name: native(q.key, choices[q.name]) for q in ADJUSTED if q.name in choices})


def machine_drift_of(keys: AdjustmentSection, path: Path) -> _core.MachineDrift | None:
    """None where the functional point is not taken to drift. Raises InvalidArgument naming the key."""
    by_time = three(native("_um_per_h", keys.machine_drift_um_per_h))
    by_temperature = three(native("_um_per_k", keys.machine_drift_um_per_k))
    if any(by_time) and any(by_temperature):
        raise InvalidArgument(
            f"{path}: adjustment: expected machine_drift_um_per_h or machine_drift_um_per_k, got both"
        )
    if any(by_temperature):
        return _core.MachineDrift(by_temperature, record=keys.machine_drift_with)
    return _core.MachineDrift(by_time) if any(by_time) else None


def smoothness_of(keys: SmoothnessSection, path: Path) -> _core.Smoothness | None:
    """None where nothing is to be smoothed."""
    if not (keys.translation_um or keys.rotation_urad or keys.cross_validated):
        return None
    with located(f"{path}: smoothness"):
        return _core.Smoothness(
            translation=keys.translation_um * MICROMETRE,
            rotation=keys.rotation_urad * MICRORADIAN,
            cross_validated=keys.cross_validated,
        )


def plausible_limits(keys: PlausibleSection) -> _core.PlausibleLimits:
    """What the scenario takes a machine for."""
    return _core.PlausibleLimits(
        positioning=keys.positioning_um_per_m * MICROMETRE / METRE,
        translation=keys.translation_um * MICROMETRE,
        rotation=keys.rotation_urad * MICRORADIAN,
    )


def change_priors(keys: ChangeSection) -> _core.ChangePriors:
    """How far the scenario's machine may have changed since its calibration."""
    return _core.ChangePriors(
        scale=keys.scale_um_per_m * MICROMETRE / METRE,
        bow=keys.bow_um * MICROMETRE,
        slope=keys.slope_urad * MICRORADIAN,
        squareness=keys.squareness_urad * MICRORADIAN,
    )


def scale_line_angle(keys: AdjustmentSection, line: str, quantity: str, *, is_known: bool = True) -> float:
    """The standard uncertainty of each angle of the laser or the reflector of a scale line, rad; 0: fixed.

    is_known: whether readings of the line determine the angle of the reflector against the laser."""
    record = SETUP_QUANTITIES[quantity]
    own = keys.by_line.get(line)
    choice = None if own is None else getattr(own, record.key)
    if choice is None:
        return record.scale_line_prior if is_known else record.scale_line_usual
    if isinstance(choice, str):
        return 0.0 if choice == "fixed" else math.inf if is_known else record.usual
    return float(choice) * MICRORADIAN
