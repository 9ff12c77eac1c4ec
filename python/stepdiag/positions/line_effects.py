"""How the values of a calibration act on deviations along a line, to first order; what of it is not determined."""

import numpy as np

from stepdiag._core import Calibration, derived_at_point
from stepdiag.calibration.table_sums import FloatArray, TableValues, Term
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

# Below this share of the largest coefficient, cancelled levers have left rounding only.
_ROUNDING = 1e-12


class LineEffects:
    """Coefficients of all 21 parameters for d · e at n points of a line of direction d, and for its change.

    A parameter that the calibration lacks counts as one with nodes at both ends of travel."""

    def __init__(self, calibration: Calibration, points: FloatArray, direction: FloatArray, tool: tuple[float, ...]):
        ends = {axis: np.array([0.0, edge]) for axis, edge in zip(AXES, calibration.volume, strict=True)}
        nowhere = np.zeros(2)
        complete = Calibration(
            calibration.method,
            calibration.chain,
            calibration.volume,
            calibration.tool,
            {name: calibration.functions.get(name, (ends[name[2]], nowhere, nowhere)) for name in FUNCTIONS},
            dict.fromkeys(SQUARENESSES, (0.0, 0.0)),
        )
        self._calibration = calibration
        self._points = points
        self._moving = {axis for axis, component in zip(AXES, direction, strict=True) if component != 0.0}
        self._parameter = np.array([name for name, _ in complete.covariance_labels])
        self._node = np.array([0.0 if node is None else node for _, node in complete.covariance_labels])
        rows = []
        for point in points:
            x, y, z = derived_at_point(complete, point, tool=tool)[:3]
            rows.append(direction @ [x.row, y.row, z.row])
        self._rows = np.array(rows)
        self._change = self._rows - self._rows[0]  # since the first point
        self._negligible = _ROUNDING * float(np.abs(self._rows).max())

    def missing(self) -> list[str]:
        """What acts in the change along the line and is not determined: EXX, slope of EXX, C0Y."""
        calibration, names = self._calibration, []
        for name in (*FUNCTIONS, *SQUARENESSES):
            own = self._parameter == name
            # Functions are 0 at home by definition.
            counts = own if name in SQUARENESSES else own & (self._node != 0.0)
            if name not in calibration.functions and name not in calibration.squareness:
                if self._acts(self._change[:, counts]):
                    names.append(name)
            elif name in calibration.undetermined_slopes and self._acts(self._change[:, own] @ self._node[own]):
                names.append(f"slope of {name}")
        return names

    def unknown_reversals(self) -> tuple[list[str], list[str]]:
        """Functions of moving axes that act on the line: without reversal table, and known but for a constant."""
        acting = [name for name in FUNCTIONS if name[2] in self._moving and self._acts(self._of(name))]
        calibration = self._calibration
        without = [name for name in acting if name not in calibration.reversal]
        open_constants = calibration.undetermined_reversal_constants
        return without, [name for name in acting if name in open_constants and self._acts(self._coefficient(name))]

    def changing(self, names: list[str]) -> list[str]:
        """The functions of these whose constant acts differently at different points."""
        return [name for name in names if self._acts(self._coefficient(name) - self._coefficient(name)[0])]

    def reversal_uncertainty(self) -> FloatArray:
        """(n,) mm: of the reversal error along the line; NaN where a table is missing. Functions as independent."""
        tables = TableValues(self._calibration)
        terms = [
            Term(f"{name}_reversal", self._points[:, AXES.index(name[2])], self._coefficient(name))
            for name in FUNCTIONS
            if name[2] in self._moving and name in self._calibration.reversal
        ]
        return tables.sum(terms)[1] if terms else np.full(len(self._points), np.nan)

    def covariance_root(self, approach: str) -> tuple[FloatArray | None, str]:
        """(n, r) mm: root · rootᵀ is the covariance of the deviations in this direction; else why it is not known."""
        calibration = self._calibration
        if calibration.covariance is None:
            return None, "the calibration has no covariance (write it as .nc with its covariance)"
        down = [name for name in calibration.reversal if approach[AXES.index(name[2])] == "-"]
        if any(self._acts(self._of(name)) for name in down):
            return None, "the line approaches positions in - direction, where the covariance of tables is not known"
        known = np.isin(self._parameter, [name for name, _ in calibration.covariance_labels])
        acting = np.any(self._change[:, known] != 0.0, axis=0)
        rows = self._change[:, known][:, acting]
        covariance = calibration.covariance[np.ix_(acting, acting)]
        # The smaller of two matrices is decomposed.
        if len(rows) <= rows.shape[1]:
            return _root(rows @ covariance @ rows.T), ""
        return rows @ _root(covariance), ""

    def _of(self, name: str) -> FloatArray:
        """(n, nodes) coefficients of a function."""
        return self._rows[:, self._parameter == name]

    def _coefficient(self, name: str) -> FloatArray:
        """(n,) coefficient of a function at each point: its nodes' weights sum up to 1."""
        total: FloatArray = self._of(name).sum(axis=1)
        return total

    def _acts(self, coefficients: FloatArray) -> bool:
        return bool(np.any(np.abs(coefficients) > self._negligible))


def _root(covariance: FloatArray) -> FloatArray:
    """R with R · Rᵀ = covariance, which may be singular."""
    variances, directions = np.linalg.eigh(covariance)
    known = variances > 1e-14 * variances.max(initial=0.0)
    root: FloatArray = directions[:, known] * np.sqrt(variances[known])
    return root
