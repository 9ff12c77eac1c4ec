"""The uncertainty budget: which inputs make the largest uncertainty of each family, from an uncertainty result."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stepdiag._core import Calibration, InvalidArgument
from stepdiag.io.netcdf import NetcdfFile, read_netcdf
from stepdiag.parameters import KINDS, Kind, kind_of
from stepdiag.presentation.page.figure import Figures, values
from stepdiag.presentation.page.html import Markup, element, markup, section, table
from stepdiag.presentation.page.look import INK
from stepdiag.presentation.page.numbers import position, shown
from stepdiag.style import SERIES
from stepdiag.uncertainty.result import UNCERTAINTY_FORMAT
from stepdiag.units import report_value

# Groups that make less than this of every variance could not be seen in the figure: they are added up.
SMALL_SHARE = 0.02
MOST_GROUPS = len(SERIES)  # that have a colour of their own; the rest is grey
GREY = "#8c8c8c"


class BudgetShare(NamedTuple):
    """Shares of the variance by group for the most uncertain value of a family."""

    kind: Kind
    parameter: str
    place: float  # mm; NaN of a squareness
    unit: str
    standard_uncertainty: float  # propagated; native units
    shares: dict[str, float]


class Budget(NamedTuple):
    path: Path
    shares: list[BudgetShare]
    method: str
    coverage: float


def read_budget(path: Path, calibration: Calibration) -> Budget:
    """Read the budget of an uncertainty result (netCDF). Raises InvalidArgument where it is none, or of a machine or a
    method other than the calibration's."""
    file = read_netcdf(path)
    is_uncertainty = file.text("format", "").startswith("stepdiag uncertainty")
    if is_uncertainty:
        file.check_format(UNCERTAINTY_FORMAT)
    if not is_uncertainty or "budget" not in file:
        raise InvalidArgument(f"{path}: expected a result of `stepdiag uncertainty` (.nc) with its budget")
    _check_belongs(file, path, calibration)
    outputs = ("output",)
    names, units = file.texts("output_name", outputs), file.texts("output_units", outputs)
    where = file.numbers("output_position", outputs, "mm", missing=True)
    groups = file.texts("group", ("group",))
    parts = file.numbers("budget", ("group", "output"), None)
    total = np.array([_uncertainty(file, name, at) for name, at in zip(names, where, strict=True)])
    for name, (nodes, _, _) in calibration.functions.items():
        own = where[[one == name for one in names]]
        if len(own) != len(nodes) or not np.allclose(own, nodes, rtol=0.0, atol=1e-6):
            raise InvalidArgument(f"{path}: {name} has other positions than the calibration: it is of another plan")
    method, coverage = file.text("method", ""), file.number("coverage") or 0.95
    shares = []
    kinds = [kind_of(name) if np.isfinite(u) else None for name, u in zip(names, total, strict=True)]
    for kind in KINDS:
        members = [k for k, own in enumerate(kinds) if own == kind and total[k] > 0.0]
        if members:
            worst = max(members, key=lambda k: total[k])
            found = {group: float((part[worst] / total[worst]) ** 2) for group, part in zip(groups, parts, strict=True)}
            rest = 1.0 - sum(found.values())
            if abs(rest) >= SMALL_SHARE:
                found["correlations between groups"] = rest
            shares.append(
                BudgetShare(kind, names[worst], float(where[worst]), units[worst], float(total[worst]), found)
            )
    return Budget(path, shares, method, coverage)


def _check_belongs(file: NetcdfFile, path: Path, calibration: Calibration) -> None:
    method = file.text("method", "")
    if method != calibration.method:
        raise InvalidArgument(f"{path}: is of the method {method}, the calibration of {calibration.method}")
    if file.text("chain", "") != calibration.chain.name:
        raise InvalidArgument(
            f"{path}: is of the chain {file.text('chain', '')}, the calibration of {calibration.chain}"
        )
    for name, own in (("volume_mm", calibration.volume), ("tool_mm", calibration.tool)):
        if not np.allclose(file.lengths(name), own, rtol=0.0, atol=1e-6):
            raise InvalidArgument(f"{path}: {name} is not that of the calibration")


def _uncertainty(file: NetcdfFile, name: str, at: float) -> float:
    """The propagated standard uncertainty of an output; NaN of derived ones."""
    variable = f"{name}_propagated_u"
    if variable not in file:
        return float("nan")
    along = file.dimensions(variable)
    found = file.numbers(variable, along, None, missing=True)
    if not along:
        return float(found)
    nodes = file.numbers(along[0], along, "mm")
    return float(found[int(np.argmin(np.abs(nodes - at)))])


def budget_section(budget: Budget | None, figures: Figures) -> Markup:
    """Stacked bars of the shares; without a result, how to get one."""
    title = "Uncertainty budget"
    if budget is None:
        return section(
            "budget",
            title,
            element(
                "p",
                "No uncertainty result was given, so the uncertainties of this report are not broken down further than "
                "in the summary. They are those of the calibration’s file: what the stated uncertainties make of each "
                "value. To break them down:",
            ),
            element(
                "pre",
                element(
                    "code",
                    "stepdiag uncertainty SCENARIO -o uncertainty.nc\n"
                    "stepdiag report CALIBRATION --uncertainty uncertainty.nc -o report.html",
                ),
            ),
        )
    columns = _columns(budget.shares)
    _add_figure(budget.shares, columns, figures)
    rows = [
        [
            f"{share.kind}: {_label(share)}",
            f"{shown(report_value(share.unit, share.standard_uncertainty)[0])} {report_value(share.unit, 0.0)[1]}",
            *(f"{100.0 * parts[k]:.1f} %" for parts in columns.values()),
        ]
        for k, share in enumerate(budget.shares)
    ]
    return section(
        "budget",
        title,
        element(
            "p",
            f"Where the largest propagated uncertainty of each family comes from (GUM), method {budget.method}, "
            f"from {budget.path.name}.",
        ),
        figures.place(
            "figure-budget",
            "Stacked bars: shares of the variance by group of inputs, for the most uncertain value of each family",
            "Shares of the variance of the most uncertain value of each family.",
            "wide",
            "values-budget",
        ),
        markup(
            values(
                "values-budget",
                "Values of the budget",
                table("Budget of the most uncertain value of each family", ["Value", "u", *columns], rows),
            )
        ),
    )


def _columns(shares: Sequence[BudgetShare]) -> dict[str, list[float]]:
    """The groups that make much of a variance, each with its shares; the others added up."""
    order: dict[str, float] = {}
    for share in shares:
        for group, part in share.shares.items():
            order[group] = max(order.get(group, 0.0), abs(part))
    groups = [group for group, part in sorted(order.items(), key=lambda item: -item[1]) if part >= SMALL_SHARE]
    columns = {group: [share.shares.get(group, 0.0) for share in shares] for group in groups}
    rest = [sum(part for group, part in share.shares.items() if group not in groups) for share in shares]
    if len(groups) > MOST_GROUPS:
        for group in groups[MOST_GROUPS:]:
            rest = [a + b for a, b in zip(rest, columns.pop(group), strict=True)]
    if any(abs(part) >= SMALL_SHARE / 4 for part in rest):
        columns["others"] = rest
    return columns


def _add_figure(shares: Sequence[BudgetShare], columns: Mapping[str, list[float]], figures: Figures) -> None:
    named = [f"{share.kind}<br>{_label(share)}" for share in shares]
    bars = [
        {
            "type": "bar",
            "orientation": "h",
            "name": group,
            "y": named,
            "x": [100.0 * part for part in parts],
            "marker": {"color": colour, "line": {"color": "#ffffff", "width": 1}},
            "hovertemplate": f"{group}: %{{x:.1f}} %<extra></extra>",
        }
        for (group, parts), colour in zip(columns.items(), [*SERIES, GREY], strict=False)
    ]
    figures.add(
        "figure-budget",
        bars,
        {"title": {"text": "share of the variance (%)", "standoff": 6}},
        {"autorange": "reversed", "nticks": None, "tickfont": {"color": INK}},
        barmode="relative",
        hovermode="closest",
        showlegend=True,
        legend={"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "x": 0, "traceorder": "normal"},
        margin={"l": 10, "r": 10, "t": 8, "b": 90},
    )


def _label(share: BudgetShare) -> str:
    return share.parameter if np.isnan(share.place) else f"{share.parameter} at {position(share.place)} mm"
