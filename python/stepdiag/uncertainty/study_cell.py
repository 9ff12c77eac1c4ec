"""One cell of a study: its virtual calibrations and the figures kept of them."""

import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag._core import InvalidArgument, ReplayMismatch
from stepdiag.parameters import kind_of
from stepdiag.scenario.packed import PackedScenario, unpacked
from stepdiag.uncertainty.result import FloatArray, UncertaintyResult
from stepdiag.uncertainty.run import UncertaintyRequest, evaluate_uncertainty
from stepdiag.uncertainty.study_keys import Method

# Figures kept of each parameter and family: largest and median absolute value of each.
FIGURES: Final[Mapping[str, str]] = {
    "mean": "mean of the samples",
    "u": "standard uncertainty",
    "symmetric": "length of the probabilistically symmetric coverage interval",
    "shortest": "length of the shortest coverage interval",
    "propagated": "value without deviations",
    "propagated_u": "propagated standard uncertainty",
    "propagated_expanded": "propagated expanded uncertainty",
}
SUMMARIES: Final = ("largest", "median")


@dataclass(frozen=True)
class CellJob:
    """Everything that a cell's result depends on, besides the instruction set."""

    packed: PackedScenario
    method: Method
    samples: int
    seed: int
    digits: int
    coverage: float


@dataclass(frozen=True)
class CellResult:
    """The result of a cell.

    `figures`: parameter or family -> figure -> largest and median value (mm or rad). `failure`: why
    there are no figures, otherwise empty."""

    figures: Mapping[str, Mapping[str, tuple[float, float]]]
    samples: int
    lost: int
    instruction_set: str
    seconds: float
    failure: str = ""

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "CellResult":
        content = json.loads(text)
        figures = {
            name: {figure: (float(pair[0]), float(pair[1])) for figure, pair in of.items()}
            for name, of in content.pop("figures").items()
        }
        return cls(figures=figures, **content)


def compute_cell(job: CellJob, *, threads: int = 0) -> CellResult:
    """Compute a cell. Errors in its scenario, such as an unsuitable method, become `failure`."""
    start = time.monotonic()
    instruction_set = _core.instruction_set()
    try:
        with unpacked(job.packed) as scenario:
            wanted = UncertaintyRequest(
                method=job.method,
                samples=job.samples or None,
                digits=job.digits,
                coverage=job.coverage,
                seed=job.seed,
                threads=threads,
            )
            result = evaluate_uncertainty(scenario, wanted)
    except (InvalidArgument, ReplayMismatch) as error:
        return CellResult({}, 0, 0, instruction_set, time.monotonic() - start, str(error))
    found = result.monte_carlo
    return CellResult(
        figures=_figures(result),
        samples=0 if found is None else int(found.samples),
        lost=0 if found is None else int(found.lost),
        instruction_set=instruction_set,
        seconds=time.monotonic() - start,
    )


def _figures(result: UncertaintyResult) -> dict[str, dict[str, tuple[float, float]]]:
    """The figures of each parameter and each family."""
    values = _values(result)
    rows: dict[str, list[int]] = {}
    for k, output in enumerate(result.outputs[: result.entries]):
        rows.setdefault(output.name, []).append(k)
        rows.setdefault(kind_of(output.name), []).append(k)
    return {name: {figure: _summary(value[own]) for figure, value in values.items()} for name, own in rows.items()}


def _values(result: UncertaintyResult) -> dict[str, FloatArray]:
    values: dict[str, FloatArray] = {}
    found, other = result.monte_carlo, result.propagation
    if found is not None:
        values["mean"] = np.asarray(found.mean)
        values["u"] = np.asarray(found.standard_uncertainty)
        values["symmetric"] = np.diff(found.symmetric, axis=1)[:, 0]
        values["shortest"] = np.diff(found.shortest, axis=1)[:, 0]
    if other is not None:
        values["propagated"] = np.asarray(other.value)
        values["propagated_u"] = np.asarray(other.standard_uncertainty)
        values["propagated_expanded"] = np.asarray(other.expanded(result.coverage))
    return values


def _summary(values: FloatArray) -> tuple[float, float]:
    """Largest and median absolute value.

    Values that are 0 by definition (home, ends) count as well."""
    sizes = np.abs(values)
    return float(np.max(sizes)), float(np.median(sizes))
