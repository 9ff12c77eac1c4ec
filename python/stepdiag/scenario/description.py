"""A scenario: one TOML file that says which machine, plan and head a run is made with.

docs/scenario.md lists every key. What an evaluation may know, and the truth behind a simulated run, are two types: what
evaluates takes a scenario's known half, and has no way from there to the other.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.calibration.evaluations import evaluate, in_words
from stepdiag.config.key_errors import models_of, suggest
from stepdiag.config.key_types import narrowed
from stepdiag.config.scenario_keys import SECTIONS_BY_LINE, TABLES_BY_NAME, KnownKeys, ScenarioKeys, TruthKeys
from stepdiag.config.toml_text import check_keys, located, parse_toml
from stepdiag.display import Displayed, Facts
from stepdiag.findings.meaning import FITS, MEANING
from stepdiag.findings.reasons import mistake_reason
from stepdiag.io.refused_files import explained
from stepdiag.io.whole_files import read_text
from stepdiag.memory import check_memory, for_evaluation
from stepdiag.parameters import FUNCTIONS, SQUARENESSES
from stepdiag.scenario.budget import budget_text, positioning_budget
from stepdiag.scenario.condition_text import condition_rows
from stepdiag.scenario.conditions import conditions_of
from stepdiag.scenario.heads import describe_heads, make_heads, of_run
from stepdiag.scenario.instrument import index_uncertainty, times
from stepdiag.scenario.known import Known, known_of, runs_of
from stepdiag.scenario.planned_readings import only, with_channels
from stepdiag.scenario.plausible_inputs import implausible_air, implausible_columns, limits_of
from stepdiag.scenario.setup import counted_with
from stepdiag.scenario.temperature import scales_of
from stepdiag.scenario.truth import Truth, errors_of, truth_of
from stepdiag.wrong_arguments import checked


@dataclass(frozen=True, eq=False, repr=False)
class Scenario(Displayed):
    """What a scenario file says. Make one with `read_scenario`. A file that says nothing of errors, misalignments,
    noise and air has the truth of a perfect machine."""

    known: Known
    truth: Truth

    @property
    def path(self) -> Path:
        return self.known.path

    def _facts(self) -> Facts:
        return [*self.known._facts(), *self.truth._facts()]

    def machine(self) -> _core.Machine:
        """The machine to simulate: reads the error map, or makes the random one."""
        return _core.Machine(self.known.chain, errors_of(self.truth, self.known), self.known.tool)

    def actual_heads(self) -> Mapping[str, _core.Head]:
        """The heads to simulate with, by line; those that are known are without the pose errors of their components."""
        return make_heads(self.known.described_heads, self.truth.pose_errors, self.path)


def simulate_scenario(scenario: Scenario, errors: _core.ErrorMap | None = None) -> _core.Measurement:
    """The run that a scenario describes; with `errors`, that of a machine with these."""
    known, heads = scenario.known, scenario.actual_heads()
    machine = scenario.machine() if errors is None else _core.Machine(known.chain, errors, known.tool)
    with located(str(scenario.path)):
        run = _core.simulate(
            machine,
            known.plan,
            of_run(heads),
            simulation_options(scenario),
        )
    return only(times(_with_air(run, scenario), 1.0 + known.instrument.scale), known.signals)


def air_of(scenario: Scenario) -> dict[str, float]:
    """The true air by channel, where the instrument counts with a constant index; else empty."""
    assumed = scenario.known.assumed_air
    if assumed is None:
        return {}
    state = (scenario.truth.environment or assumed).state
    if state is None:
        raise InvalidArgument(
            f'{scenario.path}: environment.readings: "constant_index" goes with a state of the air, got an index'
        )
    quantities = {"temperature": "temperature", "pressure": "pressure", "humidity": "relative_humidity"}
    return {f"air_{name}": state[quantity] for name, quantity in quantities.items()}


def _with_air(run: _core.Measurement, scenario: Scenario) -> _core.Measurement:
    """The run with the columns of the air that an instrument with a constant index needs."""
    channels = {name: np.full(len(run), value) for name, value in air_of(scenario).items()}
    if not channels:
        return run
    return with_channels(run, channels)


def reduced_run(known: Known, measurement: _core.Measurement) -> _core.Measurement:
    """A run as evaluations take it: with the channels that the scenario's head has, distances corrected by the scale of
    the instrument, and in the air of the run where the instrument counted with a constant index. Raises InvalidArgument
    for temperatures, air and times that no workshop has."""
    implausible_inputs(known, measurement)
    return _reduced(known, measurement)


def implausible_inputs(scenario: Scenario | Known, measurement: _core.Measurement) -> list[str]:
    """What scenario and run say that no workshop has, a sentence each: such a fit is at best doubtful. Raises
    InvalidArgument for what is beyond the outer limits of [plausible.inputs]."""
    known = scenario.known
    return [*known.implausible, *implausible_columns(limits_of(known.keys), measurement)]


def implausible_truth(truth: Truth, known: Known) -> Iterator[str]:
    """The same of the air that a run is simulated in."""
    if truth.environment is not None:
        yield from implausible_air(limits_of(known.keys), "environment", truth.environment)


def _reduced(known: Known, measurement: _core.Measurement) -> _core.Measurement:
    run = times(only(measurement, known.signals), 1.0 / (1.0 + known.instrument.scale))
    if known.assumed_air is None:
        return run
    with located(f"{known.path}: environment.readings"):
        return _core.in_recorded_air(run, known.plan, of_run(known.heads), known.assumed_air)


@checked
def evaluate_scenario(
    scenario: Scenario | Known,
    measurement: _core.Measurement,
    *,
    method: Literal["conventional", "enhanced", "adjustment"] = "adjustment",
    full_covariance: bool = False,
) -> _core.Calibration:
    """Evaluates a run of a scenario's plan, by what is known."""
    known = scenario.known
    if method == "adjustment":
        adjustment = adjust_scenario(known, measurement, full_covariance=full_covariance)
        return adjustment.calibration.with_between_nodes(known.between_nodes)
    implausible = implausible_inputs(known, measurement)
    found = _evaluated(known, measurement, method, full_covariance)
    return _judged(found, found.fit or "unchecked", [], implausible)


def _evaluated(
    known: Known, measurement: _core.Measurement, method: Literal["conventional", "enhanced"], full_covariance: bool
) -> _core.Calibration:
    _check_memory(known, measurement, full_covariance)
    found = evaluate(
        _reduced(known, measurement),
        known.plan,
        of_run(known.heads),
        known.chain,
        known.tool,
        method=method,
        uncertainty=known.uncertainty,
        full_covariance=full_covariance,
        plausible=known.plausible,
        expansion=known.expansion,
    )
    return found.with_between_nodes(known.between_nodes).with_conditions(*_words(found, known, measurement))


def _words(calibration: _core.Calibration, known: Known, measurement: _core.Measurement) -> tuple[list[str], str]:
    """The conditions of an evaluation, and the budget of its largest positioning uncertainty."""
    conditions = list(condition_rows(conditions_of(known, measurement), known))
    return conditions, budget_text(positioning_budget(calibration, known))


def _judged(
    calibration: _core.Calibration, fit: str, reasons: list[tuple[str, str]], implausible: list[str]
) -> _core.Calibration:
    """With this verdict, at best doubtful where there are implausible inputs. `reasons`: code and sentence."""
    if implausible:
        fit = max(fit, "doubtful", key=FITS.index)
        reasons = reasons + [("implausible_input", sentence) for sentence in implausible]
    return calibration.judged(fit, [text for _, text in reasons], [code for code, _ in reasons])


@dataclass(frozen=True)
class JudgedEvaluation:
    """An evaluation by a linear method beside the adjustment of the same readings, which sees set-up and rotations that
    the method leaves out.

    `calibration` carries the worse of both verdicts; `own` is the method's test of its contradictions. Where the
    readings cannot be adjusted, `adjustment` is None, and `refusal` says why."""

    calibration: _core.Calibration
    own: str
    adjustment: _core.Adjustment | None
    refusal: str = ""

    def with_mistake(self, mistake: str) -> "JudgedEvaluation":
        """The same, rejected because this mistake would explain the readings."""
        found = self.calibration
        return replace(
            self,
            calibration=found.judged(
                "rejected", [mistake_reason(mistake), *found.fit_reasons], ["mistake", *found.fit_codes]
            ),
            adjustment=self.adjustment and with_mistake(self.adjustment, mistake),
        )


def evaluate_beside_adjustment(
    scenario: Scenario | Known,
    measurement: _core.Measurement,
    *,
    method: Literal["conventional", "enhanced"],
    full_covariance: bool = False,
    search_faults: bool = True,
) -> JudgedEvaluation:
    """Evaluates a run by a linear method, and adjusts it for its verdict. `search_faults`: as of adjust_scenario."""
    known = scenario.known
    implausible = implausible_inputs(known, measurement)
    calibration = _evaluated(known, measurement, method, full_covariance)
    own = calibration.fit or "unchecked"
    adjustment, refusal = None, ""
    try:
        adjustment = _adjusted(known, measurement, search_faults=search_faults)
    except InvalidArgument as error:
        refusal = str(error)
    other = adjustment.verdict.fit if adjustment is not None else "unchecked"
    reasons = [] if own == "accepted" else [("method_by_itself", f"the method {method} by itself: {MEANING[own]}")]
    if refusal:
        reasons.append(("not_adjustable", f"adjustment of the same readings: {' '.join(refusal.split())}"))
    if adjustment is not None:
        found = adjustment.calibration
        reasons += [
            (code, f"adjustment of the same readings: {reason}")
            for code, reason in zip(found.fit_codes, found.fit_reasons, strict=True)
        ]
    return JudgedEvaluation(
        _judged(calibration, max(own, other, key=FITS.index), reasons, implausible), own, adjustment, refusal
    )


def with_mistake(adjustment: _core.Adjustment, mistake: str) -> _core.Adjustment:
    """The same, rejected because this mistake would explain the readings."""
    return in_words(_core.judge(adjustment, mistake=mistake))


@checked
def adjust_scenario(
    scenario: Scenario | Known,
    measurement: _core.Measurement,
    *,
    full_covariance: bool = False,
    reliability: bool = False,
    search_faults: bool = True,
) -> _core.Adjustment:
    """The exact adjustment of a run, with the unknowns that the scenario's [adjustment] and [smoothness] name: the
    calibration, and with it the set-up that was found, residuals, faults and how well it all fits. `reliability`:
    also which faults the readings control. `search_faults` False: it is known already what is wrong with the run as a
    whole; no faults of single readings are looked for."""
    known = scenario.known
    implausible = implausible_inputs(known, measurement)
    adjustment = _adjusted(
        known,
        measurement,
        full_covariance=full_covariance,
        reliability=reliability,
        search_faults=search_faults,
    )
    return in_words(_core.judge(adjustment, implausible_inputs=implausible)) if implausible else adjustment


def _adjusted(known: Known, measurement: _core.Measurement, **choices: bool) -> _core.Adjustment:
    found = in_words(adjusted_numbers(known, measurement, **choices))
    return found.with_calibration(found.calibration.with_conditions(*_words(found.calibration, known, measurement)))


def adjusted_numbers(
    known: Known,
    measurement: _core.Measurement,
    *,
    full_covariance: bool = False,
    reliability: bool = False,
    search_faults: bool = True,
) -> _core.Adjustment:
    """As `adjust_scenario`, without sentences and without a look at what no workshop has: for many runs that nobody has
    measured."""
    _check_memory(known, measurement, full_covariance)
    return _core.adjust(
        _reduced(known, measurement),
        known.plan,
        of_run(known.heads),
        known.chain,
        known.tool,
        adjustment_options(
            known,
            measurement,
            full_covariance=full_covariance,
            reliability=reliability,
            search_faults=search_faults,
        ),
    )


def _check_memory(known: Known, measurement: _core.Measurement, full_covariance: bool) -> None:
    values = len(FUNCTIONS) * (known.plan.steps + 1) * (2 if known.keys.plan.backward else 1) + len(SQUARENESSES)
    check_memory(
        for_evaluation(len(measurement), values, full_covariance),
        f"the evaluation of {len(measurement)} readings"
        + (f" with the covariance of {values} values" if full_covariance else ""),
        "leave the covariance out (`no_covariance`)" if full_covariance else "evaluate fewer of its runs at a time",
    )


def simulation_options(
    scenario: Scenario, turned: Mapping[str, _core.Misalignment] = MappingProxyType({})
) -> _core.SimulationOptions:
    """How the scenario's run is simulated; `turned`: lines that are misaligned otherwise."""
    known, truth = scenario.known, scenario.truth
    keys = known.keys
    return _core.SimulationOptions(
        misalignment={**truth.misalignment, **turned},
        noise=truth.noise,
        environment=truth.environment or known.assumed_air,
        assumed_environment=truth.assumed_environment if known.assumed_air is None else known.assumed_air,
        verified_share=keys.head.verified_share,
        repeats=runs_of(keys.plan),
        backward=keys.plan.backward,
        seconds_per_reading=keys.plan.seconds_per_reading,
        scales=truth.scales or (None if known.expansion is None else scales_of(known.expansion)),
        machine_drift=truth.machine_drift,
    )


def adjustment_options(
    known: Known,
    measurement: _core.Measurement | None = None,
    *,
    full_covariance: bool = False,
    of_samples: bool = False,
    reliability: bool = False,
    search_faults: bool = True,
) -> _core.AdjustmentOptions:
    """What an adjustment of the scenario's runs takes for known and unknown. `measurement`: the run, for the mean of
    its air; without one the uncertainty of the index is that in air of 20 °C. `of_samples`: of many simulated runs,
    whose noise is what is stated: none of their readings is left out, no uncertainty is scaled."""
    keys = known.keys.adjustment
    return _core.AdjustmentOptions(
        uncertainty=known.uncertainty,
        setup=known.setup,
        setup_by_line=dict(known.setup_by_line),
        one_setup_per_line=keys.one_setup_per_line,
        reversal=keys.reversal,
        rotations=keys.angles == "free",
        smoothness=known.smoothness,
        outlier_probability=0.0 if of_samples else keys.outlier_probability,
        slips=keys.slips,
        scale_uncertainty=keys.scale_uncertainty and not of_samples,
        full_covariance=full_covariance,
        plausible=known.plausible,
        expansion=known.expansion,
        machine_drift=known.machine_drift,
        reliability=reliability,
        search_faults=search_faults,
        distance_scale_uncertainty=known.instrument.scale_uncertainty or 0.0,
        air_index_uncertainty=index_uncertainty(
            known.instrument, measurement, known.assumed_air, known.head.wavelength
        ),
        variance_components=not of_samples,
    )


@checked
def read_scenario(path: str | PathLike[str]) -> Scenario:
    """Reads and checks a scenario file. Raises InvalidArgument naming the file and the line or key."""
    with explained(Path(path), "scenario"):
        return parse_scenario(read_text(Path(path)), path)


@checked
def parse_scenario(text: str, path: str | PathLike[str] = "scenario.toml") -> Scenario:
    """A scenario from its text. `path` names it in messages; paths in it are relative to its folder."""
    return scenario_of(parse_toml(text, str(path)), path)


def scenario_of(content: Mapping[str, Any], path: str | PathLike[str] = "scenario.toml") -> Scenario:
    """A scenario from the tables of its file."""
    file = str(path)
    if not content:
        raise InvalidArgument(f"{file}: has no sections; expected [volume], [machine], [plan] and [head]")
    content = {name: _by_name(name, section, file) for name, section in content.items()}
    return _build(check_keys(content, ScenarioKeys, file), Path(path))


def _by_name(name: str, section: Any, file: str) -> Any:
    """Puts tables of the user's own names, [misalignment.ppp] or [head.left], under a name of their own."""
    place = TABLES_BY_NAME.get(name)
    if place is None or not isinstance(section, dict):
        return section
    if place in section:
        raise InvalidArgument(f"{file}: {name}.{place}: unknown key")
    (model,) = models_of(ScenarioKeys.model_fields[name].annotation)
    named = {key: value for key, value in section.items() if key not in model.model_fields and _is_table(value)}
    return {key: value for key, value in section.items() if key not in named} | {place: named}


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) and "distribution" not in value  # which is the value of a misspelt key


def _build(keys: ScenarioKeys, path: Path) -> Scenario:
    described, pose_errors = describe_heads(keys.head, path)
    known = known_of(narrowed(keys, KnownKeys), described, path, counted_with(keys.environment, path))
    lines = list(known.heads)
    for section in SECTIONS_BY_LINE:
        for line in getattr(keys, section).by_line:
            if line not in lines:
                raise InvalidArgument(f"{path}: {section}.{line}: not a line of the plan; {suggest(line, lines)}")
    truth = truth_of(narrowed(keys, TruthKeys), pose_errors, known)
    with located(str(path)):
        list(implausible_truth(truth, known))
    return Scenario(known, truth)
