"""The picture of the volume shows the errors of the exact pose, and the worst point."""

from __future__ import annotations

import numpy as np
import pytest
from calibrations import calibrate, parts_of
from ink import ink, labels, texts

import stepdiag as sd


def test_planes_show_the_exact_errors_through_the_worst_point() -> None:
    calibration = calibrate(1)
    found = sd.volume(calibration, ranking=False)
    figure = found.plot()
    assert min(ink(figure).values()) > 1000
    assert {"position X (mm)", "position Y (mm)", "position Z (mm)", "length of the error (µm)"} == set(labels(figure))
    machine = sd.Machine(calibration.chain, calibration.to_error_map(), calibration.tool)
    for axes, (u, v) in zip(figure.axes, ((0, 1), (0, 2), (1, 2)), strict=False):
        mesh = axes.collections[0]
        points = np.tile(found.largest_at, (mesh.get_coordinates().size // 2, 1))
        points[:, [u, v]] = mesh.get_coordinates().reshape(-1, 2)
        expected = 1e3 * np.linalg.norm(machine.error(points), axis=1)
        np.testing.assert_allclose(np.ravel(mesh.get_array()), expected, rtol=1e-9, atol=1e-9)  # µm
        (worst,) = [line for line in axes.lines if len(line.get_xdata()) == 1]
        np.testing.assert_array_equal(worst.get_xydata()[0], found.largest_at[[u, v]])
    assert any(f"largest {found.largest * 1e3:.3g} µm" in text for text in texts(figure))


def test_unknown_error_is_not_drawn() -> None:
    parts = parts_of(calibrate(1))
    del parts["functions"]["EXX"]
    found = sd.volume(sd.Calibration(**parts), ranking=False)
    with pytest.raises(sd.InvalidArgument, match="the error in the volume is not known: EXX are not determined"):
        found.plot()
