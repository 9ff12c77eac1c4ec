"""Temperatures of the scales: what holds from the start, and what LinuxCNC does not start with."""

from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS
from test_refusals import start

from stepdiag import Compensator
from stepdiag.linuxcnc.session import LinuxcncError, LinuxcncSession

ARITHMETIC = 1e-11  # mm: see test_kinematics.py
POINT = (350.0, 130.0, 90.0)
WARM = (24.5, 23.25, 18.0)
SENSORS = [f"{KINS}temperature-{axis}" for axis in "xyz"]
APPLIED = [f"{KINS}temperature-applied-{axis}" for axis in "xyz"]


def test_what_the_sensors_say_at_the_start_is_in_force_at_once(warm_table: Path) -> None:
    hal = [f"setp {pin} {value}" for pin, value in zip(SENSORS, WARM, strict=True)]
    options = {"temperatures": "10,35", "temperature_rate": 1e-6}
    with LinuxcncSession(
        table=warm_table, chain=CHAIN, options=options, hal=[*hal, f"setp {KINS}temperature-enable 1"]
    ) as session:
        joints = session.visit([POINT])[0]
        expected = Compensator(warm_table, CHAIN, temperatures=(10.0, 35.0)).command([POINT], temperature=WARM)[0]
        assert session.pins(APPLIED) == list(WARM)
        assert np.abs(joints - expected).max() < ARITHMETIC


def test_without_the_argument_there_are_no_pins(warm_table: Path) -> None:
    with LinuxcncSession(table=warm_table, chain=CHAIN) as session, pytest.raises(LinuxcncError):
        session.pin(APPLIED[0])


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"temperatures": "10"}, "two numbers lowest,highest"),
        ({"temperatures": "35,10"}, "temperatures: expected the lowest below the highest"),
        ({"temperatures": "0,0"}, "temperatures: expected the lowest below the highest"),
        ({"temperatures": "22,35"}, "range with the calibration's reference 20 in it"),
        ({"temperatures": "10,35", "temperature_rate": "0"}, "temperature_rate: expected"),
    ],
)
def test_arguments_that_are_none_are_refused(warm_table: Path, options: dict[str, str], reason: str) -> None:
    assert reason in start(warm_table, options=options)


def test_a_table_as_found_takes_no_temperatures(table: Path) -> None:
    found = table.with_name("found.csv")
    found.write_text("# temperature_as_found_c=23.1 23.0 22.8\n" + table.read_text())
    assert "errors as found at 23.1 23.0 22.8" in start(found, options={"temperatures": "10,35"})
