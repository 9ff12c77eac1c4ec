"""Runs of the usual plan with set-ups from their priors, and copies of them with a mistake."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import one_thread  # noqa: F401 (for what its import does)
from usual import CHAIN, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd

NOISE = {"distance": 1e-4, "tilt": 1e-6, "spot": 1e-3}
HEADS = {
    "ideal": '[head]\nlayout = "ideal"\n',
    "psd": '[head]\nlayout = "psd"\npsd_distance_mm = 100.0\n',
    "multi_beam": '[head]\nlayout = "multi_beam"\nbeam_offsets_mm = [[0.0, 50.0], [-43.3, -25.0], [43.3, -25.0]]\n',
}


def described(head: str, *, steps: int, lines: Sequence[str] = DIAGONALS) -> sd.Scenario:
    """What an evaluation knows. `head`: a name, or its sections."""
    listed = ", ".join(f'"{line}"' for line in lines)
    x, y, z = VOLUME
    return sd.parse_scenario(
        f"[volume]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\n"
        f'[machine]\nchain = "{CHAIN}"\n[machine.random]\nseed = 1\n'
        f'[plan]\nlines = [{listed}]\nsteps = {steps}\nscale_lines = ["p00", "0p0", "00p"]\n'
        f"[uncertainty]\ndistance_um = 0.1\ntilt_urad = 1.0\nspot_um = 1.0\n" + HEADS.get(head, head)
    )


def step_plan(
    steps: int, *, lines: Sequence[str] = DIAGONALS, order: str = "XYZ", volume: Sequence[float] = VOLUME
) -> sd.Plan:
    return sd.Plan(volume, list(lines), steps, order=order, scale_lines=SCALE_LINES)


def set_ups(layout: str, lines: Sequence[str], *, seed: int) -> dict[str, sd.Misalignment]:
    """Drawn from the priors that an adjustment has by default; a free quantity from a usual one."""
    rng, drawn = np.random.default_rng([17, seed]), {}
    for line in lines:
        measured = line.count("0") < 2
        laser = 1e-3 * rng.normal(size=2) if measured else 500e-6 * rng.uniform(-1.0, 1.0, 2)
        drawn[line] = sd.Misalignment(
            1e-3 * rng.normal(size=2) if measured else laser,
            laser,
            rng.normal(size=2) if layout == "psd" and measured else (0.0, 0.0),
            rng.normal(),
            list(0.05 * rng.normal(size=3)) if layout == "multi_beam" and measured else [],
            lateral=rng.normal(size=2),
            roll=20e-3 * rng.normal() * measured,
            gain=0.01 * rng.normal() * measured,
        )
    return drawn


def simulated(
    scenario: sd.Scenario,
    *,
    seed: int,
    plan: sd.Plan | None = None,
    head: sd.Head | None = None,
    chain: str = CHAIN,
    noise: float = 1.0,
    machine: int | None = None,
) -> sd.Measurement:
    """A run of a random machine, of the seed `machine` or the same one. `plan`, `head`, `chain`: what was really
    measured with; the points then have the positions of the scenario's plan all the same, and the lines its names."""
    known = scenario.known
    real, stated = plan or known.plan, [*known.plan.lines, *known.plan.scale_lines]
    lines = [*real.lines, *real.scale_lines]
    drawn = list(set_ups(known.head.layout, stated, seed=seed).values())
    run = sd.simulate(
        sd.Machine(
            chain, sd.random_error_map(real.volume, seed=seed if machine is None else machine, intervals=real.steps)
        ),
        real,
        head or known.head,
        misalignment=dict(zip(lines, drawn, strict=True)),
        noise=sd.Noise(seed=seed, **{name: noise * value for name, value in NOISE.items()}),
    )
    names = dict(zip(lines, stated, strict=True))
    position = [known.plan.points(names[line])[point] for line, point in zip(run.line, run.point, strict=True)]
    return sd.Measurement(
        [names[line] for line in run.line], run.point.tolist(), np.array(position), dict(run.channels)
    )


def rows_of(run: sd.Measurement, line: str | None) -> np.ndarray:
    return np.array([row for row, name in enumerate(run.line) if line in (None, name)])


def changed(run: sd.Measurement, fields: Mapping[str, np.ndarray]) -> sd.Measurement:
    return sd.Measurement(run.line, run.point.tolist(), run.position, {**run.channels, **fields}, run=run.run.tolist())


def moved(run: sd.Measurement, source: np.ndarray) -> sd.Measurement:
    """Each row has the readings of another one; -1: lost."""
    return changed(run, {n: np.where(source >= 0, v[source], np.nan) for n, v in run.channels.items()})
