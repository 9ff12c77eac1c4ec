"""Covariance of many samples with noise only beside propagation: few of those of benchmarks/million.py."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from places import ROOT
from usual import DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd

sys.path.insert(0, str(ROOT / "benchmarks"))

import million


@pytest.mark.parametrize(
    ("method", "layout", "samples"),
    [
        ("conventional", "ideal", 100_000),
        ("enhanced", "ideal", 100_000),
        ("enhanced", "psd", 100_000),
        ("enhanced", "multi_beam", 100_000),
        ("one_step", "ideal", 60_000),
        ("adjustment", "ideal", 20_000),
    ],
)
def test_samples_scatter_as_propagation_says(method: str, layout: str, samples: int) -> None:
    u, r, _ = million.compare(million.virtual(method, layout, 6), samples, threads=0)
    # u scatters by 1/sqrt(2 n), correlations by 1/sqrt(n); the largest of a hundred, and of ten thousand: 4.5 and 5.5.
    assert u <= 4.5 / np.sqrt(2 * samples)
    assert r <= 5.5 / np.sqrt(samples)


@pytest.mark.parametrize("layout", list(million.HEADS))
def test_propagated_noise_is_what_the_evaluation_itself_states(layout: str) -> None:
    """Independent noise on every channel: the evaluation's own covariance (eq. 6)."""
    calibrations = million.virtual("enhanced", layout, 6)
    propagation = million._core.propagate(calibrations, covariance=True)
    calibration = sd.methods.evaluate(
        calibrations.nominal,
        sd.Plan(VOLUME, DIAGONALS, 6, scale_lines=SCALE_LINES),
        million.HEADS[layout],
        sd.Chain("[w X' b Y Z t]"),
        method="enhanced",
        full_covariance=True,
    )
    labels = [(o.name, None if np.isnan(o.position) else o.position) for o in calibrations.outputs]
    assert [name for name, _ in labels] == [name for name, _ in calibration.covariance_labels]
    stated = calibration.covariance
    assert stated is not None
    scale = np.sqrt(np.diag(stated)) + 1e-12
    # Derivatives, exact there and differences here.
    assert np.max(np.abs(np.asarray(propagation.covariance) - stated) / np.outer(scale, scale)) <= 1e-4
