"""The figure of files: their content decides what is drawn."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from stepdiag._core import Calibration, ErrorMap, InvalidArgument, read_error_map
from stepdiag.config.toml_text import located
from stepdiag.io.data_files import read_calibration, read_measurement
from stepdiag.io.file_kind import kind_of_file

KINDS = (
    "a calibration (with an error map as its truth), two calibrations, an error map, a measurement (with its "
    "scenario), a comparison, an uncertainty result, a scenario, or a table of observe"
)
# What is drawn, by the kinds of its files.
_COMBINATIONS = {
    ("calibration",): "calibration",
    ("calibration", "error map"): "calibration",
    ("calibration", "calibration"): "calibrations",
    ("error map",): "error map",
    ("measurement",): "measurement",
    ("TOML file", "measurement"): "measurement",
    ("comparison",): "comparison",
    ("uncertainty result",): "uncertainty",
    ("TOML file",): "observation",
    ("table of steps",): "growth",
}


def draw_files(files: Sequence[Path], *, volume: bool = False) -> tuple[Figure, dict[Path, Calibration]]:
    """Draw what files contain: the figure, and each calibration in it, by its file.

    The order counts for two calibrations alone: B - A. `volume`: the error in the volume of a
    calibration in place of its parameters. Raises InvalidArgument naming the file."""
    kinds = {file: kind_of_file(file) for file in files}
    found = sorted(str(kind) for kind in (kinds[file] for file in files))
    what = _COMBINATIONS.get(tuple(found))
    if what is None:
        listed = ", ".join(f"{file}: {kinds[file] or 'not recognised'}" for file in files)
        raise InvalidArgument(f"expected {KINDS}; got {listed}")
    if volume and what != "calibration":
        raise InvalidArgument(f"`volume`: expected a calibration, got {', '.join(map(str, files))}")
    of_kind = {kind: [file for file in files if kinds[file] == kind] for kind in found}
    name = ", ".join(file.name for file in files)
    if what == "calibration":
        maps = of_kind.get("error map", [])
        return _draw_calibration(of_kind["calibration"][0], maps[0] if maps else None, volume=volume)
    if what == "calibrations":
        return _draw_difference(files[0], files[1])
    if what == "measurement":
        scenarios = of_kind.get("TOML file", [])
        return _draw_measurement(of_kind["measurement"][0], scenarios[0] if scenarios else None)
    if what == "comparison":
        from stepdiag.figures.comparison import draw_comparison
        from stepdiag.io.comparison_read import read_comparison

        return draw_comparison(read_comparison(files[0]), name), {}
    if what == "uncertainty":
        from stepdiag.figures.uncertainty import draw_uncertainty, read_drawn_uncertainty

        return draw_uncertainty(read_drawn_uncertainty(files[0]), name), {}
    if what == "error map":
        from stepdiag.figures.error_map import draw_error_map

        errors = read_error_map(files[0])
        with located(str(files[0])):
            return draw_error_map(errors, name), {}
    if what == "growth":
        from stepdiag.figures.growth import draw_growth, read_steps

        table = read_steps(files[0])
        with located(str(files[0])):
            return draw_growth(table, name), {}
    return _draw_observation(files[0])


def _draw_calibration(file: Path, truth: Path | None, *, volume: bool) -> tuple[Figure, dict[Path, Calibration]]:
    calibration = read_calibration(file)
    if volume:
        if truth is not None:
            raise InvalidArgument("`volume`: expected a calibration alone, without an error map")
        from stepdiag.calibration.volume import volume as errors_in_volume
        from stepdiag.figures.volume import draw_volume

        with located(str(file)):
            return draw_volume(errors_in_volume(calibration, ranking=False), file.name), {file: calibration}
    from stepdiag.figures.calibration import draw_calibration

    errors: ErrorMap | None = None if truth is None else read_error_map(truth)
    return draw_calibration(calibration, errors, file.name), {file: calibration}


def _draw_difference(a: Path, b: Path) -> tuple[Figure, dict[Path, Calibration]]:
    from stepdiag.calibration.comparison import compare
    from stepdiag.figures.comparison import draw_comparison

    one, other = _both(a, b)
    with located(f"{a}, {b}"):
        comparison = compare(one, other)
    return draw_comparison(comparison, f"{a.name}, {b.name}"), {a: one, b: other}


def _both(a: Path, b: Path) -> tuple[Calibration, Calibration]:
    return read_calibration(a), read_calibration(b)


def _draw_measurement(file: Path, scenario: Path | None) -> tuple[Figure, dict[Path, Calibration]]:
    from stepdiag.figures.measurement import draw_measurement

    measurement = read_measurement(file)
    if scenario is None:
        with located(str(file)):
            return draw_measurement(measurement, name=file.name), {}
    from stepdiag.scenario.description import adjust_scenario, read_scenario

    known = read_scenario(scenario).known
    with located(str(file)):
        adjustment = adjust_scenario(known, measurement)
        return draw_measurement(measurement, adjustment, file.name), {file: adjustment.calibration}


def _draw_observation(file: Path) -> tuple[Figure, dict[Path, Calibration]]:
    from stepdiag.figures.uncertainty import draw_observation
    from stepdiag.planning.observation import USUAL_STEPS, observe, prospects
    from stepdiag.scenario.description import read_scenario

    known = read_scenario(file).known
    run, found = observe(known)
    table = prospects(known, [*USUAL_STEPS, known.plan.steps])
    return draw_observation(run, found, known, file.name, table), {}
