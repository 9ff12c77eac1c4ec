"""A comparison of two calibrations in blocks, as CSV and as a labelled table."""

from collections.abc import Collection, Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any, Final

import numpy as np

from stepdiag._core import Calibration
from stepdiag.calibration.comparison import Comparison, Difference, made_of
from stepdiag.calibration.truth import TruthAgreement
from stepdiag.calibration.volume_change import VolumeChange
from stepdiag.findings.meaning import unverified_key
from stepdiag.io.comparison_read import COMPARISON_FORMAT
from stepdiag.io.csv_text import csv_text, lengths
from stepdiag.io.data_files import date_of_today, is_netcdf
from stepdiag.io.labelled import LabelledTable
from stepdiag.io.whole_files import write_whole
from stepdiag.parameters import REPORT_UNIT, in_report_units, kind_of, units_of
from stepdiag.presentation.blocks import Block, HeadingBlock, RowBlock, TableBlock, VerdictBlock
from stepdiag.units import report_value

EFFECTS_SHOWN: Final = 5
LEAST_PROBABILITY: Final = 1e-12  # that is shown


def comparison_blocks(comparison: Comparison, change: VolumeChange, name_a: str, name_b: str) -> Iterator[Block]:
    """What is compared, what it means in the volume, a table by parameter with the significant ones marked, and what
    cannot be compared."""
    yield RowBlock("A", f"{name_a}: {_described(comparison.a)}")
    yield RowBlock("B", f"{name_b}: {_described(comparison.b)}")
    a = comparison.a
    volume, tool = (" x ".join(f"{edge:g}" for edge in a.volume), " ".join(f"{offset:g}" for offset in a.tool))
    yield RowBlock("machine", f"chain {a.chain}, volume {volume} mm, tool offset {tool} mm")
    yield HeadingBlock("error of the tool in the volume")
    yield _verdict(change, (comparison.a.fit, comparison.b.fit))
    yield from _volume_blocks(change)
    if comparison.agreement is not None:
        yield from _agreement_rows(comparison.agreement)
    yield HeadingBlock("differences by parameter")
    yield TableBlock(
        tuple(_row(comparison, difference) for difference in comparison.differences),
        ("", "B - A", "u", "at mm", "(B - A)/u", "at mm", "probability", ""),
        left=(0, 7),
    )
    yield HeadingBlock("how to read it")
    yield from _rules(comparison)


def _verdict(change: VolumeChange, fits: Collection[str | None]) -> VerdictBlock:
    """Whether the machine became better or worse, as far as its largest error shows."""
    figure = change.largest
    verdict, headline = "undecided", "whether the largest error has changed is not known"
    why = change.no_verdict_because
    if "rejected" in fits:
        why = "a fit is rejected, so that these figures do not show whether the machine has changed"
    elif not np.isnan(figure.change):
        way = "smaller" if figure.change < 0.0 else "larger"
        headline = f"the largest error is {_micrometres(abs(figure.change))} µm {way} by B than by A"
        if figure.verdict is not None:
            verdict, headline = figure.verdict, f"{figure.verdict}: {headline}"
            why = f"the 95 % interval of B - A {'contains' if verdict == 'undecided' else 'excludes'} 0"
    return VerdictBlock("change", verdict, headline, why)


def _volume_blocks(change: VolumeChange) -> Iterator[Block]:
    rows = []
    for name, figure in (("largest", change.largest), ("rms", change.rms)):
        interval = "-" if figure.interval is None else " to ".join(map(_micrometres, figure.interval))
        values = map(_micrometres, (figure.a, figure.b, figure.change))
        rows.append((name, *values, interval, f"µm  {figure.verdict or ''}"))
    yield TableBlock(tuple(rows), ("", "A", "B", "B - A", "95 %", ""), left=(0, 5))
    if change.no_verdict_because:
        yield RowBlock("no verdict", change.no_verdict_because)
    rows = []
    for effect in change.effects[:EFFECTS_SHOWN]:
        mark = "µm  significant" if effect.significant else "µm"
        rows.append((effect.parameter, _micrometres(effect.largest), _micrometres(effect.rms), mark))
    if rows:
        yield TableBlock(tuple(rows), ("error by one difference alone", "largest", "rms", ""), left=(0, 3))


def _agreement_rows(agreement: TruthAgreement) -> Iterator[Block]:
    if not agreement.values:
        yield RowBlock(
            "agreement with the error map", "not known, because the calibration has no standard uncertainties"
        )
        return
    share = 100.0 * agreement.beyond_two / agreement.values
    yield RowBlock(
        "agreement with the error map",
        f"{agreement.beyond_two} of {agreement.values} values beyond 2 u ({share:.1f} %; 4.6 % expected), rms "
        f"{agreement.rms:.3g} u",
    )
    if agreement.chi_square is None or agreement.probability is None:
        yield RowBlock("chi-square", "not known, because the calibration has no covariance (write it as .nc)")
    else:
        yield RowBlock(
            "chi-square",
            f"{agreement.chi_square:.4g} with {agreement.degrees_of_freedom} degrees of freedom, probability of a "
            f"larger one {agreement.probability:.3g}",
        )


def _micrometres(value: float) -> str:
    return "-" if np.isnan(value) else f"{report_value('mm', value)[0]:.4g}"


def _described(calibration: Calibration) -> str:
    made = made_of(calibration)
    return ", ".join(
        filter(None, (made["method"] or "method not known", made["date"] or "date not known", made["temperature"]))
    )


def _row(comparison: Comparison, difference: Difference) -> tuple[str, ...]:
    kind = kind_of(difference.parameter)
    k, worst = difference.largest, difference.most_significant
    value, u = (in_report_units(kind, float(x[k])) for x in (difference.value, difference.standard_uncertainty))
    name = difference.parameter.replace("_", " ") + (" shape" if difference.shape_only else "")
    largest = (name, f"{value:.4g}", "-" if np.isnan(u) else f"{u:.3g}", _place(difference, k))
    probability = comparison.probability(difference)
    if worst is None or probability is None:
        return (*largest, "-", "-", "-", REPORT_UNIT[kind])
    mark = " significant" if comparison.is_significant(difference) else ""
    normalised = f"{float(difference.normalised[worst]):.3g}"
    return (*largest, normalised, _place(difference, worst), _chance(probability), f"{REPORT_UNIT[kind]}{mark}")


def _chance(probability: float) -> str:
    return f"{probability:.3g}" if probability >= LEAST_PROBABILITY else f"< {LEAST_PROBABILITY:g}"


def _place(difference: Difference, k: int) -> str:
    return "-" if np.isnan(difference.position[k]) else f"{difference.position[k]:g}"


def _rules(comparison: Comparison) -> Iterator[Block]:
    if comparison.count:
        marked = sum(map(comparison.is_significant, comparison.differences))
        yield RowBlock(
            "significant",
            f"{marked} of {len(comparison.differences)} parameters, where |B - A| is beyond "
            f"{comparison.threshold:.3g} u for any of its values",
        )
        yield RowBlock(
            "probability",
            f"that chance makes any of the {comparison.count} values differ so, at most (Bonferroni); significant up "
            f"to {comparison.limit:g}",
        )
        if comparison.agreement is not None:
            yield RowBlock("u", "that of the calibration; the error map is taken as exact")
        else:
            yield RowBlock(
                "u",
                "sqrt(u_A^2 + u_B^2), as if A and B were independent; two evaluations of one run differ by less",
            )
    else:
        yield RowBlock("significance", "not known, because one of the two has no standard uncertainties")
    for which in "AB":
        yield from _named(
            f"note: {which} is interpolated at the nodes of the other one",
            [d.parameter for d in comparison.differences if d.interpolated == which],
        )
    shapes = [d.parameter for d in comparison.differences if d.shape_only]
    slopes = [name for name in shapes if not name.endswith("_reversal")]
    yield from _named("note: shapes, both ends at 0, because a slope is not determined", slopes)
    if len(shapes) > len(slopes):
        yield RowBlock(
            "note", "shapes of reversal errors, 0 at the first position, because a constant is not determined"
        )
    yield from _named("only in A", comparison.only_in_a)
    yield from _named("only in B", comparison.only_in_b)
    yield from (RowBlock("note", note) for note in comparison.notes)


def _named(what: str, parameters: Sequence[str]) -> Iterator[RowBlock]:
    if parameters:
        yield RowBlock(what, ", ".join(parameters))


def comparison_csv(comparison: Comparison) -> str:
    """The differences value by value, with leading lines that say of what; in µm and µrad."""
    a, b = comparison.a, comparison.b
    leading = {
        "format": COMPARISON_FORMAT,
        "chain": a.chain.name,
        "volume_mm": lengths(a.volume),
        **_made(a, b),
        "limit": str(comparison.limit),
        "values": str(comparison.count),
    }
    columns = "parameter,position_mm,difference,unit,standard_uncertainty,normalised_difference,shape_only"
    rows = []
    for difference in comparison.differences:
        shift, unit = (3, "um") if units_of(difference.parameter) == "mm" else (6, "urad")
        for position, value, u, normalised in zip(
            difference.position.tolist(),
            difference.value.tolist(),
            difference.standard_uncertainty.tolist(),
            difference.normalised.tolist(),
            strict=True,
        ):
            fields = [difference.parameter, decimal(position), decimal(value, shift), unit, decimal(u, shift)]
            rows.append([*fields, decimal(normalised), str(difference.shape_only).lower()])
    return csv_text(columns.split(","), rows, leading)


def _made(a: Calibration, b: Calibration) -> dict[str, str]:
    """How and from what both calibrations were made."""
    facts = {which: made_of(c) | c.provenance | unverified_key(c) for which, c in (("a", a), ("b", b))}
    return {f"{key}_{which}": text for which, own in facts.items() for key, text in own.items()}


def decimal(value: float, shift: int = 0) -> str:
    """The number times 10^shift without rounding; empty for one that is not known."""
    if not np.isfinite(value):
        return ""
    return repr(value) if shift == 0 or value == 0.0 else str(Decimal(repr(value)).scaleb(shift))


def comparison_table(comparison: Comparison) -> LabelledTable:
    """The differences as NAME_difference, with NAME_difference_u and NAME_normalised, over positions x, y, z (mm)."""
    from stepdiag.io.labelled_tables import position_axis

    coordinates: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    for difference in comparison.differences:
        name = difference.parameter
        dimensions: tuple[str, ...] = ()
        if not np.isnan(difference.position[0]):
            dimensions = (position_axis(coordinates, name, difference.position),)
        attributes = {
            "units": units_of(name),
            "long_name": f"{name}, B - A",
            "shape_only": _flag(difference.shape_only),
        }
        attributes["significant"] = _flag(comparison.is_significant(difference))
        for suffix, values, own in (
            ("difference", difference.value, attributes),
            (
                "difference_u",
                difference.standard_uncertainty,
                {"units": units_of(name), "long_name": f"standard uncertainty of {name}, B - A, as if independent"},
            ),
            ("normalised", difference.normalised, {"units": "1", "long_name": f"{name}, (B - A)/u"}),
        ):
            variables[f"{name}_{suffix}"] = (dimensions, values if dimensions else float(values[0]), own)
    a, b = comparison.a, comparison.b
    return LabelledTable(
        variables,
        coordinates,
        {
            "title": "difference of two calibrations, B - A",
            **_made(a, b),
            "chain": a.chain.name,
            "volume_mm": a.volume,
            "limit": comparison.limit,
            "values": comparison.count,
            "only_in_a": " ".join(comparison.only_in_a),
            "only_in_b": " ".join(comparison.only_in_b),
            "notes": "\n".join(comparison.notes),
        },
    )


def write_comparison(comparison: Comparison, path: Path) -> None:
    """Writes the differences as CSV or, where the name ends in .nc, as netCDF. Raises InvalidArgument."""
    if not is_netcdf(path):
        write_whole(path, comparison_csv(comparison))
        return
    from stepdiag.io.netcdf import write_netcdf

    write_netcdf(comparison_table(comparison), path, {"format": COMPARISON_FORMAT, "date": date_of_today()})


def _flag(value: bool) -> str:
    return str(value).lower()
