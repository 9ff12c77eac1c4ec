"""A report as it is seen: drawn without a network, used by keyboard, printed."""

import re
import subprocess
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from playwright.sync_api import Browser, Page
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

HEADER = '[report]\ncustomer = "Example Ltd"\nmachine = "VMC 800"\nserial_number = "0815"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Reports of an accepted calibration (with all that there is beside it) and of a rejected one."""
    folder = tmp_path_factory.mktemp("reports")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(SCENARIO.replace("seed = 3", "tilt_urad = 1.0\nseed = 3") + HEADER)
        assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
        assert main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.nc"]) == 0
        assert main(["uncertainty", "scenario.toml", "-o", "uncertainty.nc"]) == 0
        sd.read_calibration("calibration.nc").judged("rejected", ["the readings contradict"]).write("judged.csv")
        files = ["--scenario", "scenario.toml", "--run", "run.csv", "--uncertainty", "uncertainty.nc"]
        assert main(["report", "judged.csv", "calibration.nc", *files, "-o", "report.html"]) == 3, "as one is rejected"
        assert main(["report", "judged.csv", "-o", "rejected.html"]) == 3
        sd.read_calibration("calibration.nc").judged("doubtful", ["more noise than stated"]).write("doubtful.csv")
        assert main(["report", "doubtful.csv", "-o", "doubtful.html"]) == 0
        yield folder


class Seen:
    """A page with what its browser said and asked for."""

    def __init__(self, browser: Browser, path: Path, width: int = 1280, fragment: str = "") -> None:
        self.page: Page = browser.new_page(viewport={"width": width, "height": 900})
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(f"{path.as_uri()}{fragment}")
        self.page.wait_for_selector("html[data-drawn=all]", state="attached", timeout=120_000)


@pytest.fixture(scope="module")
def report(browser: Browser, folder: Path) -> Iterator[Seen]:
    seen = Seen(browser, folder / "report.html")
    yield seen
    seen.page.close()


def picture(page: Page, selector: str) -> Any:
    """The pixels of an element, 0 to 1, without transparency."""
    return imread(BytesIO(page.locator(selector).screenshot()))[:, :, :3]


def test_page_asks_for_itself_alone_and_reports_no_error(report: Seen) -> None:
    own = [url for url in report.requests if url.startswith("file:")]
    assert len(own) == 1
    assert all(url.startswith(("file:", "data:", "blob:")) for url in report.requests)
    assert report.errors == []


def test_script_that_is_not_ours_is_not_run(report: Seen) -> None:
    report.page.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), {textContent: 'window.hurt = 1'}))"
    )
    assert report.page.evaluate("window.hurt === undefined")
    report.errors.clear()  # the browser says that it was refused


def test_every_figure_has_ink(report: Seen) -> None:
    identifiers = report.page.eval_on_selector_all(".plot", "divs => divs.map(div => div.id)")
    assert len(identifiers) == 18 + 1 + 3 + 1, "curves, volume, channels, budget"
    for identifier in identifiers:
        pixels = picture(report.page, f"#{identifier}")
        coloured = np.ptp(pixels, axis=2) > 0.2  # text, axes and grid are grey
        # A curve of two pixels across a panel of 300 covers hundreds of pixels.
        assert np.count_nonzero(coloured) > 150, identifier


def test_curves_are_seen_before_any_script_has_run(browser: Browser, folder: Path) -> None:
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto((folder / "report.html").as_uri())
    panels = page.locator(".panel .plot")
    assert panels.count() == 18
    for k in range(18):
        pixels = imread(BytesIO(panels.nth(k).screenshot()))[:, :, :3]
        assert np.count_nonzero(np.ptp(pixels, axis=2) > 0.2) > 150
    page.close()


def test_nothing_is_wider_than_a_small_screen(browser: Browser, folder: Path) -> None:
    seen = Seen(browser, folder / "report.html", width=400)
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= 400
    assert seen.errors == []
    seen.page.close()


def grid_of(page: Page) -> Any:
    """Coordinates of the deformed grid as they are drawn."""
    data = page.evaluate("document.getElementById('figure-volume').data.map(t => [t.name, t.x, t.y, t.z])")
    (found,) = [coordinates for name, *coordinates in data if name == "deformed"]
    return np.array(found, dtype=float)


def test_slider_moves_the_grid_and_the_keyboard_reaches_it(report: Seen) -> None:
    page = report.page
    page.get_by_label("Deformed grid").check()
    # Not wait_for_function: from its second look on, it asks for what the page's policy forbids.
    drawn = "document.getElementById('figure-volume').data.some(t => t.name === 'deformed')"
    for _ in range(100):
        if page.evaluate(drawn):
            break
        page.wait_for_timeout(100)
    else:
        pytest.fail("the deformed grid is not drawn")
    page.evaluate("document.activeElement.blur()")
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "exaggeration":
            break
    else:
        pytest.fail("the slider is not reached by the Tab key")
    factor = float(page.locator("#exaggeration").input_value())
    before = grid_of(page)
    page.keyboard.press("Home")
    page.wait_for_selector("output#exaggeration-value:text-is('× 0')")
    page.wait_for_timeout(200)
    commanded = grid_of(page)
    moved = before - commanded
    # Where the tool is commanded 1 mm to the side of a node, its error is another: these are the nodes.
    machine = sd.Machine(*machine_of(Path(page.url.removeprefix("file://")).parent / "calibration.nc"))
    known = ~np.isnan(commanded[0])
    error = machine.error(commanded[:, known].T)
    # Errors are drawn to 0.1 nm.
    np.testing.assert_allclose(moved[:, known].T, factor * error, rtol=0.0, atol=5.1e-8 * factor)
    page.keyboard.press("End")
    page.wait_for_timeout(200)
    np.testing.assert_allclose(
        (grid_of(page) - commanded)[:, known], 4.0 * moved[:, known], rtol=0.0, atol=1e-8 * factor
    )


def machine_of(path: Path) -> tuple[Any, Any, Any]:
    calibration = sd.read_calibration(path)
    return calibration.chain, calibration.to_error_map(), calibration.tool


@pytest.mark.parametrize("view", ["arrows", "slice"])
def test_views_of_the_volume_have_ink(view: str, report: Seen) -> None:
    report.page.check(f"input[value={view}]")
    report.page.wait_for_timeout(400)
    pixels = picture(report.page, "#figure-volume")
    assert np.count_nonzero(np.ptp(pixels, axis=2) > 0.2) > 1000
    report.page.check("input[value=before_um]")
    report.page.wait_for_timeout(400)
    assert report.errors == []
    report.page.check("input[value=error_um]")
    report.page.check("input[value=grid]")


def test_rejected_fit_is_said_first_and_in_red(browser: Browser, folder: Path) -> None:
    seen = Seen(browser, folder / "rejected.html")
    assert seen.page.title().startswith("Calibration REJECTED: do not use it")
    box = seen.page.locator("#verdict").bounding_box()
    assert box is not None
    assert box["y"] < 450, "seen without scrolling"
    assert "Calibration REJECTED: do not use it" in seen.page.locator("#verdict h2").inner_text()
    red = np.mean(picture(seen.page, "#verdict"), axis=(0, 1))
    assert red[0] > 2.0 * max(red[1], red[2]), "most of the band is red"
    seen.page.close()


@pytest.mark.parametrize("name", ["rejected", "doubtful"])
def test_what_is_not_valid_stays_in_sight(name: str, browser: Browser, folder: Path) -> None:
    seen = Seen(browser, folder / f"{name}.html")
    seen.page.evaluate("document.documentElement.scrollTo({top: 1e6, behavior: 'instant'})")
    stamp = seen.page.locator(".stamp")
    box = stamp.bounding_box()
    assert box is not None
    assert 0.0 <= box["y"] < 10.0, "at the top of the window, at the end of the page"
    assert f"Calibration {name.upper()}: do not" in stamp.inner_text()
    seen.page.close()


CONTRAST = """() => {
  const channels = (colour) => (colour.match(/[\\d.]+/g) || []).map(Number);
  const linear = (c) => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const [r, g, b, alpha] = channels(getComputedStyle(e).backgroundColor);
      if (alpha === undefined || alpha > 0) return [r, g, b];
    }
    return [255, 255, 255];
  };
  const found = [];
  for (const element of document.querySelectorAll("body *")) {
    const words = [...element.childNodes].filter((n) => n.nodeType === 3).map((n) => n.textContent.trim()).join("");
    if (!words || ["SCRIPT", "STYLE", "NOSCRIPT"].includes(element.tagName)) continue;
    const style = getComputedStyle(element), is_drawn = element instanceof SVGElement;
    const text = luminance(channels(is_drawn ? style.fill : style.color)), ground = luminance(behind(element));
    const contrast = (Math.max(text, ground) + 0.05) / (Math.min(text, ground) + 0.05);
    found.push([words.slice(0, 40), contrast]);
  }
  return found;
}"""


@pytest.mark.parametrize("name", ["report.html", "rejected.html", "doubtful.html"])
def test_words_stand_out_from_what_is_behind_them(name: str, browser: Browser, folder: Path) -> None:
    """By WCAG 2.2, level AA: contrasts of at least 4.5."""
    seen = Seen(browser, folder / name)
    found = seen.page.evaluate(CONTRAST)
    assert len(found) > 100
    assert [(words, contrast) for words, contrast in found if contrast < 4.5] == []
    seen.page.close()


def test_printed_page_has_all_figures_on_pages_of_a4(folder: Path) -> None:
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        assert main(["report", "calibration.nc", "-o", "report.pdf"]) == 0
        said = subprocess.run(["pdfinfo", "report.pdf"], capture_output=True, text=True, check=True).stdout
        assert int(re.findall(r"Pages:\s+(\d+)", said)[0]) > 1
        assert re.search(r"Page size:\s+59\d[.\d]* x 84\d[.\d]* pts", said)
        text = subprocess.run(
            ["pdftotext", "-layout", "report.pdf", "-"], capture_output=True, text=True, check=True
        ).stdout
        for name in sd.read_calibration("calibration.nc").functions:
            assert re.search(rf"{name} \((µm|µrad)\)", text), "the axis of the drawing"
        assert re.search(r"\b1 ?/ ?\d", text), "pages are numbered"
        assert "Calibration" not in pages_of("report.pdf")[1], "none where it is valid"


def pages_of(path: str) -> list[str]:
    said = subprocess.run(["pdftotext", "-layout", path, "-"], capture_output=True, text=True, check=True).stdout
    return said.split("\f")[:-1]


@pytest.mark.parametrize(
    ("name", "words"),
    [("judged", "REJECTED: do not use it"), ("doubtful", "DOUBTFUL: do not rely on the stated uncertainties")],
)
def test_every_printed_page_says_that_the_calibration_is_not_valid(name: str, words: str, folder: Path) -> None:
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        main(["report", f"{name}.csv", "-o", f"{name}.pdf"])
        pages = pages_of(f"{name}.pdf")
        assert len(pages) > 1
        for page in pages:  # the first line is the band above all else
            assert page.strip().splitlines()[0].strip() == f"Calibration {words}"


def test_volume_is_on_paper_as_it_is_on_the_screen(browser: Browser, folder: Path, tmp_path: Path) -> None:
    seen = Seen(browser, folder / "report.html")
    seen.page.pdf(path=tmp_path / "printed.pdf", prefer_css_page_size=True, print_background=True)
    subprocess.run(["pdftoppm", "-r", "60", "-png", "printed.pdf", "page"], cwd=tmp_path, check=True)
    blues = 0
    for file in tmp_path.glob("page*.png"):
        pixels = imread(file)[:, :, :3]
        text = np.ptp(pixels, axis=2) > 0.15
        blues = max(blues, int(np.count_nonzero(text)))
    assert blues > 4000, "the slice covers much of a page"
    assert seen.errors == []
    seen.page.close()
