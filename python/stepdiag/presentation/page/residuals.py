"""Residuals of the readings, faults among them, and the set-up that was found."""

from typing import Any, Final

import numpy as np

from stepdiag.io.adjustment_read import ChannelFit, FitDetails, FloatArray
from stepdiag.presentation.page.contents import Contents
from stepdiag.presentation.page.figure import Figures, value_table, values
from stepdiag.presentation.page.html import Markup, element, listed, markup, section, table
from stepdiag.presentation.page.look import BAND, GRID, LINE, MARK
from stepdiag.presentation.page.numbers import shown
from stepdiag.presentation.setup_table import setup_table
from stepdiag.style import SERIES
from stepdiag.units import report_value

MOST_POINTS: Final = 3000  # of a channel that are drawn one by one


def residuals_section(contents: Contents, figures: Figures) -> Markup:
    """A panel for each channel, in the order of the readings; what is missing, and how to get it, otherwise."""
    details = contents.details
    if details is None:
        return section("residuals", "Residuals", _missing(contents, "residuals"))
    parts: list[Any] = [
        element(
            "p",
            f"Read minus adjusted, in the order of the readings. {details.degrees_of_freedom} degrees of freedom, "
            f"variance factor {shown(details.variance_factor)} (1 is expected), probability {details.probability:.2g}. "
            f"The band is ± 2 standard uncertainties of a residual.{_not_named(details)}",
        )
    ]
    rows = []
    for name, fit in details.channels.items():
        unit, sizes = _in_report(fit)
        figures.add(
            f"figure-residual-{name}",
            _traces(name, unit, sizes, fit),
            _lines_axis(details),
            _axis(name, unit),
            margin={"l": 64, "r": 10, "t": 8, "b": 40},
            shapes=_ends(details),
            hovermode="closest",
        )
        used = fit.used & np.isfinite(sizes)
        left_out = int(np.count_nonzero(~fit.used & np.isfinite(sizes)))
        rms = float(np.sqrt(np.mean(sizes[used] ** 2))) if used.any() else float("nan")
        largest = float(np.max(np.abs(sizes[used]), initial=0.0))
        rows.append([name, f"{shown(rms)} {unit}", f"{shown(largest)} {unit}", int(np.count_nonzero(used)), left_out])
        thin = (
            " Of many readings, the smallest and largest of each group are drawn." if len(sizes) > MOST_POINTS else ""
        )
        caption = markup(element("strong", name), f": rms {shown(rms)} {unit}, largest {shown(largest)} {unit}.{thin}")
        label = f"Residuals of {name}: rms {shown(rms)} {unit}, largest {shown(largest)} {unit}, {left_out} left out"
        parts.append(figures.place(f"figure-residual-{name}", label, caption, "wide low", "values-residuals"))
    heading = ["Channel", "rms", "largest", "readings used", "left out"]
    parts.append(
        values(
            "values-residuals",
            "Values of the residuals",
            table("Residuals by channel", heading, rows),
            *_worst(details),
        )
    )
    parts.append(_faults(details))
    return section("residuals", "Residuals", *parts)


def _missing(contents: Contents, what: str) -> Markup:
    if contents.calibration.method != "adjustment":
        return element(
            "p",
            f"The method {contents.calibration.method or 'of this file'} has no {what}; stepdiag evaluate with the "
            "method adjustment has them.",
        )
    return markup(
        element(
            "p",
            f"{contents.request.calibration.name} has no {what} (a CSV file has none). To have them here, give the "
            "scenario and the run:",
        ),
        element("pre", element("code", "stepdiag report CALIBRATION --scenario SCENARIO --run RUN -o report.html")),
    )


def _in_report(fit: ChannelFit) -> tuple[str, FloatArray]:
    factor, unit = report_value(fit.units, 1.0)
    return unit, factor * fit.residual


def _traces(name: str, unit: str, sizes: FloatArray, fit: ChannelFit) -> list[dict[str, Any]]:
    number = np.arange(1, len(sizes) + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma = np.abs(sizes / fit.normalised)
    sigma = np.where(np.isfinite(sigma), sigma, np.nan)
    drawn = _chosen(sizes)
    good = drawn & fit.used
    bad = ~fit.used & np.isfinite(sizes)
    half = 2.0 * float(np.nanmedian(sigma)) if np.isfinite(sigma).any() else 0.0
    band = {"type": "scatter", "mode": "lines", "x": [0.5, len(sizes) + 0.5], "line": {"width": 0}, "hoverinfo": "skip"}
    traces: list[dict[str, Any]] = []
    if half > 0.0:
        traces += [
            band | {"y": [-half, -half]},
            band | {"y": [half, half], "fill": "tonexty", "fillcolor": BAND},
        ]
    points = {
        "type": "scatter",
        "mode": "markers",
        "hovertemplate": f"reading %{{x}}: %{{y:.3g}} {unit}<extra>{name}</extra>",
    }
    traces.append(
        points | {"x": number[good].tolist(), "y": sizes[good].tolist(), "marker": {"size": 3.5, "color": LINE}}
    )
    if bad.any():
        marks = {"size": 9, "color": MARK, "symbol": "x"}
        traces.append(points | {"x": number[bad].tolist(), "y": sizes[bad].tolist(), "marker": marks})
    return traces


def _chosen(sizes: FloatArray) -> Any:
    """Which readings are drawn: of many, the smallest and the largest of each of as many groups as fit."""
    finite = np.isfinite(sizes)
    if len(sizes) <= MOST_POINTS:
        return finite
    chosen = np.zeros(len(sizes), dtype=bool)
    for group in np.array_split(np.arange(len(sizes)), MOST_POINTS // 2):
        known = group[finite[group]]
        if len(known):
            chosen[known[np.argmin(sizes[known])]] = chosen[known[np.argmax(sizes[known])]] = True
    return chosen


def _visits(details: FitDetails) -> list[tuple[str, int, int]]:
    """Line (and run) with its first and last reading, from 1, in the order of the file."""
    found: list[tuple[str, int, int]] = []
    several = len(set(details.run)) > 1
    for number, (line, run) in enumerate(zip(details.line, details.run, strict=True), 1):
        name = f"{line} · {run}" if several else line
        if found and found[-1][0] == name:
            found[-1] = (name, found[-1][1], number)
        else:
            found.append((name, number, number))
    return found


def _lines_axis(details: FitDetails) -> dict[str, Any]:
    visits = [(name, a, b) for name, a, b in _visits(details) if b - a > 0.02 * len(details.line)]
    return {
        "tickvals": [(a + b) / 2 for _, a, b in visits],
        "ticktext": [name for name, _, _ in visits],
        "nticks": None,
        "showgrid": False,
        "range": [0.5, len(details.line) + 0.5],
        "title": {"text": "line", "standoff": 6},
        "ticks": "",
    }


def _not_named(details: FitDetails) -> str:
    short = [name for name, a, b in _visits(details) if b - a <= 0.02 * len(details.line)]
    return f" Lines of few readings have no name in the figures: {', '.join(short)}." if 0 < len(short) <= 12 else ""


def _axis(name: str, unit: str) -> dict[str, Any]:
    return {"title": {"text": f"{name} ({unit})", "standoff": 6}, "nticks": 5, "automargin": False}


def _ends(details: FitDetails) -> list[dict[str, Any]]:
    """A line between two visits."""
    first = {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "layer": "below", "line": {"color": GRID, "width": 1}}
    return [first | {"x0": end + 0.5, "x1": end + 0.5} for _, _, end in _visits(details)[:-1]]


def _worst(details: FitDetails) -> list[Markup]:
    """The ten readings with the largest normalised residuals."""
    rows = []
    for name, fit in details.channels.items():
        unit, sizes = _in_report(fit)
        for k in np.argsort(-np.nan_to_num(np.abs(fit.normalised)))[:10]:
            if np.isfinite(fit.normalised[k]):
                place_ = f"{details.line[k]}, run {details.run[k]}, point {details.point[k]}"
                state = "used" if fit.used[k] else "left out"
                rows.append(
                    (
                        abs(float(fit.normalised[k])),
                        [
                            f"{name}, {place_}",
                            f"{shown(float(sizes[k]), signed=True)} {unit}",
                            shown(float(fit.normalised[k]), signed=True),
                            state,
                        ],
                    )
                )
    rows.sort(key=lambda row: -row[0])
    heading = ["Reading", "residual", "by its standard uncertainty", ""]
    return [
        value_table("The ten largest residuals by their standard uncertainties", heading, [row for _, row in rows[:10]])
    ]


def _faults(details: FitDetails) -> Markup | None:
    if not details.faults:
        return element("p", "No reading was found to be wrong, and none was left out.")
    kinds = {"slip": "offset from this point on", "factor": "growing along the line"}
    treatments = {"left_out": "left out", "estimated": "size is an unknown of the adjustment"}
    rows = []
    for fault in details.faults:
        size, unit = report_value("rad" if fault.channel in ("alpha", "beta") else "mm", fault.size)
        u = report_value("rad" if fault.channel in ("alpha", "beta") else "mm", fault.standard_uncertainty)[0]
        rows.append(
            [
                f"{fault.number}: {fault.channel}, {fault.line}, run {fault.run}, point {fault.point}",
                kinds.get(fault.kind, "wrong reading"),
                f"{shown(size, signed=True)} {unit} (u {shown(u)} {unit})",
                treatments.get(fault.treatment, "nothing was done"),
            ]
        )
    return markup(
        element("h3", "Faults of readings"),
        element("p", "Rows of one number are alternatives: the readings do not distinguish them."),
        value_table("Faults of readings", ["Fault", "What it may be", "error", "What was done"], rows),
    )


def setup_section(contents: Contents) -> Markup:
    """How head and mirror stood on each line, as the adjustment found it."""
    details = contents.details
    title = "Set-up found"
    if details is None or not details.setup:
        return section(
            "setup",
            title,
            _missing(contents, "set-up") if details is None else element("p", "The set-up was taken as known."),
        )
    rows, notes = setup_table(
        details.setup, list(dict.fromkeys([*contents.lines, *details.line, *(one.line for one in details.setup)]))
    )
    parts: list[Any] = [
        element(
            "p", "How laser head and mirror stood on each line. 12.3(45) is 12.3 with a standard uncertainty of 4.5."
        )
    ]
    if rows:
        names, units, *body = rows
        heading = ["Line", *(f"{name} ({unit})" for name, unit in zip(names[1:], units[1:], strict=True))]
        parts.append(
            table(
                "Set-up of each line",
                heading,
                [[cell.replace("-", "−") if k else cell for k, cell in enumerate(row)] for row in body],
                "dense",
            )
        )
    if notes:
        parts.append(listed([f"{note[0].upper()}{note[1:]}." for note in notes]))
    return section("setup", title, *parts)


def temperature_section(contents: Contents, figures: Figures) -> Markup:
    """Temperatures of the run, where it has any."""
    title, run = "Temperatures", contents.measurement
    if run is None:
        return section(
            "temperatures",
            title,
            element("p", "No run was given with this report (--run), so its temperatures are not shown."),
        )
    channels = {
        name: np.asarray(column)
        for name, column in run.channels.items()
        if "temperature" in name and np.isfinite(column).any()
    }
    if not channels:
        return section("temperatures", title, element("p", "None recorded: the run has no column of temperatures."))
    number = list(range(1, len(run) + 1))
    figures.add(
        "figure-temperatures",
        [
            {
                "type": "scatter",
                "mode": "lines",
                "x": number,
                "y": [None if np.isnan(t) else float(t) for t in column],
                "name": name,
                "line": {"color": colour, "width": 1.6},
            }
            for (name, column), colour in zip(channels.items(), SERIES * len(channels), strict=False)
        ],
        {"title": {"text": "reading", "standoff": 6}},
        {"title": {"text": "temperature (°C)", "standoff": 6}},
        showlegend=len(channels) > 1,
    )
    rows = [
        [name, *(f"{f(column):.2f} °C" for f in (np.nanmean, np.nanmin, np.nanmax))]
        for name, column in channels.items()
    ]
    means = ", ".join(f"{row[0]}: mean {row[1]}" for row in rows)
    return section(
        "temperatures",
        title,
        figures.place(
            "figure-temperatures",
            f"Temperatures in the order of the readings; {means}",
            "Temperatures in the order of the readings.",
            "wide low",
            "values-temperatures",
        ),
        values(
            "values-temperatures",
            "Values of the temperatures",
            table("Temperatures", ["Sensor", "mean", "smallest", "largest"], rows),
        ),
    )
