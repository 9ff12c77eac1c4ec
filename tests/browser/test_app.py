"""The application as a person uses it: from a new machine to the report, by mouse and keyboard, without a network."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect
from running_app import PATIENCE, Running
from small_scenario import SCENARIO

from stepdiag.cli import main

SOUND = SCENARIO.replace("seed = 3", "tilt_urad = 1.0\nseed = 3")
WIDTHS = (1280, 768)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario and two runs of it, a year of wear between them."""
    folder = tmp_path_factory.mktemp("files")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(SOUND)
        assert main(["simulate", "scenario.toml", "-o", "first.csv"]) == 0
        Path("worn.toml").write_text(SOUND.replace("seed = 7", "seed = 8"))
        assert main(["simulate", "worn.toml", "-o", "second.csv"]) == 0
    return folder


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    running = Running(tmp_path_factory.mktemp("app") / "book")
    yield running
    running.end()


class Person:
    """One who clicks; what the browser said against it, and what it asked others for."""

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.page: Page = context.new_page()
        self.clicks, self.errors, self.foreign = 0, [], []
        self.page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda one: self.foreign.append(one.url) if "127.0.0.1" not in one.url else None)
        self.page.goto(address)

    def click(self, role: Any, name: str) -> None:
        self.clicks += 1
        self.page.get_by_role(role, name=name).first.click()

    def type(self, label: str, text: str) -> None:
        self.clicks += 1
        self.page.get_by_label(label, exact=True).fill(text)

    def heading(self, words: str) -> None:
        expect(self.page.get_by_role("heading", name=words).first).to_be_visible(timeout=PATIENCE)


@pytest.fixture(scope="module")
def person(browser: Browser, running: Running) -> Iterator[Person]:
    context = browser.new_context(viewport={"width": 1280, "height": 900}, locale="de-DE")
    yield Person(context, running.address)
    context.close()


def test_path_of_a_person(person: Person, files: Path, tmp_path: Path) -> None:
    """New machine, plan, import, verdict, report, table, second run, trend: without an error, by few clicks."""
    page = person.page
    person.click("link", "New machine")
    person.type("Name", "VMC 1200")
    person.type("Limit, µm", "90")
    person.click("button", "Add the machine")
    person.heading("VMC 1200")
    person.click("link", "Plan a measurement")
    person.click("button", "Write the program")
    person.heading("Done")
    with page.expect_download() as program:
        person.click("link", "plans/")
    assert Path(program.value.path()).read_text().startswith("(Measuring program")
    person.click("link", "VMC 1200")
    page.get_by_label("Drop runs").set_input_files([files / "scenario.toml", files / "first.csv"])
    person.clicks += 2
    person.heading("Runs")
    person.click("button", "Evaluate")
    person.heading("The readings agree")
    answer = page.locator("#limit-answer")
    assert answer.inner_text().strip("✓ ") == "within"
    slider = page.get_by_role("slider")
    slider.focus()
    slider.press("Home")
    assert answer.inner_text().strip("✕ ") == "not within"
    frame = page.frame_locator("#report")
    expect(frame.get_by_role("heading", name="Error functions")).to_be_visible(timeout=120_000)
    person.click("link", "Make the report")
    person.type("Customer", "Example GmbH")
    person.click("button", "Make the page (HTML)")
    person.heading("Other files")
    with page.expect_download() as download:
        person.click("link", "reports/")
    assert "Example GmbH" in Path(download.value.path()).read_text()
    person.click("link", page.locator("#calibrations tbody a").first.inner_text())
    person.click("link", "Compensate")
    page.get_by_label("It replaces").select_option("none")
    person.clicks += 1
    person.click("button", "Make the table")
    person.heading("Done")
    expect(page.get_by_role("link", name="exports/")).to_be_visible()
    person.click("link", "VMC 1200")
    page.get_by_label("Drop runs").set_input_files(files / "second.csv")
    person.clicks += 2
    expect(page.get_by_role("link", name="second.csv")).to_be_visible(timeout=PATIENCE)
    person.click("button", "Evaluate")
    person.heading("The readings agree")
    person.click("link", "VMC 1200")
    expect(page.locator("#calibrations tbody tr")).to_have_count(2)
    expect(page.locator("svg.curve").first).to_be_visible()
    expect(page.locator("#calibrations tbody")).to_contain_text(re.compile(r"\d+,\d µm"))  # as the person writes it
    person.click("link", "Trend")
    person.heading("Largest error in the volume")
    assert person.clicks <= 25
    assert person.errors == []
    assert person.foreign == []


def test_dry_run_says_every_move(person: Person, running: Running) -> None:
    page = person.page
    page.goto(running.address.split("/enter")[0] + "/machines/VMC%201200/plan?scenario=scenarios/scenario.toml")
    said = page.locator("#dry-run-said")
    page.get_by_role("button", name="Play").click()
    expect(said).to_contain_text("point 3 of", timeout=5_000)
    page.get_by_role("button", name="Pause").click()
    slider = page.get_by_role("slider", name="Point")
    slider.focus()
    slider.press("Home")
    assert "Set-up 1, line ppp, point 1 of 31: head and mirror are placed, the axes stand at 0,0 / 0,0 / 0,0 mm" in (
        said.inner_text()
    )
    mirror = page.locator("svg.machine polygon.mirror")
    places = [mirror.get_attribute("points")]
    for move in ("X to 80,0 mm", "Y to 60,0 mm", "Z to 50,0 mm"):
        slider.press("ArrowRight")
        assert said.inner_text().endswith(f": {move}")
        places.append(mirror.get_attribute("points"))
    assert len(set(places)) == 4
    slider.press("End")
    assert "line 00p" in said.inner_text()


def test_file_chosen_before_the_script_is_there_is_taken(running: Running, person: Person, files: Path) -> None:
    page, held = person.page, list[Route]()
    page.route("**/static/app.js", lambda route: held.append(route))
    page.goto(running.address.split("/enter")[0] + "/machines/VMC%201200", wait_until="commit")
    page.get_by_label("Drop runs").set_input_files(files / "second.csv")
    with page.expect_request(lambda asked: asked.method == "POST"):
        held[0].continue_()
    page.unroute("**/static/app.js")


SCREENS = {
    "machines": "/",
    "new": "/new",
    "machine": "/machines/VMC%201200",
    "plan": "/machines/VMC%201200/plan",
    "trend": "/machines/VMC%201200/trend",
    "compensate": "/machines/VMC%201200/compensate/{calibration}",
    "search": "/search?q=vmc",
    "report": "/machines/VMC%201200/report/{calibration}",
    "calibration": "/machines/VMC%201200/calibration/{calibration}",
}


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("screen", SCREENS)
def test_screens_can_be_used_by_everybody(
    browser: Browser, running: Running, person: Person, screen: str, width: int, theme: Any
) -> None:
    """WCAG 2.2 AA as far as axe-core can tell; nothing is wider than the screen; targets for gloves."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=theme)
    page = context.new_page()
    page.goto(running.address)
    page.goto(f"{running.address.split('/enter')[0]}/machines/VMC%201200")
    calibration = page.locator("#calibrations tbody a").first.inner_text()
    page.goto(running.address.split("/enter")[0] + SCREENS[screen].format(calibration=calibration))
    options = {"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"], "iframes": False}
    found = Axe().run(page, options={**options, "resultTypes": ["violations"]})
    assert found.violations_count == 0, found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    small = page.evaluate(
        "[...document.querySelectorAll('button, input:is([type=text], [type=number], [type=file]), select, .button')]"
        ".filter(one => one.checkVisibility() && one.getBoundingClientRect().height < 44).map(one => one.outerHTML)"
    )
    assert small == []
    context.close()


def test_keyboard_alone(person: Person, running: Running) -> None:
    page = person.page
    page.goto(running.address.split("/enter")[0])
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the content"
    for _ in range(12):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.textContent") == "VMC 1200":
            break
    page.keyboard.press("Enter")
    person.heading("Import files")


def test_another_page_on_this_computer_gets_nothing(browser: Browser, running: Running, person: Person) -> None:
    """A page of somebody else, in the same browser, whose person is logged in."""
    origin = running.address.split("/enter")[0]
    page = person.page.context.new_page()
    page.goto("data:text/html,<title>other</title>")
    read = f"fetch('{origin}/', {{credentials: 'include'}}).then(r => r.text()).catch(() => 'refused')"
    assert page.evaluate(read) == "refused"
    options = "{method: 'POST', mode: 'no-cors', credentials: 'include', body: 'name=Evil'}"
    page.evaluate(f"fetch('{origin}/machines', {options}).catch(() => '')")
    page.set_content(
        f"<iframe src='{origin}/'></iframe>"
        f"<form method=post action='{origin}/machines'><input name=name value=Evil></form>"
    )
    page.evaluate("document.forms[0].submit()")
    page.wait_for_timeout(1000)
    page.close()
    person.page.goto(origin)
    assert "Evil" not in person.page.content()
