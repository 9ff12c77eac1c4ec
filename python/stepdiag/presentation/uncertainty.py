"""What `stepdiag uncertainty` says: what is uncertain, tables by family, budgets, and the two methods side by side."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag.display import lines_text
from stepdiag.findings.temperature import reference_mark
from stepdiag.presentation.blocks import Block, HeadingBlock, NoteBlock, RowBlock, TableBlock
from stepdiag.scenario.uncertain_inputs import key_unit
from stepdiag.uncertainty.result import FloatArray, UncertaintyResult, label, volume_units
from stepdiag.units import report_value

# Of a budget: groups that make less than this of a variance are added up.
SMALL_SHARE: Final = 0.005
# JCGM 101, 7.2.2: samples that are to lie outside of an interval.
ENOUGH: Final = 10_000


def input_rows(inputs: _core.UncertainInputs) -> Iterator[str]:
    """Every uncertain input by its name, with its distribution in the unit of its key."""
    everything: list[_core.UncertainInput | _core.ReadingNoise] = [*inputs.inputs, *inputs.noise]
    width = max((len(one.name) for one in everything), default=0)
    for one in everything:
        yield f"  {one.name:<{width}}  {_distribution(one.distribution, *key_unit(one))}"


def _distribution(distribution: _core.Distribution, name: str, unit: float) -> str:
    text = f"{distribution.kind}, standard uncertainty {distribution.standard_uncertainty / unit:.3g} {name}".rstrip()
    if distribution.expectation != 0.0:
        text += f", expectation {distribution.expectation / unit:.3g} {name}".rstrip()
    if math.isfinite(distribution.degrees_of_freedom):
        text += f", {distribution.degrees_of_freedom:g} degrees of freedom"
    return text


def uncertainty_blocks(result: UncertaintyResult) -> Iterator[Block]:
    """What is calibrated, how many things are uncertain about it, and all tables of the result."""
    known, plan = result.known, result.known.plan
    if result.warning is not None:
        yield RowBlock("not to be trusted", result.warning)
    derived = len(result.outputs) - result.entries
    yield RowBlock(
        "virtual calibrations", f"method {result.method}, {lines_text(plan)}, readings {', '.join(known.signals)}"
    )
    yield RowBlock(
        "uncertain",
        f"{len(known.uncertain.inputs)} inputs, {len(known.uncertain.noise)} kinds of noise; "
        f"outputs: {result.entries} values of the 21 parameters" + (f", {derived} derived" if derived else ""),
    )
    reference = None if known.expansion is None else known.expansion.expansion.reference
    yield RowBlock("temperature", f"positioning errors are {reference_mark(reference)}")
    if result.propagation is not None:
        yield HeadingBlock("propagation (GUM), standard uncertainties u")
        yield _propagation_table(result)
        yield TableBlock(
            tuple(_budgets(result)),
            title="where the largest ones come from, in shares of the variance",
            left=(0, 1),
        )
    if result.monte_carlo is not None:
        yield from _monte_carlo_blocks(result)
    if result.comparison is not None:
        yield from _validation_blocks(result)
    if result.entries < len(result.outputs):
        yield HeadingBlock("derived quantities")
        yield _derived_table(result)
    if result.volume is not None:
        yield HeadingBlock(
            "ranges over the volume (V_XYZ of ISO 230-1, errors of body diagonals), by the propagated covariance"
        )
        yield _volume_table(result)


def _propagation_table(result: UncertaintyResult) -> TableBlock:
    found = result.propagation
    assert found is not None
    u, expanded = np.asarray(found.standard_uncertainty), np.asarray(found.expanded(result.coverage))
    freedom = np.asarray(found.degrees_of_freedom)
    heading = ["family", "median u", "largest u", f"U, {_percent(result)}", "freedom", "where"]
    rows = []
    for family, members, worst in _worst(result, u):
        unit = result.outputs[worst].unit
        median, largest, wide = (report_value(unit, x)[0] for x in (np.median(u[members]), u[worst], expanded[worst]))
        name = report_value(unit, 0.0)[1]
        degrees = "inf" if not freedom[worst] < 1e6 else f"{freedom[worst]:.3g}"
        rows.append(
            [family, *(f"{x:.3g} {name}" for x in (median, largest, wide)), degrees, label(result.outputs[worst])]
        )
    return _table(heading, rows)


def _worst(result: UncertaintyResult, u: FloatArray) -> Iterator[tuple[str, npt.NDArray[np.intp], int]]:
    """Families of the calibration's own values, and the output of each with the largest uncertainty."""
    for family, members in result.families():
        if family != "derived":
            # Values that are 0 by the choice of frame are no statement about the others.
            uncertain = members[u[members] > 0.0]
            if len(uncertain):
                yield family, uncertain, int(uncertain[np.argmax(u[uncertain])])


def _budgets(result: UncertaintyResult) -> Iterator[tuple[str, str]]:
    """Families, each with the groups of inputs that make the variance of its most uncertain value."""
    found = result.propagation
    assert found is not None
    u = np.asarray(found.standard_uncertainty)
    for family, _, worst in _worst(result, u):
        shares = {group: float(part[worst] / u[worst]) ** 2 for group, part in found.budget.items()}
        shares["between groups"] = float(np.asarray(found.between_groups)[worst]) / u[worst] ** 2
        named = sorted(((s, g) for g, s in shares.items() if abs(s) >= SMALL_SHARE), reverse=True)
        rest = sum(shares.values()) - sum(share for share, _ in named)
        text = ", ".join(f"{group} {share:.1%}" for share, group in named)
        yield family, text + (f", others {rest:.1%}" if rest >= SMALL_SHARE / 10.0 else "")


def _monte_carlo_blocks(result: UncertaintyResult) -> Iterator[Block]:
    found = result.monte_carlo
    assert found is not None
    lost = f", {found.lost:,} without a result" if found.lost else ""
    yield HeadingBlock(f"Monte Carlo (JCGM 101): {found.samples:,} samples, seed {result.seed}, {found.target}{lost}")
    yield from _stability(result)
    wanted = ENOUGH / (1.0 - result.coverage)
    if found.stability is None and found.samples < wanted:
        yield NoteBlock(
            f"note: JCGM 101 (7.2.2) wants about {wanted:,.0f} samples for a {_percent(result)} interval", indented=True
        )
    u = np.asarray(found.standard_uncertainty)
    heading = ["family", "median u", "largest u", f"{_percent(result)} interval about the mean", "where"]
    rows = []
    for family, members, worst in _worst(result, u):
        unit = result.outputs[worst].unit
        name = report_value(unit, 0.0)[1]
        low, high = (report_value(unit, x - found.mean[worst])[0] for x in found.symmetric[worst])
        median, largest = (report_value(unit, x)[0] for x in (np.median(u[members]), u[worst]))
        cells = [f"{median:.3g} {name}", f"{largest:.3g} {name}", f"{low:+.3g} {high:+.3g} {name}"]
        rows.append([family, *cells, label(result.outputs[worst])])
    yield _table(heading, rows)


def _validation_blocks(result: UncertaintyResult) -> Iterator[Block]:
    """By family how many outputs are validated, the worst of them, and why the worst that is not is not."""
    found = result.comparison
    assert found is not None
    difference = np.maximum(np.asarray(found.d_low), np.asarray(found.d_high))
    ratio = difference / np.asarray(found.delta)
    rows, reasons = [], []
    for family, members in result.families():
        finite = members[np.isfinite(ratio[members])]
        validated = sum(bool(found.validated[k]) for k in members)
        if not len(finite):
            rows.append([family, f"{validated} of {len(members)}", "-", "-", "-", "-"])
            continue
        worst = int(finite[np.argmax(ratio[finite])])
        unit, sizes = result.outputs[worst].unit, (difference[worst], found.delta[worst], found.sampling[worst])
        name = report_value(unit, 0.0)[1]
        cells = [f"{report_value(unit, float(size))[0]:.2g} {name}".rstrip() for size in sizes]
        rows.append([family, f"{validated} of {len(members)}", *cells, label(result.outputs[worst])])
        if not found.validated[worst]:
            reasons.append(
                NoteBlock(
                    f"{family}, {label(result.outputs[worst])}: {_in_report_signs(found.reason[worst])}", indented=True
                )
            )
    yield HeadingBlock(
        f"validation of the propagation (JCGM 101, 8): ends of y ± U beside those of the {_percent(result)} interval, "
        f"to {_digits(result)} of u"
    )
    yield _table(["family", "validated", "largest d", "tolerance", "sampling", "where"], rows)
    if reasons:
        yield NoteBlock("where propagation fails most, and why:")
        yield from reasons


def _in_report_signs(text: str) -> str:
    return text.replace(" urad", " µrad").replace(" um", " µm")


def _stability(result: UncertaintyResult) -> Iterator[Block]:
    """Of an adaptive run: whether the digits that were asked for are there."""
    found = result.monte_carlo
    assert found is not None
    if found.stability is None:
        return
    if found.stability.stable:
        yield NoteBlock(
            f"adaptive: every output is stable to {_digits(result)} of its u (JCGM 101, 7.9)", indented=True
        )
    else:
        worst = result.outputs[found.stability.output]
        yield NoteBlock(
            f"adaptive: {found.stability.unstable} of {len(result.outputs)} outputs are not yet stable to "
            f"{_digits(result)} of their u; the {found.stability.figure} of {label(worst)} is the worst, "
            f"{found.stability.ratio:.3g} times the tolerance; -n sets the largest number of samples",
            indented=True,
        )


def _derived_table(result: UncertaintyResult) -> TableBlock:
    found, other = result.monte_carlo, result.propagation
    heading = ["quantity", "value", "u"]
    heading += [f"U, {_percent(result)}"] if found is None else [f"{_percent(result)} interval", "u, propagated"]
    rows = []
    expanded = None if other is None else np.asarray(other.expanded(result.coverage))
    for k in range(result.entries, len(result.outputs)):
        output = result.outputs[k]
        name = report_value(output.unit, 0.0)[1]

        def show(value: float, unit: str = output.unit, name: str = name) -> str:
            return f"{report_value(unit, value)[0]:.4g} {name}".rstrip()

        if found is not None:
            low, high = (report_value(output.unit, x)[0] for x in found.symmetric[k])
            cells = [show(found.mean[k]), show(found.standard_uncertainty[k]), f"{low:.4g} .. {high:.4g} {name}"]
            cells.append("-" if other is None else show(other.standard_uncertainty[k]))
        else:
            assert other is not None
            assert expanded is not None
            cells = [show(other.value[k]), show(other.standard_uncertainty[k]), show(expanded[k])]
        rows.append([label(output), *cells])
    return _table(heading, rows)


def _volume_table(result: UncertaintyResult) -> TableBlock:
    found = result.volume
    assert found is not None
    rows = []
    for k, name in enumerate(found.names):
        if name in found.missing:
            rows.append([name, "-", "-", f"not determined: {', '.join(found.missing[name])}"])
            continue
        numbers = (found.value[k], found.standard_uncertainty[k], *found.interval[k])
        value, u, low, high = (report_value(volume_units(name), float(x))[0] for x in numbers)
        unit = report_value(volume_units(name), 0.0)[1]
        rows.append([name, f"{value:.4g} {unit}", f"{u:.3g} {unit}", f"{low:.4g} .. {high:.4g} {unit}"])
    return _table(["range", "value", "u", f"{_percent(result)} interval"], rows)


def _digits(result: UncertaintyResult) -> str:
    return "1 digit" if result.digits == 1 else f"{result.digits} digits"


def _percent(result: UncertaintyResult) -> str:
    return f"{100.0 * result.coverage:.8g} %"


def _table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> TableBlock:
    """Numbers by row, the first column and a last one of places are words."""
    left = (0, len(heading) - 1) if heading[-1] == "where" else (0,)
    return TableBlock(tuple(map(tuple, rows)), tuple(heading), left=left)
