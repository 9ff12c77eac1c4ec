"""Examples of the GUM and its first supplement, as models."""

import math

import numpy as np
import numpy.typing as npt

from stepdiag._core import Distribution, FunctionModel

Array = npt.NDArray[np.float64]

NOMINAL_LENGTH = 50_000_000.0  # nm
UNIFORM = Distribution("rectangular", spread=math.sqrt(3.0))  # of standard deviation 1

# GUM H.3: temperatures, and corrections of a thermometer, °C.
T = np.array([21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511])
B = -np.array([0.171, 0.169, 0.166, 0.159, 0.164, 0.165, 0.156, 0.157, 0.159, 0.161, 0.160])


def straight_line() -> tuple[Array, float]:
    """GUM H.3: the map (3, 11) from corrections to y1, y2 of y1 + y2 (t - 20) and to the correction at 30 °C, and the
    standard deviation of the residuals."""
    design = np.column_stack([np.ones_like(T), T - 20.0])
    inverse = np.linalg.pinv(design)
    residuals = B - design @ (inverse @ B)
    return np.vstack([inverse, np.array([1.0, 10.0]) @ inverse]), math.sqrt(residuals @ residuals / (len(T) - 2))


def sum_of_four(each: Distribution, last: Distribution | None = None, seed: int = 1) -> FunctionModel:
    """JCGM 101, 9.2."""
    return FunctionModel(lambda x: x.sum(axis=0), [each] * 3 + [last or each], ["Y"], seed=seed)


def gauge_block(seed: int = 1) -> FunctionModel:
    """JCGM 101, 9.5 (GUM H.1): deviation of a gauge block from its nominal length, nm, with the distributions of its
    table 10. The comparator's difference is D + d1 + d2; the blocks' temperature theta0 + delta cycles."""
    inputs = [
        Distribution("t", expectation=50_000_623.0, spread=25.0, degrees_of_freedom=18),  # length of the standard
        Distribution("t", expectation=215.0, spread=6.0, degrees_of_freedom=24),
        Distribution("t", spread=4.0, degrees_of_freedom=5),
        Distribution("t", spread=7.0, degrees_of_freedom=8),
        Distribution("rectangular", expectation=11.5e-6, spread=2e-6),  # expansion of the standard, 1/K
        Distribution(expectation=-0.1, spread=0.2),  # K, beside 20 degrees Celsius
        Distribution("arcsine", spread=0.5),
        Distribution("curvilinear_trapezoid", spread=1e-6, edge=0.1e-6),  # difference of expansions
        Distribution("curvilinear_trapezoid", spread=0.05, edge=0.025),  # difference of temperatures
    ]

    def deviation(x: Array) -> Array:
        standard, mean, random, systematic, expansion, average, cycle, of_expansion, of_temperature = x
        thermal = standard * (of_expansion * (average + cycle) + expansion * of_temperature)
        return np.asarray(standard + mean + random + systematic - thermal - NOMINAL_LENGTH)

    return FunctionModel(deviation, inputs, ["deltaL"], seed=seed)
