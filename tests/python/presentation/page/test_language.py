"""A page in another language: the whole of it, with the same numbers, and names as they were given."""

import re
import tomllib
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path

import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.io.file_kind import kind_of_file
from stepdiag.presentation.page.html import element
from stepdiag.presentation.page.language import Catalogue, in_language

ENGLISH = re.compile(r"\b(?:the|of|is|are|and|to|with|not|below|above|by|on|for|it)\b", re.IGNORECASE)


class Texts(HTMLParser):
    """What is read on a page, or said of its pictures; not what is marked as English."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.english: list[str] = []
        self.language, self._inside, self._marked = "", [""], 0
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.texts += [given[name] or "" for name in ("aria-label", "alt", "title") if name in given]
        if tag == "html":
            self.language = given["lang"] or ""
        if tag not in ("meta", "img", "input", "link", "br", "hr"):
            self._inside.append("english" if given.get("lang") == "en" and tag == "span" else tag)

    def handle_endtag(self, tag: str) -> None:
        self._inside.pop()

    def handle_data(self, data: str) -> None:
        if "english" in self._inside:
            self.english.append(data)
        elif not {"script", "style", "code", "pre"} & {*self._inside}:
            self.texts.append(data)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Calibrations that are accepted, doubtful and rejected."""
    folder = tmp_path_factory.mktemp("german")
    noisy = SCENARIO.replace("distance_um = 0.1", "distance_um = 0.1\ntilt_urad = 1.0")
    runs = {"accepted": noisy, "doubtful": noisy.replace("distance_um = 0.1\nt", "distance_um = 0.25\nt")}
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(noisy)
        for name, text in runs.items():
            Path("run.toml").write_text(text)
            assert main(["simulate", "run.toml", "-o", f"{name}.csv"]) == 0
            assert main(["evaluate", "scenario.toml", f"{name}.csv", "--covariance", "-o", f"{name}.nc"]) == 0
        sd.read_calibration("accepted.nc").judged("rejected", ["of the test"]).write("rejected.nc")
    return folder


def page_of(folder: Path, name: str, *options: str, status: int = 0) -> Texts:
    out = folder / f"{name}.html"
    command = ["report", *options, str(folder / f"{name}.nc"), "--language", "de", "--limit", "12.5", "-o", str(out)]
    assert main(command) == status
    assert kind_of_file(out) == "report page"
    return Texts(out.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["accepted", "doubtful"])
def test_whole_page_is_german(folder: Path, name: str) -> None:
    page = page_of(folder, name, "--scenario", str(folder / "scenario.toml"), "--run", str(folder / f"{name}.csv"))
    assert page.language == "de"
    assert [text for text in page.texts if ENGLISH.search(text)] == []
    assert page.english == []
    assert f"{'Angenommen' if name == 'accepted' else 'Zweifelhaft'}: " in " ".join(page.texts)


def test_before_and_after_is_german(folder: Path) -> None:
    page = page_of(folder, "doubtful", str(folder / "accepted.nc"))
    assert [text for text in page.texts if ENGLISH.search(text)] == []
    assert "Vorher und nachher" in page.texts


def test_rejected_page_says_so_in_german_and_marks_what_stays_english(folder: Path) -> None:
    page = page_of(folder, "rejected", status=3)
    assert any("VERWORFEN: nicht verwenden" in text for text in page.texts)
    assert page.english == ["of the test"]


def test_numbers_are_those_of_the_english_page(folder: Path) -> None:
    """In the same order, but for the decimal sign; the values for machines are not touched."""
    out = folder / "english.html"
    options = ["--limit", "12.5", "-o", str(out)]
    assert main(["report", str(folder / "accepted.nc"), *options]) == 0
    english, german = out.read_text(encoding="utf-8"), folder / "again.html"
    assert main(["report", str(folder / "accepted.nc"), "--language", "de", *options[:3], str(german)]) == 0
    numbers = [re.compile(r"\d+\.\d+"), re.compile(r"\d+,\d+")]
    shown = [
        sorted(found.findall(" ".join(Texts(page).texts)))
        for found, page in zip(numbers, (english, german.read_text(encoding="utf-8")), strict=True)
    ]
    versions = re.compile(r"^(?:1\.0|1,0)$")
    assert [n.replace(".", ",") for n in shown[0] if not versions.match(n)] == [
        n for n in shown[1] if not versions.match(n)
    ]
    values = re.compile(r'id="stepdiag-values">(.*?)</script>', re.DOTALL)
    mine, other = (values.search(text) for text in (english, german.read_text(encoding="utf-8")))
    assert mine is not None
    assert other is not None
    assert mine[1] == other[1]


def test_names_stay_as_they_were_given(folder: Path) -> None:
    words = ["--customer", "Line and Time, 3.5", "--instrument", "XL 2.0 of the shop", "--number", "1.5"]
    page = page_of(folder, "accepted", *words)
    for text in ("Line and Time, 3.5", "XL 2.0 of the shop", "1.5"):
        assert text in page.texts


def test_entries_are_used_from_the_longest_to_the_shortest() -> None:
    catalogue = Catalogue("xx", {"{} and {}": "{} und {}", "a line and a point of {}": "L {}", "drum": "Trommel"})
    assert catalogue.said("A line and a point of drum.") == "L Trommel."
    assert catalogue.said("drum and drum") == "Trommel und Trommel"
    assert catalogue.said(" Drum, ") == " Trommel, "
    assert catalogue.said("nothing") is None


def test_elements_outside_are_english() -> None:
    with in_language("de"):
        assert element("h2", "Summary") == "<h2>Zusammenfassung</h2>"
        assert element("p", "This is not there") == '<p><span lang="en">This is not there</span></p>'
        assert element("code", "Summary 1.5") == "<code>Summary 1.5</code>"
    assert element("h2", "Summary") == "<h2>Summary</h2>"


def test_translations_have_the_places_of_their_texts() -> None:
    text = (files("stepdiag.presentation.page") / "de.toml").read_text(encoding="utf-8")
    for english, german in tomllib.loads(text).items():
        assert english.count("{}") == german.count("{}"), english
        assert english.endswith(".") == german.endswith("."), english
