"""Temperatures from a file that another program appends to: at each reading's time, kept in the raw file, and never
what stops a measurement."""

import re
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import acquiring
import numpy as np
import pytest
from acquiring import BEAMS, LINES, Listener, acquire_through, fast, scenario

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_file import RawContent, read_raw
from stepdiag.acquisition.raw_records import Header, RawReading, Session, TemperatureRow, Visited
from stepdiag.acquisition.run_from_raw import measurement_of, write_run
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.acquisition.temperature_file import TemperatureFile
from stepdiag.acquisition.triggers import Stopped
from stepdiag.io.data_files import read_measurement
from stepdiag.presentation.file_check import examine
from stepdiag.scenario.description import Scenario, evaluate_scenario, parse_scenario
from stepdiag.scenario.order_of_run import Visit
from stepdiag.twin.server import Twin

START = datetime(2026, 11, 23, 12, 0, 0, tzinfo=UTC)
EXPANSION = "\n[temperature]\nexpansion_um_per_m_k = 11.5\nu_expansion_um_per_m_k = 0.0\nu_temperature_c = 0.0\n"


def row(*fields: object, ago: float = 0.0) -> str:
    """A row of the file as of now, or some seconds ago."""
    return ",".join([(datetime.now(UTC) - timedelta(seconds=ago)).isoformat(), *map(str, fields)]) + "\n"


class Between(TcpTrigger):
    """Does something before each reading, by its number."""

    def __init__(self, act: Callable[[int], None], *, end: int | None = None) -> None:
        super().__init__()
        self._act, self._count, self._end = act, 0, end

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        if self._count == self._end:
            raise Stopped("nobody asked for it")
        self._act(self._count)
        self._count += 1
        return super().wait(visit, index, nominal)


def warm(text: str) -> Scenario:
    return parse_scenario(acquiring.SCENARIO.format(plan=LINES, head=BEAMS, noise="") + text)


def positioning_error(described: Scenario, run: Any) -> float:
    """The largest deviation of the evaluated positioning errors from those of the machine at 20 °C, mm."""
    truth, found = described.machine().errors, evaluate_scenario(described, run).functions
    return max(
        float(np.max(np.abs(found[name][1] - truth.function(name, found[name][0])))) for name in ("EXX", "EYY", "EZZ")
    )


def test_run_with_temperatures_evaluates_to_the_machine_at_20_degrees(tmp_path: Path) -> None:
    """The twin's scales are warm; the evaluation is told by the file alone. Without it the expansion is an error."""
    true, known = warm(EXPANSION + "axes_c = [23.0, 22.0, 24.5]\n"), warm(EXPANSION)
    file, output = tmp_path / "temperatures.csv", tmp_path / "run.csv"
    file.write_text("time,temperature_x_c,temperature_y_c,temperature_z_c\n" + row(23.0, 22.0, 24.5, ago=5))
    with Twin(true) as twin:
        acquire_through(known, twin, output, temperatures=file)
    run = read_measurement(output)
    assert np.all(run.channels["temperature_z"] == 24.5)
    # What picometres of a distance make of the angles over 100 mm, see test_acquire.py; the expansion is 2.8e-3.
    assert positioning_error(known, run) < 1e-6
    with pytest.raises(InvalidArgument, match=re.escape("expected temperatures (column temperature_x_c or")):
        evaluate_scenario(known, without_temperatures(run))
    as_found = warm("")
    assert positioning_error(as_found, without_temperatures(run)) == pytest.approx(11.5e-6 * 3.0 * 80.0, rel=0.02)


def without_temperatures(run: Any) -> Any:
    channels = {name: values for name, values in run.channels.items() if "temperature" not in name}
    return type(run)(run.line, run.point, run.position, channels, run=run.run, direction=run.direction)


def test_twin_writes_what_its_scales_show(tmp_path: Path) -> None:
    file = tmp_path / "temperatures.csv"
    true, known = warm(EXPANSION + "axes_c = 26.0\n"), warm(EXPANSION)
    for _ in range(2):  # a twin that is started once more goes on with its file
        with Twin(true, temperatures=file) as twin:
            pass
    with Twin(true, temperatures=file) as twin:
        acquire_through(known, twin, tmp_path / "run.csv", temperatures=file)
    assert file.read_text().startswith("time,temperature_c\n20")
    assert file.read_text().count("time") == 1
    assert positioning_error(known, read_measurement(tmp_path / "run.csv")) < 1e-6  # as above
    air = warm(
        '\n[environment]\nreadings = "constant_index"\ntemperature_c = 21.0\npressure_hpa = 1000.0\n'
        "humidity_percent = 40.0\n[environment.assumed]\ntemperature_c = 20.0\n"
    )
    with Twin(air, temperatures=tmp_path / "air.csv"):
        pass
    header, first = (tmp_path / "air.csv").read_text().splitlines()[:2]
    assert header == "time,air_temperature_c,air_pressure_hpa,air_humidity_percent"
    assert first.split(",")[1:] == ["21.0", "1000.0", "40.0"]


@pytest.mark.parametrize(
    ("text", "content", "message"),
    [
        ("", None, "expected [temperature] or the air of a constant index, got none"),
        (EXPANSION, "time,temperature_x_c\n", "exists, and is not continued: expected time,temperature_c, got 'time,"),
    ],
)
def test_twin_without_temperatures_or_with_a_strange_file_is_refused(
    tmp_path: Path, text: str, content: str | None, message: str
) -> None:
    file = tmp_path / "temperatures.csv"
    if content is not None:
        file.write_text(content)
    with pytest.raises(InvalidArgument, match=re.escape(message)):
        Twin(warm(text), temperatures=file)
    assert file.exists() == (content is not None)


# --- values at the readings' times ---


def content_of(times: Sequence[float], rows: Sequence[tuple[float, dict[Any, float | None]]]) -> RawContent:
    """A raw file of one line with readings and rows at these seconds."""
    points = list(range(len(times)))
    line: dict[str, Any] = {"visit": 1, "line": "p00", "run": 0, "direction": "forward"}
    positions = [(float(point), 0.0, 0.0) for point in points]
    visit = Visited(
        **line, set_up=1, scale_line=True, points=points, position_mm=positions, nominal_mm=[100.0] * len(times)
    )
    header = Header(created=START, scenario="s", digest="", columns=["distance_pm"], axes=[1], sign=1, plan=[visit])
    records: list[Any] = [
        RawReading(
            **line,
            point=point,
            position_mm=positions[point],
            time=START + timedelta(seconds=seconds),
            read=[point],
            sd=[None],
            values=1,
            lost={},
        )
        for point, seconds in zip(points, times, strict=True)
    ]
    records += [
        TemperatureRow(time=START + timedelta(seconds=seconds), line=2, values=values) for seconds, values in rows
    ]
    return RawContent(Path("run.raw.jsonl"), header, tuple(records), 0, 0)


def test_values_are_interpolated_in_time_and_lost_beyond_the_age() -> None:
    readings = [-601.0, -600.0, 0.0, 25.0, 100.0, 700.0, 701.0, 1000.0, 1399.0, 1400.0, 3000.0]
    rows = [(0.0, 20.0), (100.0, 24.0), (2000.0, 30.0)]
    found = measurement_of(content_of(readings, [(t, {"temperature_c": v}) for t, v in reversed(rows)]))
    # Alone as far as 600 s from a row; between rows that both are that near (T = 20 + 0.04 t) the straight line.
    expected = [np.nan, 20.0, 20.0, 21.0, 24.0, 24.0, np.nan, np.nan, np.nan, 30.0, np.nan]
    np.testing.assert_allclose(found.channels["temperature"], expected, rtol=1e-12)
    wide = measurement_of(content_of(readings, [(t, {"temperature_c": v}) for t, v in rows]), temperature_age=2000.0)
    assert wide.channels["temperature"][7] == pytest.approx(24.0 + 6.0 * 900.0 / 1900.0, rel=1e-12)


def test_an_empty_field_is_passed_over_and_units_are_native() -> None:
    rows: list[tuple[float, dict[Any, float | None]]] = [
        (0.0, {"temperature_c": 20.0, "air_pressure_hpa": 1000.0, "air_humidity_percent": 40.0}),
        (50.0, {"temperature_c": None, "air_pressure_hpa": 1003.0, "air_humidity_percent": None}),
        (100.0, {"temperature_c": 22.0, "air_pressure_hpa": None, "air_humidity_percent": None}),
    ]
    channels = measurement_of(content_of([50.0, 75.0], rows)).channels
    np.testing.assert_allclose(channels["temperature"], [21.0, 21.5], rtol=1e-12)
    np.testing.assert_allclose(channels["air_pressure"], [100300.0, 100300.0], rtol=1e-12)
    np.testing.assert_allclose(channels["air_humidity"], [0.4, 0.4], rtol=1e-12)


# --- following the file ---


def test_rows_are_kept_as_they_were_read_and_half_a_row_is_waited_for(tmp_path: Path) -> None:
    described, output, file = scenario(), tmp_path / "run.csv", tmp_path / "t.csv"
    file.write_text("# of the sensors\r\ntime, temperature_c, note\r\n" + row(20.25, "door open"))
    half = row(20.5, "")
    pieces = {3: half[:-4], 5: half[-4:], 20: "1764000000.5,1.0,long ago\n" + row("", "no sensor")}

    def act(count: int) -> None:
        with file.open("a") as handle:
            handle.write(pieces.get(count, ""))

    operator = Listener()
    with Twin(described) as twin:
        acquire_through(described, twin, output, trigger=Between(act), operator=operator, temperatures=file)
    content = read_raw(tmp_path / "run.raw.jsonl")
    rows = [record for record in content.records if isinstance(record, TemperatureRow)]
    assert [one.values["temperature_c"] for one in rows] == [20.25, 20.5, None]
    assert [one.line for one in rows] == [3, 4, 6]
    order = [record.record for record in content.records if record.record in ("temperatures", "reading")]
    assert [k - n for n, k in enumerate(k for k, kind in enumerate(order) if kind == "temperatures")] == [0, 5, 20]
    assert operator.told[0] == f"{file}: columns that are not read: note"
    assert not any("warning" in text for text in operator.told)
    (session,) = [record for record in content.records if isinstance(record, Session)]
    assert session.temperatures == str(file)
    recorded = read_measurement(output).channels["temperature"]
    assert recorded[0] == pytest.approx(20.25, abs=0.25)
    assert np.all(np.diff(recorded) >= 0.0)
    assert np.all(recorded[5:] == 20.5)
    write_run(tmp_path / "run.raw.jsonl", tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == output.read_bytes()
    assert "; 3 rows of temperatures" in examine(tmp_path / "run.raw.jsonl").summary


@pytest.mark.slow
def test_file_that_stops_growing_is_told_once_and_readings_go_without(tmp_path: Path) -> None:
    described, output, file = scenario(), tmp_path / "run.csv", tmp_path / "t.csv"
    file.write_text("time,temperature_c\n" + row(21.0))

    def act(count: int) -> None:
        if count in (10, 20):
            time.sleep(1.2)
        if count == 20:
            with file.open("a") as handle:
                handle.write(row(22.0))

    operator = Listener()
    with Twin(described) as twin:
        result = acquire_through(
            described,
            twin,
            output,
            trigger=Between(act),
            operator=operator,
            options=fast(temperature_age=1.0),
            temperatures=file,
        )
    assert result.complete
    (warning,) = [text for text in operator.told if "warning" in text]
    assert re.fullmatch(
        rf"warning: {re.escape(str(file))}: temperature_c: no value since 20.* UTC; readings have none until there is "
        "a new one",
        warning,
    )
    recorded = read_measurement(output).channels["temperature"]
    assert np.isnan(recorded[10:20]).any()
    assert not np.isnan(recorded[20:]).any()
    assert recorded[0] == 21.0


BAD_ROWS = [
    ("nonsense\n", "expected 2 fields, as in the header, got 1"),
    ("2026-11-23T12:00:00,21\n", "time: expected a time such as 2026-01-31T12:00:00Z, or seconds since 1970, got"),
    ("yesterday,21\n", "time: expected a time such as"),
    ("1e99,21\n", "time: expected a time such as"),
    ("1764000000000,21\n", "time: expected a time such as"),
    ("2999-01-01T00:00:00Z,21\n", "time: expected a time that is past, at 20"),
    ("NOW,warm\n", "temperature_c: expected a finite number, got 'warm'"),
    ("NOW,nan\n", "temperature_c: expected a finite number, got 'nan'"),
    ("NOW,-400\n", "temperature_c: expected -273.15 to 1000, got '-400'"),
    ('NOW,"21\n', "not valid CSV"),
    ("\x00\xff,\n", "time: expected a time such as"),
]


@pytest.mark.parametrize(("bad", "message"), BAD_ROWS)
def test_bad_row_is_told_and_left_out_and_the_run_goes_on(tmp_path: Path, bad: str, message: str) -> None:
    file, told = tmp_path / "t.csv", list[str]()
    bad = bad.replace("NOW", datetime.now(UTC).isoformat())
    file.write_text("time,temperature_c\n" + row(21.0))
    followed = TemperatureFile(file, age=600.0, tell=told.append)
    assert len(followed.new_rows()) == 1
    with file.open("a", encoding="latin-1") as handle:
        handle.write(bad + bad + row(22.0))
    assert [one.values for one in followed.new_rows()] == [{"temperature_c": 22.0}]
    (warning,) = told
    assert warning.startswith(f"warning: {file}, line 3: {message}")
    assert warning.endswith("; the row is left out, and 1 more")
    assert followed.new_rows() == []
    file.write_text("time,temperature_c\n" + bad, encoding="latin-1")
    with pytest.raises(InvalidArgument, match=re.escape(f"{file}, line 2: {message}")):
        TemperatureFile(file, age=600.0, tell=told.append)  # nothing is measured yet


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read: No such file or directory"),
        ("", "expected a line with the names of its columns, got none"),
        ("time,temperature_c", "expected a line with the names of its columns, got none"),
        ("zeit,temperature_c\n", "line 1: expected the columns time and temperature_c, or temperature_x_c, "),
        ("time,temperature_x_c,temperature_y_c\n", "line 1: expected the columns time and temperature_c, or "),
        ("time,humidity\n", "line 1: expected the columns time and"),
        ("time,temperature_c,temperature_c\n", "line 1: temperature_c: expected it once, got it twice"),
        ("time;temperature_c\n", "got 'time;temperature_c'"),
    ],
)
def test_file_that_cannot_be_followed_is_refused_before_anything_is_read(
    tmp_path: Path, content: str | None, message: str
) -> None:
    file = tmp_path / "t.csv"
    if content is not None:
        file.write_text(content)
    with pytest.raises(InvalidArgument, match=f"{re.escape(str(file))}.*{re.escape(message)}"):
        acquiring.acquire(
            scenario(), "ids3010://127.0.0.1:1", tmp_path / "run.csv", trigger=TcpTrigger(), temperatures=file
        )
    assert not list(tmp_path.glob("run*"))


def test_file_that_is_replaced_or_gone_for_a_while_is_followed_on(tmp_path: Path) -> None:
    file, told = tmp_path / "t.csv", list[str]()
    rows = [row(20.0 + k, ago=10 - k) for k in range(5)]
    file.write_text("time,temperature_c\n" + "".join(rows[:2]))
    followed = TemperatureFile(file, age=600.0, tell=told.append)
    assert len(followed.new_rows()) == 2
    file.rename(tmp_path / "old.csv")
    assert followed.new_rows() == followed.new_rows() == []
    assert told == [f"warning: {file}: cannot be read: No such file or directory"]
    file.write_text("time,temperature_c\n" + "".join(rows[1:3]))
    assert [one.values["temperature_c"] for one in followed.new_rows()] == [22.0], "what is known is left out"
    file.write_text("time,temperature_c\n" + rows[3])  # shorter, the same file
    assert [one.values["temperature_c"] for one in followed.new_rows()] == [23.0]


def test_resumed_run_has_rows_of_both_parts_once(tmp_path: Path) -> None:
    described, output, file = scenario(), tmp_path / "run.csv", tmp_path / "t.csv"
    file.write_text("time,temperature_c\n" + row(19.0, ago=601.0) + row(20.0, ago=5.0))

    def act(count: int) -> None:
        if count == 8:
            with file.open("a") as handle:
                handle.write(row(21.0))

    operator = Listener()
    with Twin(described) as twin:
        with pytest.raises(Stopped):
            acquire_through(described, twin, output, end=10, trigger=Between(act, end=10), temperatures=file)
        with file.open("a") as handle:
            handle.write(row(22.0))
        trigger = Between(lambda _: None, end=4)
        with pytest.raises(Stopped):
            acquire_through(
                described, twin, output, begin=10, end=14, trigger=trigger, resume="point", temperatures=file
            )
        acquire_through(described, twin, output, begin=14, resume="point", operator=operator)
    rows = [record for record in read_raw(tmp_path / "run.raw.jsonl").records if isinstance(record, TemperatureRow)]
    assert [one.values["temperature_c"] for one in rows] == [20.0, 21.0, 22.0]
    assert any("without `temperatures` others have none" in text for text in operator.told)
    recorded = read_measurement(output).channels["temperature"]
    assert not np.isnan(recorded).any()
    assert np.all(np.diff(recorded) >= 0.0)
    assert recorded[-1] == 22.0
