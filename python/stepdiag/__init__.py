"""Calibration of three-axis machine tools by the laser step-diagonal method.

    import stepdiag as sd

    scenario = sd.read_scenario("scenario.toml")
    run = sd.read_measurement("run.csv")  # or sd.simulate(scenario)
    calibration = sd.evaluate(scenario, run)
    print(calibration.fit, calibration.EXX.value)
    sd.export(calibration, "table.csv", to="linuxcnc-kins")

Lengths are in mm, angles in rad, wavelengths in nm. Invalid arguments and files raise InvalidArgument, a ValueError.
What specialists need is in modules of its own: `sd.methods`, `sd.optics`, `sd.montecarlo`, `sd.live`, `sd.positions`;
`sd.results` has the classes of what functions return.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from stepdiag._core import (
    Adjustment,
    Calibration,
    Chain,
    CheckPoints,
    Compensator,
    Environment,
    ErrorMap,
    Expansion,
    Head,
    InvalidArgument,
    Machine,
    MachineDrift,
    Measurement,
    Misalignment,
    Noise,
    Plan,
    ScaleTemperatures,
    SimulationOptions,
    __version__,
    random_error_map,
    read_error_map,
)
from stepdiag._core import word_wrong_arguments_with as _word_wrong_arguments_with
from stepdiag.figures.methods import attach as _attach_figures
from stepdiag.findings.refusals import attach as _attach_refusals
from stepdiag.io.displays import attach as _attach_displays
from stepdiag.io.methods import attach as _attach_files
from stepdiag.wrong_arguments import wrong_arguments as _wrong_arguments

if TYPE_CHECKING:
    from stepdiag import live, methods, montecarlo, optics, positions, results
    from stepdiag.calibration.comparison import compare
    from stepdiag.calibration.largest_by_kind import largest_deviations, largest_uncertainties
    from stepdiag.calibration.volume import errors_at, volume
    from stepdiag.calibration.volume_change import volume_change
    from stepdiag.evaluation.judge import evaluate, judge
    from stepdiag.exporting.options import ExportOptions
    from stepdiag.exporting.write import export
    from stepdiag.io.data_files import read_calibration, read_measurement
    from stepdiag.mistakes.search import find_mistakes
    from stepdiag.parameters import in_report_units, kind_of
    from stepdiag.planning.observation import observe
    from stepdiag.planning.plan import plan
    from stepdiag.presentation.page.document import report
    from stepdiag.rechecking.recheck import recheck
    from stepdiag.rechecking.verification import verify
    from stepdiag.scenario.description import Scenario, parse_scenario, read_scenario
    from stepdiag.scenario.simulation import simulate

__all__ = [
    "Adjustment",
    "Calibration",
    "Chain",
    "CheckPoints",
    "Compensator",
    "Environment",
    "ErrorMap",
    "Expansion",
    "ExportOptions",
    "Head",
    "InvalidArgument",
    "Machine",
    "MachineDrift",
    "Measurement",
    "Misalignment",
    "Noise",
    "Plan",
    "ScaleTemperatures",
    "Scenario",
    "SimulationOptions",
    "__version__",
    "compare",
    "errors_at",
    "evaluate",
    "export",
    "find_mistakes",
    "in_report_units",
    "judge",
    "kind_of",
    "largest_deviations",
    "largest_uncertainties",
    "live",
    "methods",
    "montecarlo",
    "observe",
    "optics",
    "parse_scenario",
    "plan",
    "positions",
    "random_error_map",
    "read_calibration",
    "read_error_map",
    "read_measurement",
    "read_scenario",
    "recheck",
    "report",
    "results",
    "simulate",
    "verify",
    "volume",
    "volume_change",
]

# Imported on first use, because pydantic, xarray and others are slow. By module, as above.
_LATER = {
    "calibration.comparison": ("compare",),
    "calibration.largest_by_kind": (
        "largest_deviations",
        "largest_uncertainties",
    ),
    "calibration.volume": (
        "errors_at",
        "volume",
    ),
    "calibration.volume_change": ("volume_change",),
    "evaluation.judge": (
        "evaluate",
        "judge",
    ),
    "exporting.options": ("ExportOptions",),
    "exporting.write": ("export",),
    "io.data_files": (
        "read_calibration",
        "read_measurement",
    ),
    "mistakes.search": ("find_mistakes",),
    "presentation.page.document": ("report",),
    "parameters": (
        "in_report_units",
        "kind_of",
    ),
    "planning.plan": ("plan",),
    "planning.observation": ("observe",),
    "rechecking.recheck": ("recheck",),
    "rechecking.verification": ("verify",),
    "scenario.description": (
        "Scenario",
        "parse_scenario",
        "read_scenario",
    ),
    "scenario.simulation": ("simulate",),
}
_MODULE_OF = {name: module for module, names in _LATER.items() for name in names}
_MODULES = ("live", "methods", "montecarlo", "optics", "positions", "results")


_attach_files()
_attach_displays()
_attach_figures()
_attach_refusals()
_word_wrong_arguments_with(_wrong_arguments)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"stepdiag.{name}")
    if name in _MODULE_OF:
        return getattr(import_module(f"stepdiag.{_MODULE_OF[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
