"""Machines to export, and readers of the formats that share no code with their writers."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import RegularGridInterpolator
from usual import SMALL_VOLUME as VOLUME

import stepdiag as sd

TOOL = (3.0, -5.0, 40.0)
CHAINS = ["[w X' b Y Z t]", "[w b X Y Z t]", "[w Y' X' b Z t]", "[w Z' b Y X t]", "[w X' Z' Y' b t]"]
Vectors = npt.NDArray[np.float64]


def calibration_of(
    errors: sd.ErrorMap, chain: str = CHAINS[0], volume: tuple[float, ...] = VOLUME, tool: tuple[float, ...] = TOOL
) -> sd.Calibration:
    """A calibration that knows these errors; what the map lacks is not determined."""
    known = {name: (p, v, np.full(len(p), np.nan)) for name, (p, v) in errors.functions.items()}
    reversal, uncertainty = {}, {}
    for name, (p, v) in errors.negative_functions.items():
        assert np.array_equal(p, known[name][0])
        reversal[name] = (p, known[name][1] - v, np.full(len(p), np.nan))
        uncertainty[name] = np.full(len(p), np.nan)
    return sd.Calibration(
        "test",
        chain,
        volume,
        tool,
        known,
        {name: (angle, np.nan) for name, angle in errors.squareness.items()},
        reversal=reversal,
        reversal_negative_uncertainty=uncertainty,
    )


def random_calibration(
    seed: int, chain: str = CHAINS[0], *, intervals: int = 7, reversal: bool = False
) -> sd.Calibration:
    errors = sd.random_error_map(VOLUME, seed=seed, intervals=intervals)
    if reversal:
        random = np.random.default_rng(seed)
        negative = {
            name: (p, v - random.uniform(-0.004 if name[1] in "XYZ" else -4e-6, 0.0, len(p)))
            for name, (p, v) in errors.functions.items()
        }
        errors = sd.ErrorMap(errors.functions, errors.squareness, negative_functions=negative)
    return calibration_of(errors, chain)


def machine_of(calibration: sd.Calibration) -> sd.Machine:
    return sd.Machine(calibration.chain, calibration.to_error_map(), calibration.tool)


def export(calibration: sd.Calibration, to: str, output: Path, **options: Any) -> list[str]:
    return sd.export(calibration, output, to=to, **options)


def points_in(volume: tuple[float, ...], count: int, seed: int = 5) -> Vectors:
    return np.random.default_rng(seed).uniform(0.0, volume, (count, 3))


class CompFile:
    """A COMP_FILE of type 0 as LinuxCNC 2.9 treats it: usrmotLoadComp, EMCMOT_SET_JOINT_COMP, compute_screw_comp."""

    def __init__(self, path: Path) -> None:
        rows = []
        for line in path.read_text(encoding="ascii").splitlines():
            assert len(line) < 255
            assert re.fullmatch(r"(-?\d+\.\d+) (-?\d+\.\d+) (-?\d+\.\d+)", line)
            rows.append([float(word) for word in line.split()])
        self.nominal, self.forward, self.reverse = np.array(rows).T
        assert np.all(np.diff(self.nominal) > 0.0)
        assert len(rows) <= 256

    def motor(self, position: Any, direction: str) -> Vectors:
        """motor-pos-cmd for a joint position that the joint comes to in this direction."""
        trim = self.nominal - (self.forward if direction == "+" else self.reverse)
        return np.asarray(position + np.interp(position, self.nominal, trim))


@dataclass(frozen=True)
class IsgFile:
    """An ISG CSV: tables over X, Y, Z, and constants; lengths mm, angles rad."""

    tables: dict[str, tuple[Vectors, Vectors]]  # parameter -> (argument, value)
    constants: dict[str, float]
    comments: str

    @staticmethod
    def read(path: Path) -> IsgFile:
        tables: dict[str, tuple[Vectors, Vectors]] = {}
        constants: dict[str, float] = {}
        lines = path.read_text(encoding="ascii").splitlines()
        comments = "\n".join(line for line in lines if line.startswith("//"))
        body = "\n".join(line for line in lines if not line.startswith("//"))
        for block in body.split("#"):
            names, *rows = [line.split() for line in block.strip().splitlines()]
            data = np.array(rows, dtype=float)
            if names[0] in "XYZ":
                assert np.all(np.diff(data[:, 0]) > 0.0)
                tables |= {name: (data[:, 0], data[:, k]) for k, name in enumerate(names) if k}
            else:
                assert len(data) == 1
                constants |= dict(zip(names, data[0].tolist(), strict=True))
        return IsgFile(tables, constants, comments)

    def error(self, positions: Vectors, chain: str) -> Vectors:
        """e = sum of delta + theta x L with every axis on the tool's side; chain: letters from workpiece to tool."""

        def of(name: str, p: Vectors) -> Vectors:
            return np.asarray(np.interp(p, *self.tables[name]))

        total = np.zeros_like(positions)
        zero = np.array([self.constants[f"P0{axis}"] for axis in "XYZ"])
        for n, axis in enumerate(chain):
            p = positions[:, "XYZ".index(axis)]
            delta = np.stack([of(f"E{c}{axis}", p) for c in "XYZ"], axis=1)
            theta = np.stack([of(f"E{c}{axis}", p) for c in "ABC"], axis=1)
            if axis == "Y":
                delta[:, 0] -= self.constants.get("C0Y", 0.0) * p
            if axis == "Z":
                delta[:, 0] += self.constants.get("B0Z", 0.0) * p
                delta[:, 1] -= self.constants.get("A0Z", 0.0) * p
            lever = np.tile(zero, (len(p), 1))
            for after in chain[n + 1 :]:
                lever[:, "XYZ".index(after)] += positions[:, "XYZ".index(after)]
            total += delta + np.cross(theta, lever)
        return total


class GridFile:
    """A CSV grid: its leading lines, columns by name, and their interpolation."""

    def __init__(self, path: Path) -> None:
        with path.open(newline="", encoding="utf-8") as file:
            lines = file.read().splitlines()
        self.header = dict(line[2:].split("=", 1) for line in lines if line.startswith("#"))
        rows = list(csv.reader(line for line in lines if not line.startswith("#")))
        self.columns = {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}

    def vectors(self, *names: str) -> Vectors:
        return np.stack([self.columns[name] for name in names], axis=1)

    def interpolated(self, positions: Vectors) -> Vectors:
        """Error vectors, mm."""
        axes = [np.unique(self.columns[f"{axis}_mm"]) for axis in "xyz"]
        shape = [len(axis) for axis in axes]
        values = self.vectors("ex_um", "ey_um", "ez_um").reshape(*shape, 3) * 1e-3
        return np.asarray(RegularGridInterpolator(axes, values)(positions))
