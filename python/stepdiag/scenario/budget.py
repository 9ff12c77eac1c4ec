"""What makes the largest standard uncertainty of a positioning error: noise, the instrument's scale, temperature and
air."""

import math
from dataclasses import dataclass

import numpy as np

from stepdiag._core import Calibration
from stepdiag.calibration.volume import chord_variance
from stepdiag.findings.meaning import NOISE_ALONE
from stepdiag.parameters import kind_of
from stepdiag.scenario.known import Known
from stepdiag.units import MICROMETRE


@dataclass(frozen=True)
class PositioningBudget:
    """Of the positioning error of a calibration that is known worst; mm.

    `total`: its standard uncertainty, the root of the sum of the squares of the next four. noise: of the readings, and
    what the set-up's unknowns make of it. scale: of the instrument; air: of its index. None: not stated, or not counted
    by the method. between_nodes: of no reading and not in `total`; None: not known."""

    parameter: str
    position: float
    total: float
    noise: float
    scale: float | None
    temperature: float | None
    air: float | None
    between_nodes: float | None
    between_nodes_stated: bool
    noise_alone: bool


def positioning_budget(calibration: Calibration, known: Known) -> PositioningBudget | None:
    """None where no positioning error is determined with an uncertainty."""
    tables = {name: table for name, table in calibration.functions.items() if kind_of(name) == "positioning"}
    if not tables:
        return None
    name = max(tables, key=lambda one: float(np.max(tables[one][2])))
    position, value, u = tables[name]
    worst = int(np.argmax(u))
    noise_alone = calibration.method in NOISE_ALONE
    parts = calibration.uncertainty_parts
    if parts:
        own = [k for k, (label, _) in enumerate(calibration.covariance_labels) if label == name]
        parts = {source: part[own] for source, part in parts.items()}
    noise = np.sqrt(np.maximum(u**2 - sum(part**2 for part in parts.values()), 0.0))
    stated = {
        "scale": known.instrument.scale_uncertainty is not None,
        "temperature": known.expansion is not None,
        "air": bool(known.instrument.air),
    }
    found = {
        source: float(parts[source][worst]) if source in parts else 0.0 if is_stated and not noise_alone else None
        for source, is_stated in stated.items()
    }
    between = known.between_nodes
    if between is None and len(position) > 2:
        between = math.sqrt(chord_variance(position, value, np.diag(noise**2)))
    return PositioningBudget(
        name,
        float(position[worst]),
        float(u[worst]),
        float(noise[worst]),
        found["scale"],
        found["temperature"],
        found["air"],
        between,
        known.between_nodes is not None,
        noise_alone,
    )


def budget_text(budget: PositioningBudget | None) -> str:
    """One line; empty without a budget."""
    if budget is None:
        return ""
    absent = "not counted by this method" if budget.noise_alone else "not stated"
    parts = [f"noise {_um(budget.noise)}"] + [
        f"{name} {absent if part is None else _um(part)}"
        for name, part in (
            ("instrument's scale", budget.scale),
            ("temperature", budget.temperature),
            ("air", budget.air),
        )
    ]
    between = "not known"
    if budget.between_nodes is not None:
        kind = "stated" if budget.between_nodes_stated else "estimated from the table"
        between = f"{_um(budget.between_nodes)} ({kind}), not included"
        if budget.between_nodes == 0.0 and not budget.between_nodes_stated:
            between = "not seen above the table's noise"
    return (
        f"largest standard uncertainty of positioning {_um(budget.total)} ({budget.parameter} at {budget.position:g} "
        f"mm): {', '.join(parts)}; between nodes {between}"
    )


def _um(length: float) -> str:
    return f"{length / MICROMETRE:.2g} µm"
