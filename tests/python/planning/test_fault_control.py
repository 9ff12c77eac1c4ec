"""Which faults a plan controls: what is said of them against runs that have them."""

from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.parameters import KINDS, kind_of
from stepdiag.planning.fault_control import distinguishes_all, extensions
from stepdiag.planning.observation import not_measured, observe
from stepdiag.presentation.blocks import text_of
from stepdiag.presentation.fault_control import control_blocks, extension_blocks
from stepdiag.scenario.description import Scenario, adjust_scenario, parse_scenario
from stepdiag.scenario.truth import Truth

U = {"distance": 0.1e-3, "alpha": 1e-6, "beta": 1e-6}  # of a reading, mm and rad
SMALL = SCENARIO.split("[misalignment]")[0].replace("steps = 5", "steps = 2")
FACES = SMALL.replace('"nnp"]', '"nnp", "pp0", "p0p", "0pp"]')
TWICE = SMALL.replace("steps = 2", "steps = 2\nrepeats = 2")


def with_fault(run: sd.Measurement, channel: str, rows: np.ndarray, size: np.ndarray) -> sd.Measurement:
    values = run.channels
    values[channel] = values[channel].copy()
    values[channel][rows] += size
    return sd.Measurement(run.line, run.point, run.position, values, run=run.run)


def faults(run: sd.Measurement) -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    """Kind, channel, rows and shares of every fault there is, by the words of the definition: lines in their order."""
    found = []
    lines = np.array(run.line)
    for number in sorted({*run.run.tolist()}):
        for line in dict.fromkeys(run.line):
            rows = np.flatnonzero((lines == line) & (run.run == number))
            if len(rows) == 2:
                found += [("reading", channel, rows[1:], np.ones(1)) for channel in ("distance", "alpha", "beta")]
                continue
            commanded = run.position[rows]
            way = commanded[-1] - commanded[0]
            travel = (commanded - commanded[0]) @ way / (way @ way)
            found.append(("factor", "distance", rows, travel))
            for channel in ("distance", "alpha", "beta"):
                found += [("reading", channel, rows[i : i + 1], np.ones(1)) for i in range(len(rows))]
                found += [("slip", channel, rows[i:], np.ones(len(rows) - i)) for i in range(2, len(rows) - 1)]
    return found


def values(adjustment: sd.Adjustment) -> dict[str, np.ndarray]:
    """All calibrated values by the kind of their parameter."""
    by_kind: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for name, (_, value, _) in adjustment.calibration.functions.items():
        by_kind[kind_of(name)] += [*value]
    for name, (angle, _) in adjustment.calibration.squareness.items():
        by_kind[kind_of(name)].append(angle)
    return {kind: np.array(found) for kind, found in by_kind.items()}


@pytest.mark.parametrize("text", [SMALL, FACES], ids=["four body diagonals", "with three face diagonals"])
def test_what_is_said_of_faults_is_what_adjustments_of_runs_with_them_show(text: str) -> None:
    known = not_measured(parse_scenario(text).known)
    run = sd.simulate(Scenario(known, Truth()))
    sound = values(adjust_scenario(known, run))
    everything = faults(run)
    shown, effects, sizes = [], [], []
    for _, channel, rows, share in everything:
        size = 0.1 * U[channel]  # small: of first order
        found = adjust_scenario(known, with_fault(run, channel, rows, size * share))
        # What the adjustment leaves of the fault, in units of the readings, and what of it goes to the values.
        shown.append(np.concatenate([np.nan_to_num(found.residuals[c]) / U[c] for c in U]) / size)
        now = values(found)
        effects.append({kind: (now[kind] - sound[kind]) / size for kind in KINDS})
        sizes.append(size)
    offset = {channel: i * len(run) for i, channel in enumerate(U)}
    products = np.array([[left[offset[c] + rows] @ share / U[c] for _, c, rows, share in everything] for left in shown])
    u = 1.0 / np.sqrt(np.diag(products))
    correlation = products * np.outer(u, u)
    np.fill_diagonal(correlation, 0.0)

    said = {(c.kind, c.channel): c for c in adjust_scenario(known, run, reliability=True).reliability}
    assert len(said) == 5
    for (kind, name), control in said.items():
        channels = ("distance",) if name == "distance" else ("alpha", "beta")
        own = [i for i, (k, c, _, _) in enumerate(everything) if k == kind and c in channels]
        assert control.count == len(own)
        assert control.uncontrolled == 0
        # Rounding of the run's lengths, 1e-14 of a fault of 1e-5 mm by a few hundred; second order.
        rel = 1e-4
        assert control.found_from == pytest.approx(7.6 * max(u[own]), rel=rel)
        for family in KINDS:
            hidden = max(7.6 * u[i] * np.max(np.abs(effects[i][family])) for i in own)
            assert control.hidden[family] == pytest.approx(hidden, rel=rel)
        shared = dict.fromkeys(KINDS, 0.0)
        with_twin = set()
        for i in own:
            for k in np.flatnonzero(np.abs(correlation[i]) >= 0.999):
                size = correlation[i, k] * u[k] / u[i]
                apart = {kind: np.max(np.abs(effects[i][kind] - size * effects[k][kind])) for kind in KINDS}
                if max(apart.values()) > 1e-5:  # rounding is 1e-7
                    with_twin.add(i)
                    shared = {kind: max(shared[kind], apart[kind]) for kind in KINDS}
                correlation[i, k] = 0.0
        assert control.twins == len(with_twin)
        assert control.shared == pytest.approx(shared, rel=1e-3, abs=1e-6)
        alone = [5.0 * u[i] / np.sqrt(1.0 - np.max(correlation[i] ** 2)) for i in own if i not in with_twin]
        assert control.distinguished_from == pytest.approx(max(alone, default=0.0), rel=1e-3)


def test_standard_plan_tells_no_distance_from_its_twin_and_more_of_it_tells_all() -> None:
    known = parse_scenario(SMALL.replace("steps = 2", "steps = 10")).known
    own = {(c.kind, c.channel): c for c in observe(known)[1].reliability}
    for kind in ("reading", "slip"):
        assert own[kind, "distance"].twins == own[kind, "distance"].count
    assert not distinguishes_all([*own.values()])
    faces, twice = extensions(known)
    assert "pp0, p0p, 0pp" in faces.name
    assert "twice" in twice.name
    for extension in (faces, twice):
        assert not extension.trouble
        assert extension.minutes > 0.0
        for c in extension.controls:
            if c.channel == "distance":
                assert c.twins == 0, extension.name


def test_minutes_more_are_those_of_the_further_readings_and_set_ups() -> None:
    # Each line once more: 7 points of 2 s, six moves of 20 mm or so, the way back; no set-up.
    known = parse_scenario(SMALL + "[plan_by_time]\nfeed_mm_per_min = 1e9\nacceleration_mm_per_s2 = 1e9\n").known
    faces, twice = extensions(known)
    assert twice.minutes == pytest.approx((4 * 7 + 3 * 2) * 2.0 / 60.0, rel=1e-3)
    assert faces.minutes == pytest.approx(3 * (3.0 + 5 * 2.0 / 60.0), rel=1e-3)


def test_fault_of_a_reading_that_nothing_controls_may_do_anything() -> None:
    # Three body diagonals and three scale lines: nothing is measured more often than there are unknowns of it.
    known = parse_scenario(SMALL.replace(', "nnp"]', "]")).known
    own = {(c.kind, c.channel): c for c in observe(known)[1].reliability}
    rows = "\n".join(text_of(control_blocks([*own.values()])))
    assert own["reading", "distance"].uncontrolled > 0
    assert own["reading", "distance"].hidden["positioning"] == np.inf
    assert "that no other reading controls" in rows
    assert " any" in rows


def test_faults_must_be_larger_where_all_noise_is() -> None:
    # A lateral offset, roll or gain that only its prior knows weighs by the angles that are found, which are not those
    # of the other run: up to 3 % of a scale line's tilts.
    text = SMALL.replace("steps = 2", "steps = 10") + (
        "[uncertainty]\ndistance_um = 0.1\ntilt_urad = 1.0\n[adjustment]\noutlier_probability = 0.0\n"
        'lateral_mm = "fixed"\nroll_urad = "fixed"\ngain = "fixed"\n'
    )
    noisy = parse_scenario(text + "[noise]\ndistance_um = 0.4\ntilt_urad = 4.0\nseed = 1\n")
    quiet = parse_scenario(text + "[noise]\ndistance_um = 0.04\ntilt_urad = 0.4\nseed = 1\n")
    one, other = (adjust_scenario(s, sd.simulate(s), reliability=True) for s in (quiet, noisy))
    assert one.variance_factor < 1.0
    factors = [component.factor for component in other.variance_components]
    assert factors == pytest.approx([4.0] * 3, rel=0.25)
    for a, b in zip(one.reliability, other.reliability, strict=True):
        # Those of tilts and distances act on each other: by no more than the larger of the factors.
        assert min(factors) * a.found_from * 0.97 < b.found_from < max(factors) * a.found_from * 1.03


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SMALL)
    return "scenario.toml"


def test_observe_says_what_would_tell_faults_apart(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["observe", scenario, "--steps", "5"]) == 0
    said = capsys.readouterr().out
    assert "slip of distances" in said
    assert "with pp0, p0p, 0pp in it (+" in said
    assert "with every line measured twice (+" in said


def test_evaluate_says_on_demand_what_would_have_been_found(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", scenario, "-o", "run.csv"]) == 0
    assert main(["evaluate", scenario, "run.csv", "-o", "out.csv"]) == 0
    assert "distinguished" not in capsys.readouterr().out
    assert main(["evaluate", scenario, "run.csv", "--reliability", "-o", "out.csv"]) == 0
    assert "wrong distance" in capsys.readouterr().out
    assert main(["evaluate", scenario, "run.csv", "--reliability", "-m", "enhanced", "-o", "out.csv"]) == 2
    assert "expected the method adjustment" in capsys.readouterr().err


def test_plan_that_tells_all_needs_nothing_more() -> None:
    known = parse_scenario(FACES.replace("steps = 2", "steps = 10\nrepeats = 2")).known
    own = observe(known)[1].reliability
    assert not [row for row in extension_blocks(own, list(extensions(known))) if distinguishes_all(own)]
