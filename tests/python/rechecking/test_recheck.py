"""Has the machine changed: `recheck` and `stepdiag recheck`."""

from pathlib import Path

import numpy as np
import pytest
import rechecked
from json_objects import printed
from refusal import refused
from usual import DIAGONALS, SCALE_LINES

import stepdiag as sd
from stepdiag._core import with_covariance
from stepdiag.cli import main
from stepdiag.rechecking.recheck import Judged
from stepdiag.rechecking.verification import ALPHA

KNOWN = """
[volume]
x_mm = 400.0
y_mm = 300.0
z_mm = 250.0

[machine]
chain = "[w X' b Y Z t]"
errors = "machine.csv"

[head]
layout = "ideal"

[noise]
distance_um = 0.2
tilt_urad = 1.0
seed = {seed}

[adjustment]
lateral_mm = "fixed"
roll_urad = "fixed"
gain = "fixed"

[plan]
"""
LINES = 'lines = ["ppp", "npp", "pnp", "nnp"]\n'
CALIBRATED = KNOWN.format(seed=1) + LINES + 'steps = 6\nscale_lines = ["p00", "0p0", "00p"]\n'
SHORT = KNOWN.format(seed=2) + LINES + "steps = 3\n"
HIT = 40e-6  # of C0Y, rad


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A calibration, a short run of the same machine, and one after a collision."""
    monkeypatch.chdir(tmp_path)
    Path("calibrated.toml").write_text(CALIBRATED)
    Path("short.toml").write_text(SHORT)
    errors = sd.random_error_map((400.0, 300.0, 250.0), seed=5, intervals=6)
    errors.write("machine.csv")
    assert main(["simulate", "calibrated.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "calibrated.toml", "run.csv", "-o", "calibration.nc"]) == 0
    assert main(["simulate", "short.toml", "-o", "same.csv"]) == 0
    squareness = dict(errors.squareness)
    squareness["C0Y"] += HIT
    sd.ErrorMap(errors.functions, squareness).write("machine.csv")
    assert main(["simulate", "short.toml", "-o", "hit.csv"]) == 0
    return tmp_path


def test_unchanged_machine(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["recheck", "calibration.nc", "short.toml", "same.csv"]) == 0
    said, warned = capsys.readouterr()
    assert said.startswith("no change of the machine is seen: chi-square ")
    assert "warning" not in warned


def test_change_is_found_attributed_and_taken_over(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["recheck", "calibration.nc", "short.toml", "hit.csv", "--update", "updated.nc"]) == 3
    said, warned = capsys.readouterr()
    assert said.startswith("the machine has changed: chi-square ")
    assert "  C0Y (squareness)" in said
    assert "warning: calibration.nc: the machine has changed since" in warned
    before, after = sd.read_calibration("calibration.nc"), sd.read_calibration("updated.nc")
    truth = sd.read_error_map("machine.csv").squareness["C0Y"]
    value, uncertainty = after.squareness["C0Y"]
    assert abs(value - truth) < 4.0 * uncertainty
    assert abs(before.squareness["C0Y"][0] - truth) > 0.8 * HIT
    assert after.method == f"adjustment of {before.date}, rechecked"
    assert after.covariance is not None
    # It is a calibration like any other.
    assert main(["verify", "updated.nc", "short.toml", "same.csv"]) == 3
    assert main(["volume", "updated.nc"]) == 0


def test_object_has_what_the_report_has(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["calibration.nc", "short.toml", "hit.csv", "--update", "updated.nc"]
    result = printed("recheck", capsys, "recheck", *words, status=3)
    baseline, run = sd.read_calibration("calibration.nc"), sd.read_measurement("hit.csv")
    found = sd.recheck(baseline, sd.read_scenario("short.toml"), run)
    assert (result["changed"], result["explained"], result["updated"]) == (True, True, "updated.nc")
    assert result["chi_square"] == found.chi_square
    by_name = {term.parameter: term for term in found.terms}
    (changed,) = [one for one in result["changes"] if one["parameter"] == "C0Y"]
    assert changed["value"]["value"] == pytest.approx(1e6 * by_name["C0Y"].value)
    assert changed["value"]["unit"] == "urad"
    assert {(one["parameter"], one["kind"]) for one in result["changes"]} == {
        (t.parameter, t.kind) for t in found.terms
    }
    assert len(result["sums"]) == found.degrees_of_freedom


def test_what_priors_rule_out_is_no_change(folder: Path) -> None:
    Path("rigid.toml").write_text(SHORT + "[change]\nsquareness_urad = 0\n")
    baseline, run = sd.read_calibration("calibration.nc"), sd.read_measurement("hit.csv")
    found = sd.recheck(baseline, sd.read_scenario("rigid.toml"), run)
    assert "C0Y" not in {term.parameter for term in found.terms}
    judged = Judged(found, baseline, 0.001)
    assert not judged.is_explained
    assert judged.updated.fit == "rejected"


def test_one_diagonal_tells_one_number_of_scales_and_squarenesses(folder: Path) -> None:
    Path("one.toml").write_text(SHORT.replace(LINES, 'lines = ["ppp"]\n'))
    assert main(["simulate", "one.toml", "-o", "one.csv"]) == 0
    baseline = sd.read_calibration("calibration.nc")
    found = sd.recheck(baseline, sd.read_scenario("one.toml"), sd.read_measurement("one.csv"))
    lengths = [term.kind in ("scale", "squareness") for term in found.terms]
    assert all(term.determined < 0.9 for term, is_length in zip(found.terms, lengths, strict=True) if is_length)
    mostly = [sum(np.array(one.weight)[lengths] ** 2) > 0.5 for one in found.combinations]
    assert sum(mostly) == 1


def test_hidden_change_is_that_of_the_priors_where_nothing_is_told(folder: Path) -> None:
    """By the closed form: at the far corner a squareness moves the tool by the travel, a scale likewise."""
    baseline = sd.read_calibration("calibration.nc")
    priors = sd.methods.ChangePriors(scale=0.0, bow=0.0, slope=0.0, squareness=50e-6)
    known = sd.read_scenario("short.toml").known
    plan = sd.Plan((400.0, 300.0, 250.0), ["p00"], 3)
    run = sd.simulate(sd.Machine(known.chain, sd.ErrorMap({}, {})), plan, sd.Head(), noise=sd.Noise(distance=1e-4))
    found = sd.methods.recheck(baseline, run, plan, sd.Head(), known.chain, priors=priors)
    assert all(term.determined < 0.1 for term in found.terms)
    expected = 2.0 * 50e-6 * np.sqrt(300.0**2 + 2.0 * 250.0**2)
    assert Judged(found, baseline, 0.001).hidden == pytest.approx(expected, rel=1e-3)


def test_what_cannot_be_rechecked_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recheck", "calibration.nc", "calibrated.toml", "run.csv"]) == 2
    assert "the calibration was made from this run" in capsys.readouterr().err
    Path("none.toml").write_text(
        SHORT + "[change]\nsquareness_urad = 0\nscale_um_per_m = 0\nbow_um = 0\nslope_urad = 0\n"
    )
    baseline, run = sd.read_calibration("calibration.nc"), sd.read_measurement("same.csv")
    refused(sd.recheck, baseline, sd.read_scenario("none.toml"), run, names="one kind of change")


@pytest.mark.parametrize("seed", [14, 36, 54])
def test_machine_that_has_changed_in_all_ways_is_told_as_such(seed: int) -> None:
    """Set-ups are free in much, and must not be taken for the change of the machine."""
    drawn, baseline, rng = rechecked.calibrated(1_000_000 + seed, 4)
    plan = rechecked.short_plan(drawn, seed, 4)
    machine = rechecked.changed_machine(drawn, rechecked.random_change(rng))
    run = rechecked.read_again(drawn, machine, plan, rng)
    given = (baseline, run, plan, drawn.head, sd.Chain(drawn.chain), machine.tool)
    found = sd.methods.recheck(*given, options=rechecked.options(drawn))
    assert found.probability < 1e-12
    assert found.fit_probability > 1e-6
    assert sd.methods.verify(*given, options=rechecked.options(drawn)).probability < 1e-12


def with_wrong_distance(run: sd.Measurement, row: int, wrong: float) -> sd.Measurement:
    distance = np.array(run.channels["distance"])
    distance[row] += wrong
    return sd.Measurement(run.line, run.point, run.position, {**run.channels, "distance": distance})


def test_change_that_is_not_of_low_order_is_unexplained(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    errors = sd.read_error_map("machine.csv")
    position, value = errors.functions["EXX"]
    ripple = np.where(np.arange(len(position)) % 4 == 2, 5e-3, 0.0)  # at every other node that is read
    sd.ErrorMap({**errors.functions, "EXX": (position, value + ripple)}, errors.squareness).write("machine.csv")
    assert main(["simulate", "short.toml", "-o", "screw.csv"]) == 0
    capsys.readouterr()
    assert main(["recheck", "calibration.nc", "short.toml", "screw.csv", "--update", "updated.nc"]) == 3
    said, warned = capsys.readouterr()
    assert said.startswith("the machine has changed, unexplained: the readings agree neither with the calibration nor ")
    rows = [line for line in said.splitlines() if "times its standard uncertainty" in line]
    assert len(rows) == 5
    assert all(row.startswith("  distance at line ") for row in rows)
    assert warned.startswith("warning: screw.csv: the machine has changed, unexplained: ")
    updated = sd.read_calibration("updated.nc")
    assert updated.fit == "rejected"
    assert "recheck: no change of low order explains the readings" in updated.fit_reasons
    result = printed("recheck", capsys, "recheck", "calibration.nc", "short.toml", "screw.csv", status=3)
    assert (result["verdict"], result["explained"], result["left_out"]) == ("unexplained", False, [])
    for one, row in zip(result["misfits"], rows, strict=True):
        assert f"line {one['line']}, run 0, point {one['point']}: " in row
    deviations = [one["deviation"] for one in result["misfits"]]
    times = [abs(one["value"]) / one["standard_uncertainty"] for one in deviations]
    assert times == sorted(times, reverse=True)


@pytest.mark.parametrize("wrong", [0.02, -1.0])
def test_wrong_reading_is_named_and_left_out(folder: Path, capsys: pytest.CaptureFixture[str], wrong: float) -> None:
    run = sd.read_measurement("same.csv")
    row = 15
    with_wrong_distance(run, row, wrong).write("wrong.csv")
    capsys.readouterr()
    for command, verdict in (
        ("recheck", "no change of the machine is seen, by the readings that are not left out: "),
        ("verify", "the readings that are not left out agree with the calibration: "),
    ):
        assert main([command, "calibration.nc", "short.toml", "wrong.csv"]) == 3
        said, warned = capsys.readouterr()
        assert said.startswith(verdict)
        what = f"a wrong reading: distance of {run.line[row]} point {run.point[row]} is "
        assert what in said
        assert f"warning: wrong.csv: {what}" in warned
    result = printed("recheck", capsys, "recheck", "calibration.nc", "short.toml", "wrong.csv", status=3)
    assert (result["verdict"], result["changed"], result["misfits"]) == ("unchanged", False, [])
    (fault,) = result["left_out"][0]["members"]
    assert (fault["row"], fault["kind"]) == (row, "reading")
    assert abs(fault["size"]["value"] - 1e3 * wrong) < 5.0 * fault["size"]["standard_uncertainty"]


@pytest.mark.slow
@pytest.mark.parametrize("layout", rechecked.LAYOUTS)
@pytest.mark.parametrize("event", rechecked.EVENTS)
def test_whatever_happened_is_judged(event: str, layout: str) -> None:
    """No calibration near the baseline explains most of these; the run is judged all the same."""
    for seed in range(4):
        one = rechecked.after(event, layout, seed)
        judged = Judged(sd.methods.recheck(*one.given, options=one.options), one.baseline, ALPHA)
        verified = sd.methods.verify(*one.given, options=one.options)
        if event == "nothing":
            assert judged.is_sound
            assert verified.probability >= ALPHA
        if event == "cubic bow":
            assert judged.verdict != "unchanged"
            assert verified.probability < ALPHA
        if event == "wrong reading":
            assert not judged.is_sound
            for left_out in (judged.recheck.left_out, verified.left_out):
                assert one.hit in {(fault.line, fault.point) for found in left_out for fault in found.members}
            assert judged.verdict == "unchanged"
            assert verified.probability >= ALPHA


@pytest.mark.slow
def test_fit_refuses_as_many_unchanged_machines_as_it_says() -> None:
    """Of 300 machines 5 %, within four binomial standard deviations."""
    probabilities = []
    for seed in range(300):
        drawn, baseline, rng = rechecked.calibrated(seed, 4)
        plan = rechecked.short_plan(drawn, seed, 4)
        run = rechecked.read_again(drawn, drawn.machine, plan, rng)
        given = (baseline, run, plan, drawn.head, sd.Chain(drawn.chain), drawn.machine.tool)
        probabilities.append(sd.methods.recheck(*given, options=rechecked.options(drawn)).fit_probability)
    refused_share = np.mean(np.array(probabilities) < 0.05)
    assert abs(refused_share - 0.05) < 4.0 * np.sqrt(0.05 * 0.95 / len(probabilities))


def test_square_sum_of_the_fit_is_that_of_generalised_least_squares(folder: Path) -> None:
    """An oracle that shares nothing with the solution: dense, derivatives by differences of `simulate`."""
    baseline, scenario = sd.read_calibration("calibration.nc"), sd.read_scenario("short.toml")
    run, known = sd.read_measurement("same.csv"), scenario.known
    found = sd.recheck(baseline, scenario, run)
    labels, lines = baseline.covariance_labels, ("ppp", "npp", "pnp", "nnp")

    def read(change: np.ndarray, setups: np.ndarray) -> np.ndarray:
        functions = {name: (p, v.copy()) for name, (p, v, _) in baseline.functions.items()}
        squareness = {name: value for name, (value, _) in baseline.squareness.items()}
        for (name, position), by in zip(labels, change, strict=True):
            if name in squareness:
                squareness[name] += by
            else:
                functions[name][1][functions[name][0] == position] += by
        misalignment = {
            line: sd.Misalignment(reflector=s[:2], laser=s[2:4], distance_constant=s[4])
            for line, s in zip(lines, setups.reshape(4, 5), strict=True)
        }
        machine = sd.Machine(known.chain, sd.ErrorMap(functions, squareness), known.tool)
        made = sd.simulate(machine, known.plan, sd.Head(), misalignment=misalignment)
        return np.concatenate([made.channels[c] for c in ("distance", "alpha", "beta")])

    def columns(function, at, steps):  # type: ignore[no-untyped-def]
        return np.stack(
            [(function(at + step) - function(at - step)) / (2 * step[step != 0][0]) for step in np.diag(steps)], axis=1
        )

    zero, setups = np.zeros(len(labels)), np.zeros(20)
    sizes = np.array([1e-4 if name[0] == "E" and name[1] in "XYZ" else 1e-6 for name, _ in labels])
    by_value = columns(lambda change: read(change, setups), zero, sizes)
    values = np.concatenate([run.channels[c] for c in ("distance", "alpha", "beta")])
    u = np.repeat([0.2e-3, 1e-6, 1e-6], len(run))
    weight = np.linalg.inv(by_value @ baseline.covariance @ by_value.T + np.diag(u**2))
    steps = np.tile([1e-6, 1e-6, 1e-6, 1e-6, 1e-3], 4)
    root = np.linalg.cholesky(weight).T
    # Of the terms by their priors, the directions that readings tell beside free set-ups.
    by_term = root @ by_value @ found.shape * [term.prior for term in found.terms]
    basis, _ = np.linalg.qr(root @ columns(lambda s: read(zero, s), setups, steps))
    beside = by_term - basis @ (basis.T @ by_term)
    information, direction = np.linalg.eigh(beside.T @ beside)
    free = by_term @ direction[:, information >= 1e-2]
    change = np.zeros(free.shape[1])
    for _ in range(6):
        all_columns = np.hstack([root @ columns(lambda s: read(zero, s), setups, steps), free])
        residual = root @ (values - read(zero, setups)) - free @ change
        step = np.linalg.lstsq(all_columns / np.linalg.norm(all_columns, axis=0), residual, rcond=None)[0]
        step /= np.linalg.norm(all_columns, axis=0)
        setups, change = setups + step[:20], change + step[20:]
    residual = root @ (values - read(zero, setups)) - free @ change
    assert found.fit_degrees_of_freedom == len(values) - 20 - len(change)
    # Second order of the change, and differences for derivatives, are below this.
    assert found.fit_chi_square == pytest.approx(residual @ residual, rel=2e-3)


@pytest.mark.parametrize(("size", "noise"), [(10.0, 1e-7), (1000.0, 1e-6)])
def test_readings_of_a_billionth_of_their_distance_are_judged(size: float, noise: float) -> None:
    """A baseline as good as its readings would make it: of readings without noise, its covariance that of coarse ones
    scaled down."""
    volume, coarse, tilt = (size, 0.8 * size, 0.6 * size), 1e4, noise / size
    errors = sd.random_error_map(volume, seed=1, translation=1e-5 * size, rotation=2e-5, squareness=2e-5, intervals=6)
    chain, head = sd.Chain("[w X' b Y Z t]"), sd.Head(standoff=0.2 * size)

    def read(squareness: float, plan: sd.Plan, times: float) -> sd.Measurement:
        hit = sd.ErrorMap(errors.functions, {**errors.squareness, "C0Y": errors.squareness["C0Y"] + squareness})
        drawn = sd.Noise(distance=times * noise, tilt=times * tilt, seed=1)
        return sd.simulate(sd.Machine(chain, hit), plan, head, noise=drawn)

    def known_to(times: float) -> sd.methods.AdjustmentOptions:
        return sd.methods.AdjustmentOptions(
            uncertainty=sd.methods.ReadingUncertainty(distance=times * noise, tilt=times * tilt), full_covariance=True
        )

    plan = sd.Plan(volume, DIAGONALS, 6, scale_lines=SCALE_LINES)
    found = sd.methods.adjust(read(0.0, plan, 0.0), plan, head, chain, options=known_to(coarse)).calibration
    assert found.covariance is not None
    baseline = with_covariance(found, found.covariance / coarse**2)
    short = sd.Plan(volume, DIAGONALS, 3)

    def rechecked_run(run: sd.Measurement) -> sd.results.Recheck:
        return sd.methods.recheck(baseline, run, short, head, chain, options=known_to(1.0))

    same = rechecked_run(read(0.0, short, 1.0))
    assert min(same.probability, same.fit_probability) > 1e-3
    hit = rechecked_run(read(100.0 * tilt, short, 1.0))
    assert hit.probability < 1e-12
    assert hit.fit_probability > 1e-3
    wrong = rechecked_run(with_wrong_distance(read(0.0, short, 1.0), 5, 1e-4 * size))
    assert [fault.row for left_out in wrong.left_out for fault in left_out.members] == [5]
    assert wrong.left_out[0].members[0].size == pytest.approx(1e-4 * size, rel=1e-4)
    assert min(wrong.probability, wrong.fit_probability) > 1e-3
