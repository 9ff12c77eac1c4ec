"""netCDF files: the same bits back, understood by strangers, whole or not at all."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import netCDF4
import numpy as np
import pytest
import xarray as xr
from calibrations import PLAN, TOOL, VOLUME, calibrate, full_run, same_calibration, same_run, simulate
from usual import CHAIN, DIAGONALS

import stepdiag as sd
from stepdiag.findings.undetermined import combination_text
from stepdiag.io.data_files import write_calibration
from stepdiag.io.netcdf import read_netcdf


@pytest.fixture(scope="module")
def adjustment() -> tuple[sd.Adjustment, sd.Measurement]:
    """One with set-ups, residuals, reversal and covariance, and its run."""
    run = simulate(1, backward=True)
    return sd.methods.adjust(run, PLAN, sd.Head(), CHAIN, TOOL, full_covariance=True), run


# --- there and back --------------------------------------------------------------------------------------------------
def test_measurement_comes_back_with_the_same_bits(tmp_path: Path) -> None:
    run = full_run()
    run.write(tmp_path / "run.nc")
    assert same_run(sd.read_measurement(tmp_path / "run.nc"), run)


@pytest.mark.parametrize(
    "head",
    [
        sd.Head("psd", psd_distance=100.0),
        sd.Head("multi_beam", beam_offsets=[(0, 0), (20, 0), (0, 20), (20, 20)]),
    ],
    ids=lambda head: head.layout,
)
def test_measurement_of_every_layout_comes_back(tmp_path: Path, head: sd.Head) -> None:
    run = simulate(1, head=head)
    run.write(tmp_path / "run.nc")
    assert same_run(sd.read_measurement(tmp_path / "run.nc"), run)


CALIBRATIONS: dict[str, dict[str, Any]] = {
    "adjustment": {"method": "adjustment"},
    "enhanced": {"method": "enhanced", "full_covariance": True},
    "conventional": {"method": "conventional"},
    "without scales": {"method": "enhanced", "plan": sd.Plan(VOLUME, DIAGONALS, 5)},
}


@pytest.mark.parametrize("options", CALIBRATIONS.values(), ids=CALIBRATIONS)
def test_calibration_comes_back_with_the_same_bits(tmp_path: Path, options: dict[str, Any]) -> None:
    calibration = calibrate(1, **options)
    calibration.write(tmp_path / "calibration.nc")
    assert same_calibration(sd.read_calibration(tmp_path / "calibration.nc"), calibration)


def test_calibration_of_an_adjustment_comes_back_with_the_same_bits(
    adjustment: tuple[sd.Adjustment, sd.Measurement], tmp_path: Path
) -> None:
    result, run = adjustment
    assert result.calibration.reversal
    assert result.calibration.undetermined_reversal_constants
    result.write(tmp_path / "calibration.nc", measurement=run)
    assert same_calibration(sd.read_calibration(tmp_path / "calibration.nc"), result.calibration)


def test_odd_calibration_comes_back_with_the_same_bits(tmp_path: Path) -> None:
    """Nodes of their own for each function, uncertainties that are not known, a single node, nothing at all."""
    nan = np.nan
    odd = sd.Calibration(
        "by hand, 3 µm",
        "[w b X Y Z t]",
        VOLUME,
        TOOL,
        {
            "EXX": ([0.0, 40.0, 80.0], [0.0, -0.0, 1e-300], [nan, 1.0, nan]),
            "EYX": ([0.0, 80.0], [0.0, 1.0 / 3.0], [0.0, 1e-7]),
            "ECZ": ([25.0], [1e-6], [nan]),
        },
        {"B0Z": (-1e-5, nan)},
        undetermined_slopes=["EXX"],
        undetermined=["squareness C0Y: µ", "more"],
        reversal={
            "EXX": ([0.0, 80.0], [0.0, 1e-3], [nan, 1e-4]),
            "EYX": ([0.0, 40.0], [0.0, 1e-3], [0.0, 1e-4]),
            "EAZ": ([0.0, 40.0], [0.0, 1e-6], [0.0, 1e-7]),  # of a function that is not determined
        },
        reversal_negative_uncertainty={"EXX": [1e-4, nan]},
        undetermined_reversal_constants=["EXX"],
    )
    nothing = sd.Calibration("none", "[w b X Y Z t]", VOLUME, TOOL, {}, undetermined=["everything"])
    for calibration in (odd, nothing):
        calibration.write(tmp_path / "calibration.nc")
        assert same_calibration(sd.read_calibration(tmp_path / "calibration.nc"), calibration)


# --- strangers -------------------------------------------------------------------------------------------------------
def test_stranger_finds_units_and_a_meaning_for_every_variable(
    adjustment: tuple[sd.Adjustment, sd.Measurement], tmp_path: Path
) -> None:
    result, run = adjustment
    result.write(tmp_path / "calibration.nc", measurement=run)
    full_run().write(tmp_path / "run.nc")
    for file in ("calibration.nc", "run.nc"):
        with xr.open_dataset(tmp_path / file) as table:
            assert table.attrs["Conventions"] == "CF-1.11"
            for attribute in ("title", "source", "format", "date", "comment"):
                assert table.attrs[attribute]
            for name, variable in table.variables.items():
                assert variable.attrs["long_name"], name
                if variable.dtype.kind == "f":
                    assert "units" in variable.attrs or "units" in variable.attrs.get("comment", ""), name


def test_stranger_finds_the_machine_and_the_reference_of_straightness(tmp_path: Path) -> None:
    calibrate(1).write(tmp_path / "calibration.nc")
    with xr.open_dataset(tmp_path / "calibration.nc") as table:
        assert table.attrs["chain"] == CHAIN
        assert tuple(table.attrs["volume_mm"]) == VOLUME
        assert tuple(table.attrs["tool_mm"]) == TOOL
        assert "EYX + p ECX" in table.attrs["straightness_reference"]
        assert table["EYX_functional_point"].dims == ("x",)
        assert table["EYX"].attrs["units"] == table["EYX_functional_point_u"].attrs["units"] == "mm"
        assert table["ECX"].attrs["units"] == "rad"


def test_covariance_is_labelled(tmp_path: Path) -> None:
    calibration = calibrate(1, full_covariance=True)
    covariance = calibration.covariance
    assert covariance is not None
    calibration.write(tmp_path / "calibration.nc")
    with xr.open_dataset(tmp_path / "calibration.nc") as table:
        labels = list(zip(table["covariance_parameter"].values, table["covariance_position"].values, strict=True))
        i, j = labels.index(("EYX", 32.0)), labels.index(("ECX", 48.0))
        assert float(table["covariance"][i, j]) == covariance[i, j]
        assert float(table["covariance"][i, i]) == pytest.approx(float(table["EYX_u"].sel(x=32.0)) ** 2, rel=1e-12)


def test_all_of_an_adjustment_is_in_its_file(adjustment: tuple[sd.Adjustment, sd.Measurement], tmp_path: Path) -> None:
    result, run = adjustment
    result.write(tmp_path / "calibration.nc", measurement=run)
    with xr.open_dataset(tmp_path / "calibration.nc") as table:
        for channel, residual in result.residuals.items():
            np.testing.assert_array_equal(table[f"{channel}_residual"], residual)
            np.testing.assert_array_equal(table[f"{channel}_redundancy"], result.redundancy[channel])
            np.testing.assert_array_equal(table[f"{channel}_normalised_residual"], result.normalised_residuals[channel])
            np.testing.assert_array_equal(table[f"{channel}_used"] == 1, result.used[channel])
        assert table["reading_line"].values.tolist() == run.line
        assert table["reading_point"].values.tolist() == run.point.tolist()
        assert table["reading_direction"].values.tolist() == run.direction
        assert table.sizes["setup"] == len(result.setup)
        for i, unknown in enumerate(result.setup):
            row = table.isel(setup=i)
            assert (str(row["setup_line"].item()), str(row["setup_quantity"].item())) == (
                unknown.line,
                unknown.quantity,
            )
            assert float(row["setup_u"]) == unknown.standard_uncertainty
            assert float(row["setup_prior"]) == unknown.prior
            np.testing.assert_array_equal(row["setup_value"], np.nan if unknown.value is None else unknown.value)
        assert table.sizes.get("outlier", 0) == len(result.outliers)
        assert float(table["variance_factor"]) == result.variance_factor
        assert int(table["degrees_of_freedom"]) == result.degrees_of_freedom
        assert float(table["chi_square_probability"]) == result.chi_square_probability
        assert table.attrs["combinations"] == "\n".join(map(combination_text, result.combinations))


class WithOutliers:
    """An adjustment, but for its outliers."""

    def __init__(self, adjustment: sd.Adjustment, outliers: list[Any]) -> None:
        self.adjustment, self.outliers = adjustment, outliers

    def __getattr__(self, name: str) -> Any:
        return getattr(self.adjustment, name)


def test_outliers_are_in_the_file(adjustment: tuple[sd.Adjustment, sd.Measurement], tmp_path: Path) -> None:
    worst = SimpleNamespace(
        row=20, run=1, line="npp", point=4, channel="distance", residual=0.01, normalised=38.7, number=1
    )
    other = SimpleNamespace(
        row=3, run=0, line="ppp", point=3, channel="alpha", residual=-1e-4, normalised=-21.5, number=2
    )
    write_calibration(cast(Any, WithOutliers(adjustment[0], [worst, other])), tmp_path / "calibration.nc")
    with xr.open_dataset(tmp_path / "calibration.nc") as table:
        for name in ("row", "run", "line", "point", "channel", "residual", "number"):
            assert table[f"outlier_{name}"].values.tolist() == [getattr(worst, name), getattr(other, name)]
        assert table["outlier_normalised_residual"].values.tolist() == [38.7, -21.5]


def test_smoothness_in_force_is_named(tmp_path: Path) -> None:
    smooth = sd.methods.Smoothness(translation=1e-3, rotation=1e-5)
    result = sd.methods.adjust(simulate(1), PLAN, sd.Head(), CHAIN, TOOL, smoothness=smooth)
    result.write(tmp_path / "calibration.nc")
    with xr.open_dataset(tmp_path / "calibration.nc") as table:
        assert result.smoothness
        for name, deviation in result.smoothness.items():
            assert table[name].attrs["second_difference_deviation"] == deviation


def test_adjustment_in_csv_is_its_calibration(adjustment: tuple[sd.Adjustment, sd.Measurement], tmp_path: Path) -> None:
    adjustment[0].write(tmp_path / "calibration.csv")
    read = sd.read_calibration(tmp_path / "calibration.csv")
    assert read.functions.keys() == adjustment[0].calibration.functions.keys()


@pytest.mark.parametrize("form", ["NETCDF3_CLASSIC", "NETCDF3_64BIT", "NETCDF4_CLASSIC", "NETCDF4"])
def test_file_of_a_stranger_is_read(tmp_path: Path, form: Any) -> None:
    """Any netCDF format, own name of the dimension, no attributes but units, texts of fixed or of any length."""
    run = simulate(1)
    table = xr.Dataset(
        {
            "line": ("obs", np.array(run.line)),
            "point": ("obs", run.point.astype(np.int32)),
            **{axis: ("obs", run.position[:, i], {"units": "mm"}) for i, axis in enumerate("xyz")},
            "distance": ("obs", run.channels["distance"], {"units": "mm"}),
            "alpha": ("obs", run.channels["alpha"], {"units": "rad"}),
            "beta": ("obs", run.channels["beta"], {"units": "rad"}),
        }
    )
    table.to_netcdf(tmp_path / "run.nc", engine="netcdf4", format=form)
    assert same_run(sd.read_measurement(tmp_path / "run.nc"), run)


# --- whole or not at all ---------------------------------------------------------------------------------------------
def test_path_that_cannot_be_written_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "folder.nc").mkdir()
    (tmp_path / "file").write_text("kept")
    for path in ("no/such.nc", "folder.nc", "file/below.nc"):
        with pytest.raises(sd.InvalidArgument, match=path):
            calibrate(1).write(tmp_path / path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.nc"]


def test_write_that_fails_half_way_leaves_the_old_file(tmp_path: Path) -> None:
    """The disk is full: here, files may have 10,000 bytes at most."""
    simulate(1).write(tmp_path / "run.csv")
    (tmp_path / "run.nc").write_text("the old file")
    program = (
        "import resource, sys, stepdiag as sd, stepdiag.io.netcdf_write\n"
        "run = sd.read_measurement(sys.argv[1] + '.csv')\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (10000, 10000))\n"
        "try: run.write(sys.argv[1] + '.nc')\n"
        "except sd.InvalidArgument as refusal: print('refused', refusal)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "run")], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.stdout.startswith(f"refused {tmp_path / 'run.nc'}: cannot be written"), result.stderr
    assert (tmp_path / "run.nc").read_text() == "the old file"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.csv", "run.nc"]


def test_file_is_replaced_with_its_permissions_behind_its_link(tmp_path: Path) -> None:
    (tmp_path / "target.nc").write_text("the old file")
    (tmp_path / "target.nc").chmod(0o640)
    (tmp_path / "link.nc").symlink_to("target.nc")
    simulate(1).write(tmp_path / "link.nc")
    assert (tmp_path / "link.nc").is_symlink()
    assert (tmp_path / "target.nc").stat().st_mode & 0o777 == 0o640
    assert same_run(sd.read_measurement(tmp_path / "target.nc"), simulate(1))
    assert len(os.listdir(tmp_path)) == 2


@pytest.mark.slow
def test_threads_read_and_write_at_once(tmp_path: Path, adjustment: tuple[sd.Adjustment, sd.Measurement]) -> None:
    """HDF5 crashes where two threads use it at once."""
    calibration = adjustment[0].calibration

    def work(number: int) -> None:
        for _ in range(10):
            calibration.write(tmp_path / f"{number}.nc")
            assert same_calibration(sd.read_calibration(tmp_path / f"{number}.nc"), calibration)

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(work, range(4))) == [None] * 4


def test_numbers_that_others_have_packed_are_what_xarray_reads(tmp_path: Path) -> None:
    path = tmp_path / "packed.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("x", 4)
        for name, kind, attributes in (
            ("scaled", "i2", {"scale_factor": 1e-5, "add_offset": 0.25}),
            ("unsigned", "i1", {"_Unsigned": "true"}),
            ("single", "f4", {"missing_value": np.float32(3.0)}),
        ):
            variable = file.createVariable(name, kind, ("x",), fill_value=7)
            variable.set_auto_maskandscale(False)
            variable.setncatts(attributes)
            variable[:] = [1, 7, -3, 3] if kind != "f4" else [1.5, 7.0, -3.0, 3.0]
    found = read_netcdf(path)
    with xr.open_dataset(path) as expected:
        for name in ("scaled", "unsigned", "single"):
            values = found.numbers(name, ["x"], None, missing=True)
            np.testing.assert_allclose(values, expected[name].values, rtol=1e-7)  # xarray unpacks in single precision
            assert np.isnan(values[1])
