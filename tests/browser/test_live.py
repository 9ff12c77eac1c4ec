"""Aligning and measuring in the application, with a twin and a hand that does what the page says."""

import json
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect
from running_app import Running

from stepdiag.acquisition.raw_file import read_raw
from stepdiag.cli import main
from stepdiag.scenario.description import read_scenario
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit, visits_of

FloatArray = npt.NDArray[np.float64]
SCENARIO = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
[machine.random]
seed = 7
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
scale_lines = ["p00", "0p0", "00p"]
steps = 2
[head]
layout = "ideal"
mirror_mm = [500.0, 500.0]
[misalignment]
reflector_urad = [2900.0, -3600.0]
laser_urad = [-2500.0, 3500.0]
[noise]
distance_um = 0.1
tilt_urad = 1.0
[plausible.inputs]
reading_s = {inner = [0.0, 60.0]}
"""
WAY = re.compile(r"([\d.]+) mrad (right|left|up|down|towards X\+|towards X-|towards Y\+|towards Y-)")


class Hand:
    """A person at the machine of a twin: moves it, turns screws, holds a hand into the beam."""

    def __init__(self, address: str, known: Known) -> None:
        host, _, port = address.partition(":")
        self._socket = socket.create_connection((host, int(port)))
        self._known = known

    def do(self, what: str, content: Any) -> None:
        self._socket.sendall(json.dumps({what: content}).encode() + b"\n")
        rest = b""
        while b'"done"' not in rest:
            rest = rest[-200:] + self._socket.recv(65536)

    def turn(self, said: list[str], line: str) -> None:
        """Does what the page says, seen from the head."""
        frame = np.asarray(self._known.plan.frame(line))
        beam = frame[:, 2]
        right = np.cross(beam, [0.0, 0.0, 1.0])
        upright = float(np.linalg.norm(right)) < 0.05
        right = np.array([1.0, 0.0, 0.0]) if upright else right / np.linalg.norm(right)
        up = np.array([0.0, 1.0, 0.0]) if upright else np.cross(right, beam)
        ways = {"right": right, "left": -right, "up": up, "down": -up}
        ways |= {"towards X+": right, "towards X-": -right, "towards Y+": up, "towards Y-": -up}
        angles = []
        for what, sign in (("laser", 1.0), ("mirror", -1.0)):  # the face of a mirror looks back along the beam
            text = next(one for one in said if one.startswith(what))
            moved = sum((float(size) * 1e3 * ways[way] for size, way in WAY.findall(text)), np.zeros(3))
            x, y, _ = sign * frame.T @ (moved if "turn it" in text else np.zeros(3))
            angles += [-y, x]
        self.do("turn", angles)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("live")
    (folder / "vmc.toml").write_text(SCENARIO)
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        assert main(["book", "new", "VMC", "--book", "book", "--limit", "200"]) == 0
        assert main(["book", "add", "vmc.toml", "--machine", "VMC", "--book", "book"]) == 0
    return folder


@pytest.fixture(scope="module")
def known(folder: Path) -> Known:
    return read_scenario(folder / "vmc.toml").known


@pytest.fixture(scope="module")
def twin(folder: Path) -> Iterator[str]:
    """Its address."""
    command = [sys.executable, "-m", "stepdiag", "twin", "vmc.toml", "--protocol", "lines", "--port", "0"]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    yield process.stdout.readline().split()[2]
    process.terminate()  # a background shell ignores SIGINT
    process.wait(20.0)


@pytest.fixture(scope="module")
def running(folder: Path) -> Iterator[Running]:
    running = Running(folder / "book")
    yield running
    running.end()


@pytest.fixture(scope="module")
def page(browser: Browser, running: Running) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 768, "height": 1024})
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.goto(running.address)
    yield page
    context.close()
    assert errors == []


def open_measure(page: Page, twin: str) -> None:
    page.goto(page.url.split("/machines")[0].rstrip("/") + "/machines/VMC/measure")
    page.get_by_label("Instrument").fill(f"lines://{twin}")


def answer(page: Page, words: str) -> None:
    page.get_by_role("button", name=words).click()


def question(page: Page, words: str) -> None:
    expect(page.locator("#question")).to_contain_text(words, timeout=30_000)


def axe(page: Page) -> list[str]:
    found = Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]})
    return [f"{one['id']}: {one['nodes'][0]['html']}" for one in found.response["violations"]]


def test_hand_that_does_what_the_page_says_aligns_all_lines(page: Page, twin: str, known: Known) -> None:
    hand = Hand(twin, known)
    open_measure(page, twin)
    answer(page, "Align head and mirror")
    for line in (*known.plan.lines, *known.plan.scale_lines):
        for turns in range(4):
            # Scale lines are aligned from the beginning, and need no turn.
            expect(page.locator("#messages li").first).to_contain_text(
                re.compile(rf"line {line} is (not )?aligned|set-up|laser within|ready"), timeout=30_000
            )
            page.wait_for_function(
                """line => {
                  const said = [...document.querySelectorAll("#messages li")].map(one => one.textContent);
                  return said.some(one => one.includes(`line ${line} is aligned`)) ||
                    (!document.getElementById("asks").hidden &&
                     document.getElementById("question").textContent.includes(`line ${line} is not`));
                }""",
                arg=line,
                timeout=30_000,
            )
            said = page.locator("#messages").inner_text()
            if f"line {line} is aligned" in said:
                break
            assert turns < 3, said
            if line == "ppp" and turns == 0:
                assert axe(page) == []
                expect(page.locator("#cross-said")).to_contain_text("above")
            hand.turn(page.locator("#turns li").all_inner_texts(), line)
            answer(page, "Measure again")
        assert f"line {line} is aligned" in said
    expect(page.locator("#doing")).to_have_text("Ended", timeout=20_000)


def test_run_with_a_lost_point_that_is_read_once_more(page: Page, twin: str, known: Known, folder: Path) -> None:
    hand = Hand(twin, known)
    open_measure(page, twin)
    page.get_by_label("A point is read when").select_option("key")
    answer(page, "Start the run")
    places = [(visit, index) for visit in visits_of(known) for index in range(len(visit.points))]
    for number, (visit, index) in enumerate(places):
        question(page, text_of(visit, index))
        move(hand, visit, index)
        if number == 4:
            hand.do("block", True)
            expect(page.locator("#distance")).to_have_text("no beam")
            assert axe(page) == []
        answer(page, "Yes, go on")
        if number == 4:
            expect(page.locator("#left")).to_contain_text("1 lost", timeout=30_000)
            hand.do("block", False)
            answer(page, "Repeat the point")
            question(page, text_of(visit, index))
            answer(page, "Yes, go on")
            expect(page.locator("#left")).not_to_contain_text("lost", timeout=30_000)
            page.get_by_label("Remark").fill("the door was open")
            answer(page, "Keep")
    expect(page.locator("#doing")).to_have_text("Ended", timeout=60_000)
    expect(page.locator("#messages")).to_contain_text("fit: accepted")
    assert page.evaluate("document.documentElement.scrollWidth") <= 768
    assert page.locator("#deviations polyline").count() == 7
    raw = read_raw(next((folder / "book/machines/VMC/runs").glob("*.raw.jsonl")))
    assert not any(reading.is_lost for reading in raw.readings().values())
    assert any(one.record == "remark" for one in raw.records)
    answer(page, "Evaluate the run")
    expect(page.get_by_role("heading", name="The readings agree").first).to_be_visible(timeout=60_000)
    page.get_by_role("link", name="Make the report").click()
    answer(page, "Make the page (HTML)")
    expect(page.get_by_role("link", name="reports/")).to_be_visible(timeout=60_000)


def test_killed_server_and_page_disturb_nothing(browser: Browser, twin: str, known: Known, folder: Path) -> None:
    """A run goes on while there is neither; another server watches it, and a second page."""
    hand = Hand(twin, known)
    first = Running(folder / "book")
    context = browser.new_context()
    page = context.new_page()
    page.goto(first.address)
    open_measure(page, twin)
    page.get_by_label("A point is read when").select_option("key")
    answer(page, "Start the run")
    visit = next(iter(visits_of(known)))
    question(page, text_of(visit, 0))
    move(hand, visit, 0)
    answer(page, "Yes, go on")
    question(page, text_of(visit, 1))
    name = page.url.split("/live/")[1].split("?")[0]
    first.process.kill()
    first.process.wait()
    context.close()
    second = Running(folder / "book")
    try:
        context = browser.new_context()
        pages = [context.new_page() for _ in range(2)]
        for one in pages:
            one.goto(second.address)
            one.goto(f"{one.url.rstrip('/')}/machines/VMC/live/{name}")
            question(one, text_of(visit, 1))
        move(hand, visit, 1)
        answer(pages[0], "Yes, go on")
        for one in pages:
            expect(one.locator("#left")).to_contain_text("2 of", timeout=30_000)
        answer(pages[1], "Stop")
        for one in pages:
            expect(one.locator("#doing")).to_have_text("Ended: stopped", timeout=30_000)
        context.close()
    finally:
        second.end()
    raw = read_raw(folder / f"book/machines/VMC/runs/{name}.raw.jsonl")
    assert len(raw.readings()) == 2


def move(hand: Hand, visit: Visit, index: int) -> None:
    hand.do("move", [float(one) for one in visit.positions[index]])


def text_of(visit: Visit, index: int) -> str:
    return f"line {visit.line}, run {visit.run}, {visit.direction}), point {int(visit.points[index])} at"
