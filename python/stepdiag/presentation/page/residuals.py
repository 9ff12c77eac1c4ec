"""Residuals of the readings, faults among them, and the set-up that was found."""

from typing import Any, Final, NamedTuple

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

LEAST_ROOM: Final = 0.05  # of a figure's width for a line
CONTROLLED: Final = 0.02  # a residual's uncertainty, by the largest of its channel; below, nothing controls the reading
MOST_NAMED: Final = 16  # lines with so much room
MOST_POINTS: Final = 3000  # of a channel that are drawn one by one


class DrawnVisit(NamedTuple):
    """A line (and run) with its first and last reading in the order of the file, and where they are drawn: each visit
    has room for its name, however few readings it has."""

    name: str
    first: int
    last: int
    start: float
    end: float

    @property
    def places(self) -> FloatArray:
        count = self.last - self.first + 1
        return self.start + (self.end - self.start) * (np.arange(count) + 0.5) / count


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
            f"The band of a line is ± 2 standard uncertainties of its residuals.{_unnamed(details)}"
            f"{_uncontrolled(details)}",
        )
    ]
    rows = []
    for name, fit in details.channels.items():
        unit, sizes = _in_report(fit)
        figures.add(
            f"figure-residual-{name}",
            _traces(name, unit, sizes, fit, details),
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


def _traces(name: str, unit: str, sizes: FloatArray, fit: ChannelFit, details: FitDetails) -> list[dict[str, Any]]:
    number = np.arange(1, len(sizes) + 1)
    drawn = _chosen(sizes)
    good = drawn & fit.used
    bad = ~fit.used & np.isfinite(sizes)
    place = np.concatenate([visit.places for visit in _visits(details)])
    traces: list[dict[str, Any]] = []
    for visit in _visits(details):
        half = 2.0 * _usual_uncertainty(fit, visit)
        if half > 0.0:
            band = {"type": "scatter", "mode": "lines", "x": [visit.start, visit.end], "line": {"width": 0}}
            traces += [
                band | {"y": [-half, -half], "hoverinfo": "skip"},
                band | {"y": [half, half], "fill": "tonexty", "fillcolor": BAND, "hoverinfo": "skip"},
            ]
    points = {
        "type": "scatter",
        "mode": "markers",
        "hovertemplate": f"reading %{{customdata}}: %{{y:.3g}} {unit}<extra>{name}</extra>",
    }
    marks = {"size": 9, "color": MARK, "symbol": "x"}
    for which, look in ((good, {"size": 3.5, "color": LINE}), (bad, marks)):
        if which.any() or which is good:
            own = {"x": place[which].tolist(), "y": sizes[which].tolist(), "customdata": number[which].tolist()}
            traces.append(points | own | {"marker": look})
    return traces


def _usual_uncertainty(fit: ChannelFit, visit: DrawnVisit) -> float:
    """Of a residual of a visit, in report units; 0 where none is controlled."""
    part = slice(visit.first, visit.last + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma = np.abs(_in_report(fit)[1][part] / fit.normalised[part])
    return float(np.median(sigma[np.isfinite(sigma)])) if np.isfinite(sigma).any() else 0.0


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


def _visits(details: FitDetails) -> list[DrawnVisit]:
    found: list[tuple[str, int, int]] = []
    several = len(set(details.run)) > 1
    for number, (line, run) in enumerate(zip(details.line, details.run, strict=True)):
        name = f"{line} · {run}" if several else line
        if found and found[-1][0] == name:
            found[-1] = (name, found[-1][1], number)
        else:
            found.append((name, number, number))
    least = LEAST_ROOM * len(details.line) if len(found) <= MOST_NAMED else 0.0
    visits, end = [], 0.0
    for name, first, last in found:
        start, end = end, end + max(last - first + 1.0, least)
        visits.append(DrawnVisit(name, first, last, start, end))
    return visits


def _lines_axis(details: FitDetails) -> dict[str, Any]:
    visits = _visits(details)
    named = _named(visits)
    return {
        "tickvals": [(one.start + one.end) / 2 for one in named],
        "ticktext": [one.name for one in named],
        "nticks": None,
        "showgrid": False,
        "range": [0.0, visits[-1].end],
        "title": {"text": "line", "standoff": 6},
        "ticks": "",
    }


def _named(visits: list[DrawnVisit]) -> list[DrawnVisit]:
    return [one for one in visits if one.end - one.start >= 0.5 * LEAST_ROOM * visits[-1].end]


def _unnamed(details: FitDetails) -> str:
    visits = _visits(details)
    return " A line too short for its name is named when pointed at." if len(_named(visits)) < len(visits) else ""


def _uncontrolled(details: FitDetails) -> str:
    """Lines on which other readings do not control what a channel read."""
    visits = _visits(details)
    said = []
    for name, fit in details.channels.items():
        usual = [_usual_uncertainty(fit, visit) for visit in visits]
        lines = [visit.name for visit, u in zip(visits, usual, strict=True) if u < CONTROLLED * max(usual)]
        if 0 < len(lines) <= MOST_NAMED:
            said.append(f"{name} on {', '.join(lines)}")
    return f" What no other reading controls fits whatever was read: {'; '.join(said)}." if said else ""


def _axis(name: str, unit: str) -> dict[str, Any]:
    return {"title": {"text": f"{name} ({unit})", "standoff": 6}, "nticks": 5, "automargin": False}


def _ends(details: FitDetails) -> list[dict[str, Any]]:
    """A line between two visits."""
    first = {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "layer": "below", "line": {"color": GRID, "width": 1}}
    return [first | {"x0": one.end, "x1": one.end} for one in _visits(details)[:-1]]


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
