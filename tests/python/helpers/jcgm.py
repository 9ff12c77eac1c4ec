"""Examples of the GUM and its supplements as models for the Monte Carlo method. Run by itself, with a million samples
each, it prints what comes out beside what is published: `./run python tests/python/helpers/jcgm.py`."""

import math
import time
from dataclasses import dataclass

import numpy as np

from stepdiag._core import Distribution, FunctionModel, StatisticsOptions
from stepdiag.selftest.jcgm import UNIFORM, B, gauge_block, straight_line, sum_of_four
from stepdiag.uncertainty import monte_carlo

STANDARD = Distribution(spread=1.0)


@dataclass(frozen=True)
class Published:
    """None where nothing is published."""

    mean: float | None
    uncertainty: float
    coverage: float
    interval: tuple[float, float]
    shortest: bool = False


def logarithm(seed: int = 1) -> FunctionModel:
    """y = ln x with a density that rises to its upper end: the shortest interval is far from the symmetric one.
    Closed forms."""
    return FunctionModel(np.log, [Distribution("rectangular", spread=0.5, expectation=0.6)], ["Y"], seed=seed)


def calibration_line(seed: int = 1) -> FunctionModel:
    """GUM H.3: a straight line y1 + y2 (t - 20) through corrections of a thermometer, whose standard deviation is that
    of the residuals; outputs y1, y2 and the correction at 30 degrees Celsius."""
    rows, deviation = straight_line()
    inputs = [Distribution(expectation=b, spread=deviation) for b in B]
    return FunctionModel(lambda b: rows @ b, inputs, ["y1", "y2", "b(30)"], seed=seed)


EXAMPLES: dict[str, tuple[FunctionModel, Published]] = {
    "JCGM 101 9.2.2, four normal": (sum_of_four(STANDARD), Published(0.0, 2.0, 0.95, (-3.92, 3.92))),
    "JCGM 101 9.2.3, four rectangular": (sum_of_four(UNIFORM), Published(0.0, 2.0, 0.95, (-3.88, 3.88))),
    "y = ln x, shortest": (
        logarithm(),
        Published(-0.6649, 0.6062, 0.95, (math.log(0.15), math.log(1.1)), shortest=True),
    ),
    "JCGM 101 9.5, gauge block, nm": (gauge_block(), Published(838.0, 36.0, 0.99, (745.0, 932.0))),
}


def main() -> None:
    for name, (model, published) in EXAMPLES.items():
        for adaptive in (False, True):
            start = time.perf_counter()
            result = monte_carlo.run_monte_carlo(
                model,
                samples=10_000_000 if adaptive else 1_000_000,
                adaptive=adaptive,
                options=StatisticsOptions(coverage=published.coverage),
            )
            seconds = time.perf_counter() - start
            low, high = (result.shortest if published.shortest else result.symmetric)[0]
            print(
                f"{name}: {result.samples} samples{' (adaptive)' if adaptive else ''} in {seconds:.1f} s: "
                f"mean {result.mean[0]:.5g}, u {result.standard_uncertainty[0]:.4g}, "
                f"{published.coverage:.0%} [{low:.5g}, {high:.5g}]; published: mean {published.mean}, "
                f"u {published.uncertainty}, [{published.interval[0]:.5g}, {published.interval[1]:.5g}]"
            )
    result = monte_carlo.run_monte_carlo(
        calibration_line(), samples=1_000_000, options=StatisticsOptions(covariance=True, joint=[[0, 1]])
    )
    assert result.covariance is not None
    u = result.standard_uncertainty
    print(f"GUM H.3: {result.mean} u {u}, correlation {result.covariance[0, 1] / (u[0] * u[1]):.3f}; published: ")
    print("  -0.1712(29), 0.00218(67), -0.1494(41), correlation -0.93")


if __name__ == "__main__":
    main()
