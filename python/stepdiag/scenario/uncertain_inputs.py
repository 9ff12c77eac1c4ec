"""A scenario's `[uncertainty]` in native units (mm, rad, s): the uncertain inputs of its virtual calibrations."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.distribution_keys import StatedDistribution
from stepdiag.config.key_errors import show, suggest
from stepdiag.config.scenario_keys import KnownKeys
from stepdiag.config.toml_text import located
from stepdiag.config.uncertainty_keys import SetupUncertaintyKeys, UncertaintySection
from stepdiag.head.description import components
from stepdiag.scenario.heads import DescribedHead
from stepdiag.scenario.setup import weights
from stepdiag.units import HECTOPASCAL, HOUR, MICROMETRE, MICRORADIAN, PERCENT

PPM: Final = 1e-6


class Meaning(NamedTuple):
    """Of a key: the core's quantity, the key's unit in native ones, and how many components it has."""

    quantity: str
    unit: float
    components: int = 1


OF_SETUP: Final[Mapping[str, Meaning]] = {
    "reflector_urad": Meaning("reflector", MICRORADIAN, 2),
    "laser_urad": Meaning("laser", MICRORADIAN, 2),
    "psd_zero_mm": Meaning("psd_zero", 1.0, 2),
    "distance_constant_mm": Meaning("distance_constant", 1.0),
    "beam_constants_um": Meaning("beam_constant", MICROMETRE),  # one for each beam
    "lateral_mm": Meaning("lateral", 1.0, 2),
    "roll_urad": Meaning("roll", MICRORADIAN),
    "gain": Meaning("gain", 1.0),
    "drift_um_per_h": Meaning("drift", MICROMETRE / HOUR),
    "scale_um": Meaning("scale_length", MICROMETRE),
    "scale_ppm": Meaning("scale_factor", PPM),
}
OF_SCALE_LINES: Final = ("scale_um", "scale_ppm")
OF_COMPONENT: Final[Mapping[str, Meaning]] = {
    "shift_um": Meaning("part_shift", MICROMETRE, 3),
    "rotation_urad": Meaning("part_rotation", MICRORADIAN, 3),
}
OF_ALL: Final[Mapping[str, Meaning]] = {
    "psd_distance_mm": Meaning("psd_distance", 1.0),
    "beam_offsets_um": Meaning("beam_offset", MICROMETRE),  # two for each beam
    "reading_model": Meaning("reading_model", 1.0),
    "temperature_c": Meaning("temperature", 1.0),
    "pressure_hpa": Meaning("pressure", HECTOPASCAL),
    "humidity_percent": Meaning("humidity", PERCENT),
    "refractive_index_ppm": Meaning("refractive_index", PPM),
    "wavelength_ppm": Meaning("wavelength", PPM),
    "machine_drift_um_per_h": Meaning("machine_drift", MICROMETRE / HOUR, 3),
}
OF_NOISE: Final[Mapping[str, Meaning]] = {
    "head_walk_um_per_sqrt_h": Meaning("head_walk", MICROMETRE / HOUR**0.5),
    "machine_walk_um_per_sqrt_h": Meaning("machine_walk", MICROMETRE / HOUR**0.5, 3),
    "repeatability_um": Meaning("position", MICROMETRE, 3),
    "repeatability_urad": Meaning("orientation", MICRORADIAN, 3),
}
STATE_OF_AIR: Final = ("temperature_c", "pressure_hpa", "humidity_percent")
WALKS: Final = ("head_walk_um_per_sqrt_h", "machine_walk_um_per_sqrt_h")
TIMED: Final = (*WALKS, "drift_um_per_h", "machine_drift_um_per_h")

# Keys that only one layout of heads has a meaning for.
LAYOUT_OF: Final = {
    "psd_zero_mm": "psd",
    "psd_distance_mm": "psd",
    "beam_constants_um": "multi_beam",
    "beam_offsets_um": "multi_beam",
}
BY_LAYOUT: Final = ("psd_distance_mm", "beam_offsets_um")  # a description has components in their place
_UNIT_NAMES: Final = {
    "um_per_sqrt_h": "µm/√h", "um_per_h": "µm/h", "um": "µm", "urad": "µrad", "mm": "mm", "ppm": "ppm", "c": "°C",
    "hpa": "hPa", "percent": "%",
}  # fmt: skip


def uncertain_inputs(
    keys: KnownKeys, described: Mapping[str, DescribedHead], heads: Mapping[str, _core.Head], path: Path
) -> _core.UncertainInputs:
    """What the section says, checked against head and plan. Raises InvalidArgument naming the key."""
    section, place = keys.uncertainty, f"{path}: uncertainty"
    head = next(iter(heads.values()))
    _check_fit(section, keys, described, head, place)
    for line, own in section.by_line.items():
        if line in described:
            _check_fit(own, keys, {line: described[line]}, head, f"{place}.{line}")
    inputs = [*_of_lines(keys, head), *_of_components(section, described, place), *_of_all(section, head)]
    noise, correlations = list(_noise(keys, head, place)), list(_correlations(section, inputs, place))
    with located(place):
        return _core.UncertainInputs(inputs, noise, correlations)


def _check_fit(
    section: SetupUncertaintyKeys,
    keys: KnownKeys,
    described: Mapping[str, DescribedHead],
    head: _core.Head,
    place: str,
) -> None:
    """Whether head and plan have what the keys are about."""
    stated = {
        name: getattr(section, name) for name in section.model_fields_set if name in {*OF_SETUP, *OF_ALL, *OF_NOISE}
    }
    designed = any(one.design is not None for one in described.values())
    for name, value in stated.items():
        if isinstance(value, StatedDistribution) and value.is_certain:
            continue
        needed = LAYOUT_OF.get(name, head.layout)
        if head.layout != needed:
            raise InvalidArgument(f"{place}.{name}: goes with the layout {show(needed)}, got {show(head.layout)}")
        if name in BY_LAYOUT and designed:
            raise InvalidArgument(
                f"{place}.{name}: goes with a head by its layout; a description has [uncertainty.head.COMPONENT]"
            )
        if name == "gain" and designed and head.layout == "multi_beam":
            raise InvalidArgument(f"{place}.gain: the beams of a described head stand where its design says")
        if name in TIMED and keys.plan.seconds_per_reading is None:
            raise InvalidArgument(f"{place}.{name}: expected plan.seconds_per_reading as well, got none")
        if name in WALKS and value.kind != "normal":
            raise InvalidArgument(f'{place}.{name}: a random walk is normal, got the distribution "{value.kind}"')
        if name in WALKS and value.expectation != 0.0:
            raise InvalidArgument(f"{place}.{name}.expectation: a random walk has none; a drift is linear in time")
        if name in OF_SCALE_LINES and isinstance(section, UncertaintySection) and not keys.plan.scale_lines:
            raise InvalidArgument(f"{place}.{name}: goes with plan.scale_lines, got none")


def _of_lines(keys: KnownKeys, head: _core.Head) -> Iterator[_core.UncertainInput]:
    shared = keys.uncertainty
    for line in [*keys.plan.lines, *keys.plan.scale_lines]:
        own = shared.by_line.get(line, SetupUncertaintyKeys())
        for name, meaning in OF_SETUP.items():
            of_all = (name in OF_SCALE_LINES) == (line in keys.plan.scale_lines)
            stated = getattr(own, name) or (getattr(shared, name) if of_all else None)
            count = len(head.signals) if name == "beam_constants_um" else meaning.components
            yield from _inputs(stated, meaning, count, line=line)


def _of_components(
    section: UncertaintySection, described: Mapping[str, DescribedHead], place: str
) -> Iterator[_core.UncertainInput]:
    designs = {head.place: head.design for head in described.values() if head.design is not None}
    known = list(dict.fromkeys(name for design in designs.values() for name in components(design)))
    for part, own in section.head.items():
        if not designs:
            raise InvalidArgument(f"{place}.head.{part}: goes with a described head; a layout has no components")
        if part not in known:
            raise InvalidArgument(f"{place}.head.{part}: no component of the head; {suggest(part, known)}")
        for name, meaning in OF_COMPONENT.items():
            yield from _inputs(getattr(own, name), meaning, meaning.components, part=part)


def _of_all(section: UncertaintySection, head: _core.Head) -> Iterator[_core.UncertainInput]:
    for name, meaning in OF_ALL.items():
        count = 2 * len(head.signals) if name == "beam_offsets_um" else meaning.components
        yield from _inputs(getattr(section, name), meaning, count)


def _inputs(
    stated: StatedDistribution | None, meaning: Meaning, count: int, *, line: str = "", part: str = ""
) -> Iterator[_core.UncertainInput]:
    if stated is None or stated.is_certain:
        return
    distribution = stated.native(meaning.unit)
    for component in range(count):
        yield _core.UncertainInput(meaning.quantity, distribution, line=line, part=part, component=component)


def _noise(keys: KnownKeys, head: _core.Head, place: str) -> Iterator[_core.ReadingNoise]:
    """Of every channel that is read, by its own key, that of its kind, [noise] or the weight, in this order."""
    section, weight = keys.uncertainty, weights(keys)
    channels = head.signals if keys.head.tilts else ["distance"]
    own = _own_noise(section, channels, place)
    for channel in channels:
        kind = kind_of_channel(channel)
        key, unit = {"distance": ("distance_um", MICROMETRE), "tilt": ("tilt_urad", MICRORADIAN)}.get(
            kind, ("spot_um", MICROMETRE)
        )
        stated = own.get(channel) or getattr(section, key)
        if stated is None:
            distribution = _core.Distribution("normal", spread=getattr(weight, kind))
        else:
            distribution = stated.native(unit)
        if distribution.spread > 0.0 or distribution.expectation != 0.0:
            yield _core.ReadingNoise("channel", distribution, channel=channel)
    common = section.common_um or StatedDistribution("normal", keys.noise.common_um)
    if not common.is_certain:
        yield _core.ReadingNoise("common", common.native(MICROMETRE))
    for name, meaning in OF_NOISE.items():
        stated = getattr(section, name)
        if stated is not None and not stated.is_certain:
            for component in range(meaning.components):
                yield _core.ReadingNoise(meaning.quantity, stated.native(meaning.unit), component=component)


def kind_of_channel(channel: str) -> str:
    """Which of the weights a channel has: distance, tilt or spot."""
    return (
        "distance"
        if re.fullmatch(r"distance|d[1-9][0-9]*", channel)
        else channel.partition("_")[0].replace("alpha", "tilt").replace("beta", "tilt")
    )


def _own_noise(section: UncertaintySection, channels: list[str], place: str) -> dict[str, StatedDistribution]:
    keys = {f"{channel}_{'urad' if kind_of_channel(channel) == 'tilt' else 'um'}": channel for channel in channels}
    for name in section.channel or {}:
        if name not in keys:
            raise InvalidArgument(f"{place}.channel.{name}: no channel of the run; {suggest(name, list(keys))}")
    return {keys[name]: stated for name, stated in (section.channel or {}).items()}


def _correlations(
    section: UncertaintySection, inputs: list[_core.UncertainInput], place: str
) -> Iterator[tuple[list[int], np.ndarray]]:
    names = [one.name for one in inputs]
    for count, correlated in enumerate(section.correlated):
        for name in correlated.names:
            where = f"{place}.correlated[{count}].inputs"
            if name not in names:
                raise InvalidArgument(f"{where}: {show(name)} is no uncertain input; {suggest(name, names)}")
            if inputs[names.index(name)].distribution.kind != "normal":
                raise InvalidArgument(f"{where}: {show(name)} is not normal; inputs are correlated as normal ones")
        yield [names.index(name) for name in correlated.names], np.array(correlated.correlation)


def key_units(one: _core.UncertainInput | _core.ReadingNoise) -> tuple[str, float]:
    """The unit of the key that an input or noise comes from: what it is called, and what it is in native ones."""
    if isinstance(one, _core.ReadingNoise) and one.quantity in ("channel", "common"):
        return ("µrad", MICRORADIAN) if kind_of_channel(one.channel) == "tilt" else ("µm", MICROMETRE)
    everything = {**OF_SETUP, **OF_COMPONENT, **OF_ALL, **OF_NOISE}
    key, meaning = next((k, m) for k, m in everything.items() if m.quantity == one.quantity)
    return next((name for ending, name in _UNIT_NAMES.items() if key.endswith(f"_{ending}")), ""), meaning.unit
