"""The keys of a scenario that say what is uncertain, and how it is distributed: `[uncertainty]`."""

from dataclasses import dataclass
from typing import Annotated, Any, Final

from pydantic import PlainValidator
from pydantic_core import PydanticCustomError

from stepdiag.config.distribution_keys import POSITIVE_SPREAD, SPREAD, PositiveSpread, Spread, SpreadsByChannel
from stepdiag.config.key_errors import OWN_WORDS, show, suggest
from stepdiag.config.key_types import DEVIATION, Amplitude, Section, key, tables


def _uncertain(meaning: str, example: Any = None) -> Any:
    return key(SPREAD, meaning, None, example)


def _noise(meaning: str, example: Any) -> Any:
    return key(POSITIVE_SPREAD, meaning, None, example)


class SetupUncertaintyKeys(Section):
    """How uncertain the set-up of one line is; see `[uncertainty]`."""

    reflector_urad: Spread | None = _uncertain("Tilts a and b of the mirror about local x and y, each.", 300.0)
    laser_urad: Spread | None = _uncertain("Tilts a and b of the beam and the sensor's axes, each.", 100.0)
    psd_zero_mm: Spread | None = _uncertain("Layout `psd`: reading of a centred spot along x and y, each.", 0.1)
    distance_constant_mm: Spread | None = _uncertain("Constant error of all distances of a line.", 0.01)
    beam_constants_um: Spread | None = _uncertain("Layout `multi_beam`: and each of d1, d2, ... by itself.", 1.0)
    lateral_mm: Spread | None = _uncertain("Offset of the beam's origin along local x and y, each.", 0.5)
    roll_urad: Spread | None = _uncertain("Roll of the head about its beam.", 1000.0)
    gain: Spread | None = _uncertain(
        "Relative error of tilts (of spots; of the beams' offsets); not of a traced layout `multi_beam`.", 0.002
    )
    drift_um_per_h: Spread | None = _uncertain(
        "Drift of all distances, linear in time since a line's first reading; needs `plan.seconds_per_reading`.", 0.5
    )
    scale_um: Spread | None = _uncertain(
        "Error of the distances at a line's last point: the uncertainty of a length standard. Along a scale "
        "line it grows with the travel. In `[uncertainty]` itself it is that of the scale lines, each by itself, and "
        "of no others.",
        0.2,
    )
    scale_ppm: Spread | None = _uncertain(
        "Relative error of a line's travel; in `[uncertainty]` itself that of the scale lines, each by itself.", 0.5
    )


class ComponentUncertaintyKeys(Section):
    """Uncertainty of the pose of a component of the described head, along the axes of the head; common to all lines."""

    shift_um: Spread | None = _uncertain("Shift along the head's x, y, z, each.", 10.0)
    rotation_urad: Spread | None = _uncertain("Rotation about x, y, z through the component's own origin, each.", 50.0)


@dataclass(frozen=True)
class CorrelatedInputs:
    """Names of inputs, and the matrix of their correlations."""

    names: tuple[str, ...]
    correlation: tuple[tuple[float, ...], ...]


_CORRELATED: Final = ("inputs", "correlation")
_correlated = 'tables such as {inputs = ["temperature", "pressure"], correlation = [[1.0, 0.5], [0.5, 1.0]]}'


def _correlations(value: Any) -> tuple[CorrelatedInputs, ...]:
    def fail(said: str, below: str = "") -> PydanticCustomError:
        return PydanticCustomError(OWN_WORDS, "{below}: {said}", {"below": below, "said": said})

    if not isinstance(value, list | tuple) or not all(isinstance(one, dict | CorrelatedInputs) for one in value):
        raise fail(f"expected {_correlated}, got {show(value)}")
    result = []
    for count, one in enumerate(value):
        place = f"[{count}]"
        if isinstance(one, CorrelatedInputs):
            result.append(one)
            continue
        for name in one:
            if name not in _CORRELATED:
                raise fail(f"unknown key; {suggest(name, _CORRELATED)}", f"{place}.{name}")
        for name in _CORRELATED:
            if name not in one:
                raise fail(f"missing; expected {_correlated}", f"{place}.{name}")
        names, matrix = one["inputs"], one["correlation"]
        if not isinstance(names, list | tuple) or len(names) < 2 or not all(isinstance(name, str) for name in names):
            raise fail(f"expected a list of two or more names of inputs, got {show(names)}", f"{place}.inputs")
        rows = matrix if isinstance(matrix, list | tuple) else ()
        if len(rows) != len(names) or not all(_is_row(row, len(names)) for row in rows):
            expected = f"{len(names)} rows of {len(names)} numbers from -1 to 1, as many as inputs"
            raise fail(f"expected {expected}, got {show(matrix)}", f"{place}.correlation")
        result.append(CorrelatedInputs(tuple(names), tuple(tuple(map(float, row)) for row in rows)))
    return tuple(result)


def _is_row(row: Any, length: int) -> bool:
    return (
        isinstance(row, list | tuple)
        and len(row) == length
        and all(isinstance(r, int | float) and not isinstance(r, bool) and -1.0 <= r <= 1.0 for r in row)
    )


class UncertaintySection(SetupUncertaintyKeys):
    """Uncertain inputs and their distributions: docs/uncertainty.md. Except for noise, only named inputs are uncertain.

    A number is the standard deviation of a normal distribution around 0. Others are tables: {distribution = "normal",
    standard = 3.0}, {distribution = "rectangular", half_width = 3.0}, likewise "triangular" and "arcsine",
    {distribution = "t", scale = 1.0, degrees_of_freedom = 5}, and {distribution = "curvilinear_trapezoid", half_width =
    3.0, edge = 0.5}: a rectangle whose limits are known to ± edge. They may have an expectation and, for effective
    degrees of freedom, degrees_of_freedom of their standard uncertainty. All values are deviations from what the other
    sections state, in the unit of the key.

    An evaluation uses only `distance_um`, `tilt_urad` and `spot_um`: their standard uncertainties are its
    weights. By default they are the positive standard deviations of `[noise]`, else 0.1 µm, 1 µrad and 1 µm; each key
    by itself. Columns u_... of a measurement file take precedence over these.

    Keys of a set-up, from `reflector_urad` to `drift_um_per_h`, apply to each of `plan.lines` separately;
    `[uncertainty.LINE]` replaces, for one line, the keys it names. Scale lines have those of their own tables only, and
    `scale_um` and `scale_ppm`. If a key has several components, each has this distribution and is drawn separately."""

    distance_um: PositiveSpread | None = _noise("Noise of distances (also d1, d2, ...), each reading by itself.", 0.1)
    tilt_urad: PositiveSpread | None = _noise("Noise of the tilts.", 1.0)
    spot_um: PositiveSpread | None = _noise("Noise of the spot position along x and y, each.", 1.0)
    common_um: Spread | None = _uncertain(
        "Noise that all distances of a point have in common; by default that of `[noise]`.", 0.05
    )
    channel: SpreadsByChannel | None = key(
        "a table of distributions by channel: distance_um, alpha_urad, beta_urad, spot_x_um, spot_y_um, d1_um, ...",
        "Noise of single channels, in place of that of their kind (0: none); weights stay as they are.",
        None,
        {"distance_um": 0.2},
    )
    psd_distance_mm: Spread | None = _uncertain(
        "Layout `psd` without description: the true distance of the position sensing device.", 0.05
    )
    beam_offsets_um: Spread | None = _uncertain(
        "Layout `multi_beam` without description: the true place of each beam along u and v, each.", 5.0
    )
    reading_model: Spread | None = _uncertain(
        "Distances read this times L φ² too much, L the distance and φ the angle of the mirror to the beam: 0 is the "
        "chief ray, -1.5 a single-mode interferometer.",
        {"distribution": "rectangular", "half_width": 0.75, "expectation": -0.75},
    )
    temperature_c: Spread | None = _uncertain(
        "True air beside the assumed one, as the next two; by default normal with `instrument.u_air_temperature_c`.",
        0.2,
    )
    pressure_hpa: Spread | None = _uncertain("Its pressure; by default with `instrument.u_air_pressure_hpa`.", 0.5)
    humidity_percent: Spread | None = _uncertain(
        "Its relative humidity; by default with `instrument.u_air_humidity_percent`.", 5.0
    )
    refractive_index_ppm: Spread | None = _uncertain("True index of the air, relative to that of its state.", 0.1)
    wavelength_ppm: Spread | None = _uncertain(
        "Vacuum wavelength of the lasers, relative, which is the scale of all distances; by default normal with "
        "`instrument.u_scale_ppm`.",
        0.02,
    )
    head_walk_um_per_sqrt_h: Spread | None = _uncertain(
        "Random walk of the distances since a line's first reading (normal); as the next two it needs "
        "`plan.seconds_per_reading`.",
        0.3,
    )
    machine_walk_um_per_sqrt_h: Spread | None = _uncertain(
        "Random walk of the functional point along X, Y, Z, each, since the run's first reading (normal).", 1.0
    )
    machine_drift_um_per_h: Spread | None = _uncertain(
        "Drift of the functional point along X, Y, Z, each, linear in time since the run's first reading.", 2.0
    )
    expansion_um_per_m_k: Spread | None = _uncertain(
        "Expansion coefficient of the scales; by default normal with `temperature.u_expansion_um_per_m_k`. Of each "
        "axis, or of all together, as `[temperature]` has it.",
        {"distribution": "rectangular", "half_width": 2.0},
    )
    scale_temperature_c: Spread | None = _uncertain(
        "True temperature of the scales beside that of the run, likewise; by default normal with "
        "`temperature.u_temperature_c`.",
        0.1,
    )
    scale_temperature_c_per_h: Spread | None = _uncertain(
        "A ramp of that, linear in time since the run's first reading, likewise; needs `plan.seconds_per_reading`.", 0.2
    )
    repeatability_um: Spread | None = _uncertain("Positioning at every point, along X, Y, Z, each.", 0.2)
    repeatability_urad: Spread | None = _uncertain("Orientation of the tool at every point, about X, Y, Z, each.", 0.5)
    between_nodes_um: Amplitude | None = key(
        DEVIATION,
        "Of the functional point along X, Y, Z, each, by errors between the nodes, which no reading shows: a number, "
        "no distribution. The calibration carries it to `volume` and `report`; no virtual calibration uses it. By "
        "default they estimate it from second differences of the tables.",
        None,
        0.5,
    )
    correlated: Annotated[tuple[CorrelatedInputs, ...], PlainValidator(_correlations)] = key(
        f"{_correlated}; or [[uncertainty.correlated]]",
        "Inputs that are jointly normal, by the names that `stepdiag uncertainty --inputs` lists.",
        (),
        [{"inputs": ["temperature", "pressure"], "correlation": [[1.0, 0.5], [0.5, 1.0]]}],
    )
    head: dict[str, ComponentUncertaintyKeys] = tables("COMPONENT")
    by_line: dict[str, SetupUncertaintyKeys] = tables("LINE")
