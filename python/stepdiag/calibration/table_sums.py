"""Sums of a calibration's table values, and their standard uncertainties."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration

FloatArray = npt.NDArray[np.float64]


class Term(NamedTuple):
    """factor · function(position), for each of n positions (mm)."""

    function: str
    position: FloatArray
    factor: FloatArray


class TableValues:
    """The error functions of a calibration between and at their nodes, with what is known of their covariance.

    Reversal errors are functions too, NAME_reversal; their covariances are not known."""

    def __init__(self, calibration: Calibration) -> None:
        reversal = {f"{name}_reversal": table for name, table in calibration.reversal.items()}
        self.functions = calibration.functions | reversal
        self.covariance = calibration.covariance
        self._first_row: dict[str, int] = {}
        for row, (name, _) in enumerate(calibration.covariance_labels):
            self._first_row.setdefault(name, row)

    def sum(self, terms: Sequence[Term]) -> tuple[FloatArray, FloatArray]:
        """The sum of the terms and its standard uncertainty, position by position.

        Functions are linear between nodes, and hold their end values outside, as the tables do. Without a full
        covariance different terms are taken as independent, and neighbouring nodes as fully correlated."""
        value = np.sum([t.factor * np.interp(t.position, *self.functions[t.function][:2]) for t in terms], axis=0)
        known = self.covariance is not None and all(term.function in self._first_row for term in terms)
        variance = self._variance(terms) if known else self._variance_if_independent(terms)
        return value, np.sqrt(variance)

    def _variance_if_independent(self, terms: Sequence[Term]) -> FloatArray:
        variance = np.zeros(len(terms[0].position))
        for term in terms:
            nodes, _, uncertainty = self.functions[term.function]
            # An unknown uncertainty that counts nothing makes nothing unknown.
            share = np.where(term.factor == 0.0, 0.0, term.factor * np.interp(term.position, nodes, uncertainty))
            variance += share**2
        return variance

    def _variance(self, terms: Sequence[Term]) -> FloatArray:
        assert self.covariance is not None
        rows, factors = [], []
        for term in terms:
            nodes = self.functions[term.function][0]
            rows.append(self._first_row[term.function] + np.arange(len(nodes)))
            factors.append(term.factor[:, None] * _weights(nodes, term.position))
        index, factor = np.concatenate(rows), np.concatenate(factors, axis=1)
        covariance = self.covariance[np.ix_(index, index)]
        variance: FloatArray = np.sum((factor @ covariance) * factor, axis=1)
        return np.maximum(variance, 0.0)


def _weights(nodes: FloatArray, position: FloatArray) -> FloatArray:
    """(n, nodes): by how much each node counts in linear interpolation at each position."""
    weights = np.zeros((len(position), len(nodes)))
    row = np.arange(len(position))
    if len(nodes) == 1:
        weights[:, 0] = 1.0
        return weights
    after = np.clip(np.searchsorted(nodes, position, side="right"), 1, len(nodes) - 1)
    share = np.clip((position - nodes[after - 1]) / (nodes[after] - nodes[after - 1]), 0.0, 1.0)
    weights[row, after - 1] = 1.0 - share
    weights[row, after] += share
    return weights
