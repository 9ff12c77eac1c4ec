"""The package's adjustment asked as the dense one is, and how far it is from the truth."""

from __future__ import annotations

from typing import Any

import numpy as np
import reference
from dense_adjustment import DenseAdjustment, Knowledge
from dense_model import SQUARENESS, Setup, Table, Unknown
from truth import Worst, worst
from virtual_runs import head_of, plan_of

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS

# The figures of the project, mm and rad. Readings near 1 m are rounded to 1e-13 mm, and steps add up as a random walk.
# Tilts from differences of beams: 1e-13 mm over 20 mm and 50 steps.
LIMIT = {"ideal": (2e-11, 1e-13), "psd": (2e-11, 1e-13), "multi_beam": (1e-10, 1e-12)}
MOST_ITERATIONS = 6


def adjust(
    run: sd.Measurement, scenario: reference.Scenario, knowledge: Knowledge | None = None, **options: Any
) -> sd.Adjustment:
    known = knowledge or Knowledge()
    by_line: dict[str, dict[str, Any]] = {}
    for key, prior in known.setup.items():
        if isinstance(key, tuple):
            by_line.setdefault(key[0], {})[key[1]] = prior
    if known.smoothness:
        deviation = {name[1] in "ABC": value for name, value in known.smoothness.items()}
        options["smoothness"] = sd.methods.Smoothness(
            translation=deviation.get(False, 0.0), rotation=deviation.get(True, 0.0)
        )
    if not known.rotations:
        options["rotations"] = False
    return sd.methods.adjust(
        run,
        options.pop("plan", None) or plan_of(scenario),
        options.pop("head", None) or head_of(scenario),
        sd.Chain(scenario.chain),
        scenario.tool,
        uncertainty=sd.methods.ReadingUncertainty(**known.uncertainty),
        setup=sd.methods.SetupPriors(**{key: prior for key, prior in known.setup.items() if isinstance(key, str)}),
        setup_by_line={line: sd.methods.SetupPriors(**priors) for line, priors in by_line.items()},
        one_setup_per_line=known.one_setup_per_line,
        reversal=known.reversal,
        **options,
    )


def error_map(table: reference.ErrorTable) -> sd.ErrorMap:
    functions = {name: (np.array(p), np.array(v)) for name, (p, v) in table.functions.items()}
    return sd.ErrorMap(functions, table.squareness)


def distance_from(adjustment: sd.Adjustment, table: reference.ErrorTable) -> Worst:
    return worst(adjustment.calibration, error_map(table))


def is_complete(calibration: sd.Calibration) -> bool:
    return (
        set(calibration.functions) == set(FUNCTIONS)
        and set(calibration.squareness) == set(SQUARENESS)
        and not calibration.undetermined_slopes
    )


def setup_value(adjustment: sd.Adjustment, unknown: Setup) -> tuple[float | None, float]:
    """Value and standard uncertainty of one set-up unknown."""
    for s in adjustment.setup:
        if (s.run, s.line, s.quantity, s.component) == (unknown.run, unknown.line, unknown.quantity, unknown.component):
            return s.value, s.standard_uncertainty
    raise AssertionError(f"{unknown} is not among the set-up unknowns")


def nodes_of(dense: DenseAdjustment, name: str, position: np.ndarray) -> list[int]:
    edge = dense.scenario.volume["XYZ".index(name[2])]
    nodes = np.asarray(position) / edge * dense.scenario.steps
    assert np.allclose(nodes, np.rint(nodes), atol=1e-9)
    return [int(k) for k in np.rint(nodes)]


def claims(calibration: sd.Calibration, dense: DenseAdjustment) -> dict[tuple[str, int], dict[Unknown, float]]:
    """Everything that a calibration states: (parameter, node) -> the sum of unknowns that it is."""
    found: dict[tuple[str, int], dict[Unknown, float]] = {}
    for name, (position, _, _) in calibration.functions.items():
        shape = name in calibration.undetermined_slopes
        for k in nodes_of(dense, name, position):
            found[name, k] = dense.node(name, k, shape=shape)
    for name in calibration.squareness:
        found[name, 0] = {Table(name): 1.0}
    return found


def reversal_claims(calibration: sd.Calibration, dense: DenseAdjustment) -> dict[tuple[str, int], dict[Unknown, float]]:
    """The same of reversal errors; where the constant is open, of their change from home, which is none at home."""
    found: dict[tuple[str, int], dict[Unknown, float]] = {}
    for name, columns in calibration.reversal.items():
        is_open = name in calibration.undetermined_reversal_constants
        for k in nodes_of(dense, name, columns[0]):
            home: dict[Unknown, float] = {Table(name, 0, True): -1.0}
            change = (dense.node(name, k, reversal=True) | home) if k else {}
            found[name, k] = change if is_open else dense.node(name, k, reversal=True)
    return found


def statement(calibration: sd.Calibration, dense: DenseAdjustment, key: tuple[str, int]) -> tuple[float, float]:
    """Value and standard uncertainty."""
    name, node = key
    if name in SQUARENESS:
        return calibration.squareness[name]
    position, value, u = calibration.functions[name]
    i = nodes_of(dense, name, position).index(node)
    return float(value[i]), float(u[i])


def assert_rank(adjustment: sd.Adjustment, dense: DenseAdjustment) -> None:
    """Nothing that a null vector touches is claimed; nothing that none touches is missing, or silently so."""
    assert dense.gap[0] > 1e-6, "the plan's rank is in doubt: no case to test with"
    assert dense.gap[1] < 1e-12, "the plan's rank is in doubt: no case to test with"
    calibration = adjustment.calibration
    for key, weights in claims(calibration, dense).items():
        assert dense.determines(weights), f"{key} is claimed and is not determined"
    for key, weights in reversal_claims(calibration, dense).items():
        assert dense.determines(weights), f"reversal of {key} is claimed and is not determined"
    for name in FUNCTIONS:
        if name[1] in "ABC" and not dense.knowledge.rotations:
            assert name not in calibration.functions, f"{name} is known to be 0, and no result"
        elif dense.scenario.steps > 1 or name[1] == name[2] or name[1] in "ABC":  # straightness has inner nodes only
            assert_function_is_there(calibration, dense, name)
            assert_reversal_is_there(calibration, dense, name)
    said = " ".join(calibration.undetermined)
    for name in SQUARENESS:
        assert dense.squareness_is_determined(name) == (name in calibration.squareness), name
        assert name in calibration.squareness or name in said, f"{name} is not determined and nobody says so"
    for s in adjustment.setup:
        unknown = Setup(s.run, s.line, s.quantity, s.component)
        if unknown in dense.place:
            assert (s.value is not None) == dense.determines({unknown: 1.0}), unknown


def assert_reversal_is_there(calibration: sd.Calibration, dense: DenseAdjustment, name: str) -> None:
    nodes = [dense.node(name, k, reversal=True) for k in range(dense.scenario.steps + 1)]
    if name not in calibration.functions or not np.any(dense.vector(nodes[0]) * dense.seen):
        return  # a reversal error stands beside its function, and begins at home
    home: dict[Unknown, float] = {Table(name, 0, True): -1.0}
    seen = [w for w in nodes[1:] if np.any(dense.vector(w) * dense.seen)]
    known = [dense.determines(w) and dense.determines(home) for w in seen] + [dense.determines(w | home) for w in seen]
    if any(known):
        assert name in calibration.reversal, f"reversal of {name} is determined in part and missing"
    if all(dense.determines(w) and np.any(dense.vector(w) * dense.seen) for w in nodes):
        beside = calibration.functions[name][0]  # not at nodes where the function itself is open
        assert len(calibration.reversal[name][0]) == len(beside), f"reversal of {name} has not all of its nodes"
        assert name not in calibration.undetermined_reversal_constants


def assert_function_is_there(calibration: sd.Calibration, dense: DenseAdjustment, name: str) -> None:
    """All of it that is determined; what is not is said."""
    steps, present = dense.scenario.steps, calibration.functions.get(name)
    only_shape = name in calibration.undetermined_slopes
    whole = dense.function_is_determined(name)
    if whole or (steps > 1 and dense.function_is_determined(name, shape=True)):
        assert present is not None, f"{name} is determined and missing"
        assert len(present[0]) == steps + 1, f"{name} has not all of its nodes"
        assert only_shape == (not whole), f"slope of {name}"
    elif present is not None:
        kept = set(nodes_of(dense, name, present[0]))
        for k in range(1, steps + 1):
            if dense.determines(dense.node(name, k, shape=only_shape)):
                assert k in kept, f"{name} at node {k} is determined and missing"
    visited = [w for k in range(1, steps + 1) if np.any(dense.vector(w := dense.node(name, k)) * dense.seen)]
    if not visited or not all(dense.determines(w) for w in visited):
        said = " ".join(calibration.undetermined)
        words = f"scale of {name[2]}" if name[1] == name[2] else name
        assert name in said or words in said, f"{name} is not determined and nobody says so"


def assert_nothing_is_determined(dense: DenseAdjustment) -> None:
    for name in FUNCTIONS:
        nodes = [dense.node(name, k) for k in range(1, dense.scenario.steps + 1)]
        seen = [w for w in nodes if np.any(dense.vector(w))]
        assert not any(dense.determines(w) for w in seen), name
        if name[1] == name[2] and dense.scenario.steps > 1:
            assert not dense.function_is_determined(name, shape=True), name


def assert_as_dense(
    adjustment: sd.Adjustment, dense: DenseAdjustment, *, value: float = 1e-6, relative: float = 1e-6
) -> None:
    """Values within `value` of their standard uncertainties, everything statistical within `relative`."""
    calibration = adjustment.calibration
    for key, weights in claims(calibration, dense).items():
        found, u = statement(calibration, dense, key)
        expected = dense.standard_uncertainty(weights)
        assert abs(u - expected) <= relative * expected, (key, u, expected)
        assert abs(found - dense.value(weights)) <= value * expected, (key, found, dense.value(weights))
    for s in adjustment.setup:
        unknown = Setup(s.run, s.line, s.quantity, s.component)
        if s.value is not None and unknown in dense.place:
            expected = dense.standard_uncertainty({unknown: 1.0})
            assert abs(s.standard_uncertainty - expected) <= relative * expected, (s, expected)
            assert abs(s.value - dense.value({unknown: 1.0})) <= value * expected, (s, dense.value({unknown: 1.0}))
    for i, channel in enumerate(dense.channels):
        used = dense.used[i]
        assert np.array_equal(np.asarray(adjustment.used[channel]), used), channel
        ratio = (adjustment.residuals[channel] - dense.residuals[i])[used] / dense.u[i][used]
        assert np.max(np.abs(ratio), initial=0.0) <= value, channel
        difference = (adjustment.redundancy[channel] - dense.redundancy[i])[used]
        assert np.max(np.abs(difference), initial=0.0) <= relative, channel
    # At its minimum the sum of squares r'r changes by 2 r'd with the roundings d of the residuals (Cauchy and Schwarz
    # again), and in second order only with x. The density of chi-square is nowhere above 1/2.
    limit = (2 * np.sqrt(dense.square_sum) + dense.rounding) * dense.rounding
    found_sum = adjustment.variance_factor * adjustment.degrees_of_freedom
    assert adjustment.degrees_of_freedom == dense.degrees_of_freedom
    assert abs(found_sum - dense.square_sum) <= limit
    assert abs(adjustment.chi_square_probability - dense.chi_square_probability) <= limit / 2


def assert_recovered(adjustment: sd.Adjustment, table: reference.ErrorTable, limit: tuple[float, float]) -> None:
    assert is_complete(adjustment.calibration), adjustment.calibration.undetermined
    error = distance_from(adjustment, table)
    assert error.position <= limit[0], error
    assert error.angle <= limit[1], error
    assert adjustment.iterations <= MOST_ITERATIONS
    assert adjustment.outliers == []


def knowledge_of(layout: str) -> Knowledge:
    """The beams' constants are common to all; a prior on the laser would pull it away from its 2 mrad."""
    return Knowledge({"beam_constants": "fixed"} if layout == "multi_beam" else {})
