"""What each export leaves of the error in the volume: 24 random machines, one for each chain.

    ./run python benchmarks/exports.py [--seed 0]

The machines are those of README's volume: random tables with 50 intervals an axis, a tool offset of 120 mm. Each is
exported; the motors then go where the controller sends them by the file that was written, read and applied by formulas
that share no code with the exports (tests/python/helpers). The exact pose tells what is left. The second table is of
COMP_FILEs: 256 rows chosen by the export, and 256 that are spread evenly, of machines with a screw of 10 mm pitch.

The tables are Markdown. The exit code is 1 if an export states another figure than it leaves, if a matrix or fitted
angles leave a larger rms error than none, or the quadratic terms a larger one than the matrix, or if evenly spread rows
lose less. It takes about a minute of CPU time.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
from controllers import INTERPRETERS, Motors
from exported import CompFile, GridFile, calibration_of, machine_of
from simple_exports import MOTORS
from usual import ALL_CHAINS, CHAIN, VOLUME

import stepdiag as sd
from stepdiag.exporting.common import ExportOptions
from stepdiag.exporting.fewest_nodes import largest_deviation
from stepdiag.exporting.left_in_volume import left_in_volume
from stepdiag.exporting.linuxcnc_comp import JointTable
from stepdiag.exporting.write import write_export

TOOL = (0.0, 0.0, 120.0)
STATED = 1e-5  # mm: rounding, of files with six digits after the point, of which nine are added
Vectors = np.ndarray
Sizes = dict[str, tuple[float, float]]  # export -> largest and rms error, mm


def by_comp_files(folder: Path, p: Vectors) -> Vectors:
    return np.stack([CompFile(folder / f"joint{n}.comp").motor(p[:, n], "+") for n in range(3)], axis=1)


def cec_motors(path: Path, p: Vectors) -> Vectors:
    return INTERPRETERS["siemens-cec"](path, p, 1, 1.0)


def by_grid(path: Path, p: Vectors) -> Vectors:
    """First order: the error at the commanded position is subtracted."""
    return p - GridFile(path).interpolated(p)


def by_all_position_errors(paths: list[Path], p: Vectors) -> Vectors:
    return p + sum(MOTORS["position-error"](path, p) - p for path in paths)


def of_machine(calibration: sd.Calibration, folder: Path) -> tuple[Sizes, bool]:
    """What each export leaves, and whether each states that."""
    found: Sizes = {}
    holds = True

    def add(name: str, to: str, path: Path, motors: Callable[[Path, Vectors], Vectors], **options: object) -> None:
        nonlocal holds
        done = write_export(calibration, to, path, ExportOptions(**options))  # type: ignore[arg-type]
        left = left_in_volume(calibration, np.array(TOOL), lambda p, _: motors(path, p))
        assert left is not None
        found["none"] = left.without.largest, left.without.rms
        found[name] = left.with_it.largest, left.with_it.rms
        if done.left is not None:
            stated = done.left.with_it
            holds &= bool(np.allclose(found[name], (stated.largest, stated.rms), rtol=0.0, atol=STATED))

    add("`squareness`", "squareness", folder / "s.csv", MOTORS["squareness"])
    found["`squareness`, fitted angles"] = fitted_angles(calibration, folder / "s.csv")
    add("`matrix`", "matrix", folder / "m.hal", MOTORS["matrix"])
    add("`calibxyzkins`", "calibxyzkins", folder / "c.hal", MOTORS["calibxyzkins"])
    add("`linuxcnc-comp`", "linuxcnc-comp", folder / "comp", by_comp_files)
    axes = {"axis": "Y", "depends_on": "X"}
    add("`position-error` of Y by X", "position-error", folder / "e.csv", MOTORS["position-error"], **axes)
    paths = []
    for axis, by in product("XYZ", repeat=2):
        path = folder / f"e{axis}{by}.csv"
        write_export(calibration, "position-error", path, ExportOptions(axis=axis, depends_on=by))
        paths.append(path)
    left = left_in_volume(calibration, np.array(TOOL), lambda p, _: by_all_position_errors(paths, p))
    assert left is not None
    found["`position-error`, all nine"] = left.with_it.largest, left.with_it.rms
    for to, interpreter in INTERPRETERS.items():

        def by_manual(path: Path, p: Vectors, interpreter: Motors = interpreter) -> Vectors:
            return interpreter(path, p, 1, 1.0)

        add(f"`{to}`", to, folder / to, by_manual)
    for tables in (2, 8):
        add(f"`siemens-cec`, {tables} tables", "siemens-cec", folder / "few", cec_motors, tables=tables)
    add("`csv-grid`, 11 x 11 x 11", "csv-grid", folder / "g.csv", by_grid)
    write_export(calibration, "linuxcnc-kins", folder / "k.csv", ExportOptions())
    compensator = sd.Compensator(folder / "k.csv", calibration.chain)
    left = left_in_volume(calibration, np.array(TOOL), lambda p, _: compensator.command(p))
    assert left is not None
    found["`linuxcnc-kins`"] = left.with_it.largest, left.with_it.rms
    return found, holds


def fitted_angles(calibration: sd.Calibration, path: Path) -> tuple[float, float]:
    """What is left with the column fitted_urad in place of the others."""
    done = write_export(calibration, "squareness", path, ExportOptions())
    size = done.values["with_fitted"].with_it
    return size.largest, size.rms


def volume_table(seed: int) -> bool:
    of_all, holds = [], True
    for n, chain in enumerate(ALL_CHAINS):
        calibration = calibration_of(sd.random_error_map(VOLUME, seed=100 * seed + n), chain, VOLUME, TOOL)
        with tempfile.TemporaryDirectory() as folder:
            found, stated = of_machine(calibration, Path(folder))
        of_all.append(found)
        holds &= stated
        holds &= found["`squareness`, fitted angles"][1] <= min(found["none"][1], found["`squareness`"][1])
        holds &= found["`matrix`"][1] <= found["none"][1]
        holds &= found["`calibxyzkins`"][1] <= found["`matrix`"][1]
    print(f"24 machines, one for each chain, {' x '.join(f'{edge:g}' for edge in VOLUME)} mm; median (range)\n")
    print("| export | largest, um | rms, um | rms left, % | larger largest |")
    print("|---|---|---|---|---|")
    without = np.array([found["none"] for found in of_all])
    for name in of_all[0]:
        sizes = np.array([found[name] for found in of_all])
        worse = "-" if name == "none" else f"{np.sum(sizes[:, 0] > without[:, 0])} of {len(sizes)}"
        cells = [*(spread_of(1e3 * sizes[:, k]) for k in (0, 1)), spread_of(100.0 * sizes[:, 1] / without[:, 1])]
        print(f"| {name} | {' | '.join(cells)} | {worse} |")
    return holds


def spread_of(values: Vectors) -> str:
    if np.max(values) < 1e-3:
        return "< 0.001"
    return f"{np.median(values):.3g} ({np.min(values):.3g}-{np.max(values):.3g})"


def comp_table(seed: int) -> bool:
    """Deviation of 256 rows from all nodes, of positioning errors with a screw's."""
    print("\n| nodes of EXX | chosen rows deviate by, um | evenly spread rows, um |\n|---|---|---|")
    holds = True
    for nodes in (400, 800, 1600, 3200):
        random = np.random.default_rng(seed)
        x = np.linspace(0.0, VOLUME[0], nodes + 1)
        screw = 0.003 * np.sin(2.0 * np.pi * x / 10.0) * np.interp(x, [0.0, 200.0, 800.0], [1.0, 0.3, 0.6])
        value = screw + np.interp(x, np.linspace(0.0, VOLUME[0], 9), random.normal(0.0, 0.01, 9))
        functions = {f"E{c}{a}": ([0.0], [0.0]) for a in "XYZ" for c in "XYZABC"}
        errors = sd.ErrorMap(functions | {"EXX": (x, value - value[0])}, dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0))
        machine = machine_of(calibration_of(errors, CHAIN, VOLUME, TOOL))
        joint = JointTable(machine, np.array(VOLUME), "X", np.array(VOLUME) / 2.0, 256)
        even = np.unique(np.linspace(0, nodes, 256).round().astype(int))
        chosen, evenly = (largest_deviation(joint.nodes, joint.trims, kept) for kept in (joint.kept, even))
        print(f"| {nodes + 1} | {1e3 * chosen:.3g} | {1e3 * evenly:.3g} |")
        holds &= len(joint.kept) <= 256 and chosen <= evenly
    return holds


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    good = [volume_table(given.seed), comp_table(given.seed)]
    print("\nas expected" if all(good) else "\nnot as expected")
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
