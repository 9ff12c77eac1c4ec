"""Stated uncertainties against those of repeated noisy runs: python noisy_repetitions.py [repetitions] [seed].

A test runs few; the project's figure, 5 % at 2,000 repetitions, is this script's.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import reference
from adjusted import adjust
from dense_adjustment import Knowledge
from virtual_runs import measured, noisy, random_scenario, random_table

import stepdiag as sd


def vector_of(calibration: sd.Calibration, item: int) -> np.ndarray:
    """All values (1) or uncertainties (2) of a calibration in one row."""
    functions = [np.asarray(columns[item]) for _, columns in sorted(calibration.functions.items())]
    squareness = [np.array([columns[item - 1]]) for _, columns in sorted(calibration.squareness.items())]
    return np.concatenate([*functions, *squareness])


def knowledge_of(scenario: reference.Scenario) -> Knowledge:
    """No priors: what they allow for does not happen in repetitions of one set-up."""
    setup: dict[Any, Any] = dict.fromkeys(("lateral", "roll", "gain", "beam_constants"), "fixed")
    return Knowledge(setup | {(line, "laser"): "fixed" for line in scenario.scale_lines})


def ratios(repetitions: int, seed: int, steps: int = 3, layout: str = "ideal") -> np.ndarray:
    """Of every value that is not 0 by the frame choice: standard deviation of the repetitions by that stated."""
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, steps=steps, layout=layout)
    clean = measured(reference.simulate(scenario, random_table(rng, scenario.volume, steps)))
    known = knowledge_of(scenario)
    stated = vector_of(adjust(clean, scenario, known).calibration, 2)
    values = np.array(
        [
            vector_of(adjust(noisy(clean, rng), scenario, known, outlier_probability=0.0).calibration, 1)
            for _ in range(repetitions)
        ]
    )
    moves = stated > 0
    return np.std(values, axis=0, ddof=1)[moves] / stated[moves]


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    for kind in ("ideal", "psd", "multi_beam"):
        found = ratios(count, first, layout=kind)
        print(f"{kind}: {len(found)} values, {count} repetitions, ratio {found.min():.4f} .. {found.max():.4f}")
