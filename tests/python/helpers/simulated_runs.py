"""Runs of the package and of reference.py from the same random scenarios."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import reference
from hypothesis import strategies as st
from usual import ALL_CHAINS, ALL_LINES, ORDERS

import stepdiag as sd

# Roundings of coordinates near 1 m (1.1e-13 mm each), of unit vectors, and of spots, which scale a tilt by 2 x 1.2 m.
LIMIT = {"distance": 5e-12, "alpha": 1e-14, "beta": 1e-14, "spot_x": 2e-11, "spot_y": 2e-11} | {
    f"d{i}": 5e-12 for i in range(1, 10)
}


def plan_of(scenario: reference.Scenario) -> sd.Plan:
    return sd.Plan(
        scenario.volume, scenario.lines, scenario.steps, order=scenario.order, scale_lines=scenario.scale_lines
    )


def head_of(scenario: reference.Scenario, **more: Any) -> sd.Head:
    return sd.Head(
        scenario.layout,
        standoff=scenario.standoff,
        psd_distance=scenario.psd_distance,
        beam_offsets=scenario.beam_offsets,
        **more,
    )


def simulated(scenario: reference.Scenario, errors: sd.ErrorMap, **more: Any) -> sd.Measurement:
    misalignment = {line: sd.Misalignment(**setup) for line, setup in scenario.misalignment.items()}
    machine = sd.Machine(sd.Chain(scenario.chain), errors, scenario.tool)
    runs = {
        "repeats": scenario.repeats,
        "backward": scenario.backward,
        "seconds_per_reading": scenario.seconds_per_reading,
        "scales": scales_of(scenario),
    }
    return sd.simulate(machine, plan_of(scenario), head_of(scenario), misalignment=misalignment, **runs, **more)


def expansion_of(scales: reference.Scales) -> sd.Expansion:
    return sd.Expansion(scales.coefficient, fixed_point=scales.fixed_point, reference=scales.reference)


def scales_of(scenario: reference.Scenario) -> sd.ScaleTemperatures | None:
    scales = scenario.scales
    return None if scales is None else sd.ScaleTemperatures(expansion_of(scales), scales.start, scales.rate)


def table_of(errors: sd.ErrorMap) -> reference.ErrorTable:
    functions = {name: (list(p), list(v)) for name, (p, v) in errors.functions.items()}
    negative = {name: (list(p), list(v)) for name, (p, v) in errors.negative_functions.items()}
    return reference.ErrorTable(functions, dict(errors.squareness), negative)


def symmetric(size: float) -> st.SearchStrategy[float]:
    return st.floats(-size, size)


@st.composite
def scenarios(draw: st.DrawFn, layouts: tuple[str, ...] = ("ideal",)) -> reference.Scenario:
    volume = draw(st.tuples(*[st.floats(100.0, 1000.0)] * 3))
    lines = draw(st.lists(st.sampled_from(ALL_LINES), min_size=1, max_size=3, unique=True))
    pair = st.tuples(symmetric(1e-3), symmetric(1e-3))
    layout = draw(st.sampled_from(layouts))
    return reference.Scenario(
        volume=volume,
        chain=draw(st.sampled_from(ALL_CHAINS)),
        tool=draw(st.tuples(*[symmetric(100.0)] * 3)),
        lines=lines,
        steps=draw(st.integers(5, 12)),
        order=draw(st.sampled_from(ORDERS)),
        layout=layout,
        standoff=draw(st.floats(20.0, 300.0)),
        psd_distance=draw(st.floats(0.0, 100.0)) if layout == "psd" else 0.0,
        beam_offsets=[[0.0, 0.0], [20.0, 1.0], [-3.0, 15.0], [9.0, -9.0]] if layout == "multi_beam" else [],
        misalignment={
            line: {"reflector": draw(pair), "laser": draw(pair), "psd_zero": draw(st.tuples(*[symmetric(2.0)] * 2))}
            for line in lines
            if draw(st.booleans())
        },
    )


@st.composite
def warm(draw: st.DrawFn, layouts: tuple[str, ...] = ("ideal",)) -> reference.Scenario:
    """A scenario whose scales expand from anywhere while they get warmer or colder."""
    three = st.tuples
    scales = reference.Scales(
        coefficient=draw(three(*[symmetric(3e-5)] * 3)),
        start=draw(three(*[st.floats(0.0, 40.0)] * 3)),
        rate=draw(three(*[symmetric(1e-2)] * 3)),
        fixed_point=draw(three(*[symmetric(500.0)] * 3)),
        reference=draw(st.sampled_from([20.0, 23.5])),
    )
    return replace(draw(scenarios(layouts)), scales=scales, seconds_per_reading=5.0, backward=draw(st.booleans()))


def errors_of(scenario: reference.Scenario, seed: int, intervals: int) -> sd.ErrorMap:
    return sd.random_error_map(
        scenario.volume, seed=seed, translation=0.1, rotation=300e-6, squareness=300e-6, intervals=intervals
    )


def with_reversal(errors: sd.ErrorMap, other: sd.ErrorMap, count: int) -> sd.ErrorMap:
    """Of the first functions, those approached in - direction are another machine's, which is not 0 at home."""
    negative = {
        name: (position, value + 0.1 * value[-1] + 1e-6)
        for name, (position, value) in list(other.functions.items())[:count]
    }
    return sd.ErrorMap(errors.functions, errors.squareness, negative_functions=negative)
