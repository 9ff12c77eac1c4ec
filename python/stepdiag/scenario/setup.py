"""A scenario's set-up in native units: misalignments, constants, noise, air and weights."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import BY_LINE, show
from stepdiag.config.scenario_head_keys import AirKeys, EnvironmentSection
from stepdiag.config.scenario_keys import KnownKeys, MisalignmentKeys, MisalignmentSection, NoiseSection, PlanSection
from stepdiag.config.toml_text import located
from stepdiag.setup_quantities import ADJUSTED
from stepdiag.units import HECTOPASCAL, MICROMETRE, PERCENT, native, unit_of

# Of the kinds of readings: the key of their noise.
KEY_OF_READING: Final = {"distance": "distance_um", "tilt": "tilt_urad", "spot": "spot_um"}


def misalignments(
    section: MisalignmentSection, plan: PlanSection, heads: Mapping[str, _core.Head], path: Path
) -> dict[str, _core.Misalignment]:
    """By line. A line that is missing is aligned."""
    result = {}
    for line in [*plan.lines, *plan.scale_lines]:
        own = section.by_line.get(line)
        if line in plan.scale_lines and own is None:
            continue
        shared = MisalignmentKeys.model_construct() if line in plan.scale_lines else section
        values = shared.model_dump(exclude={BY_LINE}) | (own.model_dump(exclude_unset=True) if own else {})
        place = f"misalignment.{line}" if own and own.beam_constants_um is not None else "misalignment"
        _check_beam_constants(values["beam_constants_um"], heads[line], f"{path}: {place}")
        given = {q.name: native(q.key, values[q.key]) for q in ADJUSTED if values[q.key] is not None}
        result[line] = _core.Misalignment(**given)
        if values["drift_um_per_h"] != 0.0 and plan.seconds_per_reading is None:
            place = f"misalignment.{line}" if own and "drift_um_per_h" in own.model_fields_set else "misalignment"
            raise InvalidArgument(
                f"{path}: {place}.drift_um_per_h: expected plan.seconds_per_reading as well, got none"
            )
    return result


def _check_beam_constants(constants: tuple[float, ...] | None, head: _core.Head, where: str) -> None:
    count = len(head.signals) if head.layout == "multi_beam" else 0
    if constants is not None and len(constants) != count:
        expected = f"{count} constants, one for each beam" if count else f"none, for the layout {show(head.layout)}"
        raise InvalidArgument(f"{where}.beam_constants_um: expected {expected}, got {show(constants)}")


def noise_of(keys: NoiseSection) -> _core.Noise:
    deviations = {name: native(key, getattr(keys, key)) for name, key in KEY_OF_READING.items()}
    return _core.Noise(**deviations, seed=keys.seed, common=keys.common_um * MICROMETRE)


Air = _core.Environment | None


def environments(keys: EnvironmentSection, path: Path) -> tuple[Air, Air]:
    """The air of the trace, and the air that readings are reduced with; None where nothing is said of it."""
    true = environment(keys, f"{path}: environment")
    if keys.assumed is None:
        return true, true
    mine = {name: getattr(keys.assumed, name) for name in keys.assumed.model_fields_set}
    others = {name: getattr(keys, name) for name in keys.model_fields_set & AirKeys.model_fields.keys()}
    if mine and ("refractive_index" in keys.model_fields_set) != ("refractive_index" in mine):
        others = {}  # an index takes the place of a state, and the other way round
    return true, environment(AirKeys.model_validate(others | mine), f"{path}: environment.assumed")


def counted_with(keys: EnvironmentSection, path: Path) -> Air:
    """The air with whose constant index the instrument counts; None where it compensates for the true one."""
    if keys.readings == "compensated":
        return None
    return environments(keys, path)[1] or _core.Environment.from_air()


def environment(keys: AirKeys, place: str) -> Air:
    """Air of the given state, at 20 °C and so on where it is not; or of the given index; None without either."""
    state = keys.model_fields_set & AirKeys.model_fields.keys() - {"refractive_index"}
    if "refractive_index" in keys.model_fields_set and state:
        named = ", ".join(sorted(state))
        raise InvalidArgument(f"{place}: expected refractive_index or a state of the air, got both ({named})")
    with located(place):
        if not state:
            return None if keys.refractive_index is None else _core.Environment(keys.refractive_index)
        values = {
            "temperature": keys.temperature_c,
            "pressure": None if keys.pressure_hpa is None else keys.pressure_hpa * HECTOPASCAL,
            "relative_humidity": None if keys.humidity_percent is None else keys.humidity_percent * PERCENT,
            "carbon_dioxide": keys.co2_ppm,
        }
        given = {name: value for name, value in values.items() if value is not None}
        return _core.Environment.from_air(equation=keys.equation or "ciddor", **given)


def weights(keys: KnownKeys) -> _core.ReadingUncertainty:
    """[uncertainty], else the positive deviations of [noise], else the core's defaults; key by key."""
    given = {}
    for name, key in KEY_OF_READING.items():
        # A standard deviation of 0 makes a perfect simulation; it is no statement about readings.
        stated, deviation = getattr(keys.uncertainty, key), getattr(keys.noise, key)
        if stated is not None:
            given[name] = stated.native(unit_of(key).native).standard_uncertainty
        elif deviation > 0.0:
            given[name] = native(key, deviation)
    return _core.ReadingUncertainty(**given)
