"""Virtual calibrations of a scenario: its machine, its head with set-ups, and what `[uncertainty]` says of them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, Literal

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.toml_text import located
from stepdiag.scenario.description import Scenario, adjustment_options, simulation_options
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.uncertain_inputs import uncertain_air_key

Method = Literal["conventional", "enhanced", "adjustment", "one_step"]
METHODS: Final = ("adjustment", "enhanced", "conventional", "one_step")


def virtual_calibrations(
    scenario: Scenario, *, method: Method = "adjustment", seed: int = 0, derived: Sequence[Any] = ()
) -> _core.VirtualCalibrations:
    """The model that draws the scenario's uncertain inputs, traces the run and evaluates it, sample after sample.

    `derived`: quantities to be had of every calibration beside its parameters. Raises InvalidArgument where the
    scenario cannot be simulated, or not be evaluated by this method."""
    known = scenario.known
    if not known.keys.head.tilts:
        raise InvalidArgument(f"{scenario.path}: head.tilts: virtual calibrations have all readings of their head")
    environment, assumed = _air(scenario)
    truth = replace(scenario.truth, environment=environment, assumed_environment=assumed)
    machine, heads = scenario.machine(), scenario.actual_heads()
    with located(str(scenario.path)):
        return _core.VirtualCalibrations(
            machine,
            known.plan,
            of_run(heads),
            known.uncertain,
            calibration_heads=of_run(known.heads),
            method=method,
            seed=seed,
            derived=list(derived),
            simulation=simulation_options(replace(scenario, known=replace(known, assumed_air=None), truth=truth)),
            adjustment=adjustment_options(known, of_samples=True),
        )


def _air(scenario: Scenario) -> tuple[_core.Environment | None, _core.Environment | None]:
    """The true and the assumed air; that of 20 °C if the scenario has none and its state is uncertain."""
    truth = scenario.truth
    if scenario.known.assumed_air is not None:  # whose readings are reduced with what is recorded
        air = truth.environment or scenario.known.assumed_air
        return air, air
    if truth.environment is None and uncertain_air_key(scenario.known.keys) is not None:
        usual = _core.Environment.from_air()
        return usual, usual
    return truth.environment, truth.assumed_environment
