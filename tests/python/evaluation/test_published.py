"""The published evaluations written a second time, with numpy.linalg.pinv, from the papers' equations."""

from __future__ import annotations

import numpy as np
import pytest
import reference
from truth import Setup
from usual import DIAGONALS

import stepdiag as sd

AXES = "XYZ"
MISALIGNED = sd.Misalignment(reflector=(100e-6, 300e-6), laser=(700e-6, 1000e-6))


def steps_of(setup: Setup, run: sd.Measurement) -> list[tuple[str, int, int, int, int]]:
    """(line, axis, interval counted from home, first row, sign of travel) of every step of the run's diagonals."""
    rows = {(line, int(point)): i for i, (line, point) in enumerate(zip(run.line, run.point, strict=True))}
    steps = []
    for line in setup.lines:
        point = 0
        for k in range(setup.steps):
            for axis in setup.order:
                a = AXES.index(axis)
                interval = k if line[a] == "p" else setup.steps - 1 - k
                steps.append((line, a, interval, rows[line, point], 1 if line[a] == "p" else -1))
                point += 1
    return steps


def in_frame(function: np.ndarray) -> tuple[np.ndarray, float]:
    """A function without the straight line between its ends, and what was at its end."""
    end = float(function[-1])
    return function - end * np.linspace(0.0, 1.0, len(function)), end


def wang(setup: Setup, run: sd.Measurement) -> dict[str, np.ndarray | float]:
    """C. Wang, Rev. Sci. Instrum. 71 (2000) 3933: the three translations of each step of an axis, by least squares."""
    rows: dict[tuple[int, int], list[tuple[np.ndarray, float]]] = {}
    distance = run.channels["distance"]
    for line, a, interval, row, sign in steps_of(setup, run):
        n = reference.frame(line, setup.volume)[:, 2]
        excess = distance[row + 1] - distance[row] - n @ (run.position[row + 1] - run.position[row])
        rows.setdefault((a, interval), []).append((sign * n, excess))
    delta = np.zeros((3, 3, setup.steps + 1))  # axis, component, node
    for (a, interval), equations in rows.items():
        delta[a, :, interval + 1] = np.linalg.pinv(np.array([r for r, _ in equations])) @ [e for _, e in equations]
    delta = np.cumsum(delta, axis=2)
    result: dict[str, np.ndarray | float] = {}
    ends = {}
    for a, axis in enumerate(AXES):
        for c, component in enumerate(AXES):
            name = f"E{component}{axis}"
            shape, end = in_frame(delta[a, c])
            ends[name] = end / setup.volume[a]
            result[name] = delta[a, c] if a == c else shape
    # The conventions turn the frame until EYX, EZX and EZY have no slope; that turns the other axis of each pair as
    # well, so that a squareness is what the two slopes of a pair make together.
    squareness = {
        "C0Y": -(ends["EXY"] + ends["EYX"]),
        "B0Z": ends["EXZ"] + ends["EZX"],
        "A0Z": -(ends["EYZ"] + ends["EZY"]),
    }
    return result | squareness


def equation_4(setup: Setup, run: sd.Measurement) -> dict[str, np.ndarray]:
    """Eqs. 4 and 5 of the paper on the increments of the tilts."""
    rows: dict[tuple[int, int], list[tuple[np.ndarray, float]]] = {}
    for line, a, interval, row, sign in steps_of(setup, run):
        to_mirror = reference.frame(line, setup.volume).T
        for c, channel in enumerate(("alpha", "beta")):
            increment = run.channels[channel][row + 1] - run.channels[channel][row]
            rows.setdefault((a, interval), []).append((sign * to_mirror[c], increment))
    theta = np.zeros((3, 3, setup.steps + 1))
    for (a, interval), equations in rows.items():
        theta[a, :, interval + 1] = np.linalg.pinv(np.array([r for r, _ in equations])) @ [e for _, e in equations]
    theta = np.cumsum(theta, axis=2)
    return {f"E{component}{axis}": theta[a, c] for a, axis in enumerate(AXES) for c, component in enumerate("ABC")}


SETUPS = [
    Setup(steps=12),
    Setup(steps=9, order="ZXY", lines=["ppn", "npp", "nnn", "pnp"], chain="[w b Z X Y t]", tool=(5.0, 9.0, 70.0)),
    Setup(steps=7, order="YZX", lines=DIAGONALS[1:], volume=(260.0, 420.0, 160.0)),
]


@pytest.mark.parametrize("setup", SETUPS)
def test_conventional_is_the_evaluation_of_wang(setup: Setup) -> None:
    run = setup.simulate(setup.errors(9), MISALIGNED, sd.Noise(distance=1e-4, seed=4))
    calibration = setup.evaluate(run, method="conventional")
    expected = wang(setup, run)
    found = {name: value for name, (_, value, _) in calibration.functions.items()}
    found |= {name: value for name, (value, _) in calibration.squareness.items()}
    assert found.keys() == expected.keys()
    for name, value in found.items():
        # Differences of distances near 1 m, rounded to 1e-13 mm, summed over 12 steps; squarenesses over 160 mm.
        assert np.max(np.abs(value - expected[name])) <= (1e-11 if name[0] == "E" else 1e-13), name


@pytest.mark.parametrize("setup", SETUPS)
def test_enhanced_angles_are_equations_four_and_five(setup: Setup) -> None:
    run = setup.simulate(setup.errors(9), MISALIGNED, sd.Noise(tilt=1e-6, seed=4))
    calibration = setup.evaluate(run)
    for name, expected in equation_4(setup, run).items():
        _, value, _ = calibration.functions[name]
        assert np.max(np.abs(value - expected)) <= 1e-16  # sums of some ten tilts of 1 mrad, each rounded to 1e-19


def test_uncertainties_of_one_step_are_the_closed_forms() -> None:
    """Four diagonals, direction cosines n: sigma / (2 |n_i|) for E_i and sigma / (2 sqrt(1 - n_i^2)) for the angles.

    0.699, 0.932, 1.118 and 0.716, 0.593, 0.559 times sigma at 800 x 600 x 500, sigma that of an increment.
    """
    setup = Setup(steps=3)
    run = setup.simulate(setup.errors(1))
    reading = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6)
    n = np.array(setup.volume) / np.linalg.norm(setup.volume)
    assert 1 / (2 * n) == pytest.approx([0.699, 0.932, 1.118], abs=5e-4)
    assert 1 / (2 * np.sqrt(1 - n**2)) == pytest.approx([0.716, 0.593, 0.559], abs=5e-4)
    conventional = setup.evaluate(run, method="conventional", uncertainty=reading)
    enhanced = setup.evaluate(run, uncertainty=reading)
    for axis in AXES:
        # The first node of positioning: one step from home.
        u = conventional.functions[f"E{axis}{axis}"][2][1]
        assert u == pytest.approx(np.sqrt(2) * 1e-4 / (2 * n[AXES.index(axis)]), rel=1e-9)
        for c, component in enumerate("ABC"):
            u = enhanced.functions[f"E{component}{axis}"][2][1]
            assert u == pytest.approx(np.sqrt(2) * 1e-6 / (2 * np.sqrt(1 - n[c] ** 2)), rel=1e-9)
