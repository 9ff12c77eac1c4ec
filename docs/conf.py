"""Sphinx: the site that `./run docs` builds from this folder."""

import re
import sys
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_extensions"))

project = "stepdiag"
author = "The stepdiag authors"
copyright = author
release = re.search(r"VERSION (\d+\.\d+\.\d+)", (HERE.parent / "CMakeLists.txt").read_text())[1]  # type: ignore[index]
version = release

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "sphinx_design",
    # of this folder
    "command_line",
    "public_headers",
    "public_names",
]
exclude_patterns = ["_extensions"]
nitpicky = True
smartquotes = False

# --- Markdown and notebooks ---
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "auto"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True

# --- Python ---
autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_member_order = "groupwise"
autoclass_content = "both"
autodoc_typehints_format = "short"
autodoc_docstring_signature = False  # public_names takes them from the stub
default_role = "code"  # docstrings have `names` in single backticks
python_maximum_signature_line_length = 88

# --- pages ---
html_theme = "pydata_sphinx_theme"
html_title = f"stepdiag {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_theme_options = {
    "logo": {"text": "stepdiag"},
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
}


# Pages of the repository that the site shows under a name of its own.
SHOWN_AS = {"../benchmarks/peers/README.md": "peers.md", "../CHANGELOG.md": "changes.md"}


def adapt_links(app: Sphinx, docname: str, source: list[str]) -> None:
    for path, page in SHOWN_AS.items():
        source[0] = source[0].replace(f"]({path}", f"]({page}")
    # A link that is named after its file gets the title of the page.
    source[0] = re.sub(r"\[`?([\w/-]+\.md)`?\]\((\1[^)]*)\)", r"[](\2)", source[0])


def setup(app: Sphinx) -> None:
    app.add_lexer("csv", TextLexer)  # Pygments has none
    app.connect("source-read", adapt_links)
