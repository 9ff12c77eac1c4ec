"""Two calibrations of one machine side by side, or one and the truth: what differs, and whether by more than their
uncertainties."""

import math
import sys
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, ErrorMap, InvalidArgument
from stepdiag.calibration.table_sums import FloatArray, TableValues, Term
from stepdiag.calibration.truth import TRUTH, TruthAgreement, agreement_with_truth, truth_as_calibration
from stepdiag.display import Displayed, Facts, lengths_text
from stepdiag.findings.meaning import UNVERIFIED
from stepdiag.findings.temperature import temperature_mark
from stepdiag.parameters import units_of
from stepdiag.style import drawn
from stepdiag.units import report_value
from stepdiag.wrong_arguments import checked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Lengths that differ by less were rounded on the way, mm.
_ROUNDING: Final = 1e-6
# What two sums of the same numbers may differ by, mm or rad.
_NO_DIFFERENCE: Final = 1e-15

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Difference(Displayed):
    """B - A of one parameter: arrays (n,) over its common positions, mm or rad; one value for a squareness."""

    parameter: str  # NAME_reversal for a reversal error
    position: FloatArray  # mm; NaN for a squareness
    value: FloatArray
    standard_uncertainty: FloatArray  # sqrt(u_A^2 + u_B^2): as if the two were independent; NaN where one is not known
    # A slope is not determined: both are turned to 0 at the last common position. Of a reversal error the constant is
    # not: both are moved to 0 at the first one.
    shape_only: bool = False
    interpolated: str = ""  # "A" or "B": which of the two has no nodes at these positions

    @property
    def normalised(self) -> FloatArray:
        """Differences by their standard uncertainties; 0 where both are the same fixed zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio: FloatArray = self.value / self.standard_uncertainty
        return np.where(self._fixed, 0.0, ratio)

    @property
    def testable(self) -> BoolArray:
        """Where uncertainties are known, and the values are not 0 by the frame's choice."""
        return ~np.isnan(self.normalised) & ~self._fixed

    @property
    def _fixed(self) -> BoolArray:
        fixed: BoolArray = (self.standard_uncertainty == 0.0) & (np.abs(self.value) <= _NO_DIFFERENCE)
        return fixed

    @property
    def largest(self) -> int:
        """Where the difference is largest."""
        return int(np.argmax(np.abs(self.value)))

    @property
    def most_significant(self) -> int | None:
        """Where the normalised difference is largest; none where no uncertainty is known."""
        if not np.any(self.testable):
            return None
        return int(np.argmax(np.where(self.testable, np.abs(self.normalised), -1.0)))

    def _facts(self) -> Facts:
        k, worst = self.largest, self.most_significant
        size, unit = report_value(units_of(self.parameter), float(self.value[k]))
        place = "" if np.isnan(self.position[k]) else f" at {self.position[k]:g} mm"
        normalised = "not known" if worst is None else f"{self.normalised[worst]:.3g} u"
        return [
            ("parameter", self.parameter + (" (shape)" if self.shape_only else "")),
            ("largest B - A", f"{size:.4g} {unit}{place}"),
            ("most significant B - A", normalised),
            ("values", str(len(self.value))),
        ]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Displayed):
    """What two calibrations A and B say of the same parameters, and what only one of them knows."""

    a: Calibration
    b: Calibration
    differences: tuple[Difference, ...]
    only_in_a: tuple[str, ...]
    only_in_b: tuple[str, ...]
    limit: float
    notes: tuple[str, ...]
    agreement: TruthAgreement | None = None  # where one of them is a truth

    @property
    def count(self) -> int:
        """How many values are tested."""
        return sum(int(np.count_nonzero(difference.testable)) for difference in self.differences)

    @property
    def threshold(self) -> float:
        """The normalised difference beyond which one of all values is significant (Bonferroni, two-sided)."""
        return significance_threshold(self.limit, self.count)

    def probability(self, difference: Difference) -> float | None:
        """That chance alone makes any of all values compared differ by as many uncertainties as this parameter's worst.

        At most (Bonferroni): the number of values times the probability of one. None without uncertainties."""
        worst = difference.most_significant
        if worst is None:
            return None
        return min(1.0, self.count * math.erfc(abs(float(difference.normalised[worst])) / math.sqrt(2.0)))

    def is_significant(self, difference: Difference) -> bool:
        """Whether any of its values differs by more than chance would explain at the limit."""
        probability = self.probability(difference)
        return probability is not None and probability <= self.limit

    def _facts(self) -> Facts:
        significant = [difference.parameter for difference in self.differences if self.is_significant(difference)]
        text = ", ".join(significant) or "none"
        facts = [
            ("significant", text if self.count else "not known: no standard uncertainties"),
            ("compared", f"{len(self.differences)} parameters, {self.count} values"),
            ("machine", f"{self.a.chain}, {lengths_text(self.a.volume)}"),
        ]
        for name, one in (("A", self.a), ("B", self.b)):
            facts.append((name, f"{one.method or 'method not known'}, fit {one.fit or 'not known'}, {one.date}"))
        facts += [("only in A", ", ".join(self.only_in_a))] if self.only_in_a else []
        facts += [("only in B", ", ".join(self.only_in_b))] if self.only_in_b else []
        return [*facts, *((d.parameter, d._facts()[1][1]) for d in self.differences)]

    def plot(self) -> "Figure":
        """Draw the differences with 95 % bands and the limits of significance (a matplotlib Figure)."""
        return drawn(self)


def significance_threshold(limit: float, count: int) -> float:
    """The normalised difference that chance exceeds in any of `count` values with this probability at most.

    Bonferroni, two-sided."""
    return -NormalDist().inv_cdf(max(0.5 * limit / max(count, 1), sys.float_info.min))


def made_of(calibration: Calibration) -> dict[str, str]:
    """How and when a calibration was made, and for which temperature; empty: not known, or the truth."""
    temperature = "" if calibration.method == TRUTH else temperature_mark(calibration)
    return {"method": calibration.method, "date": calibration.date, "temperature": temperature}


@checked
def compare(a: Calibration | ErrorMap, b: Calibration | ErrorMap, *, limit: float = 0.05) -> Comparison:
    """Differences B - A of all parameters that both determine, with their significance.

    One of the two may be an error map, such as a known truth: it is taken at the nodes of the other one, as exact.

    Where nodes differ, those of the shorter table are taken and the other one is interpolated, linearly, its
    uncertainties likewise. Of functions whose slope one of them leaves open the shapes are compared. `limit` is the
    probability of any false alarm among all values. Raises InvalidArgument where chain or volume differ, where the tool
    does and a method takes no account of it, or where there is nothing to compare."""
    if not 0.0 < limit < 1.0:
        raise InvalidArgument(f"limit: expected a probability between 0 and 1, got {limit}")
    truths: list[str] = []
    calibration = b if isinstance(a, ErrorMap) else a
    if isinstance(calibration, ErrorMap):
        raise InvalidArgument("expected one calibration at least, got two error maps")
    if isinstance(a, ErrorMap):
        a, truths = truth_as_calibration(a, calibration)
    with_truth = a is not calibration
    if isinstance(b, ErrorMap):
        b, truths = truth_as_calibration(b, calibration)
        with_truth = True
    notes = [*_check_machines(a, b), *truths]
    marks = temperature_mark(a), temperature_mark(b)
    if marks[0] != marks[1] and not with_truth:
        notes.append(
            f"temperatures differ: A {marks[0]}, B {marks[1]}; so positioning differs by the scales' expansion"
        )
    notes += [f"{which} is {UNVERIFIED}" for which, one in (("A", a), ("B", b)) if one.unverified]
    run = a.provenance.get("run_sha256")
    if run is not None and run == b.provenance.get("run_sha256"):
        notes.append("A and B are evaluations of the same run: they are not independent")
    tables_a, tables_b = TableValues(a), TableValues(b)
    shapes = {*a.undetermined_slopes, *b.undetermined_slopes}
    constants = {*a.undetermined_reversal_constants, *b.undetermined_reversal_constants}
    shapes |= {f"{name}_reversal" for name in constants}
    differences = []
    for name in sorted(tables_a.functions.keys() & tables_b.functions.keys(), key=_order):
        difference = _function_difference(tables_a, tables_b, name, name in shapes)
        if difference is None:
            notes.append(f"the positions of {name} have nothing in common; it is not compared")
        else:
            differences.append(difference)
    mine, theirs = a.squareness, b.squareness
    for name in ("C0Y", "B0Z", "A0Z"):
        if name in mine and name in theirs:
            (angle_a, u_a), (angle_b, u_b) = mine[name], theirs[name]
            value, uncertainty = np.array([angle_b - angle_a]), np.array([math.hypot(u_a, u_b)])
            differences.append(Difference(name, np.array([np.nan]), value, uncertainty))
    if not differences:
        raise InvalidArgument("the two calibrations determine no parameter in common")
    if a.reversal or b.reversal:
        notes.append("functions are those of positions approached in + direction")
    known_a, known_b = {*tables_a.functions, *mine}, {*tables_b.functions, *theirs}
    only_in_a, only_in_b = (tuple(sorted(names, key=_order)) for names in (known_a - known_b, known_b - known_a))
    agreement = None
    if with_truth:
        deviations = {difference.parameter: difference.value for difference in differences}
        shapes = {difference.parameter for difference in differences if difference.shape_only}
        tested = [d.normalised[d.testable & np.isfinite(d.normalised)] for d in differences]
        agreement = agreement_with_truth(calibration, deviations, shapes, np.concatenate(tested))
    return Comparison(a, b, tuple(differences), only_in_a, only_in_b, limit, tuple(notes), agreement)


def _check_machines(a: Calibration, b: Calibration) -> list[str]:
    if a.chain != b.chain:
        raise InvalidArgument(
            f"the chains differ, {a.chain} and {b.chain}: the error tables of an axis mean something else in each"
        )
    if not np.allclose(a.volume, b.volume, rtol=0.0, atol=_ROUNDING):
        raise InvalidArgument(
            f"the volumes differ, {_lengths(a.volume)} and {_lengths(b.volume)} mm: straightnesses and squarenesses "
            "belong to the ends of travel"
        )
    if np.allclose(a.tool, b.tool, rtol=0.0, atol=_ROUNDING):
        return []
    tools = f"the tool offsets differ, {_lengths(a.tool)} and {_lengths(b.tool)} mm"
    if "conventional" in (a.method, b.method):
        raise InvalidArgument(f"{tools}: results of the method conventional hold for one tool only")
    return [f"{tools}; the tables belong to the axes and not to the tool, so they are compared all the same"]


def _function_difference(a: TableValues, b: TableValues, name: str, shape_only: bool) -> Difference | None:
    nodes_a, nodes_b = a.functions[name][0], b.functions[name][0]
    shorter, longer, interpolated = (nodes_a, nodes_b, "B") if len(nodes_a) <= len(nodes_b) else (nodes_b, nodes_a, "A")
    position = shorter[(shorter >= longer[0] - _ROUNDING) & (shorter <= longer[-1] + _ROUNDING)]
    if len(position) == 0:
        return None
    terms = [Term(name, position, np.ones_like(position))]
    fixed = 0 if name.endswith("_reversal") else -1  # where a shape is 0 by definition
    if shape_only and position[-1] != 0.0:
        share = np.ones_like(position) if fixed == 0 else position / position[-1]
        terms.append(Term(name, np.full_like(position, position[fixed]), -share))
    (value_a, u_a), (value_b, u_b) = a.sum(terms), b.sum(terms)
    if shape_only:
        u_a[fixed] = u_b[fixed] = 0.0
    there = np.abs(longer[np.clip(np.searchsorted(longer, position - _ROUNDING), 0, len(longer) - 1)] - position)
    return Difference(
        name,
        position,
        value_b - value_a,
        np.hypot(u_a, u_b),
        shape_only,
        interpolated if np.any(there > _ROUNDING) else "",
    )


def _order(parameter: str) -> tuple[int, int, int]:
    """Axis by axis, displacements before rotations; then reversal errors, then C0Y, B0Z, A0Z."""
    if parameter[0] != "E":
        return 2, -"ABC".index(parameter[0]), 0
    return int(len(parameter) > 3), "XYZ".index(parameter[2]), "XYZABC".index(parameter[1])


def _lengths(values: FloatArray) -> str:
    return " ".join(f"{value:g}" for value in values)
