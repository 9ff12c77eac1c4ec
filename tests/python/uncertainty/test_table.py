"""The result of an uncertainty evaluation as text, netCDF and CSV; here of made-up figures, whose places are known."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.io.netcdf import read_netcdf
from stepdiag.presentation.blocks import text_of
from stepdiag.presentation.uncertainty import uncertainty_blocks
from stepdiag.scenario.description import parse_scenario
from stepdiag.uncertainty.result import UncertaintyResult, find_output, label, only_survivors
from stepdiag.uncertainty.table import uncertainty_table
from stepdiag.uncertainty.write import uncertainty_csv, write_uncertainty

NODES = (0.0, 40.0, 80.0)


def made_up(**changes: Any) -> UncertaintyResult:
    """Outputs EXX and EAX over three nodes, C0Y and a derived error: u of output k is k nanometres or nanoradians."""
    outputs = [
        SimpleNamespace(name=name, position=x, unit=unit)
        for name, unit in (("EXX", "mm"), ("EAX", "rad"))
        for x in NODES
    ]
    outputs.append(SimpleNamespace(name="C0Y", position=math.nan, unit="rad"))
    outputs.append(SimpleNamespace(name="X at (1, 2, 3)", position=math.nan, unit="mm"))
    count = len(outputs)
    u = np.arange(count) * 1e-6
    mean = np.arange(count) * 1e-3
    propagation = SimpleNamespace(
        value=mean,
        standard_uncertainty=u,
        degrees_of_freedom=np.where(np.arange(count) == 2, 7.5, np.inf),
        expanded=lambda coverage: 2.0 * u,
        budget={"noise of distance": 0.8 * u, "laser": 0.6 * u},
        between_groups=np.zeros(count),
    )
    region = SimpleNamespace(
        outputs=[6, 7],
        centre=np.zeros(2),
        covariance=np.eye(2),
        ellipsoid_factor=2.4,
        rectangle_factor=2.2,
        grid_from=np.zeros(2),
        grid_width=np.ones(2),
        smallest=np.array([[1.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    )
    drawn = SimpleNamespace(
        mean=mean,
        standard_uncertainty=u,
        symmetric=mean[:, None] + np.outer(u, [-2.0, 3.0]),
        shortest=mean[:, None] + np.outer(u, [-1.5, 2.5]),
        samples=100_000,
        lost=3,
        target="AVX2",
        covariance=np.outer(u, u),
        kept={6: np.array([1.0, np.nan, 3.0])},
        joint=[region],
        stability=None,
    )
    comparison = SimpleNamespace(
        digits=2,
        delta=np.full(count, 5e-7),
        d_low=np.arange(count) * 1e-7,
        d_high=np.zeros(count),
        sampling=np.full(count, 1e-8),
        validated=[k < 6 for k in range(count)],
        reason=["" if k < 6 else "the mean is shifted by 0.5 urad" for k in range(count)],
    )
    settings: dict[str, Any] = {"propagation": propagation, "monte_carlo": drawn, "comparison": comparison}
    return UncertaintyResult(
        parse_scenario(SCENARIO).known, "enhanced", 2**64 - 1, outputs, count - 1, 0.95, 2, **(settings | changes)
    )


def test_every_parameter_lies_over_its_axis_with_all_its_figures() -> None:
    table = uncertainty_table(made_up())
    assert table["EXX"].dims == ("x",)
    assert table["EXX_u"].values.tolist() == [0.0, 1e-6, 2e-6]
    assert table["EAX_high"].values == pytest.approx([0.003 + 9e-6, 0.004 + 12e-6, 0.005 + 15e-6], rel=1e-15)
    assert table["EAX_shortest_low"].values == pytest.approx([0.003 - 4.5e-6, 0.004 - 6e-6, 0.005 - 7.5e-6], rel=1e-15)
    assert table["EXX_freedom"].values.tolist() == [math.inf, math.inf, 7.5]
    assert table["C0Y_propagated_expanded"].item() == 12e-6
    assert table["derived_mean"].values.tolist() == [0.007]
    assert table["budget"].sel(group="laser").values == pytest.approx(0.6e-6 * np.arange(8), rel=1e-15)


def test_every_variable_says_what_it_is_and_in_which_units() -> None:
    for name, variable in uncertainty_table(made_up()).variables.items():
        assert variable.attrs.get("long_name"), name
        if variable.dtype.kind == "f":
            assert "units" in variable.attrs or "units" in variable.attrs.get("comment", ""), name


def test_netcdf_file_has_it_all_for_who_never_heard_of_us(tmp_path: Path) -> None:
    path = tmp_path / "u.nc"
    write_uncertainty(made_up(), path)
    with xr.open_dataset(path) as table:
        facts = {name: table.attrs[name] for name in ("samples", "samples_without_result", "seed", "instruction_set")}
        assert facts == {
            "samples": 100_000,
            "samples_without_result": 3,
            "seed": str(2**64 - 1),
            "instruction_set": "AVX2",
        }
        assert table["covariance"].dims == ("output", "output_2")
        assert table["kept_samples"].values[0, [0, 2]].tolist() == [1.0, 3.0]
        assert table["joint_a_smallest"].values.tolist() == [[1, 0, 1], [1, 0, 0]]
        assert table["joint_a_name"].values.tolist() == ["C0Y", "X at (1, 2, 3)"]
        assert table["output_name"].values.tolist()[-2:] == ["C0Y", "X at (1, 2, 3)"]
    assert read_netcdf(path).numbers("EXX_u", ["x"], "mm").tolist() == [0.0, 1e-6, 2e-6]


def test_csv_file_has_a_row_an_output_in_micrometres(tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    write_uncertainty(made_up(), path)
    lines = path.read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row["output"] for row in rows] == ["EXX"] * 3 + ["EAX"] * 3 + ["C0Y", "X at (1, 2, 3)"]
    assert (rows[2]["unit"], rows[2]["position_mm"], float(rows[2]["standard_uncertainty"])) == ("um", "80.0", 2e-3)
    assert (rows[6]["unit"], rows[6]["position_mm"], float(rows[6]["mean"])) == ("urad", "", 6000.0)
    assert float(rows[2]["freedom"]) == 7.5
    assert "# samples=100000" in lines


def test_propagation_alone_makes_a_table_without_samples(tmp_path: Path) -> None:
    table = uncertainty_table(made_up(monte_carlo=None))
    assert "EXX_propagated_u" in table
    assert not {"EXX", "EXX_u", "covariance", "kept_samples"} & set(table)
    assert "samples" not in table.attrs


def test_report_names_the_largest_of_each_family_and_where_it_comes_from() -> None:
    said = "\n".join(text_of(uncertainty_blocks(made_up())))
    assert "EXX at 80 mm" in said
    assert "EAX at 80 mm" in said
    assert "100,000 samples" in said
    assert "3 without a result" in said
    assert "noise of distance 64.0%, laser 36.0%" in said
    assert "7.5" in said
    assert "X at (1, 2, 3)" in said


def test_validation_counts_what_agrees_and_says_why_the_worst_does_not() -> None:
    said = "\n".join(text_of(uncertainty_blocks(made_up())))
    assert re.search(r"positioning +3 of 3", said)
    assert "squareness, C0Y: the mean is shifted by 0.5 µrad" in said
    table = uncertainty_table(made_up())
    assert table["output_validated"].values.tolist() == [1] * 6 + [0] * 2
    assert table["output_reason"].values.tolist()[5:7] == ["", "the mean is shifted by 0.5 urad"]
    assert table["EAX_d_low"].values == pytest.approx([3e-7, 4e-7, 5e-7], rel=1e-15)


def test_too_few_samples_for_the_interval_are_noted() -> None:
    result = made_up()
    assert "wants about 200,000 samples for a 95 % interval" in "\n".join(text_of(uncertainty_blocks(result)))
    assert result.monte_carlo is not None
    result.monte_carlo.samples = 200_000
    assert "wants about" not in "\n".join(text_of(uncertainty_blocks(result)))


def test_adaptive_run_that_did_not_end_says_so() -> None:
    result = made_up()
    assert result.monte_carlo is not None
    stability = {"ratio": 1.5, "output": 2, "figure": "upper end", "unstable": 3}
    result.monte_carlo.stability = SimpleNamespace(stable=False, **stability)
    said = "\n".join(text_of(uncertainty_blocks(result)))
    assert "3 of 8 outputs are not yet stable to 2 digits" in said
    assert "the upper end of EXX at 80 mm is the worst, 1.5 times" in said
    result.monte_carlo.stability = SimpleNamespace(stable=True, **stability)
    assert "every output is stable" in "\n".join(text_of(uncertainty_blocks(result)))


@pytest.mark.parametrize(("text", "row"), [("C0Y", 6), ("EXX@40", 1), ("EXX", 2), ("X at (1, 2, 3)", 7)])
def test_output_is_found_by_name_and_position(text: str, row: int) -> None:
    outputs = made_up().outputs
    assert find_output(outputs, text, "keep") == row
    assert label(outputs[1]) == "EXX at 40 mm"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("EXY", "`keep`: 'EXY' is no output; did you mean EXX?"),
        ("EXX@45", "`keep`: 'EXX@45': no node of EXX; the nearest node is at 40 mm"),
        ("C0Y@1", "`keep`: 'C0Y@1': no node of C0Y; it has no position"),
        ("EXX@end", "`keep`: expected a position in mm after @, got 'EXX@end'"),
    ],
)
def test_output_that_is_none_is_refused(text: str, message: str) -> None:
    with pytest.raises(sd.InvalidArgument) as error:
        find_output(made_up().outputs, text, "keep")
    assert str(error.value) == message


def test_result_of_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(sd.InvalidArgument, match=r"u\.txt: expected a name that ends in \.nc or \.csv"):
        write_uncertainty(made_up(), tmp_path / "u.txt")


def test_figures_of_survivors_say_so_in_first_line_and_file() -> None:
    sound, spoilt = made_up(), made_up()
    spoilt.monte_carlo.lost = 101  # of 100,101 samples
    assert sound.warning is None
    assert spoilt.warning is not None
    assert spoilt.warning.startswith("101 of 100,101 virtual calibrations gave no")
    assert next(iter(text_of(uncertainty_blocks(spoilt)))) == f"not to be trusted: {spoilt.warning}"
    assert next(iter(text_of(uncertainty_blocks(sound)))).startswith("virtual calibrations")
    assert uncertainty_table(spoilt).attrs["warning"] == spoilt.warning
    assert "warning" not in uncertainty_table(sound).attrs
    assert f"# warning={spoilt.warning}\n" in uncertainty_csv(spoilt)


@pytest.mark.parametrize(("samples", "lost", "says"), [(999, 1, False), (998, 2, True), (0, 5, True), (7, 0, False)])
def test_one_sample_in_a_thousand_may_be_lost(samples: int, lost: int, says: bool) -> None:
    assert (only_survivors(samples, lost) is not None) == says
