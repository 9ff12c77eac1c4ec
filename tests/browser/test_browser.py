"""The browser itself."""

from pathlib import Path

from playwright.sync_api import Browser


def test_page_from_a_file_is_shown(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("<title>a page</title>")
    page = browser.new_page()
    page.goto((tmp_path / "page.html").as_uri())
    assert page.title() == "a page"
