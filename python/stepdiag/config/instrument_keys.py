"""Keys of `[instrument]`: what the certificate of the instrument says."""

from typing import Annotated, Final

from pydantic import Field

from stepdiag.config.key_types import Section, key

LARGEST_SCALE: Final = 1000.0  # ppm

Scale = Annotated[float, Field(ge=-LARGEST_SCALE, le=LARGEST_SCALE)]
Uncertainty = Annotated[float, Field(ge=0.0, le=100.0)]

_uncertainty = "a number from 0 to 100"


class InstrumentSection(Section):
    """The instrument by its certificate: docs/uncertainty.md. An evaluation corrects the distances by `scale_ppm`; the
    adjustment adds the standard uncertainties to those of the machine's parameters, and `stepdiag uncertainty` takes
    them by default for `wavelength_ppm`, `temperature_c`, `pressure_hpa` and `humidity_percent` of `[uncertainty]`.

    What is not stated counts as known exactly, and every result says that it is not stated. Give standard
    uncertainties: half of an expanded uncertainty with k = 2, or a limit of error divided by √3. The temperature
    sensors of the scales are in `[temperature]`."""

    scale_ppm: Scale = key(
        f"a number from -{LARGEST_SCALE:g} to {LARGEST_SCALE:g}, in ppm",
        "Relative error of all distances: evaluations divide distances by 1 + this; `simulate` makes such distances.",
        0.0,
    )
    u_scale_ppm: Uncertainty | None = key(
        f"{_uncertainty}, in ppm",
        "Standard uncertainty of the distance scale (wavelength or frequency, without the air), common to all "
        "distances. No reading distinguishes it from a scale error of the machine.",
        None,
        0.1,
    )
    u_air_temperature_c: Uncertainty | None = key(
        f"{_uncertainty}, in kelvins",
        "Standard uncertainty of the temperature of the air along the beam, as the instrument's sensor or the run's "
        "column has it: 1 K is 0.93 ppm of all distances.",
        None,
        0.2,
    )
    u_air_pressure_hpa: Uncertainty | None = key(
        f"{_uncertainty}, in hPa", "Of its pressure, likewise: 1 hPa is 0.27 ppm.", None, 0.5
    )
    u_air_humidity_percent: Uncertainty | None = key(
        f"{_uncertainty}, in %", "Of its relative humidity, likewise: 10 % are 0.09 ppm.", None, 5.0
    )
