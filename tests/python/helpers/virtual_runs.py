"""Random machines, plans and set-ups, and their runs by the reference's closed form: what the adjustment is tried with.

Everything comes from a seed. mm, rad, s.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import reference
from dense_model import Setup, Table, Unknown
from usual import ALL_CHAINS, DIAGONALS, ORDERS, SCALE_LINES

import stepdiag as sd

BEAMS = [[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]]


def random_table(
    rng: np.random.Generator,
    volume: Iterable[float],
    steps: int,
    *,
    translation: float = 0.02,
    rotation: float = 60e-6,
    squareness: float = 60e-6,
    roughness: float = 0.2,
    reversal: float = 0.0,
    straightness_constants: bool = False,
) -> reference.ErrorTable:
    """In the frame choice: 0 at home, straightnesses 0 at the end. Long waves, and every node with a share of its own.

    roughness: that share, of the amplitudes.
    reversal > 0: other tables in - direction, by constants and shapes of that share of the amplitudes; constants of
    straightnesses only if asked for, because lines whose axes turn back all at once do not see all of them."""
    functions, negative = {}, {}
    for axis, edge in zip("XYZ", volume, strict=True):
        nodes = [k * edge / steps for k in range(steps + 1)]
        share = np.arange(steps + 1) / steps
        for c in "XYZABC":
            amplitude = translation if c in "XYZ" else rotation
            wave = sum(rng.normal() * np.sin((2 * i + 1) * np.pi / 4 * share) for i in range(3))
            value = amplitude * (wave / 2 + roughness * rng.normal(size=steps + 1))
            value -= value[0]
            if c in "XYZ" and c != axis:
                value = value - share * value[-1]
            functions[f"E{c}{axis}"] = (nodes, [float(v) for v in value])
            if reversal:
                difference = reversal * amplitude * (rng.normal() + 0.3 * rng.normal(size=steps + 1))
                if c in "XYZ" and c != axis and not straightness_constants:
                    difference -= difference[0]
                negative[f"E{c}{axis}"] = (nodes, [float(v) for v in value - difference])
    angles = {name: float(rng.uniform(-squareness, squareness)) for name in ("C0Y", "B0Z", "A0Z")}
    return reference.ErrorTable(functions, angles, negative)


def within(rng: np.random.Generator, size: float) -> tuple[float, float]:
    """A pair of which neither is beyond `size`."""
    u, v = rng.uniform(-size, size, 2)
    return float(u), float(v)


def random_scenario(rng: np.random.Generator, **given: Any) -> reference.Scenario:
    """A machine of any kind, four diagonals and three scale lines, head and mirror up to 2 mrad out of true."""
    lines = given.get("lines", DIAGONALS)
    layout = given.get("layout", "ideal")
    misalignment = {
        line: {"reflector": within(rng, 2e-3), "laser": within(rng, 2e-3)}
        | ({"psd_zero": within(rng, 3.0)} if layout == "psd" else {})
        for line in lines
    }
    drawn: dict[str, Any] = {
        "volume": tuple(float(v) for v in rng.uniform(250.0, 1000.0, 3)),
        "chain": str(rng.choice(ALL_CHAINS)),
        "tool": tuple(float(v) for v in rng.uniform(-100.0, 100.0, 3)),
        "order": str(rng.choice(ORDERS)),
        "steps": int(rng.integers(4, 24)),
        "lines": DIAGONALS,
        "scale_lines": SCALE_LINES,
        "standoff": float(rng.uniform(50.0, 250.0)),
        "psd_distance": float(rng.uniform(20.0, 80.0)) if layout == "psd" else 0.0,
        "beam_offsets": BEAMS if layout == "multi_beam" else [],
        "misalignment": misalignment,
    }
    return reference.Scenario(**(drawn | given))


def plan_of(scenario: reference.Scenario) -> sd.Plan:
    return sd.Plan(
        scenario.volume,
        scenario.lines,
        scenario.steps,
        order=scenario.order,
        scale_lines=scenario.scale_lines,
        check_points=sd.CheckPoints(*scenario.check_points),
        scale_points=scenario.scale_points,
        block=scenario.block,
    )


def head_of(scenario: reference.Scenario) -> sd.Head:
    return sd.Head(
        scenario.layout,
        standoff=scenario.standoff,
        psd_distance=scenario.psd_distance,
        beam_offsets=scenario.beam_offsets,
    )


def measured(rows: Iterable[dict[str, Any]]) -> sd.Measurement:
    """Rows of the reference's simulation as a measurement."""
    table = list(rows)
    channels = [name for name in table[0] if name not in ("line", "point", "position", "run", "direction")]
    return sd.Measurement(
        [row["line"] for row in table],
        [row["point"] for row in table],
        np.array([row["position"] for row in table], dtype=float),
        {name: np.array([row[name] for row in table], dtype=float) for name in channels},
        run=[row.get("run", 0) for row in table],
        direction=[row.get("direction", "forward") for row in table],
    )


def noisy(
    run: sd.Measurement, rng: np.random.Generator, *, distance: float = 1e-4, tilt: float = 1e-6, spot: float = 1e-3
) -> sd.Measurement:
    """Independent Gaussians on every field."""
    deviation = {"alpha": tilt, "beta": tilt, "spot_x": spot, "spot_y": spot}
    channels = {name: np.array(value) for name, value in run.channels.items()}
    for name in channels:
        noise = rng.normal(size=len(run))
        if name != "time" and not name.startswith("temperature"):
            channels[name] += deviation.get(name, distance) * noise
    return sd.Measurement(
        run.line,
        run.point,
        run.position,
        channels,
        run=run.run,
        direction=run.direction,
        standard_uncertainty=run.standard_uncertainty,
    )


def truth_of(
    scenario: reference.Scenario, table: reference.ErrorTable, runs: Iterable[int] = (0,)
) -> dict[Unknown, float]:
    """The unknowns of the dense model as they are in the virtual machine."""
    truth: dict[Unknown, float] = {Table(name): value for name, value in table.squareness.items()}
    for name, (_, values) in table.functions.items():
        truth |= {Table(name, k): value for k, value in enumerate(values)}
        if name in table.negative:
            pairs = zip(values, table.negative[name][1], strict=True)
            truth |= {Table(name, k, reversal=True): plus - minus for k, (plus, minus) in enumerate(pairs)}
    for line in [*scenario.lines, *scenario.scale_lines]:
        setup = dict(scenario.misalignment.get(line, {}))
        beams = setup.pop("beam_constants", None) or [0.0]
        setup["distance_constant"] = setup.get("distance_constant", 0.0) + beams[0]
        for run in runs:
            truth |= {Setup(run, line, "beam_constants", i): b - beams[0] for i, b in enumerate(beams) if i}
            for quantity, value in setup.items():
                parts = value if isinstance(value, tuple) else (value,)
                truth |= {Setup(run, line, quantity, i): float(part) for i, part in enumerate(parts)}
    return truth


def lost(run: sd.Measurement, places: Iterable[tuple[str, int]] = (), channels: Iterable[str] = ()) -> sd.Measurement:
    """The run without whole channels, and without all fields of some points (line, point)."""
    gone = set(places)
    keep = np.array([(line, int(point)) not in gone for line, point in zip(run.line, run.point, strict=True)])
    values = {name: np.where(keep, value, np.nan) for name, value in run.channels.items() if name not in set(channels)}
    return sd.Measurement(run.line, run.point, run.position, values, run=run.run, direction=run.direction)
