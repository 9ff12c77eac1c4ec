"""The adjustment's model written a second time, for dense matrices: all readings of a run as one function of the 21
parameters at the plan's nodes and of every line's set-up, differentiated by complex steps. mm, rad, s.

Nothing of the package's evaluation is used: frames and points are the reference's, poses and readings are written out
here from the conventions, with rotations by power series (all angles are small), so that a complex step of 1e-30 gives
derivatives to the last bit.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import reference

AXES = "XYZ"
SQUARENESS = {"C0Y": ("Y", 0, -1.0), "B0Z": ("Z", 0, +1.0), "A0Z": ("Z", 1, -1.0)}  # axis, component, sign
COMPONENTS = {"reflector": 2, "laser": 2, "distance_constant": 1, "psd_zero": 2, "lateral": 2, "roll": 1, "gain": 1}
STEP = 1e-30  # of a complex step: its square is below every bit, so no step is too small

Array = np.ndarray


@dataclass(frozen=True)
class Table:
    """An error function's value at a node; reversal: that value minus the one approached in - direction."""

    name: str
    node: int = 0
    reversal: bool = False


@dataclass(frozen=True)
class Setup:
    """One set-up unknown of a line; run: the first run that has this set-up."""

    run: int
    line: str
    quantity: str
    component: int = 0


Unknown = Table | Setup


@dataclass(frozen=True)
class Stations:
    """Row by row: where, in which visit and when a run was read, and with which set-up."""

    line: list[str]
    position: Array  # (rows, 3), commanded
    setup: list[tuple[int, str]]  # (first run, line)
    sense: Array  # (rows, 3): +1 or -1, the direction in which each axis came to where it stands
    time: Array  # since the set-up's first reading


def rounding(channel: str) -> float:
    """How far off double precision leaves a reading: nine roundings of a direction's 1, seventeen of 1.3 m, in mm."""
    return 1e-15 if channel in ("alpha", "beta") else 2e-12


def turns(vectors: Array) -> Array:
    """Exp of rotation vectors (n, 3), as (n, 3, 3); a quaternion by power series, exact below 0.05 rad."""
    s = np.sum(vectors * vectors, axis=1)
    w = 1 - s / 8 + s**2 / 384 - s**3 / 46080 + s**4 / 10321920
    q = vectors * (0.5 - s / 48 + s**2 / 3840 - s**3 / 645120)[:, None]
    x, y, z = q.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ],
        axis=1,
    )


def times(matrices: Array, vectors: Array) -> Array:
    return np.einsum("nij,nj->ni", matrices, vectors)


class DenseModel:
    """Channels of all rows as a function of a vector of unknowns."""

    def __init__(
        self, scenario: reference.Scenario, stations: Stations, channels: list[str], reversal: bool = False
    ) -> None:
        self.scenario, self.stations, self.channels = scenario, stations, channels
        self.rows = len(stations.line)
        volume = np.array(scenario.volume)
        self.node = np.rint(stations.position / volume * scenario.steps).astype(int)
        self.position = self.node * volume / scenario.steps
        frames = {line: reference.frame(line, scenario.volume) for line in {*stations.line}}
        self.frame = np.array([frames[line] for line in stations.line])
        corner = np.array([[s == "n" for s in line] for line in stations.line]) * volume
        self.origin = corner + np.array(scenario.tool) - scenario.standoff * self.frame[:, :, 2]
        travel = self.position - corner
        self.travelled = np.einsum("ni,ni->n", travel, self.frame[:, :, 2])
        self.tables = self.table_unknowns(reversal)
        self.setups = self.setup_unknowns()
        self.unknowns: list[Unknown] = [*self.tables, *self.setups]
        self.place = {unknown: i for i, unknown in enumerate(self.unknowns)}
        self.scatter = self.table_weights()

    def table_unknowns(self, reversal: bool) -> list[Table]:
        """In the frame choice: 0 at home, straightnesses 0 at the end, what reversal leaves of either is unknown."""
        last = self.scenario.steps
        found = []
        for axis in AXES:
            for c in "XYZABC":
                straightness = c in AXES and c != axis
                found += [Table(f"E{c}{axis}", k) for k in range(1, last + (0 if straightness else 1))]
        found += [Table(name) for name in SQUARENESS]
        if reversal:
            names = [f"E{c}{axis}" for axis in AXES for c in "XYZABC"]
            found += [Table(name, k, reversal=True) for name in names for k in range(last + 1)]
        return found

    def setup_unknowns(self) -> list[Setup]:
        sizes = COMPONENTS | {"beam_constants": max(len(self.scenario.beam_offsets) - 1, 0), "drift": 1, "cosine": 1}
        setups = dict.fromkeys(self.stations.setup)
        first = {"beam_constants": 1}  # d1 is what the others are compared with
        return [
            Setup(*setup, quantity, first.get(quantity, 0) + i)
            for setup in setups
            for quantity, size in sizes.items()
            for i in range(size)
        ]

    def table_weights(self) -> Array:
        """(rows, 18, tables): what the six errors of each axis at a row are made of."""
        weights = np.zeros((self.rows, 18, len(self.tables)))
        for j, table in enumerate(self.tables):
            if table.name in SQUARENESS:
                axis, component, sign = SQUARENESS[table.name]
                a = AXES.index(axis)
                weights[:, 6 * a + component, j] = sign * self.position[:, a]
                continue
            a = AXES.index(table.name[2])
            at_node = self.node[:, a] == table.node
            if table.reversal:
                weights[:, 6 * a + "XYZABC".index(table.name[1]), j] = -1.0 * (
                    at_node & (self.stations.sense[:, a] < 0)
                )
            else:
                weights[:, 6 * a + "XYZABC".index(table.name[1]), j] = at_node
        return weights

    def poses(self, errors: Array) -> tuple[Array, Array]:
        """(rotation, functional point) from the 18 errors at each row."""
        rotation = np.tile(np.eye(3, dtype=errors.dtype), (self.rows, 1, 1))
        point = np.zeros((self.rows, 3), dtype=errors.dtype)
        links = re.findall(r"[XYZ]|b", self.scenario.chain)
        for place, link in enumerate(links):
            if link == "b":
                continue
            a = AXES.index(link)
            shift = errors[:, 6 * a : 6 * a + 3].copy()
            shift[:, a] += self.position[:, a]
            turn = turns(errors[:, 6 * a + 3 : 6 * a + 6])
            if place < links.index("b"):
                rotation = rotation @ turn
            point = point + times(rotation, shift)
            if place > links.index("b"):
                rotation = rotation @ turn
        tool = np.tile(np.array(self.scenario.tool), (self.rows, 1))
        return rotation, point + times(rotation, tool)

    def setup_values(self, x: Array) -> dict[str, Array]:
        """Of every quantity the values of each row's set-up, (rows, components)."""
        values: dict[str, Array] = {}
        for quantity in {u.quantity for u in self.setups}:
            parts = [u for u in self.setups if u.quantity == quantity]
            of_setup: dict[tuple[int, str], list[Any]] = {}
            for u in parts:
                of_setup.setdefault((u.run, u.line), []).append(x[self.place[u]])
            values[quantity] = np.array([of_setup[s] for s in self.stations.setup])
        return values

    def errors(self, x: Array) -> Array:
        return np.einsum("nlj,j->nl", self.scatter, x[: len(self.tables)])

    def readings(self, errors: Array, setup: dict[str, Array]) -> dict[str, Array]:
        """Channel -> (rows,), by the words of the conventions."""
        zero = np.zeros((self.rows, 1))
        x_and_y = self.frame[:, :, :2]
        origin = self.origin + np.einsum("nij,nj->ni", x_and_y, setup["lateral"])
        roll = np.hstack([zero, zero, setup["roll"]])
        sensor = self.frame @ turns(np.hstack([setup["laser"], zero])) @ turns(roll)
        rotation, point = self.poses(errors)
        mirror = rotation @ self.frame @ turns(np.hstack([setup["reflector"], zero]))
        normal = np.einsum("nji,nj->ni", sensor, mirror[:, :, 2])  # in the sensor frame
        q = np.einsum("nji,nj->ni", sensor, point - origin)
        slope_x, slope_y = normal[:, 0] / normal[:, 2], normal[:, 1] / normal[:, 2]
        length = q[:, 2] + slope_x * q[:, 0] + slope_y * q[:, 1]  # (q . n)/(n . d), d = (0, 0, 1)
        cos_2phi = 2 * normal[:, 2] ** 2 - 1  # of unit vectors: 2 (n . d)^2 - 1
        gain = 1 + setup["gain"][:, 0]
        moved = setup["distance_constant"][:, 0] + setup["drift"][:, 0] * self.stations.time
        moved = moved - setup["cosine"][:, 0] * self.travelled

        def half_round_trip(u: Any, v: Any) -> Array:
            from_there = length - slope_x * u - slope_y * v
            return (from_there + from_there / cos_2phi) / 2

        found = {
            "distance": half_round_trip(0.0, 0.0) + moved,
            "alpha": -slope_y * gain,
            "beta": slope_x * gain,
        }
        # r = d - 2 (n . d) n, unfolded: spot = way (r_x, r_y)/(-r_z), and -r_z = cos 2 phi
        way = length + self.scenario.psd_distance
        for i, name in enumerate(["spot_x", "spot_y"]):
            reflected = -2 * normal[:, 2] * normal[:, i]
            found[name] = way * reflected / cos_2phi * gain + setup["psd_zero"][:, i]
        for i, (u, v) in enumerate(self.scenario.beam_offsets):
            constant = setup["beam_constants"][:, i - 1] if i else 0.0
            found[f"d{i + 1}"] = half_round_trip(u * gain, v * gain) + moved + constant
        return found

    def __call__(self, x: Array) -> Array:
        """All channels, (channels, rows)."""
        found = self.readings(self.errors(x), self.setup_values(x))
        return np.array([found[name] for name in self.channels])

    def jacobian(self, x: Array) -> Array:
        """(channels, rows, unknowns): by the 18 errors of each row, then to the unknowns they are made of."""
        errors, setup = self.errors(x), self.setup_values(x)
        by_errors = np.empty((len(self.channels), self.rows, 18))
        for i in range(18):
            stepped = errors.astype(complex)
            stepped[:, i] += 1j * STEP
            found = self.readings(stepped, setup)
            by_errors[:, :, i] = [found[name].imag / STEP for name in self.channels]
        matrix = np.zeros((len(self.channels), self.rows, len(self.unknowns)))
        matrix[:, :, : len(self.tables)] = np.einsum("cnl,nlj->cnj", by_errors, self.scatter)
        index = {s: np.array([t == s for t in self.stations.setup]) for s in set(self.stations.setup)}
        for quantity, values in setup.items():
            for i in range(values.shape[1]):
                stepped_setup = {name: value.astype(complex) for name, value in setup.items()}
                stepped_setup[quantity][:, i] += 1j * STEP
                found = self.readings(errors.astype(complex), stepped_setup)
                column = np.array([found[name].imag / STEP for name in self.channels])
                for s, rows in index.items():
                    first = 1 if quantity == "beam_constants" else 0
                    matrix[:, rows, self.place[Setup(*s, quantity, first + i)]] = column[:, rows]
        return matrix
