"""Uncertainty of a scenario's calibration: propagation, and if samples are asked for the Monte Carlo method."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.toml_text import located
from stepdiag.memory import check_memory, for_samples
from stepdiag.scenario.description import Scenario
from stepdiag.uncertainty.monte_carlo import Executor, run_monte_carlo
from stepdiag.uncertainty.result import UncertaintyResult, find_output
from stepdiag.uncertainty.virtual_calibrations import Method, virtual_calibrations
from stepdiag.wrong_arguments import checked

Vector = tuple[float, float, float]
Progress = Callable[[int, int], None]  # samples done, and how many there will be

LARGEST_JOINT: Final = 3
# Of an adaptive run without `samples`: of a model that never gets stable.
MOST_SAMPLES: Final = 10_000_000


@dataclass(frozen=True)
class UncertaintyRequest:
    """What is asked for. `points`: commanded positions, each with a tool offset of its own or None (mm)."""

    method: Method = "adjustment"
    samples: int | None = None
    adaptive: bool = False
    digits: int = 2
    coverage: float = 0.95
    seed: int = 0
    threads: int = 0
    covariance: bool = False
    keep: Sequence[str] = ()
    joint: Sequence[Sequence[str]] = ()
    compare: bool = False
    points: Sequence[tuple[Vector, Vector | None]] = ()
    volume: bool = False
    checkpoint: Path | None = None
    resume: bool = False

    @property
    def draws(self) -> bool:
        """Whether the Monte Carlo method is asked for."""
        return self.samples is not None or self.adaptive

    def check(self) -> None:
        """Raises InvalidArgument for wishes that do not go together."""
        if not 0.0 < self.coverage < 1.0:
            raise InvalidArgument(f"`coverage`: expected a probability between 0 and 1, got {self.coverage:g}")
        if self.samples is not None and self.samples < 1:
            raise InvalidArgument(
                f"`samples`: expected at least 1, or None for the propagation alone, got {self.samples}"
            )
        named = {
            "compare": self.compare,
            "covariance": self.covariance,
            "keep": bool(self.keep),
            "joint": bool(self.joint),
            "resume": self.resume,
        }
        for option, given in named.items():
            if given and not self.draws:
                raise InvalidArgument(f"`{option}`: goes with the Monte Carlo method: `samples` or `adaptive`")
        for names in self.joint:
            if not 1 <= len(names) <= LARGEST_JOINT or len(set(names)) < len(names):
                expected = f"one to {LARGEST_JOINT} different outputs"
                raise InvalidArgument(f"`joint`: expected {expected}, such as C0Y,B0Z, got {','.join(names)!r}")


def model_for(scenario: Scenario, request: UncertaintyRequest) -> tuple[_core.VirtualCalibrations, int]:
    """The errors at the points asked for stand behind the calibration's own values; and how many those are."""
    model = virtual_calibrations(scenario, method=request.method, seed=request.seed)
    derived = [d for point, tool in request.points for d in _core.derived_at_point(model.calibration, point, tool=tool)]
    entries = len(model.outputs)
    if derived:
        model = virtual_calibrations(scenario, method=request.method, seed=request.seed, derived=derived)
    return model, entries


@checked
def evaluate_uncertainty(
    scenario: Scenario, request: UncertaintyRequest, progress: Progress | None = None, executor: Executor | None = None
) -> UncertaintyResult:
    """Propagates, and draws if samples are asked for, by the executor where there is one. `progress(done, total)` is
    told of samples; what it raises ends the run, which then leaves its checkpoint. Raises InvalidArgument for what
    cannot be done."""
    request.check()
    model, entries = model_for(scenario, request)
    kept = [find_output(model.outputs, name, "keep") for name in request.keep]
    joint = [[find_output(model.outputs, name, "joint") for name in names] for names in request.joint]
    samples = 0 if not request.draws else MOST_SAMPLES if request.samples is None else request.samples
    if kept or request.covariance:
        check_memory(
            for_samples(len(model.outputs), len(kept), samples, request.covariance),
            f"{samples} samples of {len(model.outputs)} outputs with "
            f"{' and '.join(['`covariance`'] * request.covariance + ['`keep`'] * bool(kept))}",
            "keep fewer outputs, leave `covariance` out, or take fewer steps or samples",
        )
    with located(str(scenario.path)):
        propagation = _core.propagate(model, covariance=request.volume)
        volume = _volume(model.calibration, propagation, entries, request) if request.volume else None
    result = UncertaintyResult(
        known=scenario.known,
        method=request.method,
        seed=request.seed,
        outputs=model.outputs,
        entries=entries,
        coverage=request.coverage,
        digits=request.digits,
        propagation=propagation,
        volume=volume,
    )
    if not request.draws:
        return result
    options = _core.StatisticsOptions(
        coverage=request.coverage, digits=request.digits, covariance=request.covariance, kept=kept, joint=joint
    )
    found = run_monte_carlo(
        model,
        samples=MOST_SAMPLES if request.samples is None else request.samples,
        adaptive=request.adaptive,
        options=options,
        threads=request.threads,
        checkpoint=request.checkpoint,
        resume=request.resume,
        progress=progress,
        executor=executor,
    )
    return replace(result, monte_carlo=found, comparison=_core.compare(propagation, found) if request.compare else None)


def _volume(
    calibration: _core.Calibration, propagation: _core.Propagation, entries: int, request: UncertaintyRequest
) -> _core.VolumetricAccuracy:
    """Of the calibration with the covariance that was propagated to it."""
    covariance = propagation.covariance
    assert covariance is not None
    known = _core.with_covariance(calibration, covariance[:entries, :entries])
    return _core.volumetric_accuracy(known, coverage=request.coverage, seed=request.seed)
