"""The truth of a simulated run: what is wrong with machine, head, set-up and air. No evaluation is given it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import show
from stepdiag.config.scenario_keys import TruthKeys
from stepdiag.config.toml_text import located
from stepdiag.display import Displayed, Facts
from stepdiag.findings.error_map import check_angles
from stepdiag.io.whole_files import check_input
from stepdiag.scenario.heads import PoseErrors
from stepdiag.scenario.known import Known
from stepdiag.scenario.setup import environments, misalignments, noise_of
from stepdiag.scenario.temperature import three, true_scales
from stepdiag.scenario.uncertain_inputs import uncertain_air_key
from stepdiag.units import MICROMETRE, MICRORADIAN, native


@dataclass(frozen=True, eq=False, repr=False)
class Truth(Displayed):
    """What a run is simulated with beside what is known, checked and in native units.

    Truth() is that of a perfect machine and a perfect set-up, read without noise. `error_map`: the file that [machine]
    names, read when the machine is simulated. `pose_errors`: by the place of a head's keys. `assumed_environment`: what
    the instrument takes the air for, with which it reduces its readings; the true air, where nothing else is said.
    `scales`: how warm they are; None where they do not expand. `machine_drift`: of the functional point, mm/s."""

    keys: TruthKeys = field(default_factory=TruthKeys)
    error_map: Path | None = None
    pose_errors: Mapping[str, PoseErrors] = field(default_factory=dict)
    misalignment: Mapping[str, _core.Misalignment] = field(default_factory=dict)
    noise: _core.Noise = field(default_factory=_core.Noise)
    environment: _core.Environment | None = None
    assumed_environment: _core.Environment | None = None
    scales: _core.ScaleTemperatures | None = None
    machine_drift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def _facts(self) -> Facts:
        random = self.keys.machine.random
        errors = "none" if random is None else f"random, seed {random.seed}"
        noise = {name: getattr(self.noise, name) for name in ("distance", "tilt", "spot", "common")}
        return [
            ("errors", errors if self.error_map is None else str(self.error_map)),
            ("noise (mm, rad)", ", ".join(f"{name} {size:g}" for name, size in noise.items() if size) or "none"),
            ("misaligned", ", ".join(self.misalignment) or "no line"),
            ("components out of place", str(sum(map(len, self.pose_errors.values())))),
            ("scales", "do not expand" if self.scales is None else "expand"),
            ("air", "not stated" if self.environment is None else "stated"),
        ]


def truth_of(keys: TruthKeys, pose_errors: Mapping[str, PoseErrors], known: Known) -> Truth:
    """Of a run of what is known. Raises InvalidArgument naming the key."""
    path, errors = known.path, keys.machine.errors
    if errors is not None and keys.machine.random is not None:
        raise InvalidArgument(f"{path}: machine: expected errors or [machine.random], got both")
    if errors is not None and "\0" in errors:
        raise InvalidArgument(f"{path}: machine.errors: expected the path of a file, got {show(errors)}")
    environment, assumed = environments(keys.environment, path)
    _check_air(keys, known)
    return Truth(
        keys=keys,
        error_map=None if errors is None else path.parent / errors,
        pose_errors=MappingProxyType(dict(pose_errors)),
        misalignment=MappingProxyType(misalignments(keys.misalignment, known.keys.plan, known.heads, path)),
        noise=noise_of(keys.noise),
        environment=environment,
        assumed_environment=assumed,
        machine_drift=_machine_drift(keys, known),
        scales=true_scales(known.expansion, keys.temperature, known.keys.plan.seconds_per_reading, path),
    )


def _machine_drift(keys: TruthKeys, known: Known) -> tuple[float, float, float]:
    if any(keys.machine.drift_um_per_h) and known.keys.plan.seconds_per_reading is None:
        raise InvalidArgument(f"{known.path}: machine.drift_um_per_h: expected plan.seconds_per_reading as well")
    return three(native("_um_per_h", keys.machine.drift_um_per_h))


def _check_air(keys: TruthKeys, known: Known) -> None:
    """Whether air whose state is uncertain has one."""
    uncertain = uncertain_air_key(known.keys) if "refractive_index" in keys.environment.model_fields_set else None
    if uncertain is not None:
        raise InvalidArgument(
            f"{known.path}: {uncertain}: goes with a state of the air; [environment] has a "
            "refractive_index, for which there is uncertainty.refractive_index_ppm"
        )


def errors_of(truth: Truth, known: Known) -> _core.ErrorMap:
    """The machine's: reads the error map, or makes the random one."""
    random = truth.keys.machine.random
    if truth.error_map is not None:
        with located(f"{known.path}: machine.errors"):
            check_input(truth.error_map)
            errors = _core.read_error_map(truth.error_map)
            check_angles(errors, str(truth.error_map))
            return errors
    if random is None:
        return _core.ErrorMap()
    with located(f"{known.path}: machine.random"):
        return _core.random_error_map(
            known.plan.volume,
            seed=random.seed,
            translation=random.translation_um * MICROMETRE,
            rotation=random.rotation_urad * MICRORADIAN,
            squareness=random.squareness_urad * MICRORADIAN,
            intervals=random.intervals or max(2, known.plan.steps),
            screw_pitch=random.screw_pitch_mm,
            screw_amplitude=random.screw_amplitude_um * MICROMETRE,
        )
