"""A scenario: one TOML file that says which machine, plan and head a run is made with.

docs/scenario.md lists every key. An evaluator may ask a scenario for `chain`, `tool`, `plan`, `heads`, `signals`,
`uncertainty`, and what stands in [adjustment] and [smoothness]; the truth behind a simulated run (`machine()`,
`actual_heads()`, `misalignment`, `noise`, `environment`) is not touched, and need not exist.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import models_of, show
from stepdiag.config.scenario_keys import TABLES_BY_NAME, PlanSection, RandomSection, ScenarioKeys
from stepdiag.config.toml_text import check_keys, located, parse_toml
from stepdiag.io.whole_files import check_input, read_text
from stepdiag.scenario.adjustment import plausible_limits, setup_priors, smoothness_of
from stepdiag.scenario.heads import DescribedHead, actual_heads, heads_by_line, nominal_heads, of_run, signals_of
from stepdiag.scenario.planned_readings import only
from stepdiag.scenario.setup import environments, misalignments, noise_of, weights
from stepdiag.scenario.uncertain_inputs import uncertain_inputs
from stepdiag.units import MICROMETRE, MICRORADIAN


@dataclass(frozen=True, eq=False)
class Scenario:
    """What a scenario file says, checked and in native units (mm, rad, nm). Make one with `read_scenario`."""

    path: Path
    keys: ScenarioKeys
    chain: _core.Chain
    tool: tuple[float, float, float]
    plan: _core.Plan
    described_heads: Mapping[str, DescribedHead]
    heads: Mapping[str, _core.Head]
    signals: tuple[str, ...]
    misalignment: Mapping[str, _core.Misalignment]
    noise: _core.Noise
    environment: _core.Environment | None
    assumed_environment: _core.Environment | None
    uncertainty: _core.ReadingUncertainty
    setup: _core.SetupPriors
    setup_by_line: Mapping[str, _core.SetupPriors]
    smoothness: _core.Smoothness | None
    plausible: _core.PlausibleLimits
    uncertain: _core.UncertainInputs

    @property
    def head(self) -> _core.Head:
        """The head of the first line; those of the others have the same readings."""
        return next(iter(self.heads.values()))

    @property
    def error_map(self) -> Path | None:
        """The file of the error map that [machine] names."""
        errors = self.keys.machine.errors
        return None if errors is None else self.path.parent / errors

    def machine(self) -> _core.Machine:
        """The machine to simulate: reads the error map, or makes the random one."""
        return _core.Machine(self.chain, self._errors(), self.tool)

    def actual_heads(self) -> Mapping[str, _core.Head]:
        """The heads to simulate with, by line; `heads` are the same without the pose errors of their components."""
        return actual_heads(self.described_heads, self.path)

    def _errors(self) -> _core.ErrorMap:
        path, random = self.error_map, self.keys.machine.random
        if path is not None:
            with located(f"{self.path}: machine.errors"):
                check_input(path)
                return _core.read_error_map(path)
        if random is not None:
            with located(f"{self.path}: machine.random"):
                return _random_errors(self.keys, random)
        return _core.ErrorMap()


def simulate_scenario(scenario: Scenario) -> _core.Measurement:
    """The run that a scenario describes."""
    machine, heads = scenario.machine(), scenario.actual_heads()
    with located(str(scenario.path)):
        run = _core.simulate(
            machine,
            scenario.plan,
            of_run(heads),
            simulation_options(scenario),
        )
    return only(run, scenario.signals)


def evaluate_scenario(
    scenario: Scenario,
    measurement: _core.Measurement,
    *,
    method: Literal["conventional", "enhanced", "adjustment"] = "adjustment",
    full_covariance: bool = False,
) -> _core.Calibration:
    """Evaluates a run of a scenario's plan, and sees nothing of its truth."""
    if method == "adjustment":
        return adjust_scenario(scenario, measurement, full_covariance=full_covariance).calibration
    return _core.evaluate(
        only(measurement, scenario.signals),
        scenario.plan,
        of_run(scenario.heads),
        scenario.chain,
        scenario.tool,
        method=method,
        uncertainty=scenario.uncertainty,
        full_covariance=full_covariance,
        plausible=scenario.plausible,
    )


def adjust_scenario(
    scenario: Scenario, measurement: _core.Measurement, *, full_covariance: bool = False
) -> _core.Adjustment:
    """The exact adjustment of a run, with the unknowns that the scenario's [adjustment] and [smoothness] name: the
    calibration, and with it the set-up that was found, residuals, outliers and how well it all fits."""
    return _core.adjust(
        only(measurement, scenario.signals),
        scenario.plan,
        of_run(scenario.heads),
        scenario.chain,
        scenario.tool,
        adjustment_options(scenario, full_covariance=full_covariance),
    )


def simulation_options(scenario: Scenario) -> _core.SimulationOptions:
    """How the scenario's run is simulated."""
    plan = scenario.keys.plan
    return _core.SimulationOptions(
        misalignment=dict(scenario.misalignment),
        noise=scenario.noise,
        environment=scenario.environment,
        assumed_environment=scenario.assumed_environment,
        verified_share=scenario.keys.head.verified_share,
        repeats=runs_of(plan),
        backward=plan.backward,
        seconds_per_reading=plan.seconds_per_reading,
    )


def adjustment_options(scenario: Scenario, *, full_covariance: bool = False) -> _core.AdjustmentOptions:
    """What an adjustment of the scenario's runs takes for known and unknown."""
    keys = scenario.keys.adjustment
    return _core.AdjustmentOptions(
        uncertainty=scenario.uncertainty,
        setup=scenario.setup,
        setup_by_line=dict(scenario.setup_by_line),
        one_setup_per_line=keys.one_setup_per_line,
        reversal=keys.reversal,
        rotations=keys.angles == "free",
        smoothness=scenario.smoothness,
        outlier_probability=keys.outlier_probability,
        full_covariance=full_covariance,
        plausible=scenario.plausible,
    )


def read_scenario(path: str | PathLike[str]) -> Scenario:
    """Reads and checks a scenario file. Raises InvalidArgument naming the file and the line or key."""
    return parse_scenario(read_text(Path(path)), path)


def parse_scenario(text: str, path: str | PathLike[str] = "scenario.toml") -> Scenario:
    """A scenario from its text. `path` names it in messages; paths in it are relative to its folder."""
    return scenario_of(parse_toml(text, str(path)), path)


def scenario_of(content: Mapping[str, Any], path: str | PathLike[str] = "scenario.toml") -> Scenario:
    """A scenario from the tables of its file."""
    file = str(path)
    if not content:
        raise InvalidArgument(f"{file}: has no sections; expected [volume], [machine], [plan] and [head]")
    content = {name: _by_name(name, section, file) for name, section in content.items()}
    return build_scenario(check_keys(content, ScenarioKeys, file), Path(path))


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


def build_scenario(keys: ScenarioKeys, path: Path) -> Scenario:
    """Makes the core's types, whose own checks get file and section put in front."""
    machine, plan_keys = keys.machine, keys.plan
    if machine.errors is not None and machine.random is not None:
        raise InvalidArgument(f"{path}: machine: expected errors or [machine.random], got both")
    if machine.errors is not None and "\0" in machine.errors:
        raise InvalidArgument(f"{path}: machine.errors: expected the path of a file, got {show(machine.errors)}")
    with located(f"{path}: machine.chain"):
        chain = _core.Chain(machine.chain)
    with located(f"{path}: plan"):
        plan = _core.Plan(
            (keys.volume.x_mm, keys.volume.y_mm, keys.volume.z_mm),
            list(plan_keys.lines),
            plan_keys.steps,
            order=_orders(plan_keys),
            scale_lines=list(plan_keys.scale_lines),
        )
    described = heads_by_line(keys, plan, path)
    heads = nominal_heads(described, path)
    environment, assumed = environments(keys.environment, path)
    with located(str(path)):
        uncertainty = weights(keys)
    signals = signals_of(keys, next(iter(heads.values())), path)
    setup, setup_by_line = setup_priors(keys, next(iter(heads.values())).layout, path)
    return Scenario(
        path=path,
        keys=keys,
        chain=chain,
        tool=machine.tool_mm,
        plan=plan,
        described_heads=MappingProxyType(described),
        heads=MappingProxyType(heads),
        signals=tuple(signals),
        misalignment=MappingProxyType(misalignments(keys, heads, path)),
        noise=noise_of(keys.noise),
        environment=environment,
        assumed_environment=assumed,
        uncertainty=uncertainty,
        setup=setup,
        setup_by_line=MappingProxyType(setup_by_line),
        smoothness=smoothness_of(keys.smoothness, path),
        plausible=plausible_limits(keys.plausible),
        uncertain=uncertain_inputs(keys, described, heads, path),
    )


def _orders(keys: PlanSection) -> list[str]:
    """By run: a backward run goes the way of the forward run before it."""
    orders = [keys.order] if isinstance(keys.order, str) else keys.order
    return [order for order in orders for _ in range(2 if keys.backward and len(orders) > 1 else 1)]


def runs_of(keys: PlanSection) -> int:
    """How often each line is measured, backward runs not counted."""
    return keys.repeats * (1 if isinstance(keys.order, str) else len(keys.order))


def _random_errors(keys: ScenarioKeys, random: RandomSection) -> _core.ErrorMap:
    return _core.random_error_map(
        (keys.volume.x_mm, keys.volume.y_mm, keys.volume.z_mm),
        seed=random.seed,
        translation=random.translation_um * MICROMETRE,
        rotation=random.rotation_urad * MICRORADIAN,
        squareness=random.squareness_urad * MICRORADIAN,
        intervals=random.intervals or max(2, keys.plan.steps),
        screw_pitch=random.screw_pitch_mm,
        screw_amplitude=random.screw_amplitude_um * MICROMETRE,
    )
