"""Mistakes that a tired person makes, and what becomes of each: told, listed, or silently wrong by how much.

    ./run python benchmarks/tired_person.py [--check] [--only WORDS] [--seed 1] [--workers N]

A sound run (README's volume, faces, a tool offset, warm scales, an instrument that counts with a constant index) is
simulated, one thing in its scenario or its file is changed, and the command line evaluates both. Outcomes:

named       the messages (errors, warnings, verdict) say what it is
rejected    exit status 2 or 3, or another one that is not 0, without naming it
doubtful    the verdict, without naming it
listed      accepted; the report shows the wrong value where it says which inputs it used
harmless    accepted; at most 1 µm more is left than by the run without the mistake
silent      accepted, wrong, and nowhere to be seen

"left" is the largest error of the functional point in the volume, predicted by the calibration against the truth, in
µm; "other tool" the same with a tool that is 100 mm longer. --check: exit status 1 where an outcome is worse than the
one that is required; the last line says how many.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import csv
import functools
import io
import itertools
import json
import multiprocessing
import os
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import stepdiag as sd
from stepdiag.cli.command_line import run as command

OUTCOMES = ["named", "rejected", "doubtful", "harmless", "listed", "silent"]  # from the best to the worst
TOLD, LISTED, RECOGNISED = "doubtful", "listed", "named"  # what is required: this or better
MUCH = 1.0  # µm beyond what a right evaluation leaves
LONGER_TOOL = np.array([0.0, 0.0, -100.0])
Row = dict[str, str]

SOUND: dict[str, Any] = {
    "volume": {"x_mm": 800.0, "y_mm": 600.0, "z_mm": 500.0},
    "machine": {"chain": "[w X' b Y Z t]", "tool_mm": [30.0, -20.0, -150.0], "random": {"seed": 1}},
    "plan": {
        "lines": ["ppp", "npp", "pnp", "nnp", "pp0", "p0p", "0pp"],
        "steps": 10,
        "scale_lines": ["p00", "0p0", "00p"],
        "seconds_per_reading": 4.0,
    },
    "head": {"layout": "ideal", "standoff_mm": 150.0, "wavelength_nm": 1530.0},
    "misalignment": {
        "reflector_urad": [100.0, 300.0],
        "laser_urad": [-200.0, 50.0],
        "distance_constant_mm": 0.3,
    },
    "noise": {"distance_um": 0.1, "tilt_urad": 1.0, "spot_um": 1.0, "seed": 1},
    "temperature": {
        "expansion_um_per_m_k": 11.5,
        "u_expansion_um_per_m_k": 1.0,
        "u_temperature_c": 0.1,
        "axes_c": [23.0, 24.5, 21.5],
        "axes_c_per_h": 0.5,
    },
    "environment": {
        "temperature_c": 22.5,
        "pressure_hpa": 998.0,
        "humidity_percent": 45.0,
        "readings": "constant_index",
        "assumed": {"temperature_c": 20.0, "pressure_hpa": 1013.25, "humidity_percent": 50.0},
    },
}
HEADS: dict[str, dict[str, Any]] = {
    "psd": {"layout": "psd", "psd_distance_mm": 100.0},
    "multi_beam": {"layout": "multi_beam", "beam_offsets_mm": [[0.0, 50.0], [-43.3, -25.0], [43.3, -25.0]]},
}


@dataclass
class Case:
    """What a person has: the scenario, the rows of the run, and how the file was written."""

    scenario: dict[str, Any]
    rows: list[Row]
    text: Callable[[str], bytes] = str.encode  # of the CSV, before it is a file
    through_import: bool = False
    hidden: tuple[int, ...] = ()  # rows of a workbook that a filter hides


Change = Callable[[Case], object]


@dataclass(frozen=True)
class Mistake:
    kind: str
    name: str
    change: Change
    required: str
    words: str  # regular expression: what names it
    listed: str = ""  # the same: the wrong value as the report has it
    truth: Change | None = None  # what is different in the simulated run itself


def of_columns(names: str, new: Callable[[float], float], lines: str = "") -> Change:
    """Changes the fields of columns that match, of lines that match."""

    def change(case: Case) -> None:
        for row in case.rows:
            for name in row:
                if re.fullmatch(names, name) and re.fullmatch(lines or ".*", row["line"]) and row[name]:
                    row[name] = repr(float(new(float(row[name]))))

    return change


def stated(path: str, value: Any) -> Change:
    """Another value of a key; None: the key or section is left out."""

    def change(case: Case) -> None:
        *sections, key = path.split(".")
        at = functools.reduce(lambda table, name: table.setdefault(name, {}), sections, case.scenario)
        if value is None:
            at.pop(key, None)
        else:
            at[key] = value

    return change


def all_of(*changes: Change) -> Change:
    def change(case: Case) -> None:
        for one in changes:
            one(case)

    return change


def exchanged_columns(a: str, b: str) -> Change:
    def change(case: Case) -> None:
        for row in case.rows:
            row[a], row[b] = row[b], row[a]

    return change


READINGS = re.compile(r"distance_mm|alpha_urad|beta_urad|spot_[xy]_mm|d\d_mm")


def readings_from(source: Callable[[list[Row]], list[Row]], line: str) -> Change:
    """The readings of a line's rows are those of other rows."""

    def change(case: Case) -> None:
        old = copy.deepcopy(case.rows)
        own = [row for row in case.rows if row["line"] == line]
        for row, other in zip(own, source([row for row in old if re.fullmatch(line, row["line"])]), strict=True):
            row.update({name: other[name] for name in row if READINGS.fullmatch(name)})

    return change


def lines_named(names: dict[str, str]) -> Change:
    """Rows of a line with the name, and the positions, of another one: in a sheet the readings are what is moved."""

    def change(case: Case) -> None:
        old = {(row["line"], row["point"]): dict(row) for row in case.rows}
        for row in case.rows:
            other = old.get((names.get(row["line"], row["line"]), row["point"]))
            if other is not None:
                row.update({name: other[name] for name in row if READINGS.fullmatch(name)})

    return change


def of_rows(new: Callable[[list[Row]], list[Row]]) -> Change:
    def change(case: Case) -> None:
        case.rows[:] = new(case.rows)

    return change


def simulated_otherwise(other: Change, lines: str) -> Change:
    """The readings, temperatures and air of some lines are those of a run that differs."""

    def change(case: Case) -> None:
        there = copy.deepcopy(case.scenario)
        other(Case(there, []))
        rows = {(row["line"], row["point"]): row for row in simulated(there)}
        for row in case.rows:
            if re.fullmatch(lines, row["line"]):
                row.update(rows[row["line"], row["point"]])

    return change


def in_file(text: Callable[[str], bytes], through_import: bool = False) -> Change:
    def change(case: Case) -> None:
        case.text, case.through_import = text, through_import

    return change


def lost_as(value: str, line: str = "pnp", point: str = "12") -> Change:
    def change(case: Case) -> None:
        for row in case.rows:
            if (row["line"], row["point"]) == (line, point):
                row.update({name: value for name in row if READINGS.fullmatch(name)})

    return change


def hide(case: Case) -> None:
    """A filter hid rows of a wrong measurement, which was repeated below."""
    wrong = [dict(row) for row in case.rows if row["line"] == "npp"]
    for row in wrong:
        row["distance_mm"] = repr(float(row["distance_mm"]) + 0.05 * float(row["point"]) / 30.0)
    first = len(case.rows)
    kept = [row for row in case.rows if row["line"] != "npp"]
    case.rows[:] = [*kept, *wrong]
    case.hidden = tuple(range(len(kept), first))
    case.through_import = True


def shifted(rows: list[Row]) -> list[Row]:
    return [rows[0], *rows[:-1]]


def head(layout: str) -> Change:
    return stated("head", {**SOUND["head"], **HEADS[layout]})


def backward(case: Case) -> None:
    case.scenario["plan"].update(backward=True)


def forward_labels(case: Case) -> None:
    for row in case.rows:
        row["direction"] = "forward"


def warm(case: Case) -> None:
    case.scenario["temperature"].update(axes_c=[26.0, 27.5, 24.5])


def no_columns(case: Case) -> None:
    for row in case.rows:
        for name in [name for name in row if name.startswith("temperature_")]:
            del row[name]


TEMPERATURES, AIR_T = r"temperature_[xyz]_c", "air_temperature_c"
DISTANCES, TILTS = r"distance_mm|d\d_mm", r"alpha_urad|beta_urad"
F, P, H = "air_temperature_c", "air_pressure_hpa", "air_humidity_percent"
EXPANSION = "temperature.expansion_um_per_m_k"


def mistakes() -> list[Mistake]:
    """What is required: `named` where CONVENTIONS or docs/mistakes.md promise a sentence, `doubtful` where it must be
    told, `listed` where no reading and no limit shows it."""
    units = [
        ("distances in inches", of_columns(DISTANCES, lambda v: v / 25.4), "inch"),
        ("distances in µm", of_columns(DISTANCES, lambda v: v * 1e3), r"µm|\bum\b|1000"),
        ("distances in m", of_columns(DISTANCES, lambda v: v / 1e3), r"\bm\b|metre|1000"),
        ("distances of the round trip", of_columns(DISTANCES, lambda v: 2.0 * v), "factor of 2|round trip|twice"),
        ("distances halved", of_columns(DISTANCES, lambda v: v / 2.0), "halved|factor of 2"),
        ("tilts in degrees", of_columns(TILTS, lambda v: np.degrees(v * 1e-6)), "degree|°"),
        ("tilts in seconds of arc", of_columns(TILTS, lambda v: v / 4.84813681), "seconds of arc|arcsec"),
        ("tilts in mrad", of_columns(TILTS, lambda v: v / 1e3), "1000|mrad"),
        ("tilts of the beam", of_columns(TILTS, lambda v: 2.0 * v), "factor of 2|twice"),
        ("positions in inches", of_columns("[xyz]_mm", lambda v: v / 25.4), "inch|the row says"),
        ("volume in cm", stated("volume", {"x_mm": 80.0, "y_mm": 60.0, "z_mm": 50.0}), "the row says|volume|x_mm"),
    ]
    found = [Mistake("units", name, change, "named", words) for name, change, words in units]
    found += [
        Mistake("units", "time in ms", of_columns("time_s", lambda v: 1e3 * v), "named", r"\bms\b|time_s|millisecond"),
        Mistake(
            "units", "time in minutes", of_columns("time_s", lambda v: v / 60.0), TOLD, "time_s|minute|reading.* s"
        ),
        Mistake(
            "units",
            "noise stated 10 times too small",
            stated("uncertainty", {"distance_um": 0.01, "tilt_urad": 0.1}),
            "named",
            "noise|as much as stated|uncertaint",
        ),
        Mistake(
            "units",
            "noise stated 10 times too large",
            stated("uncertainty", {"distance_um": 1.0, "tilt_urad": 10.0}),
            TOLD,
            "noise|less|as much as stated|as stated|smaller",
        ),
        Mistake(
            "units",
            "noise of distances in nm",
            stated("uncertainty", {"distance_um": 100.0}),
            TOLD,
            "noise|less|as much as stated|smaller",
        ),
    ]
    temperature = r"temperature.*(°F|fahrenheit)|°F|[Ff]ahrenheit"
    sensors: list[tuple[str, Change, str, str, str]] = [
        ("scales in °F", of_columns(TEMPERATURES, lambda v: 1.8 * v + 32.0), "named", temperature, ""),
        ("scales in K", of_columns(TEMPERATURES, lambda v: v + 273.15), "named", r"\bK\b|kelvin", ""),
        ("scales in tenths of °C", of_columns(TEMPERATURES, lambda v: 10.0 * v), "named", "tenth", ""),
        (
            "scales' columns 0",
            of_columns(TEMPERATURES, lambda v: 0.0),
            "named",
            "temperature.*(sensor|says nothing|0 in)",
            "",
        ),
        ("one scale's column 0", of_columns("temperature_x_c", lambda v: 0.0), "named", "temperature_x|of X", ""),
        ("scales 85 °C", of_columns(TEMPERATURES, lambda v: 85.0), "named", "temperature.*85|85.*temperature", ""),
        ("one scale 85 °C", of_columns("temperature_y_c", lambda v: 85.0), "named", "temperature_y|of Y", ""),
        (
            "scales -127 °C",
            of_columns(TEMPERATURES, lambda v: -127.0),
            "named",
            "temperature.*-127|-127.*temperature",
            "",
        ),
        (
            "one reading of a scale 85 °C",
            lambda case: case.rows[40].update(temperature_x_c="85.0"),
            "named",
            "temperature_x|of X",
            "",
        ),
        (
            "one axis' sensor in the sun (+12 K)",
            of_columns("temperature_z_c", lambda v: v + 12.0),
            TOLD,
            "temperature_z|of Z|sensors",
            "",
        ),
        (
            "one axis' sensor 4 K off",
            of_columns("temperature_z_c", lambda v: v + 4.0),
            LISTED,
            "temperature_z",
            "25[.]5",
        ),
        (
            "one axis' column empty",
            lambda case: [row.update(temperature_y_c="") for row in case.rows],
            LISTED,
            "temperature_y",
            "temperature.*24[.]5",
        ),
        (
            "sensors of X and Y exchanged",
            exchanged_columns("temperature_x_c", "temperature_y_c"),
            LISTED,
            "temperature_",
            "24[.]5.*23",
        ),
        ("air in mmHg", of_columns(P, lambda v: v * 0.750062), "named", "mmHg", ""),
        ("air in inHg", of_columns(P, lambda v: v * 0.0295300), "named", "inHg", ""),
        ("air in kPa", of_columns(P, lambda v: v / 10.0), "named", "kPa", ""),
        ("air in Pa", of_columns(P, lambda v: v * 100.0), "named", r"\bPa\b", ""),
        ("air in °F", of_columns(AIR_T, lambda v: 1.8 * v + 32.0), "named", "°F|[Ff]ahrenheit", ""),
        ("air in K", of_columns(AIR_T, lambda v: v + 273.15), "named", r"\bK\b|kelvin", ""),
        ("air temperature 0", of_columns(AIR_T, lambda v: 0.0), "named", "air_temperature", ""),
        ("air humidity as a fraction", of_columns(H, lambda v: v / 100.0), "named", "fraction|percent", ""),
        ("air reduced to sea level at 500 m", of_columns(P, lambda v: v + 58.0), LISTED, "sea level", "1056"),
        ("expansion -11.5", stated(EXPANSION, -11.5), "named", "expansion", ""),
        ("expansion 0.0115 (mm)", stated(EXPANSION, 0.0115), "named", "expansion", ""),
        ("expansion 11.5e-6 (1/K)", stated(EXPANSION, 11.5e-6), "named", "expansion", ""),
        ("expansion 115", stated(EXPANSION, 115.0), "named", "expansion", ""),
        ("expansion 1.15", stated(EXPANSION, 1.15), LISTED, "expansion", r"stated 1[.]15\b|scales 1[.]15\b"),
        (
            "expansion 23.1 (of aluminium)",
            stated(EXPANSION, 23.1),
            LISTED,
            "expansion",
            r"stated 23[.]1\b|scales 23[.]1\b",
        ),
        ("expansion left out", stated("temperature", None), TOLD, "as found", ""),
        ("reference_c 68", stated("temperature.reference_c", 68.0), "named", "reference", ""),
        ("reference_c 293.15", stated("temperature.reference_c", 293.15), "named", "reference", ""),
        ("reference_c 0", stated("temperature.reference_c", 0.0), "named", "reference", ""),
        ("reference_c 23", stated("temperature.reference_c", 23.0), TOLD, "reference", "referred to 23"),
    ]
    found += [
        Mistake("sensors", name, change, required, words, listed) for name, change, required, words, listed in sensors
    ]

    swap_xy = {"npp": "pnp", "pnp": "npp", "p00": "0p0", "0p0": "p00", "p0p": "0pp", "0pp": "p0p"}
    labels: list[tuple[str, Change, str, str]] = [
        ("lines ppp and npp exchanged", lines_named({"ppp": "npp", "npp": "ppp"}), "named", "exchanged"),
        ("line npp from its end", readings_from(lambda rows: rows[::-1], "npp"), "named", "reversed"),
        ("X and Y exchanged in the names of lines", lines_named(swap_xy), TOLD, "exchanged|volume|X and Y"),
        ("two scale lines exchanged", lines_named({"p00": "0p0", "0p0": "p00"}), "named", "exchanged|0p0|p00"),
        ("both tilts with the wrong sign", of_columns(TILTS, lambda v: -v), "named", "wrong sign|upside down"),
        ("alpha with the wrong sign", of_columns("alpha_urad", lambda v: -v), "named", "wrong sign"),
        ("alpha with the wrong sign on npp", of_columns("alpha_urad", lambda v: -v, "npp"), "named", "wrong sign"),
        ("alpha and beta exchanged", exchanged_columns("alpha_urad", "beta_urad"), "named", "exchanged"),
        (
            "head turned by 90° on all lines",
            all_of(exchanged_columns("alpha_urad", "beta_urad"), of_columns("beta_urad", lambda v: -v)),
            "named",
            "turned by",
        ),
        ("distances with the wrong sign", of_columns(DISTANCES, lambda v: -v), "named", "wrong sign"),
    ]
    found += [Mistake("labels", name, change, required, words) for name, change, required, words in labels]
    found += [
        Mistake(
            "labels", "backward run labelled forward", forward_labels, TOLD, "backward|direction|reversed", "", backward
        ),
        Mistake(
            "labels",
            "beams d1 and d2 exchanged",
            exchanged_columns("d1_mm", "d2_mm"),
            "named",
            "exchanged",
            "",
            head("multi_beam"),
        ),
        Mistake(
            "labels",
            "spot_x and spot_y exchanged",
            exchanged_columns("spot_x_mm", "spot_y_mm"),
            "named",
            "exchanged",
            "",
            head("psd"),
        ),
    ]
    places: list[tuple[str, Change, str, str, str]] = [
        (
            "tool 50 mm too short",
            stated("machine.tool_mm", [30.0, -20.0, -100.0]),
            LISTED,
            "tool",
            r"tool offset \(30, -20, -100",
        ),
        (
            "tool forgotten",
            stated("machine.tool_mm", None),
            LISTED,
            "tool offset must",
            r"tool offset.*\(0, 0, 0|no tool|tool offset 0",
        ),
        (
            "tool with the wrong sign",
            stated("machine.tool_mm", [-30.0, 20.0, 150.0]),
            LISTED,
            "tool ",
            r"tool offset \(-30, 20, 150",
        ),
        (
            "volume X and Y exchanged",
            stated("volume", {"x_mm": 600.0, "y_mm": 800.0, "z_mm": 500.0}),
            "named",
            "the row says|x_mm|volume",
            "",
        ),
        (
            "x_mm 810, positions of the plan",
            all_of(stated("volume.x_mm", 810.0), of_columns("x_mm", lambda v: v * 810.0 / 800.0)),
            "named",
            "x_mm = 800",
            "",
        ),
        ("steps 5 for 10", stated("plan.steps", 5), "named", "point|step|position", ""),
        ("order XZY", all_of(stated("plan.order", "XZY")), "named", "order|the row says", ""),
        (
            "chain in another order",
            stated("machine.chain", "[w Y' b X Z t]"),
            "named",
            "order Y X Z|order X Y Z|chain",
            "",
        ),
        (
            "b elsewhere in the chain",
            stated("machine.chain", "[w b X Y Z t]"),
            LISTED,
            "place of b must",
            r"place of b in the chain \[w b X Y Z t",
        ),
        ("standoff 50 for 150", stated("head.standoff_mm", 50.0), LISTED, "standoff must", "standoff 50"),
        ("positions from another origin", of_columns("x_mm", lambda v: v + 100.0), "named", "the row says|x_mm", ""),
        (
            "constants fixed that are not",
            stated("adjustment.distance_constant_mm", "fixed"),
            TOLD,
            "constant|standoff",
            "",
        ),
        (
            "fixed point of a scale at its far end",
            stated("temperature.fixed_point_mm", [800.0, 600.0, 500.0]),
            LISTED,
            "fixed point",
            "fixed point",
        ),
    ]
    found += [
        Mistake("places", name, change, required, words, listed) for name, change, required, words, listed in places
    ]
    found += [
        Mistake(
            "places",
            "psd_distance_mm 300 for 100",
            stated("head.psd_distance_mm", 300.0),
            "named",
            "psd_distance",
            "",
            head("psd"),
        ),
        Mistake(
            "places",
            "beam offsets in inches",
            stated("head.beam_offsets_mm", [[0.0, 1.9685], [-1.7047, -0.9843], [1.7047, -0.9843]]),
            "named",
            "beam_offsets|inch",
            "",
            head("multi_beam"),
        ),
    ]
    yesterday = all_of(stated("noise.seed", 7), stated("machine.random.squareness_urad", 80.0))
    other_machine = stated("machine.random.seed", 77)
    files: list[tuple[str, Change, str, str, str]] = [
        ("yesterday's file for one line", simulated_otherwise(yesterday, "pnp"), TOLD, "pnp", ""),
        ("same file for two lines", lines_named({"npp": "ppp"}), TOLD, "npp|ppp|same readings", ""),
        (
            "readings of two rows exchanged",
            readings_from(lambda rows: [*rows[:9], rows[10], rows[9], *rows[11:]], "pnp"),
            TOLD,
            "point 9|point 10|exchanged",
            "",
        ),
        ("readings one row too low", readings_from(shifted, "pnp"), "named", "row|read twice|skipped", ""),
        ("last row missing", of_rows(lambda rows: rows[:-1]), "named", "1 point|without a row|00p", ""),
        ("file of another machine for one line", simulated_otherwise(other_machine, "nnp"), TOLD, "nnp", ""),
        ("file of another machine, same plan", simulated_otherwise(other_machine, ".*"), "silent", "machine", ""),
        ("rows hidden by a filter", hide, "named", "hidden", ""),
        (
            "decimal commas",
            in_file(lambda t: t.replace(",", ";").replace(".", ",").encode()),
            "named",
            "decimal comma",
            "",
        ),
        (
            "decimal commas, imported",
            in_file(lambda t: t.replace(",", ";").replace(".", ",").encode(), True),
            TOLD,
            "-----",
            "",
        ),
        (
            "points numbered from 1",
            lambda case: [row.update(point=str(int(row["point"]) + 1)) for row in case.rows],
            "named",
            "point|position",
            "",
        ),
        (
            "file cut in a row",
            in_file(lambda t: t[: 2 * len(t) // 3].encode()),
            "named",
            "line \\d+|fields|complete",
            "",
        ),
        ("file cut after a row", of_rows(lambda rows: rows[:120]), "named", "without a row|nnp|lost|missing", ""),
        ("rows pasted twice", of_rows(lambda rows: [*rows[:30], *rows[20:]]), "named", "twice|given|row", ""),
        (
            "a digit mistyped (1 mm)",
            lambda case: case.rows[40].update(distance_mm=repr(float(case.rows[40]["distance_mm"]) + 1.0)),
            "named",
            "npp|point",
            "",
        ),
        ("lost beam as 0 0 0", lost_as("0"), "named", "pnp.*(12|lost)|lost", ""),
        ("lost beam as 9999.999", lost_as("9999.999"), "named", "pnp.*12|9999.999", ""),
        (
            "lost beams as the last value",
            readings_from(lambda rows: [*rows[:25], *[rows[25]] * (len(rows) - 25)], "pnp"),
            TOLD,
            "pnp",
            "",
        ),
        (
            "rows sorted by text",
            of_rows(lambda rows: sorted(rows, key=lambda row: (row["line"], row["point"]))),
            TOLD,
            "-----",
            "",
        ),
    ]
    found += [
        Mistake("files", name, change, required, words, listed) for name, change, required, words, listed in files
    ]

    later = "pnp|nnp|0pp|00p"
    days: list[tuple[str, Change, str, str, str]] = [
        (
            "two days, temperature of the first",
            all_of(simulated_otherwise(warm, later), no_columns),
            TOLD,
            "temperature",
            "",
        ),
        (
            "two days, columns of the first",
            all_of(simulated_otherwise(warm, later), of_columns(TEMPERATURES, lambda v: v - 3.0, later)),
            TOLD,
            "temperature",
            "",
        ),
        ("air of another day", of_columns(P, lambda v: v + 25.0), LISTED, "air_pressure", "1023"),
        (
            "air of another day for half the lines",
            of_columns(P, lambda v: v + 25.0, later),
            TOLD,
            "pressure|factor",
            "",
        ),
        ("summer time during the run", of_columns("time_s", lambda v: v + 3600.0, later), TOLD, "time", ""),
        (
            "winter time within a line",
            lambda case: [row.update(time_s=repr(float(row["time_s"]) - 3600.0)) for row in case.rows[45:]],
            "named",
            "time",
            "",
        ),
        (
            "squareness changed between two lines",
            simulated_otherwise(stated("machine.random.squareness_urad", 75.0), later),
            TOLD,
            "squareness|pnp|nnp|0pp",
            "",
        ),
        (
            "temperature stated, not measured: 20 for 23",
            all_of(no_columns, stated("temperature.axes_c", 20.0)),
            LISTED,
            "axes_c",
            r"scales.*\b20\b.*°C.*(stated|axes_c)|temperature of the scales.*20",
        ),
    ]
    found += [Mistake("days", name, change, required, words, listed) for name, change, required, words, listed in days]
    index: list[tuple[str, Change, str, str, str]] = [
        ("wavelength 633 for 1530", stated("head.wavelength_nm", 633.0), LISTED, "wavelength must", "wavelength 633"),
        ("wavelength in µm", stated("head.wavelength_nm", 1.53), "named", "wavelength", ""),
        (
            "index 1.0 for the assumed air",
            stated("environment.assumed", {"refractive_index": 1.0}),
            LISTED,
            "index must",
            "index.*1[.]0*\\b.*|vacuum",
        ),
        (
            "index 1.27 for 1.00027",
            stated("environment.assumed", {"refractive_index": 1.27}),
            "named",
            "refractive_index|index",
            "",
        ),
        (
            "index on the scale lines alone",
            of_columns(DISTANCES, lambda v: v * 1.000268, "p00|0p0|00p"),
            "named",
            "scale lines",
            "",
        ),
        (
            "compensated, stated as counted with an index",
            stated("environment.readings", None),
            LISTED,
            "readings must",
            "instrument compensates",
        ),
        ("assumed air left out", stated("environment.assumed", None), LISTED, "assumed", "counted with"),
    ]
    found += [
        Mistake("index", name, change, required, words, listed) for name, change, required, words, listed in index
    ]
    compensated = stated("environment.readings", None)
    found.append(
        Mistake(
            "index",
            "constant_index for an instrument that compensates",
            stated("environment.readings", "constant_index"),
            LISTED,
            "readings must",
            "constant index",
            all_of(compensated, recorded_air),
        )
    )
    return found


def recorded_air(case: Case) -> None:
    case.scenario["environment"].pop("assumed", None)


def toml(table: dict[str, Any], prefix: str = "") -> str:
    own = "".join(f"{key} = {json.dumps(value)}\n" for key, value in table.items() if not isinstance(value, dict))
    head_line = f"[{prefix}]\n" if prefix else ""
    deeper = (toml(v, f"{prefix}.{k}" if prefix else k) for k, v in table.items() if isinstance(v, dict))
    return head_line + own + "".join(deeper)


def simulated(scenario: dict[str, Any]) -> list[Row]:
    described = sd.parse_scenario(toml(scenario))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        sd.simulate(described).write(path)
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    air = scenario["environment"]
    for row in rows:  # an instrument that compensates may record the air as well
        row.setdefault("air_temperature_c", str(air["temperature_c"]))
        row.setdefault("air_pressure_hpa", str(air["pressure_hpa"]))
        row.setdefault("air_humidity_percent", str(air["humidity_percent"]))
    return rows


def workbook(case: Case, path: Path) -> None:
    import openpyxl  # type: ignore[import-untyped]

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(list(case.rows[0]))
    for row in case.rows:
        sheet.append(
            [value if name in ("line", "direction") or not value else float(value) for name, value in row.items()]
        )
    for number in case.hidden:
        sheet.row_dimensions[number + 2].hidden = True
    book.save(path)


def commanded(*arguments: str) -> tuple[int, str, str]:
    """Exit status (1 for an exception), standard output and error of a command."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = command(list(arguments))
        except Exception as error:  # an internal error is an outcome too
            status = 1
            print(f"internal error: {error!r}", file=sys.stderr)
    return status, out.getvalue(), err.getvalue()


@dataclass(frozen=True)
class Found:
    status: int
    output: str  # of evaluate
    messages: str  # errors, warnings and the verdict's lines
    fit: str
    left: float  # µm; NaN: no calibration
    other_tool: float


def evaluated(case: Case, truth: sd.Machine, volume: np.ndarray) -> Found:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenario, run, calibration = folder / "scenario.toml", folder / "run.csv", folder / "calibration.csv"
        scenario.write_text(toml(case.scenario), encoding="utf-8")
        text = io.StringIO()
        writer = csv.DictWriter(text, list(case.rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(case.rows)
        told = ""
        if case.hidden:
            workbook(case, folder / "sheet.xlsx")
        else:
            (folder / "sheet.csv" if case.through_import else run).write_bytes(case.text(text.getvalue()))
        if case.through_import:
            status, out, err = commanded("import", str(next(folder.glob("sheet.*"))), "-o", str(run))
            told = out + err
            if status:
                return Found(status, out, told, "", np.nan, np.nan)
        status, out, err = commanded("evaluate", str(scenario), str(run), "-o", str(calibration))
        before, _, after = out.partition("\nmethod: ")
        verdict = "\n".join(
            re.findall(r"^(?!note:).*", before, re.MULTILINE) + re.findall(r"\n((?:fault|lost).*)", after)
        )
        # Names of files say nothing.
        messages = (told + err + verdict).replace(name, "")
        fit = re.search(r"^fit: (\w+)", out, re.MULTILINE)
        if not calibration.exists():
            return Found(status, out, messages, "", np.nan, np.nan)
        found = sd.read_calibration(calibration)
        grid = np.array(list(itertools.product(*(np.linspace(0.0, edge, 6) for edge in volume))))
        errors = sd.ErrorMap(
            {name: (position, value) for name, (position, value, _) in found.functions.items()},
            {name: value for name, (value, _) in found.squareness.items()},
        )

        def left(longer: np.ndarray) -> float:
            ours = sd.Machine(found.chain, errors, found.tool + longer).error(grid)
            return 1e3 * float(np.max(np.linalg.norm(ours - with_tool(truth, longer).error(grid), axis=1)))

        return Found(status, out, messages, fit[1].lower() if fit else "", left(np.zeros(3)), left(LONGER_TOOL))


def with_tool(machine: sd.Machine, longer: np.ndarray) -> sd.Machine:
    return sd.Machine(machine.chain, machine.errors, machine.tool + longer)


def outcome(mistake: Mistake, found: Found, sound: Found) -> str:
    small = found.left <= sound.left + MUCH and found.other_tool <= sound.other_tool + MUCH
    # A fault in an accepted fit tells something only where its treatment helped.
    told = found.fit != "accepted" or re.search(f"^(warning|lost{'|fault' * small})", found.messages, re.MULTILINE)
    if told and re.search(mistake.words, found.messages):
        return "named"
    if found.status != 0 or found.fit in ("rejected", "unchecked"):
        return "rejected"
    if found.fit == "doubtful":
        return "doubtful"
    if small:
        return "harmless"
    return "listed" if mistake.listed and re.search(mistake.listed, found.output) else "silent"


def one(seed: int, number: int) -> tuple[str, Found, Found]:
    mistake = mistakes()[number]
    case = Case(copy.deepcopy(SOUND), [])
    case.scenario["machine"]["random"]["seed"] = case.scenario["noise"]["seed"] = seed
    if mistake.truth:
        mistake.truth(case)
    described = sd.parse_scenario(toml(case.scenario))
    volume = described.known.plan.volume
    truth = described.machine()
    case.rows = simulated(case.scenario)
    sound = evaluated(replace(case, rows=copy.deepcopy(case.rows)), truth, volume)
    mistake.change(case)
    found = evaluated(case, truth, volume)
    return outcome(mistake, found, sound), found, sound


def first_line(found: Found) -> str:
    lines = [line for line in found.messages.splitlines() if re.match(r"(stepdiag: )?(error|warning|fit: [dru])", line)]
    return (lines or [""])[0].replace("|", "/")[:160]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="exit status 1 where an outcome is worse than required")
    parser.add_argument("--only", default="", help="mistakes whose kind or name has these words")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start, counts, worse, unsound = time.monotonic(), Counter[str](), list[str](), list[str]()
    chosen = [(n, m) for n, m in enumerate(mistakes()) if given.only in f"{m.kind}: {m.name}"]
    print(f"stepdiag {sd.__version__}\n")
    print(
        "| kind | mistake | outcome | required | exit | left, µm | by the right run | other tool, µm | first message |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        results = pool.imap(functools.partial(one, given.seed), [n for n, _ in chosen])
        for (_, mistake), (what, found, sound) in zip(chosen, results, strict=True):
            counts[what] += 1
            if OUTCOMES.index(what) > OUTCOMES.index(mistake.required) and what != "harmless":
                worse.append(f"{mistake.name} ({what})")
            if sound.fit != "accepted" or sound.status != 0:
                unsound.append(mistake.name)
            figures = " | ".join("" if np.isnan(v) else f"{v:.3g}" for v in (found.left, sound.left, found.other_tool))
            print(
                f"| {mistake.kind} | {mistake.name} | {what} | {mistake.required} | {found.status} | {figures} | "
                f"{first_line(found)} |",
                flush=True,
            )
    print(f"\n{len(chosen)} mistakes: {', '.join(f'{counts[name]} {name}' for name in OUTCOMES)}")
    print(f"{time.monotonic() - start:.0f} s")
    if unsound:
        print(f"**the run without a mistake is not accepted**: {', '.join(unsound)}")
    print(f"{len(worse)} worse than required{': ' if worse else ''}{'; '.join(worse)}")
    return 1 if unsound or (given.check and worse) else 0


if __name__ == "__main__":
    sys.exit(main())
