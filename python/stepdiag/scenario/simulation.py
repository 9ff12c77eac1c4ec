"""A simulated run, of a scenario or of values."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, overload

from stepdiag import _core
from stepdiag._core import ErrorMap, Head, Machine, Measurement, Plan, SimulationOptions

if TYPE_CHECKING:
    from stepdiag.scenario.description import Scenario


@overload
def simulate(scenario: "Scenario", /, *, errors: ErrorMap | None = None) -> Measurement: ...


@overload
def simulate(
    machine: Machine,
    plan: Plan,
    head: Head | Mapping[str, Head],
    options: SimulationOptions | None = None,
    **more: Any,
) -> Measurement: ...


def simulate(machine: Any, plan: Any = None, head: Any = None, options: Any = None, **more: Any) -> Measurement:
    """Simulate a run: of a scenario, `simulate(scenario)`, or of values, `simulate(machine, plan, head)`.

    Lines of the plan come first, then its scale lines. Points of a visit are approached in the direction of its own
    travel. Readings whose beam misses the mirror or does not come back are lost (NaN). Same arguments, same bits.

    Args:
        machine: the machine, or a Scenario instead of all other arguments; with it `errors` replaces those of its
            machine.
        plan: lines, steps and scale lines.
        head: one, or a mapping with one for each line.
        options: SimulationOptions, or its fields by name: misalignment, noise, environment, repeats, ...

    Raises:
        InvalidArgument: an argument is not valid.
        RuntimeError: a replay of a traced head and its trace differ.
    """
    if isinstance(machine, Machine):
        return _core.simulate(machine, plan, head, options, **more)
    from stepdiag.scenario.description import Scenario, simulate_scenario

    if not isinstance(machine, Scenario):
        raise TypeError(f"simulate(): expected a Scenario or a Machine, got {type(machine).__name__}")
    if plan is not None or head is not None or options is not None:
        raise TypeError("simulate(): a Scenario has its plan, head and options; expected no others")
    return simulate_scenario(machine, **more)
