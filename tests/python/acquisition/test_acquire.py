"""A run that is acquired from a twin over a socket is the simulated run, to the picometre."""

from pathlib import Path

import acquiring
import numpy as np
import pytest
from acquiring import BEAMS, IDEAL, LINES, SMALL, Listener, acquire_through, fast, scenario

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.raw_records import Value
from stepdiag.acquisition.run_from_raw import measurement_of
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.acquisition.triggers import KeyTrigger
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import evaluate_scenario, parse_scenario, simulate_scenario
from stepdiag.twin.instrument import TwinBehaviour
from stepdiag.twin.server import Twin


def to_picometres(values: np.ndarray) -> np.ndarray:
    return np.round(values * 1e9) / 1e9


@pytest.mark.parametrize("head", [BEAMS, IDEAL])
@pytest.mark.parametrize(
    "plan",
    [
        LINES,
        SMALL + "\nrepeats = 2\nseconds_per_reading = 3.0",
        LINES + '\ncheck_points = 2\nblock = 3\nscale_points = "steps"',
    ],
)
def test_acquired_run_is_the_simulated_run_to_the_picometre(tmp_path: Path, head: str, plan: str) -> None:
    described = scenario(plan=plan, head=head, noise="distance_um = 0.1\ncommon_um = 0.2\nseed = 3")
    with Twin(described) as twin:
        result = acquire_through(described, twin, tmp_path / "run.csv")
    expected, run = simulate_scenario(described), read_measurement(tmp_path / "run.csv")
    assert result.complete
    assert result.lost == 0
    assert result.readings == len(expected)
    assert (run.line, run.direction) == (expected.line, expected.direction)
    assert np.array_equal(run.run, expected.run)
    assert np.array_equal(run.point, expected.point)
    assert np.array_equal(run.position, expected.position)
    channels = ["distance"] if head == IDEAL else ["d1", "d2", "d3"]
    assert run.channels.keys() == {*channels, "time"}
    for name in channels:
        # Exactly: the instrument counts whole picometres, and nothing rounds them again.
        assert np.array_equal(run.channels[name], to_picometres(expected.channels[name])), name
    assert np.all(np.diff(run.channels["time"]) >= 0.0)


@pytest.mark.parametrize(
    ("section", "drift"),
    [("[misalignment]", "drift_um_per_h = 40.0"), ("[machine]", "drift_um_per_h = [9.0, -4.0, 2.5]")],
)
def test_drift_is_that_of_the_simulated_run(tmp_path: Path, section: str, drift: str) -> None:
    """Of a set-up, and of the functional point."""
    plan = SMALL + "\nseconds_per_reading = 60.0\ncheck_points = 1"
    text = acquiring.SCENARIO.format(plan=plan, head=BEAMS, noise="")
    described = parse_scenario(text.replace(section, f"{section}\n{drift}"))
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv")
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    assert np.array_equal(run.channels["d2"], to_picometres(expected.channels["d2"]))


def test_acquired_run_evaluates_to_the_calibration_of_the_simulated_run(tmp_path: Path) -> None:
    described = scenario(plan=LINES)
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv")
    acquired = evaluate_scenario(described, read_measurement(tmp_path / "run.csv"))
    simulated = evaluate_scenario(described, simulate_scenario(described))
    for name, table in simulated.functions.items():
        # Half a picometre of a distance is 5e-11 rad of a tilt between beams 20 mm apart, and over 100 mm 5e-9 mm; the
        # adjustment adds up some of those.
        assert np.allclose(acquired.functions[name][1], table[1], rtol=0.0, atol=5e-8), name


def test_one_axis_evaluates_conventionally(tmp_path: Path) -> None:
    described = scenario(plan=LINES, head=IDEAL)
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv")
    run = read_measurement(tmp_path / "run.csv")
    acquired = evaluate_scenario(described, run, method="conventional")
    simulated = evaluate_scenario(described, simulate_scenario(described), method="conventional")
    assert acquired.functions.keys() == simulated.functions.keys()
    assert acquired.functions
    for name, table in simulated.functions.items():
        assert np.allclose(acquired.functions[name][1], table[1], rtol=0.0, atol=5e-8), name  # as above


def test_values_are_averaged_and_every_one_is_kept(tmp_path: Path) -> None:
    described = scenario()
    settling = Settling(count=3, average=50, limit_um=5.0, interval=0.0)
    with Twin(described, behaviour=TwinBehaviour(sampling_noise_um=0.1)) as twin:
        acquire_through(described, twin, tmp_path / "run.csv", options=fast(settling=settling, uncertainties=True))
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    error = run.channels["d1"] - expected.channels["d1"]
    # 28 means of 50 values: a deviation of 0.1/sqrt(50) um; six of them leave nothing to chance.
    assert np.max(np.abs(error)) < 6 * 1e-4 / np.sqrt(50)
    assert np.std(error) > 0.3 * 1e-4 / np.sqrt(50)
    stated = run.standard_uncertainty["d1"]
    assert np.all((stated > 0.5 * 1e-4 / np.sqrt(50)) & (stated < 2.0 * 1e-4 / np.sqrt(50)))
    content = read_raw(tmp_path / "run.raw.jsonl")
    values = [record for record in content.records if isinstance(record, Value) and record.point == 2]
    for (visit, point), reading in content.readings().items():
        mine = [value for value in values if (value.visit, value.point) == (visit, point)]
        if point == 2:
            averaged = [value.read[0] for value in mine if value.kind == "average"]
            assert len(averaged) == reading.values == 50
            assert len(mine) >= 53
            assert reading.read[0] == round(np.mean([float(pm or 0) for pm in averaged]))


@pytest.mark.parametrize("latch", [True, False])
def test_interrupted_beam_is_a_lost_reading(tmp_path: Path, latch: bool) -> None:
    described = scenario()
    operator = Listener()
    behaviour = TwinBehaviour(lost=frozenset({(1, 4)}), latch=latch)
    with Twin(described, behaviour=behaviour) as twin:
        result = acquire_through(described, twin, tmp_path / "run.csv", operator=operator)
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    lost = np.isnan(run.channels["d1"])
    # A beam that was interrupted stays lost until the measurement is started anew: at the next set-up.
    assert list(np.flatnonzero(lost)) == (list(range(4, 14)) if latch else [4])
    assert result.complete
    assert result.lost == np.count_nonzero(lost)
    for name in ("d1", "d2", "d3"):
        assert np.array_equal(run.channels[name][~lost], to_picometres(expected.channels[name])[~lost])
    assert any(
        "point 4" in text and "d1, d2, d3 are lost: no beam (number 9001: the beam was" in text
        for text in operator.told
    )
    assert any("`restart_set_up`" in text for text in operator.told)


def test_measurement_is_started_anew_where_moving_the_head_interrupted_the_beams(tmp_path: Path) -> None:
    described = scenario()
    operator = Listener()
    with Twin(described, behaviour=TwinBehaviour(interrupt=True)) as twin:
        twin.instrument.stop()
        result = acquire_through(described, twin, tmp_path / "run.csv", operator=operator)
    assert result.complete
    assert result.lost == 0
    started = [text for text in operator.told if "restarting its measurement" in text]
    assert len(started) == 2
    assert "system idle" in started[0]
    assert "interrupted" in started[1]


def test_instrument_is_left_alone_where_nobody_wants_it_started(tmp_path: Path) -> None:
    described = scenario()
    with Twin(described) as twin:
        twin.instrument.stop()
        with pytest.raises(OSError, match="system idle; expected a running measurement"):
            acquiring.acquire(
                described,
                twin.source,
                tmp_path / "run.csv",
                trigger=KeyTrigger(),
                options=fast(start="never"),
                operator=Listener(),
            )
        assert twin.instrument.mode == "system idle"


def test_zero_takes_a_constant_off_every_set_up_and_beam(tmp_path: Path) -> None:
    described = scenario(noise="distance_um = 0.1\nseed = 3")
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv")
    content = read_raw(tmp_path / "run.raw.jsonl")
    kept, zeroed = measurement_of(content), measurement_of(content, zero="first")
    for name in ("d1", "d2", "d3"):
        constants = np.round((kept.channels[name] - zeroed.channels[name]) * 1e9)
        assert [len(set(constants[part])) for part in (slice(0, 14), slice(14, 28))] == [1, 1]
        assert zeroed.channels[name][0] == zeroed.channels[name][14] == described.known.head.standoff


def test_sign_turns_the_distances(tmp_path: Path) -> None:
    described = scenario()
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv", options=fast(sign=-1))
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    assert np.array_equal(run.channels["d3"], -to_picometres(expected.channels["d3"]))


def test_axes_may_be_in_any_order(tmp_path: Path) -> None:
    described = scenario()
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv", options=fast(axes=(3, 1, 2)))
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    for name, axis in (("d1", "d3"), ("d2", "d1"), ("d3", "d2")):
        assert np.array_equal(run.channels[name], to_picometres(expected.channels[axis]))


FOUR = 'layout = "multi_beam"\nbeam_offsets_mm = [[15.0, 0.0], [0.0, 15.0], [-15.0, 0.0], [0.0, -15.0]]'


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ('layout = "psd"\npsd_distance_mm = 80.0', 'the layout "psd" cannot be read'),
        (FOUR, "expected 3 beams, one for each axis of the IDS3010, got 4"),
    ],
)
def test_heads_that_the_instrument_cannot_be_are_refused(tmp_path: Path, head: str, message: str) -> None:
    described = scenario(head=head)
    with pytest.raises(InvalidArgument, match=message):
        acquiring.acquire(described, "ids3010://127.0.0.1", tmp_path / "run.csv", trigger=TcpTrigger())
    with pytest.raises(InvalidArgument, match=message):
        Twin(described)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("axes", [(1, 2), (1, 2, 2), (0, 1, 2), (1, 2, 4), (1, 2, 3, 1)])
def test_axes_that_are_not_one_for_each_beam_are_refused(tmp_path: Path, axes: tuple[int, ...]) -> None:
    with pytest.raises(InvalidArgument, match="axes: expected 3 different numbers from 1 to 3"):
        acquiring.acquire(
            scenario(), "ids3010://127.0.0.1", tmp_path / "run.csv", trigger=TcpTrigger(), options=fast(axes=axes)
        )


@pytest.mark.parametrize(
    "source",
    [
        "",
        "127.0.0.1",
        "http://127.0.0.1",
        "ids3010://",
        "ids3010://h:0",
        "ids3010://h:99999",
        "ids3010://h/x",
        "ids3010://u@h",
    ],
)
def test_sources_that_name_no_instrument_are_refused(tmp_path: Path, source: str) -> None:
    with pytest.raises(InvalidArgument, match="source: expected ids3010://HOST"):
        acquiring.acquire(scenario(), source, tmp_path / "run.csv", trigger=TcpTrigger())


def test_a_measurement_without_its_raw_file_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("another measurement")
    with pytest.raises(InvalidArgument, match=r"run\.csv: exists, and was not made from .*run\.raw\.jsonl"):
        acquiring.acquire(scenario(), "ids3010://127.0.0.1:1", tmp_path / "run.csv", trigger=TcpTrigger())
    assert (tmp_path / "run.csv").read_text() == "another measurement"


@pytest.mark.parametrize(
    "given", [{"sign": 0}, {"attempts": 0}, {"timeout": 0.0}, {"timeout": float("nan")}, {"wait_timeout": -1.0}]
)
def test_options_that_make_no_sense_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(InvalidArgument, match=next(iter(given))):
        AcquireOptions(**given)  # type: ignore[arg-type]


def test_a_line_that_is_not_on_its_way_is_told_after_it(tmp_path: Path) -> None:
    described = scenario(plan=LINES, head=IDEAL)
    operator = Listener()
    with Twin(described) as twin:
        acquire_through(described, twin, tmp_path / "run.csv", operator=operator, options=fast(sign=-1))
    remarks = [text for text in operator.told if text.startswith("warning: line")]
    assert len(remarks) == 7
    assert all("the sign of distances is wrong, or the line is reversed" in text for text in remarks)
