"""Figures of standard uncertainties: of an uncertainty result with its budget, and of what a plan determines."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepdiag._core import Adjustment, InvalidArgument, Measurement
from stepdiag.display import lines_text
from stepdiag.figures.calibration import undetermined_notes, with_gaps
from stepdiag.figures.growth import OWN, draw_growth_panels
from stepdiag.figures.page import SMALL, Heading, Page
from stepdiag.figures.parameter_panels import HATCH, HEIGHT, WIDTH, ParameterPanels, scaled
from stepdiag.findings.temperature import reference_mark
from stepdiag.findings.undetermined import combination_text
from stepdiag.io.csv_text import CsvTable, finite_number, read_csv
from stepdiag.io.data_files import is_netcdf
from stepdiag.parameters import FUNCTIONS, REPORT_UNIT, SQUARENESSES, kind_of, units_of
from stepdiag.planning.observation import Prospect
from stepdiag.scenario.known import Known
from stepdiag.style import COLOUR, SERIES, axis_label, own_style, plain
from stepdiag.uncertainty.result import UNCERTAINTY_FORMAT, UncertaintyResult
from stepdiag.units import native

if TYPE_CHECKING:
    from stepdiag.io.netcdf import NetcdfFile

FloatArray = npt.NDArray[np.float64]
Curves = Mapping[str, tuple[FloatArray, FloatArray]]  # name -> position (mm; NaN of a squareness), u (mm or rad)

BUDGET_HEIGHT: Final = 2.3
GROWTH_HEIGHT: Final = 2.6
PARAMETERS: Final = (*FUNCTIONS, *SQUARENESSES)
PROPAGATED: Final[Mapping[str, Any]] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (3, 2)), "marker": ""}


@dataclass(frozen=True, eq=False)
class DrawnUncertainty:
    """What the figure of an uncertainty result shows; native units."""

    volume: FloatArray
    facts: str
    sampled: Curves  # by the Monte Carlo method; empty without
    propagated: Curves  # empty without
    groups: Sequence[str]  # of the budget
    budget: Mapping[str, tuple[float, FloatArray]]  # name -> position and parts, where its u is largest
    notes: Sequence[str]


def draw_uncertainty(result: UncertaintyResult | DrawnUncertainty, name: str = "uncertainty") -> Figure:
    """Draw the standard uncertainties of all parameters, and the budget as stacked bars.

    A bar shows which shares of the variance the groups of inputs make, at the node with the largest
    uncertainty of a parameter. `name`: the title."""
    drawn = _of_result(result) if isinstance(result, UncertaintyResult) else result
    with own_style():
        height = HEIGHT + (BUDGET_HEIGHT if drawn.budget else 0.0)
        page = Page(Heading(f"{name}: standard uncertainties", drawn.facts), WIDTH, height, drawn.notes)
        below = BUDGET_HEIGHT if drawn.budget else 0.0
        panels = ParameterPanels(page, drawn.volume, "u", below=below)
        main = drawn.sampled or drawn.propagated
        _draw_curves(panels, main)
        if drawn.sampled:
            for parameter, (position, u) in drawn.propagated.items():
                if parameter in panels.axes:
                    panels.draw(parameter, position, u, **PROPAGATED)
                else:
                    panels.draw_true_squareness(parameter, float(u[0]))
        if drawn.budget:
            _draw_budget(page, drawn)
        page.legend(list(_handles(drawn, missing=len(main) < len(PARAMETERS))))
        return page.finish()


def draw_observation(
    run: Measurement, found: Adjustment, known: Known, name: str = "scenario", table: Sequence[Prospect] = ()
) -> Figure:
    """Draw what `observe` has found: standard uncertainties of what a plan determines.

    What it does not determine is hatched, and below is what would help. `name`: the title. `table`:
    what other numbers of steps would give."""
    calibration, plan = found.calibration, known.plan
    facts = (
        f"{lines_text(plan)}, {len(run)} points, "
        f"{', '.join(known.signals)}; {found.degrees_of_freedom} readings more than unknowns"
    )
    facts += f", positioning {reference_mark(calibration.temperature_reference)}"
    tables = {p: with_gaps(calibration, p, *table) for p, table in calibration.functions.items()}
    curves = {parameter: (position, u) for parameter, (position, _, u) in tables.items()}
    curves |= {p: (np.array([np.nan]), np.array([u])) for p, (_, u) in calibration.squareness.items()}
    notes = undetermined_notes(calibration)
    notes += [f"known: {combination_text(combination, value=False)}" for combination in found.combinations]
    with own_style():
        below = GROWTH_HEIGHT if table else 0.0
        page = Page(Heading(f"{name}: what the plan determines, and how well", facts), WIDTH, HEIGHT + below, notes)
        panels = ParameterPanels(page, plan.volume, "u", below=below)
        _draw_curves(panels, curves)
        for parameter in calibration.undetermined_slopes:
            panels.remark(parameter, "shape only")
        handles = [_curve_handle("standard uncertainty u, for a perfect machine")]
        if len(curves) < len(PARAMETERS):
            handles.append(Patch(label="not determined", **HATCH))
        if table:
            bottom = float(page.grid(1, 1).bottom or 0.0)
            draw_growth_panels(page, table, plan.steps, top=bottom + (GROWTH_HEIGHT - 0.95) / page.size[1])
            handles.append(Line2D([], [], label=f"this plan: {plan.steps} steps", **OWN))
        page.legend(handles)
        return page.finish()


def read_drawn_uncertainty(path: Path) -> DrawnUncertainty:
    """Read what the figure shows from the file of an uncertainty result, netCDF (.nc) or CSV.

    Raises InvalidArgument naming the file, and the variable or line."""
    if not is_netcdf(path):
        return _of_csv(read_csv(path, ("output", "position_mm", "unit"), UNCERTAINTY_FORMAT))
    from stepdiag.io.netcdf import read_netcdf

    file = read_netcdf(path)
    file.check_format(UNCERTAINTY_FORMAT)
    return _of_netcdf(file)


def _of_result(result: UncertaintyResult) -> DrawnUncertainty:
    from stepdiag.io.labelled import LabelledTable
    from stepdiag.io.netcdf import NetcdfFile
    from stepdiag.uncertainty.table import uncertainty_table

    return _of_netcdf(NetcdfFile(result.known.path, LabelledTable.of(uncertainty_table(result))))


def _of_netcdf(file: "NetcdfFile") -> DrawnUncertainty:
    sampled, propagated = _curves(file, "_u"), _curves(file, "_propagated_u")
    if not sampled and not propagated:
        raise InvalidArgument(f"{file.path}: expected standard uncertainties EXX_u ... or EXX_propagated_u, got none")
    groups, budget = _budget(file, propagated)
    reference = file.number("temperature_reference_c")
    facts = _facts(file.text("scenario", ""), file.text("method", ""), file.number("samples"), reference)
    return DrawnUncertainty(
        file.lengths("volume_mm"), facts, sampled, propagated, groups, budget, _notes(file.text("warning", ""))
    )


def _of_csv(table: CsvTable) -> DrawnUncertainty:
    sampled, propagated = (
        _columns(table, name) for name in ("standard_uncertainty", "propagated_standard_uncertainty")
    )
    if not sampled and not propagated:
        raise InvalidArgument(f"{table.path}: expected standard uncertainties of EXX ... A0Z, got none")
    get = table.leading.get
    samples = finite_number(get("samples", "0"), f"{table.path}: samples")
    notes = _notes(get("warning", ""))
    if propagated:
        notes.append("the sources of these uncertainties (budget) are in netCDF files (.nc), not in CSV files")
    warmth = get("temperature_reference_c")
    reference = None if warmth is None else finite_number(warmth, f"{table.path}: temperature_reference_c")
    facts = _facts(get("scenario", ""), get("method", ""), samples, reference)
    return DrawnUncertainty(table.lengths("volume_mm"), facts, sampled, propagated, [], {}, notes)


def _facts(scenario: str, method: str, samples: float | None, reference: float | None) -> str:
    drawn = f"{samples:,.0f} virtual calibrations" if samples else ""
    temperature = f"positioning {reference_mark(reference)}"
    return ", ".join(filter(None, (scenario, f"method {method or 'not known'}", drawn, temperature)))


def _notes(warning: str) -> list[str]:
    return [f"not to be trusted: {warning}"] if warning else []


def _columns(table: CsvTable, column: str) -> Curves:
    """The curves in a column; derived quantities have none."""
    if column not in table.columns:
        return {}
    found: dict[str, list[tuple[float, float]]] = {}
    for where, row in table.rows:
        name, unit = row["output"], row["unit"]
        if name not in PARAMETERS:
            continue
        expected = REPORT_UNIT[kind_of(name)].replace("µ", "u")
        if unit != expected:
            raise InvalidArgument(f"{where}: unit: expected {expected} for {name}, got {unit!r}")
        if (name in FUNCTIONS) != bool(row["position_mm"]):
            raise InvalidArgument(
                f"{where}: position_mm: expected a number for functions alone, got {row['position_mm']!r}"
            )
        position = finite_number(row["position_mm"], f"{where}: position_mm") if name in FUNCTIONS else np.nan
        u = finite_number(row[column], f"{where}: {column}") if row[column] else np.nan
        if u < 0.0:
            raise InvalidArgument(f"{where}: {column}: expected at least 0, got {row[column]}")
        if name in found and not position > found[name][-1][0]:
            raise InvalidArgument(f"{where}: expected positions of {name} that ascend, got {row['position_mm']}")
        found.setdefault(name, []).append((position, native(f"_{unit}", u)))
    curves = {name: np.transpose(rows) for name, rows in found.items()}
    return {name: (position, u) for name, (position, u) in curves.items() if np.isfinite(u).any()}


def _curves(file: "NetcdfFile", ending: str) -> Curves:
    found = {}
    for name in PARAMETERS:
        if f"{name}{ending}" not in file:
            continue
        dimensions = file.dimensions(f"{name}{ending}")
        if len(dimensions) != (name in FUNCTIONS):
            raise file.fail(f"{name}{ending}", f"expected the positions of {name} as its only dimension")
        u = np.atleast_1d(file.numbers(f"{name}{ending}", dimensions, units_of(name), missing=True))
        found[name] = (file.numbers(dimensions[0], dimensions, "mm") if dimensions else np.array([np.nan]), u)
    return found


def _budget(file: "NetcdfFile", propagated: Curves) -> tuple[list[str], dict[str, tuple[float, FloatArray]]]:
    """Groups, and by parameter the position of its largest u with the part of each group there."""
    if "budget" not in file:
        return [], {}
    group, output = file.dimensions("group"), file.dimensions("output_name")
    groups, names = file.texts("group", group), np.array(file.texts("output_name", output))
    parts = file.numbers("budget", (*group, *output), None)
    position = file.numbers("output_position", output, "mm", missing=True)
    budget = {}
    for name, (_, u) in propagated.items():
        rows = np.flatnonzero(names == name)
        if len(rows) != len(u):
            raise file.fail("output_name", f"expected the {len(u)} outputs of {name}, got {len(rows)}")
        k = rows[int(np.argmax(np.nan_to_num(u)))]
        if np.any(parts[:, k] > 0.0):
            budget[name] = float(position[k]), parts[:, k]
    return groups, budget


def _draw_curves(panels: ParameterPanels, curves: Curves) -> None:
    for name in PARAMETERS:
        if name not in curves:
            panels.mark_missing(name)
            continue
        position, u = curves[name]
        if name in panels.axes:
            panels.draw(name, position, u, np.zeros(len(u)), u)
            k = int(np.argmax(np.nan_to_num(u)))
            unit = REPORT_UNIT[kind_of(name)]
            panels.remark(name, f"{scaled(name, u[k]):.3g} {unit} at {position[k]:g}")
            if np.isnan(u).any():
                panels.mark_gaps(name, position, u)
        else:
            place = SQUARENESSES.index(name)
            panels.squareness.bar(place, scaled(name, u[0]), width=0.6, color="#9a9a9a", edgecolor="#4a4a4a")
    for axes in (*panels.axes.values(), panels.squareness):
        axes.set_ylim(bottom=0.0)


def _draw_budget(page: Page, drawn: DrawnUncertainty) -> None:
    """Shares of the variance, the largest groups first; all others are one."""
    names = list(drawn.budget)
    shares = np.array([parts**2 / np.sum(parts**2) for _, parts in drawn.budget.values()]).T
    order = np.argsort(-shares.sum(axis=1), kind="stable")
    kept = order if len(order) <= len(SERIES) else order[: len(SERIES) - 1]
    rest = [k for k in order if k not in kept]
    bars = [(drawn.groups[k], shares[k]) for k in kept]
    if rest:
        bars.append((f"{len(rest)} others", shares[rest].sum(axis=0)))
    width, height = page.size
    grid = page.grid(1, 1)
    bottom = float(grid.bottom or 0.0)
    axes = page.figure.add_axes((0.72 / width, bottom, (width - 3.6) / width, (BUDGET_HEIGHT - 0.85) / height))
    floor = np.zeros(len(names))
    for (group, share), colour in zip(bars, SERIES, strict=False):
        axes.bar(
            range(len(names)),
            100.0 * share,
            bottom=floor,
            color=colour,
            width=0.72,
            edgecolor="white",
            linewidth=0.5,
            label=plain(group),
        )
        floor += 100.0 * share
    labels = [
        name if np.isnan(position) else f"{name}\nat {position:g}" for name, (position, _) in drawn.budget.items()
    ]
    axes.set_xticks(range(len(names)), labels, size=6.5)
    axes.set_xlim(-0.6, len(names) - 0.4)
    axes.set_ylim(0.0, 100.0)
    axes.grid(axis="x", visible=False)
    axes.set_ylabel(axis_label("share of the variance", "%"))
    axes.set_title("budget at the node with the largest standard uncertainty", weight="bold", pad=3.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=SMALL, reverse=True, borderaxespad=0.0)


def _curve_handle(label: str) -> Any:
    return Line2D([], [], color=COLOUR["X"], marker=".", markersize=4.0, linewidth=1.1, label=label)


def _handles(drawn: DrawnUncertainty, *, missing: bool) -> Iterator[Any]:
    yield _curve_handle("u, Monte Carlo method" if drawn.sampled else "u, propagated")
    if drawn.sampled and drawn.propagated:
        yield Line2D([], [], label="u, propagated", **PROPAGATED)
    if missing:
        yield Patch(label="not determined", **HATCH)
