"""The virtual calibrations of a scenario as a plain value, from which any process makes the same model."""

from dataclasses import dataclass
from pathlib import Path

from stepdiag._core import SampleModel
from stepdiag.config.toml_text import parse_toml
from stepdiag.io.whole_files import read_text
from stepdiag.scenario.packed import PackedScenario, pack_scenario, unpacked
from stepdiag.uncertainty.run import UncertaintyRequest, model_for


@dataclass(frozen=True)
class PackedCalibrations:
    """A ModelSource. Make it with `pack_calibrations`."""

    packed: PackedScenario
    request: UncertaintyRequest

    def model(self) -> SampleModel:
        with unpacked(self.packed) as scenario:
            return model_for(scenario, self.request)[0]


def pack_calibrations(path: Path, request: UncertaintyRequest) -> PackedCalibrations:
    """Of the scenario in a file. Of the request only what the model depends on: the same model for any number of
    samples. Raises InvalidArgument for a file that cannot be read."""
    content = parse_toml(read_text(path), str(path))
    usual = UncertaintyRequest(method=request.method, seed=request.seed, points=tuple(request.points))
    return PackedCalibrations(pack_scenario(content, path), usual)
