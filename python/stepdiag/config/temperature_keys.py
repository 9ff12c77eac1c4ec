"""Keys of `[temperature]`: how the scales of the axes expand, and how warm they are."""

from typing import Annotated, Final

from pydantic import Field

from stepdiag.config.key_types import THREE_LENGTHS, Section, Triple, key

LARGEST_EXPANSION: Final = 1000.0  # µm/(m K)
LOWEST: Final = -273.15  # °C
HIGHEST: Final = 1000.0

Expansion = Annotated[float, Field(ge=-LARGEST_EXPANSION, le=LARGEST_EXPANSION)]
Uncertainty = Annotated[float, Field(ge=0.0, le=LARGEST_EXPANSION)]
Celsius = Annotated[float, Field(ge=LOWEST, le=HIGHEST)]
Rate = Annotated[float, Field(ge=-HIGHEST, le=HIGHEST)]


class KnownTemperatureKeys(Section):
    """What is known of the scales."""

    expansion_um_per_m_k: Expansion | tuple[Expansion, Expansion, Expansion] = key(
        "a number, or three for X, Y, Z, in µm/(m K)",
        "Expansion coefficient of the scales, or of what positions the axes: one that all have in common, or three.",
        example=11.5,
    )
    u_expansion_um_per_m_k: Uncertainty | tuple[Uncertainty, Uncertainty, Uncertainty] = key(
        "a number of at least 0, or three where expansion_um_per_m_k has three",
        "Its standard uncertainty: one number of one coefficient, or three that are independent. The adjustment takes "
        "coefficients for unknowns with this prior; 0: they are known exactly.",
        example=1.0,
    )
    u_temperature_c: Annotated[float, Field(ge=0.0, le=100.0)] = key(
        "a number of at least 0, in kelvins",
        "Standard uncertainty of the constant deviation of each temperature sensor.",
        example=0.1,
    )
    low_expansion: bool = key(
        "true or false",
        "true: the scales are of a glass ceramic, Invar or another material that hardly expands. Coefficients below "
        "`plausible.inputs.expansion_um_per_m_k` are refused otherwise.",
        False,
    )
    fixed_point_mm: Triple = key(THREE_LENGTHS, "Positions of X, Y, Z from which their scales expand.", (0.0, 0.0, 0.0))
    reference_c: Celsius = key("a temperature in °C", "Temperature that results are referred to.", 20.0)
    axes_c: Celsius | tuple[Celsius, Celsius, Celsius] | None = key(
        "a temperature in °C, or three for X, Y, Z",
        "Temperature of the scales in lines for which the run has none; `simulate` starts with it, by default with "
        "`reference_c`. One number: one sensor, whose deviation is common to the axes.",
        None,
        23.0,
    )


class TrueTemperatureKeys(Section):
    """How the scales get warmer."""

    axes_c_per_h: Rate | tuple[Rate, Rate, Rate] = key(
        "a number, or three for X, Y, Z, in K/h",
        "Used by `simulate` only: the scales get warmer since the first reading; needs `plan.seconds_per_reading`.",
        0.0,
    )


class TemperatureSection(TrueTemperatureKeys, KnownTemperatureKeys):
    """Thermal expansion of the scales: docs/temperature.md. With this section, evaluations refer positioning errors to
    `reference_c`, by the columns `temperature_x_c`, `temperature_y_c`, `temperature_z_c` of a run, or `temperature_c`
    of one sensor for all axes. Without it, they are as found."""
