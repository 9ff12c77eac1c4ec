"""The compensator with the temperatures of the scales: against the conventions in 40 digits, its range, its table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compensator_oracle import CAPPED, OUTSIDE, REFUSED, Oracle
from error_tables import RandomTable
from refusal import refused
from usual import ALL_CHAINS, CHAIN, VOLUME

import stepdiag as sd

# As in test_truth.py: sums of errors of 0.1 mm have roundings of a few 1e-17 mm. The scales add up to 1 mm here.
ERROR = 2e-15  # mm
POSITION = 2.4e-13  # mm
NOT_TAKEN = REFUSED | 16
EXPANSION = [
    "# temperature_reference_c=19.5",
    "# expansion_per_k=1.15e-05 2.38e-05 -3e-06",
    "# fixed_point_mm=150 -40.5 500",
]
WARM = (28.25, 31.0, 4.5)


def table(seed: int, chain: str = CHAIN, expansion: list[str] = EXPANSION) -> str:
    return "\n".join([*expansion, RandomTable(seed=seed, chain=chain).text()])


def inside(seed: int, count: int, outside: float = 0.0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-outside, np.add(VOLUME, outside), size=(count, 3))


def made(folder: Path, text: str, chain: str = CHAIN, **options: Any) -> sd.Compensator:
    path = folder / "table.csv"
    path.write_text(text)
    return sd.Compensator(path, chain, **({"temperatures": (0.0, 40.0)} | options))


@pytest.mark.slow
@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_answers_of_every_chain_are_those_of_the_conventions(tmp_path: Path, chain: str) -> None:
    text = table(ALL_CHAINS.index(chain), chain)
    compensator, oracle = made(tmp_path, text, chain), Oracle(text)
    for tool in (None, (-150.0, 40.0, 220.0)):
        points = inside(1, 4)
        answers = [oracle.error(p, tool, WARM) for p in points]
        close(compensator.error(points, tool, WARM), [a.position for a in answers], ERROR)
        close(compensator.orientation(points, tool, WARM), [a.orientation for a in answers], 1e-18)
        close(compensator.forward(points, tool, WARM), [oracle.forward(p, tool, WARM) for p in points], POSITION)
        close(
            compensator.command(points, tool, WARM),
            [oracle.command(p, tool, WARM) for p in points],
            POSITION + 1.2 * compensator.inverse_bound,
        )
        assert list(compensator.status(points, tool, WARM)) == [0, 0, 0, 0]


def close(found: Any, expected: Any, tolerance: float) -> None:
    worst = max(float(abs(f - e)) for f, e in zip(np.ravel(found), np.ravel(np.array(expected)), strict=True))
    assert worst <= tolerance, f"{worst} is more than {tolerance}"


@pytest.mark.parametrize(
    "options",
    [{"outside": "linear", "margin": 10.0}, {"origin": (-400.0, 1000.0, 1 / 3)}, {"largest_correction": 0.1}, {}],
)
def test_options_mean_the_same(tmp_path: Path, options: dict[str, Any]) -> None:
    text = table(100)
    compensator, oracle = made(tmp_path, text, **options), Oracle(text, **options)
    beyond = inside(2, 9)
    beyond[:, 2] = -9.0
    points = np.vstack([inside(2, 9), beyond]) + options.get("origin", (0.0, 0.0, 0.0))
    answers = [oracle.error(p, None, WARM) for p in points]
    assert {a.status & ~CAPPED for a in answers} == {0, OUTSIDE}
    np.testing.assert_array_equal(compensator.status(points, temperature=WARM), [a.status for a in answers])
    close(compensator.error(points, temperature=WARM), [a.position for a in answers], ERROR)
    close(compensator.forward(points, temperature=WARM), [oracle.forward(p, None, WARM) for p in points], POSITION)


@pytest.mark.parametrize("seed", range(3))
def test_forward_of_a_command_is_the_target(tmp_path: Path, seed: int) -> None:
    chain = ALL_CHAINS[7 * seed]
    compensator = made(tmp_path, table(200 + seed, chain), chain, temperatures=(-50.0, 90.0))
    targets = inside(seed, 20_000, outside=20.0)
    for temperature in (WARM, (-50.0, 90.0, 19.5), (90.0, 90.0, -50.0)):
        reached = compensator.forward(compensator.command(targets, temperature=temperature), temperature=temperature)
        assert np.linalg.norm(reached - targets, axis=1).max() <= compensator.inverse_bound
        assert compensator.inverse_bound == 1e-10  # as without temperatures


def test_the_scales_alone_move_the_tool_by_their_expansion(tmp_path: Path) -> None:
    """A machine without errors, steel, 3 K: 11.5 µm/(m K) · 0.8 m · 3 K = 27.6 µm at the end of X."""
    lines = ["# temperature_reference_c=20", "# expansion_per_k=11.5e-6 11.5e-6 11.5e-6"]
    sd.ErrorMap({"EXX": ([0.0, 800.0], [0.0, 0.0])}).write(
        tmp_path / "none.csv", chain=CHAIN, volume=VOLUME, tool=(0, 0, 0)
    )
    text = "\n".join([*lines, (tmp_path / "none.csv").read_text()])
    compensator = made(tmp_path, text, outside="linear", margin=1.0)
    error = compensator.error([VOLUME], temperature=(23.0, 23.0, 18.0))[0]
    np.testing.assert_allclose(error, (27.6e-3, 20.7e-3, -11.5e-3), rtol=0, atol=1e-15)
    command = compensator.command([VOLUME], temperature=(23.0, 23.0, 18.0))[0]
    np.testing.assert_allclose(command, np.array(VOLUME) / (1 + 11.5e-6 * np.array([3, 3, -2])), rtol=0, atol=1e-10)


def test_without_temperatures_nothing_changes(tmp_path: Path) -> None:
    points = inside(3, 500, outside=10.0)
    plain = made(tmp_path, RandomTable(seed=300).text(), temperatures=None)
    expands = made(tmp_path, table(300))
    for name in ("error", "orientation", "command", "forward", "status"):
        np.testing.assert_array_equal(getattr(expands, name)(points), getattr(plain, name)(points))
    np.testing.assert_array_equal(expands.error(points, temperature=(19.5, 19.5, 19.5)), plain.error(points))
    assert plain.temperature_reference is None
    assert expands.temperature_reference == 19.5
    assert plain.fingerprint != expands.fingerprint


def test_a_temperature_that_is_not_taken_has_no_answer(tmp_path: Path) -> None:
    compensator = made(tmp_path, table(301), temperatures=(10.0, 30.0))
    points = inside(4, 2)
    assert list(compensator.status(points, temperature=(10.0, 30.0, 20.0))) == [0, 0]
    for bad in (9.9, 30.1, np.nan, np.inf, -np.inf):
        temperature = (20.0, bad, 20.0)
        assert list(compensator.status(points, temperature=temperature)) == [NOT_TAKEN, NOT_TAKEN]
        for answer in (compensator.error, compensator.orientation, compensator.command, compensator.forward):
            assert np.isnan(answer(points, temperature=temperature)).all()
    off = made(tmp_path, table(301), temperatures=None)
    assert list(off.status(points, temperature=(20.0, 20.0, 20.0))) == [NOT_TAKEN, NOT_TAKEN]
    refused(compensator.error, points, None, (20.0, 20.0), names="temperature")


def test_a_table_that_is_not_referred_by_a_known_expansion_is_refused(tmp_path: Path) -> None:
    def refuses(lines: list[str], names: str, **options: Any) -> None:
        refused(made, tmp_path, table(302, expansion=lines), names=names, **options)

    refuses([], "got neither")
    refuses(["# temperature_as_found_c=23.1 23.0 22.8"], "got errors as found at 23.1 23.0 22.8 degrees Celsius")
    refuses(["# temperature_reference_c=20.0"], "got no expansion")
    refuses(["# expansion_per_k=1e-5 1e-5 1e-5"], "temperature_reference_c: expected")
    refuses(["# temperature_reference_c=20", "# expansion_per_k=11.5 11.5 11.5"], "expansion coefficient")
    for range_ in ((30.0, 10.0), (20.0, 20.0), (283.0, 303.0), (np.nan, 30.0), (0.0, np.inf)):
        refuses(EXPANSION, "temperatures: expected", temperatures=range_)
    made(tmp_path, table(302, expansion=["# temperature_as_found_c=23.1 23.0 22.8"]), temperatures=None)
