"""What the adjustment claims to determine, against the null space of the dense model; and the words it says it with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference
from adjusted import adjust, assert_nothing_is_determined, assert_rank, distance_from, error_map, is_complete
from dense_adjustment import DenseAdjustment, Knowledge
from hypothesis import given, settings
from hypothesis import strategies as st
from truth import deviations
from usual import ALL_CHAINS, DIAGONALS, FACES, ORDERS, SCALE_LINES
from virtual_runs import lost, measured, random_scenario, random_table, within

import stepdiag as sd

SINGLE = ["p00", "0p0", "00p", "n00", "0n0", "00n"]
ALL_LINES = [a + b + c for a in "pn0" for b in "pn0" for c in "pn0" if a + b + c != "000"]
FREE_ANGLES = {"reflector": "free", "laser": "free"}

# What is not determined is taken to be near 0, and what is determined sees the difference in second order: the scale of
# an axis and angles of the set-up, 1e-4 both, times angles of 60 urad and more, over 1 m.
SECOND_ORDER = (1e-3, 1e-6)  # mm, rad


def tried(
    lines: list[str],
    scale_lines: list[str],
    knowledge: Knowledge | None = None,
    drop: tuple[str, ...] = (),
    gone: tuple[tuple[str, int], ...] = (),
    **given: Any,
) -> tuple[sd.Adjustment | None, DenseAdjustment, reference.ErrorTable]:
    """A noise-free run of a plan, adjusted, and the dense model's rank; no adjustment where nothing is determined.

    Set-up angles that are fixed or have a prior are 0; the others are small, because where they are not determined
    either, they are taken to be near 0."""
    rng = np.random.default_rng(21)
    setup = (knowledge or Knowledge()).setup
    small = {
        line: {
            quantity: within(rng, 1e-4)
            for quantity in ("reflector", "laser")
            if setup.get((line, quantity), setup.get(quantity, "free")) == "free"
        }
        for line in lines
    }
    scenario = random_scenario(
        rng, **({"lines": lines, "scale_lines": scale_lines, "steps": 3, "misalignment": small} | given)
    )
    turning = 60e-6 if knowledge is None or knowledge.rotations else 0.0
    table = random_table(rng, scenario.volume, scenario.steps, rotation=turning)
    run = lost(measured(reference.simulate(scenario, table)), gone, drop)
    dense = DenseAdjustment(run, scenario, knowledge)
    return adjusted_or_refused(run, scenario, knowledge, dense), dense, table


def adjusted_or_refused(
    run: sd.Measurement, scenario: reference.Scenario, knowledge: Knowledge | None, dense: DenseAdjustment
) -> sd.Adjustment | None:
    """None where nothing at all is determined, and that is what is said."""
    try:
        return adjust(run, scenario, knowledge, outlier_probability=0.0)
    except sd.InvalidArgument as refusal:
        message = str(refusal)
    assert "nothing can be determined" in message, message
    assert_nothing_is_determined(dense)
    return None


PLANS: dict[str, tuple[list[str], list[str], dict[Any, Any]]] = {
    "diagonals and three scale lines": (DIAGONALS, SCALE_LINES, {}),
    "diagonals and two scale lines": (DIAGONALS, SCALE_LINES[1:], {}),
    "diagonals and one scale line": (DIAGONALS, ["0p0"], {}),
    "diagonals alone": (DIAGONALS, [], {}),
    "three diagonals and scale lines": (DIAGONALS[:3], SCALE_LINES, {}),
    "three diagonals alone": (DIAGONALS[1:], [], {}),
    "two diagonals and scale lines": (DIAGONALS[:2], SCALE_LINES, {}),
    "one diagonal": (["ppp"], [], {}),
    "one diagonal and scale lines": (["npn"], SCALE_LINES, {}),
    "faces, angles free": (FACES, [], FREE_ANGLES),
    "faces, reflector fixed": (FACES, [], {"reflector": "fixed"}),
    "faces, laser fixed": (FACES, [], {"laser": "fixed"}),
    "faces and scale lines, angles free": (FACES, SCALE_LINES, FREE_ANGLES),
    "four faces": (FACES[:4], [], {"reflector": "fixed"}),
    "two faces": (FACES[:2], [], {"reflector": "fixed"}),
    "faces and diagonals": ([*FACES[:3], *DIAGONALS[:2]], [], {}),
    "single axes": (SCALE_LINES, [], {}),
    "one axis": (["p00"], [], {}),
    "one axis and scale lines": (["p00"], ["0p0", "00p"], {}),
    "a single axis both ways": (["p00", "n00"], [], {}),
    "everything fixed": (DIAGONALS, [], {"reflector": "fixed", "laser": "fixed", "distance_constant": "fixed"}),
    "laser known": (DIAGONALS, [], {"laser": 1e-4}),
    "both known": (["ppp", "pp0"], ["00p"], {"laser": 1e-5, "reflector": 1e-5}),
    "constants fixed": (DIAGONALS[:3], [], {"distance_constant": "fixed"}),
    "scale lines' reflector free": (DIAGONALS, SCALE_LINES, {("p00", "reflector"): "free"}),
    "no cosine error": (DIAGONALS, SCALE_LINES, {("p00", "laser"): "fixed", ("0p0", "laser"): "fixed"}),
}


@pytest.mark.parametrize("layout", ["ideal", "psd"])
@pytest.mark.parametrize("plan", PLANS)
def test_claims_are_those_of_the_rank(plan: str, layout: str) -> None:
    lines, scale_lines, setup = PLANS[plan]
    adjustment, dense, table = tried(lines, scale_lines, Knowledge(setup), layout=layout)
    if adjustment is None:
        return
    assert_rank(adjustment, dense)
    error = distance_from(adjustment, table)
    assert error.position <= SECOND_ORDER[0], error
    assert error.angle <= SECOND_ORDER[1], error


@pytest.mark.parametrize("laser", [None, "free", "fixed"])
@pytest.mark.parametrize("lines", [DIAGONALS, DIAGONALS[:3], FACES, ["ppp"]])
def test_claims_of_beams_with_constants_are_those_of_the_rank(lines: list[str], laser: Any) -> None:
    knowledge = Knowledge({} if laser is None else {"laser": laser})
    adjustment, dense, _ = tried(lines, SCALE_LINES, knowledge, layout="multi_beam")
    assert adjustment is not None
    assert_rank(adjustment, dense)


@pytest.mark.parametrize("rotations", [True, False])
@pytest.mark.parametrize("reflector", ["free", "fixed"])
@pytest.mark.parametrize("lines", [DIAGONALS, [*DIAGONALS, "ppn", "nnn"], FACES, [*FACES, *DIAGONALS], ["ppp", "p00"]])
def test_distances_only(lines: list[str], reflector: Any, rotations: bool) -> None:
    """Without tilts only a machine without angles is seen: by lever arms the others show in some places."""
    knowledge = Knowledge({"reflector": reflector}, rotations=rotations)
    scales = [line for line in SCALE_LINES[:2] if line not in lines]
    adjustment, dense, _ = tried(lines, scales, knowledge, drop=("alpha", "beta"), tool=(0.0, 0.0, 0.0))
    if adjustment is not None:
        assert_rank(adjustment, dense)


@pytest.mark.parametrize(
    "gone",
    [
        (("ppp", 0),),
        (("ppp", 9),),
        (("ppp", 4), ("npp", 4), ("pnp", 4), ("nnp", 4)),
        (("ppp", 8), ("ppp", 9), ("npp", 8), ("npp", 9), ("pnp", 8), ("pnp", 9), ("nnp", 8), ("nnp", 9)),
        tuple(("ppp", k) for k in range(10)),
        tuple((line, k) for line in DIAGONALS for k in (0, 1, 2)),
        tuple((line, k) for line in DIAGONALS for k in (4, 5, 6)),
        (("p00", 0),),
        (("p00", 1), ("0p0", 1)),
    ],
)
@pytest.mark.parametrize("lines", [DIAGONALS, DIAGONALS[:3]])
def test_lost_points_lines_and_nodes(lines: list[str], gone: tuple[tuple[str, int], ...]) -> None:
    there = tuple((line, k) for line, k in gone if line in [*lines, *SCALE_LINES])
    adjustment, dense, _ = tried(lines, SCALE_LINES, gone=there, order="XYZ")
    if adjustment is not None:
        assert_rank(adjustment, dense)


@pytest.mark.slow
@settings(max_examples=150)
@given(data=st.data())
def test_any_plan_with_any_losses_claims_what_the_rank_allows(data: st.DataObject) -> None:
    pool = data.draw(st.sampled_from([ALL_LINES, DIAGONALS, [*FACES, *DIAGONALS]]))
    lines = data.draw(st.lists(st.sampled_from(pool), min_size=1, max_size=5, unique=True))
    scales = data.draw(st.lists(st.sampled_from(SINGLE), max_size=3, unique=True))
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    prior = st.sampled_from(["free", "fixed", 1e-4])
    setup = {
        quantity: data.draw(prior)
        for quantity in data.draw(st.sets(st.sampled_from(["reflector", "laser", "distance_constant"])))
    }
    scenario = random_scenario(
        rng,
        lines=lines,
        scale_lines=[line for line in scales if line not in lines],
        steps=data.draw(st.integers(1, 3)),
        layout=data.draw(st.sampled_from(["ideal", "psd", "multi_beam"])),
        chain=data.draw(st.sampled_from(ALL_CHAINS)),
        order=data.draw(st.sampled_from(ORDERS)),
        misalignment={},
        backward=data.draw(st.booleans()),
    )
    knowledge = Knowledge({(line, q): p for q, p in setup.items() for line in lines})
    run = measured(reference.simulate(scenario, random_table(rng, scenario.volume, scenario.steps)))
    share = data.draw(st.sampled_from([0.0, 0.05, 0.3]))
    channels = {name: np.where(rng.random(len(run)) < share, np.nan, value) for name, value in run.channels.items()}
    run = sd.Measurement(run.line, run.point, run.position, channels, run=run.run, direction=run.direction)
    dense = DenseAdjustment(run, scenario, knowledge)
    if not dense.gap[1] < 1e-12 or dense.gap[0] < 1e-5:
        return  # readings lost so that something is barely determined: a matter of the threshold
    adjustment = adjusted_or_refused(run, scenario, knowledge, dense)
    if adjustment is not None:
        assert_rank(adjustment, dense)


def test_words_name_what_is_missing_and_what_would_help() -> None:
    adjustment, _, _ = tried(DIAGONALS, ["0p0"])
    assert adjustment is not None
    said = "\n".join(adjustment.calibration.undetermined)
    for axis, line in (("X", "p00"), ("Z", "00p")):
        assert any(f"scale of {axis}" in s and line in s for s in adjustment.calibration.undetermined), said
    assert "scale of Y" not in said
    # Two scales in one equation left: what is known of both is listed.
    assert adjustment.combinations

    adjustment, _, _ = tried(FACES, [], Knowledge(FREE_ANGLES))
    assert adjustment is not None
    said = "\n".join(adjustment.calibration.undetermined)
    assert is_complete(adjustment.calibration)
    assert "reflector" in said
    assert "prior" in said
    assert "pp0" in said


def test_nothing_at_all_is_a_refusal() -> None:
    rng = np.random.default_rng(1)
    scenario = random_scenario(rng, steps=2, misalignment={})
    run = measured(reference.simulate(scenario, random_table(rng, scenario.volume, 2)))
    nothing = sd.Measurement(
        run.line, run.point, run.position, {name: np.full(len(run), np.nan) for name in run.channels}
    )
    with pytest.raises(sd.InvalidArgument, match=r"determined|reading"):
        adjust(nothing, scenario)


@pytest.mark.parametrize("channel", ["alpha", "beta"])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_open_stays_within_the_uncertainties(channel: str, seed: int) -> None:
    """Without one of the tilts an angle of each laser is open, up to 2 mrad; by its square it moves micrometres."""
    rng = np.random.default_rng(90 + seed)
    scenario = random_scenario(rng, steps=5)
    table = random_table(rng, scenario.volume, 5)
    run = measured(reference.simulate(scenario, table))
    channels = dict(run.channels) | {channel: np.full(len(run), np.nan)}
    adjustment = adjust(sd.Measurement(run.line, run.point, run.position, channels), scenario)
    calibration = adjustment.calibration
    assert any("laser tilt" in sentence for sentence in calibration.undetermined)
    assert len(calibration.functions) >= 9
    for name, deviation in deviations(calibration, error_map(table)).items():
        u = calibration.squareness[name][1] if name in calibration.squareness else calibration.functions[name][2]
        assert np.all(np.abs(deviation) <= 4.5 * u + 1e-11), name  # noise-free: it is all of this kind
