"""A scenario's `[adjustment]` and `[smoothness]` in native units (mm, rad, s): what an adjustment takes for unknown."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.adjustment_keys import AdjustmentKeys, AdjustmentSection, SmoothnessSection
from stepdiag.config.key_errors import show
from stepdiag.config.scenario_keys import KnownKeys, PlausibleSection
from stepdiag.config.toml_text import located
from stepdiag.units import MICROMETRE, MICRORADIAN

HOUR: Final = 3600.0  # s
METRE: Final = 1000.0  # mm

# Of each key: the core's quantity, and its unit in native ones.
QUANTITIES: Final[Mapping[str, tuple[str, float]]] = {
    "reflector_urad": ("reflector", MICRORADIAN),
    "laser_urad": ("laser", MICRORADIAN),
    "distance_constant_mm": ("distance_constant", 1.0),
    "beam_constants_um": ("beam_constants", MICROMETRE),
    "psd_zero_mm": ("psd_zero", 1.0),
    "lateral_mm": ("lateral", 1.0),
    "roll_urad": ("roll", MICRORADIAN),
    "gain": ("gain", 1.0),
    "drift_um_per_h": ("drift", MICROMETRE / HOUR),
}

# How well a scale line's laser stands along its axis, where nothing is said (the core's default).
SCALE_LINE_ANGLE: Final = 500.0 * MICRORADIAN

# Keys that only one layout of heads has a meaning for: the layout, and what the others lack.
LAYOUT_OF: Final = {"psd_zero_mm": ("psd", "no spot"), "beam_constants_um": ("multi_beam", "no beams d1, d2, ...")}


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
    choices = {name: getattr(keys, name) for name in keys.model_fields_set & QUANTITIES.keys()}
    for name, (needed, lack) in LAYOUT_OF.items():
        if layout != needed and choices.get(name, "fixed") != "fixed":
            raise InvalidArgument(
                f"{place}.{name}: goes with the layout {show(needed)}; a head {show(layout)} has {lack}, "
                f"got {show(choices[name])}"
            )
    with located(place):
        return _core.SetupPriors(**native(choices))


def native(choices: Mapping[str, Any]) -> dict[str, Any]:
    """By the core's names: "free", "fixed", or a standard uncertainty in native units."""
    result = {}
    for key, choice in choices.items():
        quantity, unit = QUANTITIES[key]
        result[quantity] = choice if isinstance(choice, str) else choice * unit
    return result


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


def scale_line_angle(keys: AdjustmentSection, line: str) -> float:
    """The standard uncertainty of each of the laser's angles on a scale line, rad; 0: fixed."""
    own = keys.by_line[line].laser_urad if line in keys.by_line else None
    if own is None:
        return SCALE_LINE_ANGLE
    return 0.0 if isinstance(own, str) else own * MICRORADIAN
