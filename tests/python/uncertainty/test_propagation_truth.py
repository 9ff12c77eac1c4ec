"""Propagation against differences of whole calibrations simulated a second time, and covariances built by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pytest
import reference
from uncertain_cases import all_inputs, all_noise, calibrations_of, channel_names, scenario_of, table_of
from virtual_runs import head_of, measured, plan_of
from virtual_samples import Air, Sample

import stepdiag as sd
from stepdiag import _core

AIR = Air()
WEIGHTS = sd.methods.ReadingUncertainty()


# Large effects of the reading model miss the rest by many standard uncertainties: what a drift shares with scales would
# then depend on where the derivatives are taken.
KNOWN_DRIFT: Final = {"setup": sd.methods.SetupPriors(drift="fixed")}


class Differences:
    """Derivatives of an evaluation by whatever is put into its readings."""

    def __init__(self, scenario: reference.Scenario, table: reference.ErrorTable, method: str) -> None:
        self.scenario, self.table, self.method = scenario, table, method
        self.channels = channel_names(scenario)
        self.rows = Sample(scenario, table, _core.UncertainInputs(), [], air=AIR).rows()
        self.nominal = table_of(self.rows, self.channels)

    def evaluated(self, readings: np.ndarray) -> np.ndarray:
        rows = [
            row | dict(zip(self.channels, values, strict=True)) for row, values in zip(self.rows, readings, strict=True)
        ]
        s = self.scenario
        told = (measured(rows), plan_of(s), head_of(s), sd.Chain(s.chain), s.tool)
        if self.method == "adjustment":
            calibration = sd.methods.adjust(
                *told, outlier_probability=0.0, variance_components=False, full_covariance=True, **KNOWN_DRIFT
            ).calibration
        else:
            calibration = sd.methods.evaluate(*told, method=self.method, full_covariance=True)
        functions, squareness = calibration.functions, calibration.squareness
        self.labels = [(name, np.nan if at is None else at) for name, at in calibration.covariance_labels]
        self.covariance = calibration.covariance
        found = []
        for name, at in calibration.covariance_labels:
            if at is None:
                found.append(squareness[name][0])
            else:
                found.append(functions[name][1][int(np.argmin(np.abs(functions[name][0] - at)))])
        return np.array(found)

    def by_input(self, one: Any, size: float) -> tuple[np.ndarray, np.ndarray]:
        """(f(+) - f(-))/2 and (f(+) + f(-) - 2 f(0))/2."""
        inputs = _core.UncertainInputs([one])
        plus, minus = (
            self.evaluated(table_of(Sample(self.scenario, self.table, inputs, [v], air=AIR).rows(), self.channels))
            for v in (size, -size)
        )
        return (plus - minus) / 2, (plus + minus) / 2 - self.evaluated(self.nominal)

    def gain(self) -> np.ndarray:
        """(outputs, rows, channels)"""
        found = np.empty((len(self.evaluated(self.nominal)), *self.nominal.shape))
        for row, channel in np.ndindex(*self.nominal.shape):
            size = {"alpha": 1e-6, "beta": 1e-6, "spot_x": 1e-3, "spot_y": 1e-3}.get(self.channels[channel], 1e-4)
            changed = np.zeros_like(self.nominal)
            changed[row, channel] = size
            found[:, row, channel] = (
                self.evaluated(self.nominal + changed) - self.evaluated(self.nominal - changed)
            ) / (2 * size)
        return found

    def by_pose(self, kind: str, component: int) -> np.ndarray:
        """d reading / d movement of the tool at that reading, (rows, channels)."""
        size = 1e-3 if kind == "moved" else 1e-6

        found = []
        for sign in (1.0, -1.0):
            sample = Moved(self.scenario, self.table, _core.UncertainInputs(), [], air=AIR)
            sample.kind, sample.step = kind, sign * size * np.eye(3)[component]
            found.append(table_of(sample.rows(), self.channels))
        return (found[0] - found[1]) / (2 * size)


class Moved(Sample):
    """The tool stands beside its place at every reading."""

    kind: str
    step: np.ndarray

    def _read(self, row: int, line: str, *at: Any) -> dict[str, Any]:
        *where, moved, turned = at
        if self.kind == "moved":
            return super()._read(row, line, *where, moved + self.step, turned)
        return super()._read(row, line, *where, moved, self.step)


def shared_walk(first: np.ndarray, seconds: float) -> np.ndarray:
    """Covariance of a walk that starts from 0 at the rows `first`: min(i, j) steps in common."""
    n = len(first)
    i = np.arange(n)
    common = np.minimum(i[:, None], i[None, :]) - first[:, None]
    return np.where(first[:, None] == first[None, :], common, 0) * seconds


def as_stated(one: Any) -> float:
    """A t distribution counts with its scale (GUM 4.2.3), others with their standard deviation."""
    d = one.distribution
    return float(d.spread if d.kind == "t" else d.standard_uncertainty)


def centred(entries: list[Any]) -> list[Any]:
    """The same without expectations: differences are taken at the nominal run."""
    found = []
    for one in entries:
        d = one.distribution
        extra = {"edge": d.edge} if d.edge else {}
        if np.isfinite(d.degrees_of_freedom):
            extra["degrees_of_freedom"] = d.degrees_of_freedom
        fresh = _core.Distribution(d.kind, spread=d.spread, **extra)
        if isinstance(one, _core.UncertainInput):
            found.append(
                _core.UncertainInput(one.quantity, fresh, line=one.line, part=one.part, component=one.component)
            )
        else:
            found.append(_core.ReadingNoise(one.quantity, fresh, channel=one.channel, component=one.component))
    return found


def small(layout: str, seed: int) -> tuple[reference.Scenario, reference.ErrorTable]:
    scenario, table = scenario_of(layout, seed)
    return replace(scenario, steps=2, lines=["ppp", "npp", "nnp", "pnp"]), table


def order_of(calibrations: Any, labels: list[tuple[str, float]]) -> list[int]:
    """Where an entry of the evaluation stands among the outputs."""
    outputs = [(o.name, o.position) for o in calibrations.outputs]
    found = []
    for name, at in labels:
        at_place = [i for i, (n, p) in enumerate(outputs) if n == name and (np.isnan(at) or abs(p - at) < 1e-9)]
        assert len(at_place) == 1, (name, at)
        found += at_place
    return found


@pytest.mark.slow
@pytest.mark.parametrize("method", ["enhanced", "adjustment"])
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_inputs_act_as_differences_of_whole_calibrations_say(layout: str, method: str) -> None:
    scenario, table = small(layout, 21)
    left_out: tuple[str, ...] = ()
    if method == "enhanced":  # of what it does not know its nominal weights make something else than its own
        scenario = replace(scenario, misalignment={})
        left_out = ("psd_zero", "beam_constants")
    every = [one for one in all_inputs(scenario, angles=1e-4) if one.line in ("", "ppp", "00p")]
    inputs = centred([one for one in every if one.quantity not in left_out])
    told = KNOWN_DRIFT if method == "adjustment" else {}
    calibrations = calibrations_of(scenario, table, _core.UncertainInputs(inputs), method=method, air=AIR, **told)
    propagation = _core.propagate(calibrations, covariance=True)
    differences = Differences(scenario, table, method)
    differences.evaluated(differences.nominal)
    u = np.sqrt(np.diag(differences.covariance))  # of the readings' noise: what is below matters to nobody
    order = order_of(calibrations, differences.labels)
    assert list(propagation.inputs) == [one.name for one in inputs]
    total = np.zeros((len(u), len(u)))
    for i, one in enumerate(inputs):
        first, second = differences.by_input(one, as_stated(one))
        # A part of an uncertainty of 0.1 um and 1 urad; of large effects a part of themselves.
        close = 2e-3 * (u + np.abs(first)) + 1e-12
        assert np.all(np.abs(np.asarray(propagation.first_order)[order, i] - first) <= close), one.name
        assert np.all(np.abs(np.asarray(propagation.second_order)[order, i] - second) <= close), one.name
        total += np.outer(first, first)
    found = np.asarray(propagation.covariance)[np.ix_(order, order)]
    scale = np.sqrt(np.diag(total)) + u + 1e-12
    assert np.max(np.abs(found - total) / np.outer(scale, scale)) <= 3e-3


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_noise_has_the_covariance_built_by_hand(layout: str) -> None:
    scenario, table = small(layout, 22)
    differences = Differences(scenario, table, "enhanced")
    channels = differences.channels
    noise = centred(all_noise(channels))
    calibrations = calibrations_of(scenario, table, _core.UncertainInputs([], noise), air=AIR)
    propagation = _core.propagate(calibrations, covariance=True)
    gain = differences.gain()
    order = order_of(calibrations, differences.labels)
    distances = np.array([name[0] == "d" for name in channels])
    count = len(differences.rows)
    starts = [i for i, row in enumerate(differences.rows) if i == 0 or row["line"] != differences.rows[i - 1]["line"]]
    first = np.array([max(s for s in starts if s <= i) for i in range(count)])
    seconds = scenario.seconds_per_reading or 0.0
    total = np.zeros((len(gain), len(gain)))
    for one in noise:
        variance = as_stated(one) ** 2
        if one.quantity == "channel":
            effect = gain[:, :, channels.index(one.channel)]
            total += variance * effect @ effect.T
        elif one.quantity == "common":
            effect = gain[:, :, distances].sum(axis=2)
            total += variance * effect @ effect.T
        elif one.quantity == "head_walk":
            effect = gain[:, :, distances].sum(axis=2)
            total += variance * effect @ shared_walk(first, seconds) @ effect.T
        else:
            kind = "turned" if one.quantity == "orientation" else "moved"
            effect = np.einsum("orc,rc->or", gain, differences.by_pose(kind, one.component))
            walk = one.quantity == "machine_walk"
            in_common = shared_walk(np.zeros(count, dtype=int), seconds) if walk else np.eye(count)
            total += variance * effect @ in_common @ effect.T
    found = np.asarray(propagation.covariance)[np.ix_(order, order)]
    u = np.sqrt(np.maximum(np.diag(total), 0.0))
    moves = u > 1e-6 * np.max(u)
    assert np.allclose(np.asarray(propagation.standard_uncertainty)[order][moves], u[moves], rtol=1e-4)
    assert np.max(np.abs(found - total)[np.ix_(moves, moves)] / np.outer(u[moves], u[moves])) <= 1e-3
