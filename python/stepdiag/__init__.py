"""Calibration of three-axis machine tools by the laser step-diagonal method.

    import stepdiag as sd

    machine = sd.Machine("[w X' b Y Z t]", sd.random_error_map((800, 600, 500), seed=1))
    plan = sd.Plan((800, 600, 500), ["ppp", "npp", "pnp", "nnp"], 50, scale_lines=["p00", "0p0", "00p"])
    run = sd.simulate(machine, plan, sd.Head())
    calibration = sd.evaluate(run, plan, sd.Head(), machine.chain)

Units are native throughout: length mm, angle rad, wavelength nm.
Bad input raises InvalidArgument, a ValueError.
"""

from typing import TYPE_CHECKING, Any

from stepdiag._core import (
    BeamSpot,
    Calibration,
    Camera,
    Chain,
    ErrorMap,
    GaussianMode,
    Head,
    Interferometer,
    InvalidArgument,
    LateralEffect,
    Machine,
    Measurement,
    Misalignment,
    Noise,
    Plan,
    ReadingUncertainty,
    ReturnedBeam,
    __version__,
    beam_radius,
    couple,
    cramer_rao_bound,
    evaluate,
    expose,
    locate,
    power_inside,
    random_error_map,
    read_calibration,
    read_distance,
    read_error_map,
    read_measurement,
    simulate,
)
from stepdiag.comparison import Deviation, largest_deviations

if TYPE_CHECKING:
    from stepdiag.scenario import (
        Scenario,
        evaluate_scenario,
        parse_scenario,
        read_scenario,
        simulate_scenario,
    )

__all__ = [
    "BeamSpot",
    "Calibration",
    "Camera",
    "Chain",
    "Deviation",
    "ErrorMap",
    "GaussianMode",
    "Head",
    "Interferometer",
    "InvalidArgument",
    "LateralEffect",
    "Machine",
    "Measurement",
    "Misalignment",
    "Noise",
    "Plan",
    "ReadingUncertainty",
    "ReturnedBeam",
    "Scenario",
    "__version__",
    "beam_radius",
    "couple",
    "cramer_rao_bound",
    "evaluate",
    "evaluate_scenario",
    "expose",
    "largest_deviations",
    "locate",
    "parse_scenario",
    "power_inside",
    "random_error_map",
    "read_calibration",
    "read_distance",
    "read_error_map",
    "read_measurement",
    "read_scenario",
    "simulate",
    "simulate_scenario",
]

_IN_SCENARIO = {"Scenario", "evaluate_scenario", "parse_scenario", "read_scenario", "simulate_scenario"}


def __getattr__(name: str) -> Any:
    """Imports what has to do with scenario files on first use: it brings pydantic along."""
    if name in _IN_SCENARIO:
        from stepdiag import scenario

        return getattr(scenario, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
