"""Where readings leave set-ups open and distances are known to a nanometre: the covariance and what is made of it."""

from pathlib import Path

import numpy as np
import pytest

import stepdiag as sd

VOLUME = (400.0, 300.0, 250.0)
LINES = ["ppp", "npp", "pnp", "nnp"]
# Without these distances the scales between the ends, two squarenesses and the set-ups of the diagonals are open.
LOST = {
    *((line, point) for point in (9, 12, 18, 27) for line in ("npp", "nnp")),
    *((line, 14) for line in LINES),
    *((line, 30) for line in LINES),
    *(("ppp", 6), ("pnp", 6), ("npp", 1), ("nnp", 1), ("ppp", 28), ("pnp", 28), ("pnp", 4), ("npp", 25)),
    *(("nnp", 20), ("pnp", 20)),
}


def adjusted(distance: float) -> tuple[sd.Measurement, sd.Adjustment]:
    """`distance`: its standard uncertainty, mm."""
    plan = sd.Plan(VOLUME, LINES, 10, scale_lines=["p00", "0p0", "00p"])
    machine = sd.Machine("[w X' b Y Z t]", sd.random_error_map(VOLUME, seed=7, intervals=10))
    noise = sd.Noise(distance, 1e-6, seed=3)
    run = sd.simulate(machine, plan, sd.Head(), noise=noise)
    channels = dict(run.channels)
    lost = [place in LOST for place in zip(run.line, run.point, strict=True)]
    channels["distance"] = np.where(lost, np.nan, channels["distance"])
    run = sd.Measurement(run.line, run.point, run.position, channels)
    stated = sd.methods.ReadingUncertainty(distance=distance, tilt=1e-6)
    options = {"uncertainty": stated, "search_faults": False}
    found = sd.methods.adjust(run, plan, sd.Head(), machine.chain, full_covariance=True, **options)
    without = sd.methods.adjust(run, plan, sd.Head(), machine.chain, **options)
    assert sorted(uncertainties(found.calibration)) == sorted(uncertainties(without.calibration))
    return run, found


def uncertainties(calibration: sd.Calibration) -> list[float]:
    """By parameter, in the order of the covariance."""
    functions, squareness = calibration.functions, calibration.squareness
    order = dict.fromkeys(
        name for name, _ in calibration.covariance_labels or [(n, 0) for n in (*functions, *squareness)]
    )
    return [u for name in order for u in (functions[name][2] if name in functions else [squareness[name][1]])]


@pytest.mark.parametrize("distance", [1e-4, 1e-5, 1e-6, 1e-7])
def test_calibration_with_covariance_is_written_and_read(distance: float, tmp_path: Path) -> None:
    run, found = adjusted(distance)
    found.write(tmp_path / "calibration.nc", measurement=run)
    read = sd.read_calibration(tmp_path / "calibration.nc").covariance
    covariance = found.calibration.covariance
    assert np.array_equal(read, covariance)
    u = np.array(uncertainties(found.calibration))
    assert np.allclose(np.sqrt(np.diag(covariance)), u, rtol=1e-15, atol=0.0)  # roundings of one product
    # Readings that are independent: no combination of the values has a negative variance, but for rounding.
    kept = u > 0.0
    correlation = covariance[np.ix_(kept, kept)] / np.outer(u[kept], u[kept])
    assert np.linalg.eigvalsh(correlation)[0] > -1e-6
