"""What a table of an adjustment says beside the calibration: residuals, set-up, faults and test values."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from stepdiag._core import Adjustment, Measurement
from stepdiag.io.adjustment_table import adjustment_table
from stepdiag.io.data_files import is_netcdf
from stepdiag.io.labelled_tables import channel_units
from stepdiag.io.netcdf import NetcdfFile, read_netcdf
from stepdiag.io.netcdf_read import CALIBRATION_FORMAT
from stepdiag.setup_quantities import SETUP_QUANTITIES

FloatArray = npt.NDArray[np.float64]
_ENDING = "_residual"


class ChannelFit(NamedTuple):
    """How the readings of a channel fit, (n,) along the rows of the run; native units (mm, rad)."""

    units: str
    residual: FloatArray  # read minus adjusted
    normalised: FloatArray  # by its own standard uncertainty
    used: npt.NDArray[np.bool_]


class SetupEntry(NamedTuple):
    """An unknown of a set-up; as `SetupEstimate`."""

    run: int
    line: str
    quantity: str
    component: int
    value: float | None
    standard_uncertainty: float
    prior: float


class FaultEntry(NamedTuple):
    """What may have been wrong with a reading; mm or rad, as its channel."""

    number: int  # of its class: the readings do not determine which of a class happened
    treatment: str
    kind: str
    run: int
    line: str
    point: int
    channel: str
    size: float
    standard_uncertainty: float


@dataclass(frozen=True, eq=False)
class FitDetails:
    """Residuals by channel with the line, run, point and direction of each row (n,), set-ups, faults, and the test of
    the whole fit."""

    line: list[str]
    run: list[int]
    point: list[int]
    channels: Mapping[str, ChannelFit]
    setup: list[SetupEntry]
    faults: list[FaultEntry]
    degrees_of_freedom: int
    variance_factor: float
    probability: float


def read_fit_details(path: Path) -> FitDetails | None:
    """Read what the file of a calibration says of its fit; None of a CSV file and of other methods.

    Raises InvalidArgument naming file and variable."""
    if not is_netcdf(path):
        return None
    file = read_netcdf(path)
    file.check_format(CALIBRATION_FORMAT)
    return _details(file) if "degrees_of_freedom" in file and "reading_line" in file else None


def details_of(adjustment: Adjustment, measurement: Measurement) -> FitDetails:
    """The same of an adjustment that was just made."""
    return _details(NetcdfFile(Path("adjustment"), adjustment_table(adjustment, measurement)))


def _details(file: NetcdfFile) -> FitDetails:
    along = ("reading",)
    channels = {}
    for variable in file.names:
        if (
            variable.endswith(_ENDING)
            and not variable.endswith(f"normalised{_ENDING}")
            and variable != f"outlier{_ENDING}"
        ):
            name = variable.removesuffix(_ENDING)
            channels[name] = ChannelFit(
                channel_units(name) or "1",
                file.numbers(variable, along, channel_units(name), missing=True),
                file.numbers(f"{name}_normalised_residual", along, "1", missing=True),
                np.asarray(file.integers(f"{name}_used", along), dtype=bool),
            )
    return FitDetails(
        line=file.texts("reading_line", along),
        run=file.integers("reading_run", along),
        point=file.integers("reading_point", along),
        channels=channels,
        setup=_setup(file) if "setup_value" in file else [],
        faults=_faults(file) if "fault_class" in file else [],
        degrees_of_freedom=int(file.numbers("degrees_of_freedom", (), None)),
        variance_factor=float(file.numbers("variance_factor", (), "1", missing=True)),
        probability=float(file.numbers("chi_square_probability", (), "1", missing=True)),
    )


def _setup(file: NetcdfFile) -> list[SetupEntry]:
    along = ("setup",)
    value = file.numbers("setup_value", along, None, missing=True).tolist()
    columns = (
        file.integers("setup_run", along),
        file.texts("setup_line", along),
        file.texts("setup_quantity", along),
        file.integers("setup_component", along),
        [None if np.isnan(one) else one for one in value],
        file.numbers("setup_u", along, None, missing=True).tolist(),
        file.numbers("setup_prior", along, None, infinite=True).tolist(),
    )
    found = [SetupEntry(*row) for row in zip(*columns, strict=True)]
    for entry in found:
        quantity = SETUP_QUANTITIES.get(entry.quantity)
        if quantity is None:
            raise file.fail("setup_quantity", f'expected one of {", ".join(SETUP_QUANTITIES)}, got "{entry.quantity}"')
        if entry.component < 0 or not (quantity.of_beams or entry.component < max(1, len(quantity.components))):
            raise file.fail("setup_component", f"expected a component of {entry.quantity}, got {entry.component}")
    return found


def _faults(file: NetcdfFile) -> list[FaultEntry]:
    along = ("fault",)
    columns = (
        file.integers("fault_class", along),
        file.texts("fault_treatment", along),
        file.texts("fault_kind", along),
        file.integers("fault_run", along),
        file.texts("fault_line", along),
        file.integers("fault_point", along),
        file.texts("fault_channel", along),
        file.numbers("fault_size", along, None).tolist(),
        file.numbers("fault_u", along, None, missing=True).tolist(),
    )
    return [FaultEntry(*row) for row in zip(*columns, strict=True)]
