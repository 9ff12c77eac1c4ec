"""Alignment with an instrument: the twin of an IDS3010 or of an adapter, and a hand that turns what is said."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acquiring import BEAMS, IDEAL, LINES, SCENARIO

from stepdiag.acquisition.acquire import instrument_of
from stepdiag.acquisition.conductor import Conductor
from stepdiag.acquisition.control import Control
from stepdiag.acquisition.live_state import LiveState
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.settling import Settling
from stepdiag.alignment.loop import AlignmentLoop, first_visits
from stepdiag.cli import main
from stepdiag.scenario.description import Scenario, parse_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin import instrument as twin_instrument
from stepdiag.twin.server import Twin

FAST = Settling(count=2, average=2, interval=0.0)
MISALIGNED = "reflector_urad = [2000.0, -3000.0]\nlaser_urad = [-1500.0, 2500.0]"
WAY = re.compile(r"([\d.]+) mrad (right|left|up|down|towards [XY][+-])")


def misaligned(head: str) -> Scenario:
    return parse_scenario(
        SCENARIO.format(plan=LINES, head=head, noise="distance_um = 0.1").replace(
            "reflector_urad = [100.0, 300.0]", MISALIGNED
        )
    )


class Hand:
    """Turns what is said, and says yes to all questions."""

    def __init__(self, described: Scenario, twin: Twin) -> None:
        self._known, self._twin = described.known, twin
        self.told: list[str] = []
        self.turned = 0
        self._answer: Control | None = None
        self.signals: list[dict[str, float]] = []

    def tell(self, text: str) -> None:
        self.told.append(text)

    def confirm(self, text: str) -> None:
        self.told.append(text)

    def repeats(self, text: str) -> bool:
        raise AssertionError("it is asked, not waited for")

    def ask(self, text: str, answers: list[Control]) -> None:
        self.told.append(text)
        self._answer = answers[0]
        line = re.search(r"line (\S+) is not aligned", text)
        if line is not None:
            self._turn(line[1])

    def answered(self) -> Control | None:
        if self._answer == "confirm" and not self.signals:
            return None  # not before the contrast was shown
        answer, self._answer = self._answer, None
        return answer

    def withdraw(self) -> None:
        pass

    def show(self, state: LiveState) -> None:
        if state.signal:
            self.signals.append(state.signal)

    def _turn(self, line: str) -> None:
        self.turned += 1
        frame = np.asarray(self._known.plan.frame(line))
        right = np.cross(frame[:, 2], [0.0, 0.0, 1.0])
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 0.05 else np.array([1.0, 0.0, 0.0])
        up = np.cross(right, frame[:, 2]) if abs(frame[2, 2]) < 0.99 else np.array([0.0, 1.0, 0.0])
        ways = {"right": right, "left": -right, "up": up, "down": -up}
        ways |= {"towards X+": right, "towards X-": -right, "towards Y+": up, "towards Y-": -up}
        angles: list[float] = []
        for what, sign in (("laser", 1.0), ("mirror", -1.0)):
            said = [text for text in self.told if text.startswith(f"{what}: ")][-1]
            amounts = WAY.findall(said) if "turn it" in said else []
            x, y, _ = sign * frame.T @ sum((1e3 * float(size) * ways[way] for size, way in amounts), np.zeros(3))
            angles += [-y, x]
        self._twin.instrument.turn(angles)


def aligned(described: Scenario, twin: Twin, lines: list[str]) -> tuple[Hand, dict[str, Any]]:
    hand, known = Hand(described, twin), described.known
    with (
        instrument_of(twin.source, known, AcquireOptions(), hand.tell) as instrument,
        Conductor(instrument, hand, None) as conductor,
    ):
        found = AlignmentLoop(known, instrument, conductor, FAST).run(first_visits(visits_of(known), lines))
    return hand, found


@pytest.mark.slow
@pytest.mark.parametrize("head", [BEAMS, IDEAL, 'layout = "psd"\npsd_distance_mm = 80.0'])
def test_lines_are_aligned_after_what_was_said_is_done(head: str) -> None:
    described = misaligned(head)
    with Twin(described, protocol="lines") as twin:
        hand, found = aligned(described, twin, [])
    assert list(found) == [*described.known.plan.lines, *described.known.plan.scale_lines]
    assert all(fit.is_ready for fit in found.values()), hand.told
    assert hand.turned <= 3 * 4  # scale lines are aligned
    assert [text for text in hand.told if text.endswith("is aligned")] == [f"line {line} is aligned" for line in found]


def test_ids3010_shows_its_contrast_before_it_measures() -> None:
    """The signal falls to nothing at 5 mrad, and comes back with the alignment."""
    described = misaligned(BEAMS)
    with Twin(described) as twin:
        twin.instrument.stop()
        hand, found = aligned(described, twin, ["ppp"])
        assert found["ppp"].is_ready
        assert twin.instrument.contrast() > 400.0
        twin.instrument.stop()
        again, _ = aligned(described, twin, ["ppp"])
    names = {"d1 contrast", "d1 baseline", "d2 contrast", "d2 baseline", "d3 contrast", "d3 baseline"}
    assert hand.signals[0].keys() == names
    assert hand.signals[0]["d1 contrast"] == 0.0
    assert again.signals[0]["d1 contrast"] > 400.0
    assert any("restarting its measurement" in text for text in hand.told)
    assert not any("too large" in text for text in [*hand.told, *again.told])


def test_signal_that_is_too_large_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(twin_instrument, "BEST_CONTRAST", 840.0)
    described = parse_scenario(SCENARIO.format(plan=LINES, head=BEAMS, noise=""))
    with Twin(described) as twin:
        twin.instrument.turn([0.0, 0.0, -100.0, -300.0])  # without any misalignment
        hand, _ = aligned(described, twin, ["ppp"])
    assert next(text for text in hand.told if "too large" in text).startswith(
        "warning: d1: contrast and baseline are 880 ‰ together, above 850"
    )


def test_command_names_the_lines_that_are_not_aligned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Standard input has nobody who turns anything."""
    monkeypatch.chdir(tmp_path)
    text = SCENARIO.format(plan=LINES, head=IDEAL, noise="").replace("reflector_urad = [100.0, 300.0]", MISALIGNED)
    text = text.replace("[machine.random]\nseed = 7\n", "")
    Path("scenario.toml").write_text(text)
    with Twin(parse_scenario(text), protocol="lines") as twin:
        assert main(["align", "scenario.toml", "--source", twin.source, "--line", "ppp", "--line", "p00"]) == 3
        said = capsys.readouterr()
        assert "line p00 is aligned" in said.out
        assert "laser: turn it" in said.out
        assert said.err == "warning: not aligned: ppp\n"
        assert main(["align", "scenario.toml", "--source", twin.source, "--line", "xyz"]) == 2
        assert "--line: expected lines of the plan, got 'xyz'" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["scenario.toml"]
