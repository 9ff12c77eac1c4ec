"""A study: a TOML file that names a scenario, and keys of it with the values to try.

[study]
scenario = "scenario.toml"
samples = 10000

[grid]                              # all combinations
plan.steps = [10, 20, 50]
noise.tilt_urad = [0.5, 1.0, 2.0]

[together.volume]                   # first with first, second with second, ...
volume.x_mm = [400.0, 800.0]
volume.y_mm = [300.0, 600.0]
"""

import itertools
import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import show, suggest
from stepdiag.config.key_types import SEED, Format, Section, Seed, format_key, key
from stepdiag.config.toml_text import check_keys, located, parse_toml
from stepdiag.io.whole_files import read_text
from stepdiag.scenario.description import Scenario, scenario_of
from stepdiag.wrong_arguments import checked

Method = Literal["enhanced", "conventional", "adjustment", "one_step"]

MOST_CELLS: Final = 10_000
SECTIONS: Final = ("format", "study", "grid", "together")


class StudySection(Section):
    """Settings for every cell of the grid."""

    scenario: Annotated[str, Field(min_length=1)] = key(
        "the path of a scenario", "The scenario to vary, relative to this file.", example="scenario.toml"
    )
    methods: Annotated[tuple[Method, ...], Field(min_length=1)] = key(
        'a list of "adjustment", "enhanced", "conventional" and "one_step"',
        "Methods of evaluation; several methods make a dimension of the result.",
        ("adjustment",),
    )
    samples: Annotated[int, Field(ge=0, le=4_000_000_000)] = key(
        "a whole number from 0 to 4e9", "Virtual calibrations in each cell; 0: propagation alone.", 10_000
    )
    seed: Seed = key(SEED, "Seed of all random numbers, the same in every cell.", 0)
    digits: Annotated[int, Field(ge=1, le=3)] = key("1, 2 or 3", "Significant digits of standard uncertainties.", 2)
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = key(
        "a probability between 0 and 1", "Probability of coverage intervals and expanded uncertainties.", 0.95
    )


class StudyKeys(Section):
    format: Format = format_key()
    study: StudySection


@dataclass(frozen=True)
class Axis:
    """A dimension of the grid: keys that change together, and their values at each step."""

    name: str
    keys: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class Cell:
    """One place in the grid, and the tables of its scenario."""

    index: tuple[int, ...]  # along the axes, then that of the method
    method: Method
    name: str  # "plan.steps = 10, method = enhanced"
    content: Mapping[str, Any]


@dataclass(frozen=True)
class Study:
    """A study as read from its file.

    `shape`: steps of each axis of the grid, then the number of methods."""

    path: Path
    scenario: Path
    content: Mapping[str, Any]
    axes: tuple[Axis, ...]
    settings: StudySection

    @property
    def shape(self) -> tuple[int, ...]:
        return (*(len(axis.values) for axis in self.axes), len(self.settings.methods))

    def cells(self) -> Iterator[Cell]:
        """The cells of the whole grid, the last axis varying fastest."""
        for place in itertools.product(*(range(len(axis.values)) for axis in self.axes)):
            content = deepcopy(dict(self.content))
            said = []
            for axis, k in zip(self.axes, place, strict=True):
                for name, value in zip(axis.keys, axis.values[k], strict=True):
                    _put(content, name.split("."), value)
                    said.append(f"{name} = {show(value)}")
            for m, method in enumerate(self.settings.methods):
                yield Cell((*place, m), method, ", ".join([*said, f"method = {method}"]), content)


@checked
def read_study(path: str | PathLike[str]) -> Study:
    """Read a study and check the scenario of every cell.

    Raises InvalidArgument naming the file and the key."""
    file = Path(path)
    content = parse_toml(read_text(file), str(file))
    for name in content:
        if name not in SECTIONS:
            raise InvalidArgument(f"{file}: {name}: unknown section; {suggest(name, SECTIONS)}")
    own = {"study": {}} | {name: value for name, value in content.items() if name in StudyKeys.model_fields}
    settings = check_keys(own, StudyKeys, str(file)).study
    if len(set(settings.methods)) < len(settings.methods):
        raise InvalidArgument(f"{file}: study.methods: expected each method once, got {show(settings.methods)}")
    axes = tuple(_axes(content, file))
    scenario = file.parent / settings.scenario
    with located(f"{file}: study.scenario"):
        tables = parse_toml(read_text(scenario), str(scenario))
        scenario_of(tables, scenario)
    study = Study(file, scenario, tables, axes, settings)
    count = 1
    for length in study.shape:
        count *= length
    if count > MOST_CELLS:
        raise InvalidArgument(f"{file}: grid: expected at most {MOST_CELLS} cells, got {count}")
    for cell in study.cells():
        scenario_of_cell(study, cell)
    return study


def scenario_of_cell(study: Study, cell: Cell) -> Scenario:
    """The scenario of a cell. Raises InvalidArgument naming study, cell and error."""
    with located(f"{study.path}: {cell.name}"):
        return scenario_of(cell.content, study.scenario)


def _axes(content: Mapping[str, Any], file: Path) -> Iterator[Axis]:
    """Axes of [grid], then of [together.NAME]. Raises InvalidArgument."""
    taken: dict[str, str] = {}

    def values(table: Any, place: str) -> dict[str, list[Any]]:
        if not isinstance(table, dict):
            raise InvalidArgument(f"{file}: {place}: expected keys of the scenario with lists of values")
        found = dict(_flat(table))
        for name, several in found.items():
            if not isinstance(several, list) or not several:
                raise InvalidArgument(f"{file}: {place}.{name}: expected a list of values to try, got {show(several)}")
            if "." not in name:
                expected = "a key of the scenario with its section, such as plan.steps"
                raise InvalidArgument(f"{file}: {place}.{name}: expected {expected}")
            if name in taken:
                raise InvalidArgument(f"{file}: {place}.{name}: is also in {taken[name]}")
            taken[name] = place
        return found

    for name, several in values(content.get("grid", {}), "grid").items():
        yield Axis(name, (name,), tuple((value,) for value in several))
    together = content.get("together", {})
    if not isinstance(together, dict):
        raise InvalidArgument(f"{file}: together: expected tables [together.NAME], got {show(together)}")
    for group, table in together.items():
        found = values(table, f"together.{group}")
        lengths = {len(several) for several in found.values()}
        if len(lengths) != 1:
            said = ", ".join(f"{len(several)} of {name}" for name, several in found.items()) or "none"
            raise InvalidArgument(f"{file}: together.{group}: expected lists of one length, got {said}")
        if re.fullmatch(r"\w+", group) is None:
            raise InvalidArgument(f"{file}: together.{group}: expected a name of letters, digits and _")
        yield Axis(group, tuple(found), tuple(zip(*found.values(), strict=True)))


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Keys by dotted names.

    TOML reads plan.steps = [...] as a table, "plan.steps" = [...] as a name."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _put(content: dict[str, Any], names: list[str], value: Any) -> None:
    """Set a key, replacing values in its path: the check of the scenario reports these."""
    table = content
    for name in names[:-1]:
        if not isinstance(table.get(name), dict):
            table[name] = {}
        table = table[name]
    table[names[-1]] = value
