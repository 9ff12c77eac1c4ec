"""Files of the runs with known truth, read for reference.py without the package."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path
from typing import Any

from reference import ErrorTable, Scenario, Table


def read_error_table(path: Path) -> ErrorTable:
    """An error map's file; a function given for - alone is that of either direction."""
    by_direction: dict[str, dict[str, Table]] = {"": {}, "-": {}}
    squareness: dict[str, float] = {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            value = float(row["value"]) * {"um": 1e-3, "urad": 1e-6}[row["unit"]]
            if row["position_mm"] == "":
                squareness[row["parameter"]] = value
            else:
                direction = "-" if row.get("direction") in ("-", "\N{MINUS SIGN}") else ""
                nodes, values = by_direction[direction].setdefault(row["parameter"], ([], []))
                nodes.append(float(row["position_mm"]))
                values.append(value)
    functions, negative = by_direction[""], by_direction["-"]
    both = {name: table for name, table in negative.items() if name in functions}
    return ErrorTable(negative | functions, squareness, both)


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Rows of a measurement file with native units; an empty field is None."""
    factor = {"mm": 1.0, "urad": 1e-6}
    rows = []
    with open(path, newline="", encoding="utf-8") as file:
        for text in csv.DictReader(file):
            row: dict[str, Any] = {"line": text.pop("line"), "point": int(text.pop("point"))}
            for column, value in text.items():
                name, unit = column.rsplit("_", 1)
                row[name] = float(value) * factor[unit] if value else None
            rows.append(row)
    return rows


def read_scenario(path: Path) -> Scenario:
    """As much of a scenario as the runs with known truth use."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    head, plan, machine = data["head"], data["plan"], data["machine"]
    misalignment = {}
    for line, keys in data.get("misalignment", {}).items():
        setup: dict[str, Any] = {"reflector": (0.0, 0.0), "laser": (0.0, 0.0), "psd_zero": (0.0, 0.0)}
        for key, value in keys.items():
            name, factor = _native(key)
            setup[name] = tuple(v * factor for v in value) if isinstance(value, list) else value * factor
        misalignment[line] = setup
    return Scenario(
        volume=(data["volume"]["x_mm"], data["volume"]["y_mm"], data["volume"]["z_mm"]),
        chain=machine["chain"],
        tool=tuple(machine["tool_mm"]),
        lines=plan["lines"],
        steps=plan["steps"],
        order=plan["order"],
        scale_lines=plan["scale_lines"],
        scale_points=plan.get("scale_points", "ends"),
        layout=head["layout"],
        standoff=head["standoff_mm"],
        psd_distance=head.get("psd_distance_mm", 0.0),
        beam_offsets=head.get("beam_offsets_mm", []),
        misalignment=misalignment,
        noise=data.get("noise", {}),
        repeats=plan.get("repeats", 1),
        backward=plan.get("backward", False),
        seconds_per_reading=plan.get("seconds_per_reading"),
    )


def _native(key: str) -> tuple[str, float]:
    """ "roll_urad": ("roll", 1e-6)."""
    for ending, factor in (("_um_per_h", 1e-3 / 3600.0), ("_urad", 1e-6), ("_um", 1e-3), ("_mm", 1.0)):
        if key.endswith(ending):
            return key.removesuffix(ending), factor
    return key, 1.0
