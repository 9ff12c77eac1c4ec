"""Do 95 % intervals cover the truth in 95 % of cases? Random machines, heads, set-ups and noise, and what came of them.

A machine is drawn from its seed alone: volume, chain, tool, errors, order of the axes, levels of noise (which the
evaluator is told), set-ups from the priors that the evaluation has of them. mm, rad.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from usual import ALL_CHAINS, DIAGONALS, ORDERS, SCALE_LINES
from virtual_runs import BEAMS

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS

STEPS = 10
SQUARENESS = ["C0Y", "B0Z", "A0Z"]
PROBABILITY = 0.95
FACTOR = 1.959963984540054  # of a normal distribution, whose standard deviation is known


@dataclass(frozen=True)
class Case:
    """An evaluator and what it meets; standard deviations of what is drawn of each line's set-up."""

    method: str
    layout: str = "ideal"
    rotation: float = 60e-6  # peaks of angular errors
    reflector: float = 0.0
    laser: float = 0.0
    psd_zero: float = 0.0
    distance_constant: float = 1.0
    beam_constants: float = 0.0
    lateral: float = 0.0
    roll: float = 0.0
    gain: float = 0.0
    scale_laser: float = 0.0  # of scale lines
    scale_mirror: float = 0.0  # of theirs, against the beam
    scale_points: str = "ends"
    distance: float | None = None  # noise of distances; None: drawn
    told: Mapping[str, Any] = field(default_factory=dict)  # options of the evaluation
    wrong: str = ""  # with the model, where it does not hold; the families of parameters that this spoils
    concerned: tuple[str, ...] = ()


def known_to(laser: float | str, mirror_of_scale_lines: str | None = None) -> dict[str, Any]:
    """What the adjustment is told: the laser of measured lines; scale lines are square."""
    fixed = {line: sd.methods.SetupPriors(laser="fixed", reflector=mirror_of_scale_lines) for line in SCALE_LINES}
    return {"setup": sd.methods.SetupPriors(laser=laser), "setup_by_line": fixed}


# What adjust() knows by default of a line: lateral 1 mm, roll 20 mrad, gain 0.01.
KNOWN: dict[str, Any] = {"lateral": 1.0, "roll": 20e-3, "gain": 0.01, "told": known_to("free")}
FAMILIES = ("scales", "positioning", "shapes", "straightnesses", "angles", "squarenesses")


def beams_with_constants(laser: float) -> dict[str, Any]:
    """They leave the angle between laser and mirror open: it is known by the prior of the laser alone."""
    return KNOWN | {"reflector": 1e-3, "laser": laser, "beam_constants": 0.05, "told": known_to(laser, "fixed")}


CASES = {
    "adjustment": Case("adjustment", reflector=1e-3, laser=1e-3, **KNOWN),
    "adjustment, layout a": Case("adjustment", "multi_beam", **beams_with_constants(3e-4)),
    "adjustment, layout b": Case("adjustment", "psd", reflector=1e-3, laser=1e-3, psd_zero=1.0, **KNOWN),
    "enhanced": Case("enhanced", reflector=1e-4, laser=1e-4),
    "enhanced, layout a": Case("enhanced", "multi_beam", reflector=1e-4, laser=1e-4),
    "enhanced, layout b": Case("enhanced", "psd", reflector=1e-4, laser=1e-4),
    "conventional": Case("conventional", rotation=0.0),
    "conventional, angular errors": Case(
        "conventional",
        wrong="angular errors are taken for errors of translation",
        concerned=("scales", "positioning", "shapes", "straightnesses", "squarenesses"),
    ),
    "enhanced, laser 1 mrad": Case(
        "enhanced",
        reflector=1e-4,
        laser=1e-3,
        wrong="cosine errors of the laser's angles, second order, are not in the linear evaluation",
        concerned=("squarenesses",),
    ),
    "adjustment, layout a, laser 1 mrad": Case(
        "adjustment",
        "multi_beam",
        **beams_with_constants(1e-3),
        wrong="second order of an angle that only its prior knows: distances read long by 3/2 of its square",
        concerned=("squarenesses",),
    ),
    "adjustment, scale lines 500 urad": Case(
        "adjustment",
        reflector=1e-3,
        laser=1e-3,
        scale_laser=500e-6,
        **(KNOWN | {"told": {}}),
    ),
}


def scale_lines_case(layout: str, laser: float, distance: float) -> Case:
    """Scale lines read at every step; head and mirror of all lines as the adjustment takes them to be."""
    beams = layout == "multi_beam"  # which do not tell the mirror of a scale line from their constants
    of_lines: dict[str, Any] = {"reflector": 1e-3, "laser": 3e-4 if beams else 1e-3}
    told = {
        "setup": sd.methods.SetupPriors(laser=of_lines["laser"] if beams else "free"),
        "setup_by_line": {line: sd.methods.SetupPriors(laser=laser) for line in SCALE_LINES},
    }
    return Case(
        "adjustment",
        layout,
        **(KNOWN | of_lines | {"told": told}),
        psd_zero=1.0 if layout == "psd" else 0.0,
        beam_constants=0.05 if beams else 0.0,
        scale_laser=laser,
        scale_mirror=SCALE_MIRROR if beams else 0.0,
        scale_points="steps",
        distance=distance,
    )


SCALE_MIRROR = 500e-6  # against the beam that comes back, as which it is aligned
SCALE_LINE_CASES = {
    f"scale lines at every step, {layout}, {laser * 1e6:g} urad, {distance * 1e6:g} nm": scale_lines_case(
        layout, laser, distance
    )
    for layout in ("ideal", "psd", "multi_beam")
    for laser in (250e-6, 500e-6)
    for distance in (1e-4, 1e-5)
}


@dataclass(frozen=True)
class Drawn:
    """A machine, its head and how everything is set up."""

    machine: sd.Machine
    plan: sd.Plan
    head: sd.Head
    misalignment: dict[str, sd.Misalignment]
    uncertainty: sd.methods.ReadingUncertainty
    chain: str

    def noise_of(self, channel: str) -> float:
        u = self.uncertainty
        return u.tilt if channel in ("alpha", "beta") else u.spot if channel.startswith("spot") else u.distance


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def setup_of(case: Case, rng: np.random.Generator, line: str) -> sd.Misalignment:
    if line in SCALE_LINES:
        laser = case.scale_laser * rng.normal(size=2)
        # A mirror square to the beam: Exp(a, b, 0) of both. Their lateral offset is known as that of measured lines.
        constant, lateral = case.distance_constant * rng.normal(), case.lateral * rng.normal(size=2)
        mirror = laser + case.scale_mirror * rng.normal(size=2) if case.scale_mirror else laser
        return sd.Misalignment(mirror, laser, distance_constant=constant, lateral=lateral)
    constants = case.beam_constants * rng.normal(size=len(BEAMS)) if case.layout == "multi_beam" else []
    return sd.Misalignment(
        case.reflector * rng.normal(size=2),
        case.laser * rng.normal(size=2),
        case.psd_zero * rng.normal(size=2) if case.layout == "psd" else (0.0, 0.0),
        case.distance_constant * rng.normal(),
        list(constants),
        lateral=case.lateral * rng.normal(size=2),
        roll=case.roll * rng.normal(),
        gain=case.gain * rng.normal(),
    )


def draw(case: Case, seed: int, steps: int = STEPS) -> tuple[Drawn, np.random.Generator]:
    """The generator that comes back is for the noise."""
    rng = np.random.default_rng([2026, seed])
    volume = rng.uniform(250.0, 1000.0, 3)
    errors = sd.random_error_map(
        volume,
        seed=seed,
        translation=log_uniform(rng, 0.005, 0.05),
        rotation=case.rotation * log_uniform(rng, 0.3, 1.5),
        squareness=60e-6,
        intervals=steps,
    )
    chain = str(rng.choice(ALL_CHAINS))
    psd, beams = case.layout == "psd", case.layout == "multi_beam"
    head = sd.Head(
        case.layout,
        standoff=rng.uniform(50.0, 250.0),
        psd_distance=rng.uniform(20.0, 80.0) if psd else 0.0,
        beam_offsets=BEAMS if beams else [],
    )
    return Drawn(
        sd.Machine(chain, errors, rng.uniform(-100.0, 100.0, 3)),
        sd.Plan(
            volume,
            DIAGONALS,
            steps,
            order=str(rng.choice(ORDERS)),
            scale_lines=SCALE_LINES,
            scale_points=case.scale_points,
        ),
        head,
        {line: setup_of(case, rng, line) for line in [*DIAGONALS, *SCALE_LINES]},
        sd.methods.ReadingUncertainty(
            # By beams 20 mm apart: as good tilts as the others have.
            distance=case.distance or (log_uniform(rng, 2e-5, 2e-4) if beams else log_uniform(rng, 5e-5, 5e-4)),
            tilt=log_uniform(rng, 5e-7, 5e-6),
            spot=log_uniform(rng, 1e-3, 1e-2),
        ),
        chain,
    ), rng


def measured(drawn: Drawn, rng: np.random.Generator) -> sd.Measurement:
    run = sd.simulate(drawn.machine, drawn.plan, drawn.head, misalignment=drawn.misalignment)
    channels = {
        name: np.asarray(value) + drawn.noise_of(name) * rng.normal(size=len(run))
        for name, value in run.channels.items()
    }
    return sd.Measurement(run.line, run.point, run.position, channels)


def evaluated(case: Case, drawn: Drawn, run: sd.Measurement) -> sd.Calibration:
    told = (run, drawn.plan, drawn.head, sd.Chain(drawn.chain), drawn.machine.tool)
    if case.method == "adjustment":
        # No reading is an outlier here; leaving out the worst would make the rest look better than it is.
        return sd.methods.adjust(
            *told, uncertainty=drawn.uncertainty, outlier_probability=0.0, full_covariance=True, **case.told
        ).calibration
    return sd.methods.evaluate(
        *told, method=case.method, uncertainty=drawn.uncertainty, full_covariance=True, **case.told
    )


@cache
def labels(steps: int = STEPS) -> list[tuple[str, str, int]]:
    """Family, parameter, node of everything that is counted. "shapes": positioning less the line through its ends."""
    found = [("squarenesses", name, 0) for name in SQUARENESS]
    for name in FUNCTIONS:
        own, angle = name[1] == name[2], name[1] in "ABC"
        for k in range(1, steps + (own or angle)):
            family = "angles" if angle else "straightnesses" if not own else "scales" if k == steps else "positioning"
            found.append((family, name, k))
    return found + [("shapes", f"E{axis}{axis}", k) for axis in "XYZ" for k in range(1, steps)]


def normalised(calibration: sd.Calibration, truth: sd.ErrorMap, steps: int = STEPS) -> np.ndarray:
    """Deviations from the truth by the standard uncertainty stated, in the order of `labels`; NaN: not stated."""
    functions, open_slopes = calibration.functions, calibration.undetermined_slopes
    deviation, u = {}, {}
    for name, (position, value, uncertainty) in functions.items():
        deviation[name], u[name] = value - truth.function(name, position), uncertainty
    for name, (angle, uncertainty) in calibration.squareness.items():
        deviation[name], u[name] = np.array([angle - truth.squareness[name]]), np.array([uncertainty])
    result = []
    for family, name, k in labels(steps):
        if family == "shapes":
            break  # the last of them: below, all nodes at once
        known = name in deviation and not (name in open_slopes and family in ("scales", "positioning"))
        result.append(deviation[name][k] / u[name][k] if known else np.nan)
    for axis in "XYZ":
        name = f"E{axis}{axis}"
        if name in functions:
            result += list(normalised_shape(calibration, name, functions[name][0], deviation[name]))
    return np.array(result)


def normalised_shape(calibration: sd.Calibration, name: str, position: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """What the function deviates from its own line through both ends, at the nodes inside, by its uncertainty."""
    covariance = calibration.covariance
    assert covariance is not None
    place = [i for i, (label, _) in enumerate(calibration.covariance_labels) if label == name]
    share = position / position[-1]
    weights = np.eye(len(position)) - np.outer(share, np.eye(len(position))[-1])
    variance = np.diag(weights @ covariance[np.ix_(place, place)] @ weights.T)
    return (weights @ deviation)[1:-1] / np.sqrt(variance[1:-1])


def outcome(case: Case, seed: int, steps: int = STEPS) -> np.ndarray:
    drawn, rng = draw(case, seed, steps)
    return normalised(evaluated(case, drawn, measured(drawn, rng)), drawn.machine.errors, steps)


def outcomes(case: Case, seeds: Iterable[int], steps: int = STEPS) -> np.ndarray:
    """A row each machine."""
    return np.array([outcome(case, seed, steps) for seed in seeds])


@dataclass(frozen=True)
class Coverage:
    """Of one family: shares of machines whose interval covers the truth. Nodes of one machine are correlated, so each
    node is counted by itself, over machines; `pooled` is their mean, and has no simple bounds of its own."""

    machines: int
    lowest: float
    pooled: float
    highest: float
    spread: float  # root mean square of the deviations, in the uncertainties stated

    @property
    def tolerance(self) -> float:
        """Four binomial standard deviations of one node."""
        return 4.0 * float(np.sqrt(PROBABILITY * (1 - PROBABILITY) / self.machines))

    @property
    def holds(self) -> bool:
        return PROBABILITY - self.tolerance <= self.lowest and self.highest <= PROBABILITY + self.tolerance


def coverages(z: np.ndarray, steps: int = STEPS) -> dict[str, Coverage]:
    """By family; families of which nothing is stated are absent. Something stated of some machines only is an error."""
    found: dict[str, Coverage] = {}
    families = np.array([family for family, _, _ in labels(steps)])
    for family in FAMILIES:
        part = z[:, families == family]
        if np.all(np.isnan(part)):
            continue
        assert not np.any(np.isnan(part)), f"{family}: stated of some machines, not of others"
        share = np.mean(np.abs(part) <= FACTOR, axis=0)
        rms = float(np.sqrt(np.mean(part**2)))
        found[family] = Coverage(len(z), float(share.min()), float(share.mean()), float(share.max()), rms)
    return found
