"""Refractive indices with 40 digits: Ciddor (1996) as NIST computes it, Edlén (1966) and modified, and the glasses by
their catalogues.

Written from the publications; no code is shared with the core. `python exact_indices.py FOLDER` writes the files of the
self-test.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path

import mpmath
from mpmath import mpf

mpmath.mp.dps = 40
# temperature, °C; humidity, %; pressure, Pa; CO2, ppm; vacuum wavelength, nm
STATES = [
    ("20", "50", "101325", "450", "632.99"),
    ("-35", "90", "60000", "1000", "400"),
    ("-5", "100", "110000", "300", "1064"),
    ("45", "95", "135000", "1500", "350"),
    ("90", "100", "120000", "450", "633"),
    ("99", "70", "139000", "0", "1550"),
]
EQUATIONS = ("ciddor", "modified_edlen", "edlen_1966")
# SCHOTT's data sheets, squared µm; fused silica: Malitson (1965), whose constants are the roots of C.
GLASSES = {
    "N-BK7": ("1.03961212 0.231792344 1.01046945", "0.00600069867 0.0200179144 103.560653"),
    "K7": ("1.1273555 0.124412303 0.827100531", "0.00720341707 0.0269835916 100.384588"),
    "N-SK4": ("1.32993741 0.228542996 0.988465211", "0.00716874107 0.0246455892 100.886364"),
    "F2": ("1.34533359 0.209073176 0.937357162", "0.00997743871 0.0470450767 111.886764"),
    "N-SF11": ("1.73759695 0.313747346 1.89878101", "0.013188707 0.0623068142 155.23629"),
    "fused silica": ("0.6961663 0.4079426 0.8974794", "0.0684043 0.1162414 9.896161"),
}
WAVELENGTHS = ("404.6561", "632.8", "1529.582")  # in air, nm


def saturation(t: mpf) -> mpf:
    """Pressure of water vapour, Pa: Wagner's equation over ice, IAPWS-IF97 over water, as NIST uses them."""
    kelvin = t + mpf("273.15")
    if t < 0:
        theta = kelvin / mpf("273.16")
        exponent = mpf("-13.928169") * (1 - theta ** mpf("-1.5")) + mpf("34.7078238") * (1 - theta ** mpf("-1.25"))
        return mpf("611.657") * mpmath.exp(exponent)
    of_if97 = (
        "1.16705214528e3 -7.24213167032e5 -1.70738469401e1 1.20208247025e4 -3.23255503223e6 1.49151086135e1 "
        "-4.82326573616e3 4.05113405421e5 -2.38555575678e-1 6.50175348448e2"
    )
    k = [mpf(text) for text in of_if97.split()]
    omega = kelvin + k[8] / (kelvin - k[9])
    a = omega**2 + k[0] * omega + k[1]
    b = k[2] * omega**2 + k[3] * omega + k[4]
    c = k[5] * omega**2 + k[6] * omega + k[7]
    return 1000000 * (2 * c / (-b + mpmath.sqrt(b**2 - 4 * a * c))) ** 4


def compressibility(p: mpf, t: mpf, x: mpf) -> mpf:
    kelvin = t + mpf("273.15")
    a = [mpf(text) for text in ("1.58123e-6", "-2.9331e-8", "1.1043e-10")]
    b, c = [mpf("5.707e-6"), mpf("-2.051e-8")], [mpf("1.9898e-4"), mpf("-2.376e-6")]
    first = a[0] + a[1] * t + a[2] * t**2 + (b[0] + b[1] * t) * x + (c[0] + c[1] * t) * x**2
    return 1 - p / kelvin * first + (p / kelvin) ** 2 * (mpf("1.83e-11") - mpf("0.765e-8") * x**2)


def ciddor(t: mpf, humidity: mpf, p: mpf, co2: mpf, wavelength: mpf) -> mpf:
    sigma2 = (1000 / wavelength) ** 2
    gas = mpf("8.314472")
    f = mpf("1.00062") + mpf("3.14e-8") * p + mpf("5.60e-7") * t**2
    x = humidity / 100 * f * saturation(t) / p
    standard = mpf("1e-8") * (5792105 / (mpf("238.0185") - sigma2) + 167917 / (mpf("57.362") - sigma2))
    standard *= 1 + mpf("0.534e-6") * (co2 - 450)
    w = [mpf(text) for text in ("295.235", "2.6422", "-0.032380", "0.004028")]
    vapour = mpf("1.022e-8") * sum(w[i] * sigma2**i for i in range(4))
    dry, water = mpf("1e-3") * (mpf("28.9635") + mpf("12.011e-6") * (co2 - 400)), mpf("0.018015")
    # Compressibility of standard air and density of pure vapour as NIST prints them, rounded.
    of_standard = 101325 * dry / (mpf("0.9995922115") * gas * mpf("288.15"))
    z = compressibility(p, t, x)
    kelvin = t + mpf("273.15")
    of_dry = p * dry / (z * gas * kelvin) * (1 - x)
    of_vapour = p * water / (z * gas * kelvin) * x
    return 1 + of_dry / of_standard * standard + of_vapour / mpf("0.00985938") * vapour


def modified_edlen(t: mpf, humidity: mpf, p: mpf, _: mpf, wavelength: mpf) -> mpf:
    s = (1000 / wavelength) ** 2
    n_s = mpf("1e-8") * (mpf("8342.54") + 2406147 / (130 - s) + 15998 / (mpf("38.9") - s))
    x = (1 + mpf("1e-8") * (mpf("0.601") - mpf("0.00972") * t) * p) / (1 + mpf("0.003661") * t)
    vapour = humidity / 100 * saturation(t)
    water = mpf("1e-10") * mpf("292.75") / (t + mpf("273.15")) * (mpf("3.7345") - mpf("0.0401") * s) * vapour
    return 1 + p * n_s * x / mpf("96095.43") - water


def edlen_1966(t: mpf, humidity: mpf, p: mpf, _: mpf, wavelength: mpf) -> mpf:
    """Pressures in torr, as published."""
    s, torr = (1000 / wavelength) ** 2, mpf(101325) / 760
    n_s = mpf("1e-8") * (mpf("8342.13") + 2406030 / (130 - s) + 15997 / (mpf("38.9") - s))
    x = (1 + mpf("1e-6") * (mpf("0.817") - mpf("0.0133") * t) * p / torr) / (1 + mpf("0.0036610") * t)
    water = mpf("1e-8") * (mpf("5.722") - mpf("0.0457") * s) * humidity / 100 * saturation(t) / torr
    return 1 + p / torr * n_s * x / mpf("720.775") - water


def of_glass(name: str, in_air: mpf) -> mpf:
    """Relative to air, as catalogues have it."""
    b, c = ([mpf(text) for text in row.split()] for row in GLASSES[name])
    c = [one**2 for one in c] if name == "fused silica" else c
    square = (in_air / 1000) ** 2
    return mpmath.sqrt(1 + sum(b[i] * square / (square - c[i]) for i in range(3)))


def files() -> dict[str, str]:
    air = ["temperature_c,humidity_percent,pressure_pa,co2_ppm,wavelength_nm," + ",".join(EQUATIONS)]
    for state in STATES:
        values = [globals()[equation](*map(mpf, state)) for equation in EQUATIONS]
        air.append(",".join([*state, *(mpmath.nstr(value, 18) for value in values)]))
    glass = ["glass,wavelength_nm,index"]
    for name, wavelength in product(GLASSES, WAVELENGTHS):
        glass.append(f"{name},{wavelength},{mpmath.nstr(of_glass(name, mpf(wavelength)), 18)}")
    return {"air_exact.csv": "\n".join([*air, ""]), "glass_exact.csv": "\n".join([*glass, ""])}


if __name__ == "__main__":
    for name, text in files().items():
        (Path(sys.argv[1]) / name).write_text(text, encoding="utf-8")
