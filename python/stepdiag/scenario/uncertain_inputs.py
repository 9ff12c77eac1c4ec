"""A scenario's `[uncertainty]` in native units (mm, rad, s): the uncertain inputs of its virtual calibrations."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.distribution_keys import StatedDistribution
from stepdiag.config.key_errors import show, suggest
from stepdiag.config.scenario_keys import KnownKeys
from stepdiag.config.toml_text import located
from stepdiag.config.uncertainty_keys import ComponentUncertaintyKeys, SetupUncertaintyKeys, UncertaintySection
from stepdiag.scenario.heads import DescribedHead
from stepdiag.scenario.setup import KEY_OF_READING, weights
from stepdiag.units import MICROMETRE, Unit, unit_of

# The core's quantities by their keys. A channel's noise has others: [noise] and uncertainty.channel.
QUANTITIES: Final[Mapping[str, _core.UncertainQuantity]] = {q.key: q for q in _core.uncertain_quantities() if q.key}
OF_SCALE_LINES: Final = ("scale_um", "scale_ppm")
STATE_OF_AIR: Final = ("temperature_c", "pressure_hpa", "humidity_percent")
# Keys of [instrument] that are the default of these.
OF_INSTRUMENT: Final = {"wavelength_ppm": "u_scale_ppm"} | {name: f"u_air_{name}" for name in STATE_OF_AIR}


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
    inputs = [*_of_lines(keys, head), *_of_components(section, described, head, place), *_of_all(keys, head)]
    inputs += _of_scales(keys, place)
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
    stated = {name: getattr(section, name) for name in section.model_fields_set & QUANTITIES.keys()}
    designed = any(one.design is not None for one in described.values())
    for name, value in stated.items():
        if isinstance(value, StatedDistribution) and value.is_certain:
            continue
        quantity, walks = QUANTITIES[name], name.endswith("_per_sqrt_h")
        if quantity.layout not in (None, head.layout):
            raise InvalidArgument(
                f"{place}.{name}: goes with the layout {show(quantity.layout)}, got {show(head.layout)}"
            )
        # A description has components in its place.
        if quantity.of == "head" and quantity.layout is not None and designed:
            raise InvalidArgument(
                f"{place}.{name}: goes with a head by its layout; a description has [uncertainty.head.COMPONENT]"
            )
        if name == "gain" and designed and head.layout == "multi_beam":
            raise InvalidArgument(f"{place}.gain: the beams of a described head stand where its design says")
        if name.endswith("_h") and keys.plan.seconds_per_reading is None:
            raise InvalidArgument(f"{place}.{name}: expected plan.seconds_per_reading as well, got none")
        if walks and value.kind != "normal":
            raise InvalidArgument(f'{place}.{name}: a random walk is normal, got the distribution "{value.kind}"')
        if walks and value.expectation != 0.0:
            raise InvalidArgument(f"{place}.{name}.expectation: a random walk has none; a drift is linear in time")
        if name in OF_SCALE_LINES and isinstance(section, UncertaintySection) and not keys.plan.scale_lines:
            raise InvalidArgument(f"{place}.{name}: goes with plan.scale_lines, got none")


def _of_lines(keys: KnownKeys, head: _core.Head) -> Iterator[_core.UncertainInput]:
    shared = keys.uncertainty
    for line in [*keys.plan.lines, *keys.plan.scale_lines]:
        own = shared.by_line.get(line, SetupUncertaintyKeys.model_construct())
        for name in SetupUncertaintyKeys.model_fields:
            of_all = (name in OF_SCALE_LINES) == (line in keys.plan.scale_lines)
            stated = getattr(own, name) or (getattr(shared, name) if of_all else None)
            yield from _inputs(stated, name, head, line=line)


def uncertain_air_key(keys: KnownKeys) -> str | None:
    """The first key that says that the state of the air is uncertain, with its section; None: there is none."""
    for name in STATE_OF_AIR:
        stated, own = getattr(keys.uncertainty, name), OF_INSTRUMENT[name]
        if stated is not None and not stated.is_certain:
            return f"uncertainty.{name}"
        if stated is None and getattr(keys.instrument, own):
            return f"instrument.{own}"
    return None


def _of_components(
    section: UncertaintySection, described: Mapping[str, DescribedHead], head: _core.Head, place: str
) -> Iterator[_core.UncertainInput]:
    known = list(dict.fromkeys(name for one in described.values() for name in one.components))
    for part, own in section.head.items():
        if not known:
            raise InvalidArgument(f"{place}.head.{part}: goes with a described head; a layout has no components")
        if part not in known:
            raise InvalidArgument(f"{place}.head.{part}: no component of the head; {suggest(part, known)}")
        for name in ComponentUncertaintyKeys.model_fields:
            yield from _inputs(getattr(own, name), name, head, part=part)


def _of_all(keys: KnownKeys, head: _core.Head) -> Iterator[_core.UncertainInput]:
    for name, quantity in QUANTITIES.items():
        if quantity.of in ("head", "air", "machine"):
            yield from _inputs(getattr(keys.uncertainty, name) or _of_instrument(keys, name), name, head)


def _of_instrument(keys: KnownKeys, name: str) -> StatedDistribution | None:
    """What its certificate says of a quantity of the air or the wavelength."""
    own = OF_INSTRUMENT.get(name)
    stated = None if own is None else getattr(keys.instrument, own)
    return None if stated is None else StatedDistribution("normal", stated)


def _of_scales(keys: KnownKeys, place: str) -> Iterator[_core.UncertainInput]:
    """By axis where [temperature] has a number for each, else in common."""
    scales, section = keys.temperature, keys.uncertainty
    if scales is None:
        for name in ("expansion_um_per_m_k", "scale_temperature_c", "scale_temperature_c_per_h"):
            if getattr(section, name) is not None:
                raise InvalidArgument(f"{place}.{name}: goes with [temperature], which is missing")
        return
    sensors = 3 if isinstance(scales.axes_c, tuple) else 1
    coefficients = scales.u_expansion_um_per_m_k
    for name, by_axis in (
        ("expansion_um_per_m_k", coefficients if isinstance(coefficients, tuple) else (coefficients,)),
        ("scale_temperature_c", (scales.u_temperature_c,) * sensors),
        ("scale_temperature_c_per_h", (0.0,) * sensors),
    ):
        quantity = QUANTITIES[name].name if len(by_axis) == 3 else f"common_{QUANTITIES[name].name}"
        for axis, uncertainty in enumerate(by_axis):
            stated = getattr(section, name) or StatedDistribution("normal", uncertainty)
            if not stated.is_certain:
                yield _core.UncertainInput(quantity, stated.native(unit_of(name).native), component=axis)


def _inputs(
    stated: StatedDistribution | None, key: str, head: _core.Head, *, line: str = "", part: str = ""
) -> Iterator[_core.UncertainInput]:
    if stated is None or stated.is_certain:
        return
    quantity, distribution = QUANTITIES[key], stated.native(unit_of(key).native)
    for component in range(quantity.count(len(head.signals))):
        yield _core.UncertainInput(quantity.name, distribution, line=line, part=part, component=component)


def _noise(keys: KnownKeys, head: _core.Head, place: str) -> Iterator[_core.ReadingNoise]:
    """Of every channel that is read, by its own key, that of its kind, [noise] or the weight, in this order."""
    section, weight = keys.uncertainty, weights(keys)
    channels = head.signals if keys.head.tilts else ["distance"]
    own = _own_noise(section, channels, place)
    for channel in channels:
        kind = kind_of_channel(channel)
        key = KEY_OF_READING[kind]
        stated = own.get(channel) or getattr(section, key)
        if stated is None:
            distribution = _core.Distribution("normal", spread=getattr(weight, kind))
        else:
            distribution = stated.native(unit_of(key).native)
        if distribution.spread > 0.0 or distribution.expectation != 0.0:
            yield _core.ReadingNoise("channel", distribution, channel=channel)
    common = section.common_um or StatedDistribution("normal", keys.noise.common_um)
    if not common.is_certain:
        yield _core.ReadingNoise("common", common.native(MICROMETRE))
    for name, quantity in QUANTITIES.items():
        stated = getattr(section, name) if quantity.of == "noise" and quantity.name != "common" else None
        if stated is not None and not stated.is_certain:
            for component in range(quantity.count(len(channels))):
                yield _core.ReadingNoise(quantity.name, stated.native(unit_of(name).native), component=component)


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


def key_unit(one: _core.UncertainInput | _core.ReadingNoise) -> Unit:
    """The unit of the key that an input or noise comes from."""
    if isinstance(one, _core.ReadingNoise) and one.channel:
        return unit_of(KEY_OF_READING[kind_of_channel(one.channel)])
    of_axes = one.quantity.removeprefix("common_")  # of scales
    return unit_of(next(key for key, q in QUANTITIES.items() if q.name in (one.quantity, of_axes)))
