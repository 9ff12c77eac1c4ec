"""Light through the flat faces of a head, written a second time with 40 digits: nothing of the package.

A beam's path is given by the names of the faces that it meets. Snell's law is written as the conservation of the wave
vector's part along the face; poses are exact rotations about a component's own origin. Lengths in mm, angles in rad,
vacuum wavelengths in nm; everything in the sensor frame (beam along +z, reference plane z = 0).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from reference import DIGITS_40, MP, ErrorTable, Number, Scenario, Vector, head_of, mirror_of, turn

MIRROR = "mirror"
AXIS = {"x": 0, "y": 1, "z": 2}


def vector(*values: float | Number) -> Vector:
    return DIGITS_40.vector(values)


def unit(v: Vector) -> Vector:
    return v / MP.sqrt(v @ v)


@dataclass(frozen=True)
class Plane:
    point: Vector
    normal: Vector  # unit, of either side


@dataclass(frozen=True)
class Frame:
    """Where a component stands: its origin, and its axes as columns."""

    origin: Vector
    axes: np.ndarray

    def plane(self, point: Vector, normal: Vector) -> Plane:
        return Plane(self.origin + self.axes @ point, self.axes @ normal)

    def local(self, point: Vector) -> Vector:
        return self.axes.T @ (point - self.origin)


@dataclass(frozen=True)
class Component:
    """A component as the head's description gives it, and how it stands out of its place."""

    numbers: Mapping[str, Any] = field(default_factory=dict)
    position: Sequence[float] = (0.0, 0.0, 0.0)
    rotation: Sequence[float] = (0.0, 0.0, 0.0)
    shift: Sequence[float] = (0.0, 0.0, 0.0)
    turned: Sequence[float] = (0.0, 0.0, 0.0)

    @cached_property
    def frame(self) -> Frame:
        return Frame(
            vector(*self.position) + vector(*self.shift), turn(self.turned, DIGITS_40) @ turn(self.rotation, DIGITS_40)
        )

    def face(self, name: str) -> Plane:
        """ "+x" ... "-z": an outer face; "split": the splitting one."""
        if name == "split":
            return self.frame.plane(vector(0, 0, 0), unit(vector(1, 0, -1)))
        edges = [self.numbers.get(key, self.numbers.get("edge")) for key in ("width", "height", "thickness")]
        axis, sign = AXIS[name[1]], 1 if name[0] == "+" else -1
        point, normal = vector(0, 0, 0), vector(0, 0, 0)
        point[axis], normal[axis] = MP.mpf(edges[axis]) * sign / 2, MP.mpf(sign)
        if self.numbers.get("shape") == "wedge" and name == "+z":
            angle = MP.mpf(self.numbers["angle"])
            normal = vector(-MP.sin(angle), 0, MP.cos(angle))
        return self.frame.plane(point, normal)


@dataclass(frozen=True)
class Light:
    """A ray where it is now, and what it has gone through."""

    point: Vector
    direction: Vector
    index: Number
    optical_length: Number = 0  # sum of n t
    reduced_length: Number = 0  # sum of t / n

    def to(self, plane: Plane) -> Light:
        t = ((plane.point - self.point) @ plane.normal) / (self.direction @ plane.normal)
        assert t > 0, "light goes forward"
        return Light(
            self.point + t * self.direction,
            self.direction,
            self.index,
            self.optical_length + t * self.index,
            self.reduced_length + t / self.index,
        )

    def turned(self, direction: Vector, index: Number) -> Light:
        return Light(self.point, direction, index, self.optical_length, self.reduced_length)

    def refracted(self, plane: Plane, index: Number) -> Light:
        wave = self.index * self.direction
        across = wave @ plane.normal
        along = wave - across * plane.normal
        onward = MP.sqrt(index**2 - along @ along) * (1 if across > 0 else -1)
        return self.turned((along + onward * plane.normal) / index, index)

    def reflected(self, plane: Plane) -> Light:
        across = (self.direction @ plane.normal) * plane.normal
        return self.turned(self.direction - across - across, self.index)


@dataclass(frozen=True)
class Description:
    """A head's numbers. `routes`: for each beam the faces that it meets, e.g. "window +z", "cube split reflected"."""

    components: Mapping[str, Component]
    routes: Mapping[str, Sequence[str]]

    def arrive(self, beam: str, air: Number, mirror: Plane) -> tuple[Light, Frame]:
        """The light of a beam at the end of its route, and the frame of the component that it meets there."""
        source = self.components[beam].frame
        wavelength = self.components[beam].numbers["wavelength"]
        light = Light(source.origin, source.axes[:, 2], air)
        *way, end = self.routes[beam]
        for met in way:
            light = self._meet(light, met, air, mirror, wavelength)
        detector = self.components[end].frame
        return light.to(detector.plane(vector(0, 0, 0), vector(0, 0, 1))), detector

    def _meet(self, light: Light, met: str, air: Number, mirror: Plane, wavelength: float) -> Light:
        if met == MIRROR:
            return light.to(mirror).reflected(mirror)
        name, face, *what = met.split()
        component = self.components[name]
        plane = component.face(face)
        light = light.to(plane)
        if face == "split":
            return light.reflected(plane) if what == ["reflected"] else light
        in_air = light.index == air
        return light.refracted(plane, material_index(component.numbers["material"], wavelength) if in_air else air)


def half_path(description: Description, beam: str, air: Number, mirror: Plane) -> Number:
    return description.arrive(beam, air, mirror)[0].optical_length / (2 * air)


def spot(description: Description, beam: str, air: Number, mirror: Plane) -> Vector:
    """In the sensor's own axes."""
    light, sensor = description.arrive(beam, air, mirror)
    return sensor.local(light.point)[:2]


def tilted_mirror(distance: Number, alpha: Number = 0, beta: Number = 0, lateral: Sequence[float] = (0, 0)) -> Plane:
    return Plane(vector(*lateral, distance), unit(vector(beta, -MP.mpf(alpha), 1)))


def read_description(path: Path, routes: Mapping[str, str], errors: Mapping[str, Any] | None = None) -> Description:
    """As much of a head's TOML as the shipped heads use; `errors`: name -> (shift, rotation vector)."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    components = {}
    for kind in ("body", "beam", "sensor"):
        for name, keys in data.get(kind, {}).items():
            numbers = {key.removesuffix("_mm").removesuffix("_nm"): value for key, value in keys.items()}
            rotation = [math.radians(angle) for angle in numbers.get("rotation_deg", (0.0, 0.0, 0.0))]
            shift, turned = (errors or {}).get(name, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
            components[name] = Component(numbers, numbers.get("position", (0.0, 0.0, 0.0)), rotation, shift, turned)
    return Description(components, {beam: [met.strip() for met in text.split(",")] for beam, text in routes.items()})


def mirror_in_sensor_frame(
    scenario: Scenario, table: ErrorTable, line: str, commanded: Any, backward: bool = False
) -> Plane:
    """The mirror on the tool with the machine at a commanded position, as the head of the line sees it."""
    sensor = Frame(*head_of(scenario, line, DIGITS_40))
    point, normal = mirror_of(scenario, table, line, commanded, DIGITS_40, backward)
    return Plane(sensor.local(point), sensor.axes.T @ normal)


SELLMEIER = {  # SCHOTT: B1 B2 B3, C1 C2 C3 / um^2
    "N-BK7": ("1.03961212 0.231792344 1.01046945", "0.00600069867 0.0200179144 103.560653"),
}


@cache
def glass_index(name: str, wavelength: float) -> Number:
    """Absolute, by the vacuum wavelength: the catalogue has both in (dry) air of 20 degrees Celsius and 101325 Pa."""
    air = ciddor(wavelength, humidity=0.0)
    square = (MP.mpf(wavelength) / air / 1000) ** 2
    terms = zip(*(map(MP.mpf, text.split()) for text in SELLMEIER[name]), strict=True)
    relative = MP.sqrt(1 + MP.fsum(b * square / (square - c) for b, c in terms))
    return relative * air


def material_index(material: str | float, wavelength: float) -> Number:
    return glass_index(material, wavelength) if isinstance(material, str) else MP.mpf(material)


def vapour_pressure(temperature: float) -> Number:
    """Saturation over water, IAPWS Industrial Formulation 1997, equation 30; Pa."""
    constants = """1167.0521452767 -724213.16703206 -17.073846940092 12020.82470247 -3232555.0322333
        14.91510861353 -4823.2657361591 405113.40542057 -0.23855557567849 650.17534844798"""
    n1, n2, n3, n4, n5, n6, n7, n8, n9, n10 = map(MP.mpf, constants.split())
    kelvin = MP.mpf(temperature) + MP.mpf("273.15")
    theta = kelvin + n9 / (kelvin - n10)
    a = theta**2 + n1 * theta + n2
    b = n3 * theta**2 + n4 * theta + n5
    c = n6 * theta**2 + n7 * theta + n8
    return 10**6 * (2 * c / (-b + MP.sqrt(b**2 - 4 * a * c))) ** 4


def ciddor(
    wavelength: float, temperature: float = 20.0, pressure: float = 101325.0, humidity: float = 0.5, co2: float = 450.0
) -> Number:
    """P. E. Ciddor, Appl. Opt. 35 (1996) 1566: phase index of moist air, by its equations 1 to 5 and 12."""
    d = MP.mpf
    sigma2 = (1000 / d(wavelength)) ** 2
    standard = (d(5792105) / (d("238.0185") - sigma2) + d(167917) / (d("57.362") - sigma2)) / 10**8
    dry = standard * (1 + d("0.534e-6") * (d(co2) - 450))
    vapour = d("1.022e-8") * (
        d("295.235") + d("2.6422") * sigma2 - d("0.032380") * sigma2**2 + d("0.004028") * sigma2**3
    )
    t, p, kelvin = d(temperature), d(pressure), d(temperature) + d("273.15")
    enhancement = d("1.00062") + d("3.14e-8") * p + d("5.6e-7") * t**2
    x = d(humidity) * enhancement * vapour_pressure(temperature) / p if humidity else d(0)

    def compressibility(p: Number, t: Number, x: Number) -> Number:
        ratio = p / (t + d("273.15"))
        first = d("1.58123e-6") - d("2.9331e-8") * t + d("1.1043e-10") * t**2
        first += (d("5.707e-6") - d("2.051e-8") * t) * x + (d("1.9898e-4") - d("2.376e-6") * t) * x**2
        return 1 - ratio * first + ratio**2 * (d("1.83e-11") - d("0.765e-8") * x**2)

    # Densities relative to those of the two refractivities: dry air at 15 degrees Celsius and 101325 Pa, vapour at 20
    # degrees Celsius and 1333 Pa.
    z = compressibility(p, t, x)
    air = (1 - x) * p / (z * kelvin) * compressibility(d(101325), d(15), d(0)) * d("288.15") / 101325
    water = x * p / (z * kelvin) * compressibility(d(1333), d(20), d(1)) * d("293.15") / 1333
    return 1 + air * dry + water * vapour
