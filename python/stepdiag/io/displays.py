"""What the extension's classes show in consoles and notebooks, and `calibration["EXX"]`; attached on import.

They are written in Python because the extension does not import the package. Imports inside functions keep `import
stepdiag` fast.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration, ErrorMap, Head, Machine, Measurement, Plan, Verdict
from stepdiag.display import (
    Facts,
    facts_of_properties,
    html_table,
    lengths_text,
    one_line,
    point_text,
    scale_lines_text,
    text_of,
)


class ParameterValues(NamedTuple):
    """What a calibration knows of one parameter: arrays over its nodes, or numbers of a squareness; mm, rad."""

    position: Any  # mm; None of a squareness
    value: Any
    standard_uncertainty: Any


def _calibration(calibration: Calibration) -> Facts:
    from stepdiag.calibration.largest_by_kind import largest_entries, largest_uncertainties

    count = len(calibration.functions) + len(calibration.squareness)
    facts = [
        ("fit", calibration.fit or "not known"),
        ("method", calibration.method or "not known"),
        ("machine", f"{calibration.chain}, {lengths_text(calibration.volume)}"),
        ("parameters", f"{count} of 21"),
    ]
    for kind, entry in largest_entries(calibration).items():
        facts.append((f"largest {kind}", _sized(kind, entry.value, entry.place)))
    for kind, (u, where) in largest_uncertainties(calibration).items():
        facts.append((f"largest u of {kind}", _sized(kind, u, where)))
    facts += [("because", reason) for reason in calibration.fit_reasons]
    facts += [("undetermined", sentence) for sentence in calibration.undetermined]
    facts.append(("tool offset", point_text(calibration.tool)))
    return [*facts, ("date", calibration.date or "not known")]


def _measurement(measurement: Measurement) -> Facts:
    lines = Counter(measurement.line)
    channels = measurement.channels
    lost = sum(any(bool(x != x) for x in row) for row in zip(*(c.tolist() for c in channels.values()), strict=True))
    facts = [
        ("points", str(len(measurement))),
        ("lines", ", ".join(lines)),
        ("channels", ", ".join(channels)),
        ("rows without a complete reading", str(lost)),
        ("runs", str(len(set(measurement.run.tolist())))),
        ("directions", ", ".join(dict.fromkeys(measurement.direction))),
    ]
    return [*facts, *((f"points of {line}", str(count)) for line, count in lines.items())]


def _plan(plan: Plan) -> Facts:
    return [
        ("volume", lengths_text(plan.volume)),
        ("lines", ", ".join(plan.lines)),
        ("steps", str(plan.steps)),
        ("scale lines", scale_lines_text(plan)),
        ("order", ", ".join(dict.fromkeys(plan.orders))),
        ("smallest mirror", lengths_text(plan.smallest_mirror())),
    ]


def _machine(machine: Machine) -> Facts:
    return [("chain", str(machine.chain)), ("tool offset", point_text(machine.tool)), *_error_map(machine.errors)]


def _error_map(errors: ErrorMap) -> Facts:
    from stepdiag.parameters import KINDS, kind_of

    functions, squareness = errors.functions, errors.squareness
    facts = [("parameters", f"{len(functions) + len(squareness)} of 21")]
    largest: dict[str, tuple[float, str]] = {}
    entries = [
        (name, value, f"{name} at {p:g} mm")
        for name, (position, values) in functions.items()
        for p, value in zip(position.tolist(), values.tolist(), strict=True)
    ]
    for name, value, where in [*entries, *((name, angle, name) for name, angle in squareness.items())]:
        if abs(value) > abs(largest.get(kind_of(name), (0.0, ""))[0]):
            largest[kind_of(name)] = value, where
    return [*facts, *((f"largest {kind}", _sized(kind, *largest[kind])) for kind in KINDS if kind in largest)]


def _head(head: Head) -> Facts:
    facts = [("layout", head.layout), ("signals", ", ".join(head.signals)), ("standoff", f"{head.standoff:g} mm")]
    if head.design is not None:
        facts.append(("described", head.design.name))
    return [*facts, ("wavelength", f"{head.wavelength:g} nm"), ("mirror", text_of(head.mirror))]


def _adjustment(adjustment: Adjustment) -> Facts:
    degrees = adjustment.degrees_of_freedom
    return [
        *_verdict(adjustment.verdict),
        ("variance factor", f"{adjustment.variance_factor:.3g} with {degrees} degrees of freedom"),
        ("faults", str(len(adjustment.faults))),
        ("readings left out", str(len(adjustment.outliers))),
        *((label, text) for label, text in _calibration(adjustment.calibration) if label not in ("fit", "because")),
    ]


def _verdict(verdict: Verdict) -> Facts:
    from stepdiag.findings.reasons import reason_texts

    return [("fit", verdict.fit), *(("because", text) for text in reason_texts(verdict.reasons))]


def _sized(kind: Any, value: float, where: str) -> str:
    from stepdiag.parameters import REPORT_UNIT, in_report_units

    return f"{in_report_units(kind, value):.4g} {REPORT_UNIT[kind]} ({where})"


_FACTS: Final[Mapping[type, Callable[[Any], Facts]]] = {
    Adjustment: _adjustment,
    Calibration: _calibration,
    ErrorMap: _error_map,
    Head: _head,
    Machine: _machine,
    Measurement: _measurement,
    Plan: _plan,
    Verdict: _verdict,
    _core.Chain: lambda chain: [("chain", chain.name)],
}
# They show their properties, in native units.
_PLAIN: Final = """
BeamSegment BeamSpot CalibrationEntry Camera ChangeCombination ChangePriors ChangeTerm CheckPoints Compensator
DiagonalErrors Distribution DriftEstimate ErrorAtPoint Expansion ExpansionEstimate Fault FaultClass FaultControl
FitReason GaussianMode HeadBeam HeadBody HeadCalibration HeadDesign Interferometer KnownCombination KnownExpansion
LateralEffect LineDeviation MachineDrift Misalignment MonteCarloResult Noise Outlier PlausibleLimits Propagation
ReadingNoise ReadingUncertainty Recheck ReturnedBeam RoundedChannel ScaleTemperatures Sensitivity SetupEstimate
Smoothness SpotSensor UncertainInput UncertainInputs Undetermined Validation VarianceComponent Verification
VirtualCalibrations VolumetricAccuracy
"""


def attach() -> None:
    plain = [(getattr(_core, name), facts_of_properties) for name in _PLAIN.split()]
    for kind, facts in [*_FACTS.items(), *plain]:
        _attach(kind, facts)
    calibration: Any = Calibration
    calibration.__getitem__ = _get
    calibration.__contains__ = _has
    calibration.__iter__ = _names


def _attach(kind: Any, facts: Callable[[Any], Facts]) -> None:
    def __repr__(self: Any) -> str:
        return one_line(kind.__name__, facts(self))

    def _repr_html_(self: Any) -> str:
        return html_table(kind.__name__, facts(self))

    if "__repr__" not in vars(kind):  # Chain and CalibrationEntry have short ones of their own
        kind.__repr__ = __repr__
    kind._repr_html_ = _repr_html_


def _get(self: Calibration, parameter: str) -> ParameterValues:
    """Return position, value and standard uncertainty of a parameter, such as EXX, C0Y or EXX_reversal; mm, rad.

    Of a function these are arrays (n,), of a squareness numbers without a position. Raises KeyError naming the
    parameters that there are."""
    tables = self.functions | {f"{name}_reversal": table for name, table in self.reversal.items()}
    if parameter in tables:
        return ParameterValues(*tables[parameter])
    if parameter in self.squareness:
        return ParameterValues(None, *self.squareness[parameter])
    raise KeyError(f"no parameter {parameter!r} in this calibration; it has {', '.join(_names(self))}")


def _has(self: Calibration, parameter: object) -> bool:
    return parameter in list(_names(self))


def _names(self: Calibration) -> Iterator[str]:
    """Names of the parameters that there are: functions, reversal errors, squarenesses."""
    from stepdiag.parameters import FUNCTIONS, SQUARENESSES

    functions, reversal, squareness = self.functions, self.reversal, self.squareness
    yield from (name for name in FUNCTIONS if name in functions)
    yield from (f"{name}_reversal" for name in FUNCTIONS if name in reversal)
    yield from (name for name in SQUARENESSES if name in squareness)
