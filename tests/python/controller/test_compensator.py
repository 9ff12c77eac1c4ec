"""The compensator from Python: its answers, its options, its refusals, and the fingerprint computed by other means."""

from __future__ import annotations

import struct
import threading
from pathlib import Path

import numpy as np
import pytest
from refusal import refused
from usual import CHAIN, VOLUME

import stepdiag as sd

TOOL = (5.0, -3.0, 80.0)
ERRORS = sd.random_error_map(VOLUME, seed=1)
# The machine adds up positions of 1,000 mm, each rounded to 1e-13 mm; the compensator adds up errors.
MACHINE_ROUNDING = 2e-12


def written(path: Path, errors: sd.ErrorMap = ERRORS, chain: str = CHAIN) -> Path:
    errors.write(path, chain=chain, volume=VOLUME, tool=TOOL)
    return path


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return written(tmp_path / "table.csv")


def positions(count: int = 200, outside: float = 0.0) -> np.ndarray:
    return np.random.default_rng(1).uniform(-outside, np.array(VOLUME) + outside, (count, 3))


def test_error_is_that_of_the_machine_for_any_tool(table: Path) -> None:
    compensator = sd.Compensator(table, CHAIN)
    for tool in (None, (0.0, 0.0, 0.0), (-50.0, 10.0, 200.0)):
        machine = sd.Machine(CHAIN, ERRORS, TOOL if tool is None else tool)
        np.testing.assert_allclose(
            compensator.error(positions(), tool), machine.error(positions()), rtol=0, atol=MACHINE_ROUNDING
        )


def test_orientation_is_the_rotation_vector_of_the_tool(table: Path) -> None:
    rotation, _ = sd.Machine(CHAIN, ERRORS).pose(positions())
    skew = 0.5 * (rotation - rotation.transpose(0, 2, 1))
    sine = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    length = np.linalg.norm(sine, axis=1, keepdims=True)
    # Off-diagonal elements of 1e-4 are sums of terms rounded to 1e-20; of what the series leaves out, even less.
    np.testing.assert_allclose(
        sd.Compensator(table, CHAIN).orientation(positions()), sine * np.arcsin(length) / length, rtol=0, atol=1e-18
    )


def test_a_machine_sent_where_command_says_is_where_it_should_be(table: Path) -> None:
    compensator = sd.Compensator(table, CHAIN)
    command = compensator.command(positions())
    _, actual = sd.Machine(CHAIN, ERRORS, TOOL).pose(command)
    np.testing.assert_allclose(actual - TOOL, positions(), rtol=0, atol=compensator.inverse_bound + MACHINE_ROUNDING)
    np.testing.assert_allclose(compensator.forward(command), positions(), rtol=0, atol=compensator.inverse_bound)
    assert compensator.inverse_bound <= 1e-9


def test_file_error_map_and_calibration_are_one_table(table: Path) -> None:
    from_file = sd.Compensator(table, CHAIN)
    others = [
        sd.Compensator(str(table), sd.Chain("wX'bYZt")),
        sd.Compensator(sd.read_error_map(table), CHAIN),
        sd.Compensator(sd.read_calibration(table), CHAIN),
    ]
    for other in others:
        assert other.fingerprint == from_file.fingerprint
        np.testing.assert_array_equal(other.error(positions()), from_file.error(positions()))


def test_origin_is_where_the_controller_has_home(table: Path) -> None:
    origin = np.array([-400.0, 12.5, 1000.0])
    here, there = sd.Compensator(table, CHAIN), sd.Compensator(table, CHAIN, origin=origin)
    np.testing.assert_allclose(
        there.command(positions() + origin), here.command(positions()) + origin, rtol=0, atol=1e-12
    )


def test_outside_the_volume_is_what_was_chosen(table: Path) -> None:
    inside, near, far = (100.0, 100.0, 100.0), (-10.0, 100.0, 100.0), (-30.0, 100.0, 100.0)
    points = [inside, near, far, (np.nan, 0.0, 0.0)]
    hold = sd.Compensator(table, CHAIN)
    linear = sd.Compensator(table, CHAIN, outside="linear", margin=20.0)
    refuse = sd.Compensator(table, CHAIN, outside="refuse")
    assert list(hold.status(points)) == [0, 1, 1, 4]
    assert list(linear.status(points)) == [0, 1, 5, 4]
    assert list(refuse.status(points)) == [0, 5, 5, 4]
    np.testing.assert_array_equal(hold.error([near]), hold.error([(0.0, 100.0, 100.0)]))
    assert np.all(linear.error([near]) != hold.error([near]))
    for answers in (refuse.error(points), refuse.command(points), refuse.forward(points), refuse.orientation(points)):
        assert list(np.isnan(answers).all(axis=1)) == [False, True, True, True]


def test_a_cap_limits_the_correction_and_not_what_is_told(table: Path) -> None:
    capped = sd.Compensator(table, CHAIN, largest_correction=0.01)
    long = np.linalg.norm(capped.error(positions()), axis=1) > 0.01
    assert long.any()
    assert np.array_equal(capped.status(positions()) == 2, long)
    np.testing.assert_allclose(
        np.linalg.norm((capped.command(positions()) - positions())[long], axis=1).max(), 0.01, rtol=0, atol=1e-9
    )


def test_reversal_is_corrected_for_the_chosen_approach(tmp_path: Path) -> None:
    nodes = np.linspace(0.0, 800.0, 5)
    exx = {"EXX": (nodes, 1e-5 * nodes)}
    both = sd.ErrorMap(exx, negative_functions={"EXX": (nodes, 1e-5 * nodes - 0.004)})
    path = written(tmp_path / "reversal.csv", both)
    for approach, shift in (("positive", 0.0), ("negative", -0.004), ("mean", -0.002)):
        compensator = sd.Compensator(path, CHAIN, approach=approach)
        np.testing.assert_allclose(compensator.error([(300.0, 0.0, 0.0)]), [[0.003 + shift, 0, 0]], rtol=0, atol=1e-15)


def test_what_is_not_compensated_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "part.csv", sd.ErrorMap({"EXX": ([0.0, 784.0], [0.0, 0.01])}, {"C0Y": 1e-5}))
    told = sd.Compensator(path, CHAIN).uncompensated
    assert told[:2] == ["EXX (above 784.0 mm)", "EYX"]
    assert len(told) == 18 + 2
    text = path.read_text().replace("# chain", "# undetermined_slopes=EXX\n# chain")
    path.write_text(text)
    assert "EXX (slope)" in sd.Compensator(path, CHAIN).uncompensated


def fnv1a(words: list[bytes]) -> int:
    """As the hash's authors define it: http://www.isthe.com/chongo/tech/comp/fnv"""
    value = 0xCBF29CE484222325
    for byte in b"".join(words):
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value


def test_fingerprint_is_the_hash_of_the_numbers(tmp_path: Path) -> None:
    def integer(number: int) -> bytes:
        return struct.pack("<Q", number)

    def numbers(*values: float) -> bytes:
        return struct.pack(f"<{len(values)}d", *values)

    chain = b"".join(integer(byte) for byte in CHAIN.encode())
    exx = integer(1) + integer(2) + numbers(0.0, 800.0) + integer(2) + numbers(0.0, 0.01)
    nothing = integer(0) * (1 + 2 * 17 + 3)
    expected = fnv1a([integer(len(CHAIN)), chain, numbers(*VOLUME), numbers(*TOOL), exx, nothing])
    path = written(tmp_path / "exx.csv", sd.ErrorMap({"EXX": ([0.0, 800.0], [0.0, 0.01])}))
    assert sd.Compensator(path, CHAIN).fingerprint == expected == 7928635067038002598


def test_bad_tables_and_options_are_refused_by_name(table: Path, tmp_path: Path) -> None:
    refused(sd.Compensator, table, "[w Y' b X Z t]", names="chain")
    refused(sd.Compensator, tmp_path / "none.csv", CHAIN, names="none.csv")
    refused(sd.Compensator, ERRORS, CHAIN, names="error map: the leading line")  # no chain, volume, tool in it
    refused(sd.Compensator, table, CHAIN, outside="stop", names="outside")
    refused(sd.Compensator, table, CHAIN, approach="both", names="approach")
    refused(sd.Compensator, table, CHAIN, margin=1.0, names="margin")
    refused(sd.Compensator, table, CHAIN, largest_correction=np.nan, names="largest_correction")
    refused(sd.Compensator, table, CHAIN, origin=(0.0, 0.0), names="origin")
    compensator = sd.Compensator(table, CHAIN)
    refused(compensator.error, (1.0, 2.0, 3.0), names="positions")
    refused(compensator.command, [(1.0, 2.0)], names="targets")
    refused(compensator.forward, [(1.0, 2.0, 3.0)], (1.0, 2.0), names="tool")


def test_threads_ask_one_compensator_at_once(table: Path) -> None:
    compensator, answers = sd.Compensator(table, CHAIN), {}
    points = positions(20_000)

    def ask(name: int) -> None:
        answers[name] = compensator.command(points)

    threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for answer in answers.values():
        np.testing.assert_array_equal(answer, answers[0])
