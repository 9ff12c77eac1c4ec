"""Sources of models that take no time, and that worker processes can import."""

import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import stepdiag as sd  # noqa: F401 (the extension's classes)
from stepdiag import _core

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Sums:
    """y1 = x1 + x2, y2 = x1 x2, of a normal and a rectangular number; `seconds`: more time for each call."""

    seed: int = 0
    seconds: float = 0.0

    def model(self) -> _core.SampleModel:
        inputs = [
            _core.Distribution("normal", spread=1.0),
            _core.Distribution("rectangular", spread=2.0),
        ]
        return _core.FunctionModel(self.values, inputs, ["sum", "product"], seed=self.seed)

    def values(self, x: FloatArray) -> FloatArray:
        time.sleep(self.seconds)
        return np.stack([x[0] + x[1], x[0] * x[1]])
