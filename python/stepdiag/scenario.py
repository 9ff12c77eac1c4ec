"""A scenario: one TOML file that says which machine, plan and head a run is made with.

docs/scenario.md lists every key. An evaluator may ask a scenario for `chain`, `tool`, `plan`, `head` and
`uncertainty` only; the truth behind a simulated run (`machine()`, `misalignment`, `noise`) is not touched, and
need not exist.
"""

import math
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from pydantic import ValidationError

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.files import check_input, read_text
from stepdiag.scenario_errors import explain, show, suggest
from stepdiag.scenario_keys import BY_LINE, SECTIONS_BY_LINE, HeadSection, RandomSection, ScenarioKeys

MICROMETRE = 1e-3  # mm
MICRORADIAN = 1e-6  # rad


@dataclass(frozen=True, eq=False)
class Scenario:
    """What a scenario file says, checked and in native units (mm, rad, nm). Make one with `read_scenario`."""

    path: Path
    keys: ScenarioKeys
    chain: _core.Chain
    tool: tuple[float, float, float]
    plan: _core.Plan
    head: _core.Head
    misalignment: Mapping[str, _core.Misalignment]
    noise: _core.Noise
    refractive_index: float
    uncertainty: _core.ReadingUncertainty

    @property
    def error_map(self) -> Path | None:
        """The file of the error map that [machine] names."""
        errors = self.keys.machine.errors
        return None if errors is None else self.path.parent / errors

    def machine(self) -> _core.Machine:
        """The machine to simulate: reads the error map, or makes the random one."""
        return _core.Machine(self.chain, self._errors(), self.tool)

    def _errors(self) -> _core.ErrorMap:
        path, random = self.error_map, self.keys.machine.random
        if path is not None:
            with _located(f"{self.path}: machine.errors"):
                check_input(path)
                return _core.read_error_map(path)
        if random is not None:
            with _located(f"{self.path}: machine.random"):
                return _random_errors(self.keys, random)
        return _core.ErrorMap()


def simulate_scenario(scenario: Scenario) -> _core.Measurement:
    """The run that a scenario describes."""
    machine = scenario.machine()
    with _located(str(scenario.path)):
        return _core.simulate(
            machine,
            scenario.plan,
            scenario.head,
            misalignment=dict(scenario.misalignment),
            noise=scenario.noise,
            environment=_core.Environment(scenario.refractive_index),
        )


def evaluate_scenario(
    scenario: Scenario,
    measurement: _core.Measurement,
    *,
    method: Literal["conventional", "enhanced"] = "enhanced",
    full_covariance: bool = False,
) -> _core.Calibration:
    """Evaluates a run of a scenario's plan, and sees nothing of its truth."""
    return _core.evaluate(
        measurement,
        scenario.plan,
        scenario.head,
        scenario.chain,
        scenario.tool,
        method=method,
        uncertainty=scenario.uncertainty,
        full_covariance=full_covariance,
    )


def read_scenario(path: str | PathLike[str]) -> Scenario:
    """Reads and checks a scenario file. Raises InvalidArgument naming the file and the line or key."""
    return parse_scenario(read_text(Path(path)), path)


def parse_scenario(text: str, path: str | PathLike[str] = "scenario.toml") -> Scenario:
    """A scenario from its text. `path` names it in messages; paths in it are relative to its folder."""
    file = str(path)
    content = _parse_toml(text, file)
    if not content:
        raise InvalidArgument(f"{file}: has no sections; expected [volume], [machine], [plan] and [head]")
    content = {name: _by_line(name, section, file) for name, section in content.items()}
    try:
        keys = ScenarioKeys.model_validate(_tuples(content))
    except ValidationError as error:
        raise explain(error, content, file) from None
    return _build(keys, Path(path))


def _parse_toml(text: str, file: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InvalidArgument(f"{file}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        raise InvalidArgument(f"{file}: not valid TOML: {message[:1].lower()}{message[1:]}") from None
    except ValueError:  # Python reads integers of up to 4300 digits
        raise InvalidArgument(f"{file}: not valid TOML: a number has too many digits") from None


def _by_line(name: str, section: Any, file: str) -> Any:
    """Puts the tables for single lines, [misalignment.ppp], under a name of their own."""
    if name not in SECTIONS_BY_LINE or not isinstance(section, dict):
        return section
    if BY_LINE in section:
        raise InvalidArgument(f"{file}: {name}.{BY_LINE}: unknown key")
    by_line = {key: value for key, value in section.items() if isinstance(value, dict)}
    return {key: value for key, value in section.items() if key not in by_line} | {BY_LINE: by_line}


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


def _build(keys: ScenarioKeys, path: Path) -> Scenario:
    """Makes the core's types, whose own checks get file and section put in front."""
    machine, plan_keys, noise = keys.machine, keys.plan, keys.noise
    if machine.errors is not None and machine.random is not None:
        raise InvalidArgument(f"{path}: machine: expected errors or [machine.random], got both")
    if machine.errors is not None and "\0" in machine.errors:
        raise InvalidArgument(f"{path}: machine.errors: expected the path of a file, got {show(machine.errors)}")
    with _located(f"{path}: machine.chain"):
        chain = _core.Chain(machine.chain)
    with _located(f"{path}: plan"):
        plan = _core.Plan(
            (keys.volume.x_mm, keys.volume.y_mm, keys.volume.z_mm),
            list(plan_keys.lines),
            plan_keys.steps,
            order=plan_keys.order,
            scale_lines=list(plan_keys.scale_lines),
        )
    return Scenario(
        path=path,
        keys=keys,
        chain=chain,
        tool=machine.tool_mm,
        plan=plan,
        head=_head(keys.head, plan, path),
        misalignment=MappingProxyType(_misalignment(keys, path)),
        noise=_core.Noise(
            distance=noise.distance_um * MICROMETRE,
            tilt=noise.tilt_urad * MICRORADIAN,
            spot=noise.spot_um * MICROMETRE,
            seed=noise.seed,
        ),
        refractive_index=keys.environment.refractive_index,
        uncertainty=_uncertainty(keys),
    )


def _head(keys: HeadSection, plan: _core.Plan, path: Path) -> _core.Head:
    if keys.layout == "psd" and keys.psd_distance_mm is None:
        raise InvalidArgument(f'{path}: head.psd_distance_mm: missing; the layout "psd" needs it')
    if keys.layout == "multi_beam" and keys.beam_offsets_mm is None:
        raise InvalidArgument(f'{path}: head.beam_offsets_mm: missing; the layout "multi_beam" needs it')
    with _located(f"{path}: plan"):  # it may find the steps too small
        smallest = plan.smallest_mirror()
    if keys.mirror_mm is not None and (keys.mirror_mm[0] < smallest[0] or keys.mirror_mm[1] < smallest[1]):
        least = [math.ceil(10.0 * edge) / 10.0 for edge in smallest]  # so that what is named will do
        raise InvalidArgument(
            f"{path}: head.mirror_mm: too small for this plan: expected at least {least}, got {show(keys.mirror_mm)}"
        )
    with _located(f"{path}: head"):
        return _core.Head(
            keys.layout,
            standoff=keys.standoff_mm,
            psd_distance=keys.psd_distance_mm or 0.0,
            beam_offsets=list(keys.beam_offsets_mm or ()),
            wavelength=keys.wavelength_nm,
            aperture=keys.aperture_mm,
            mirror=keys.mirror_mm,
        )


def _misalignment(keys: ScenarioKeys, path: Path) -> dict[str, _core.Misalignment]:
    lines = [*keys.plan.lines, *keys.plan.scale_lines]
    for section in SECTIONS_BY_LINE:
        for line in getattr(keys, section).by_line:
            if line not in lines:
                raise InvalidArgument(f"{path}: {section}.{line}: not a line of the plan; {suggest(line, lines)}")
    shared = keys.misalignment.model_dump(exclude={BY_LINE})
    aligned = type(keys.misalignment)().model_dump(exclude={BY_LINE})
    result = {}
    for line in lines:
        own = keys.misalignment.by_line.get(line)
        if line in keys.plan.scale_lines and own is None:
            continue
        values = aligned if line in keys.plan.scale_lines else shared
        values = values | (own.model_dump(exclude_unset=True) if own is not None else {})
        result[line] = _core.Misalignment(
            reflector=_scaled(values["reflector_urad"]),
            laser=_scaled(values["laser_urad"]),
            psd_zero=values["psd_zero_mm"],
        )
    return result


def _scaled(angles: tuple[float, float]) -> tuple[float, float]:
    return angles[0] * MICRORADIAN, angles[1] * MICRORADIAN


def _uncertainty(keys: ScenarioKeys) -> _core.ReadingUncertainty:
    """[uncertainty], else the positive deviations of [noise], else the core's defaults; key by key."""
    weights = {}
    for name, key, unit in (
        ("distance", "distance_um", MICROMETRE),
        ("tilt", "tilt_urad", MICRORADIAN),
        ("spot", "spot_um", MICROMETRE),
    ):
        # A standard deviation of 0 makes a perfect simulation; it is no statement about readings.
        value = getattr(keys.uncertainty, key) or getattr(keys.noise, key)
        if value > 0.0:
            weights[name] = value * unit
    return _core.ReadingUncertainty(**weights)


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


@contextmanager
def _located(place: str) -> Iterator[None]:
    """Puts `place` in front of what the core has to say about its arguments."""
    try:
        yield
    except InvalidArgument as error:
        raise InvalidArgument(f"{place}: {error}") from None
