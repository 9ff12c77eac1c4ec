"""Directive `headers ROOM`: every public header of a room, each declaration below its comment.

The headers are written for readers: a sentence before each signature, with shapes, units and errors. So they are shown
as they are. A declaration without a comment of its own belongs to the one before it.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

INCLUDE = Path(__file__).parents[2] / "cpp" / "include"
# What a reader of declarations does not need.
LEFT_OUT = re.compile(r"#|namespace |\}  // namespace|extern \"C\"|\}$")
TYPE = re.compile(r"^(?:typedef )?(?:class|struct|enum class|enum|using|concept)\s+(?:\[\[\w+\]\]\s*)?(\w+)")
TYPEDEF = re.compile(r"^\}\s*(\w+);")
FUNCTION = re.compile(r"([A-Za-z_]\w*)\s*\((?!\*)|operator\S+")
CONSTANT = re.compile(r"(\w+)\s*(?:=|\{|;)")


@dataclass
class Entry:
    comment: list[str] = field(default_factory=list)
    code: list[str] = field(default_factory=list)

    def name(self) -> str:
        """Of the type, function or constant that is declared."""
        lines = [line for line in self.code if not line.startswith("template")]
        if found := TYPE.match(lines[0]) or TYPEDEF.match(lines[-1]):
            return found[1]
        text = " ".join(lines)
        found = FUNCTION.search(text) if "(" in text else CONSTANT.search(text)
        return found[1] or found[0] if found else text


def remark(line: str) -> str | None:
    """The text of a line that is a comment at the left margin."""
    found = re.match(r"(?://|/\*| \*(?!/)) ?(.*?)(?: \*/)?$", line)
    return found[1] if found else None


def entries_of(text: str) -> tuple[list[str], list[Entry]]:
    """The opening comment of a header, and its declarations."""
    lines = [line for line in text.splitlines() if not line.startswith("#ifdef __cplusplus")]
    first = next(i for i, line in enumerate(lines) if remark(line) is None)
    opening = [remark(line) or "" for line in lines[:first]]
    entries: list[Entry] = []
    current, depth = Entry(), 0

    def close() -> None:
        nonlocal current
        if current.code or current.comment:  # a comment alone is about all that follows
            entries.append(current)
        current = Entry()

    for line in lines[first:]:
        text = remark(line)
        if depth == 0 and text is not None:
            if current.code:
                close()
            current.comment.append(text)
        elif depth == 0 and (not line.strip() or LEFT_OUT.match(line)):
            close()
        else:
            current.code.append(line)
            depth += line.count("{") + line.count("(") - line.count("}") - line.count(")")
    close()
    return opening, entries


def prose(lines: list[str]) -> list[nodes.Node]:
    """Paragraphs; indented lines are formulas, or items of a list."""
    found: list[nodes.Node] = []
    kind, gathered = "", []

    def end(following: str) -> None:
        nonlocal kind
        text = " ".join(line.strip() for line in gathered)
        if kind == "item":
            if not found or not isinstance(found[-1], nodes.bullet_list):
                found.append(nodes.bullet_list())
            content = re.sub(r"^- ", "", text)
            found[-1] += nodes.list_item("", nodes.paragraph("", "", *inline(content)))
        elif kind == "formula":
            formula = "\n".join(gathered)
            found.append(nodes.literal_block(formula, formula, language="none"))
        elif kind:
            found.append(nodes.paragraph("", "", *inline(text)))
        kind = following
        gathered.clear()

    for line in lines:
        if re.match(r" +(- |\d\. )", line):
            end("item")
        elif not line.strip():
            end("")
        elif line.startswith("  "):
            if kind not in ("item", "formula"):
                end("formula")
        elif kind != "paragraph":
            end("paragraph")
        if line.strip():
            gathered.append(line)
    end("")
    return found


def inline(text: str) -> list[nodes.Node]:
    parts = re.split(r"`([^`]+)`", text)
    return [nodes.literal(part, part) if i % 2 else nodes.Text(part) for i, part in enumerate(parts) if part]


class Headers(SphinxDirective):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        room = INCLUDE / "stepdiag" / self.arguments[0]
        files = sorted([*room.glob("*.hpp"), *room.glob("*.h")])
        if not files:
            raise self.error(f"no public header in {room}")
        return [self.header(file) for file in files]

    def header(self, file: Path) -> nodes.section:
        self.env.note_dependency(str(file))
        opening, entries = entries_of(file.read_text(encoding="utf-8"))
        path = file.relative_to(INCLUDE).as_posix()
        section = self.section(path, path)
        section += prose(opening)
        include = f"#include <{path}>"
        section += nodes.literal_block(include, include, language="cpp")
        inside = section
        for entry in entries:
            if not entry.code:
                section += prose(entry.comment)
                continue
            if entry.comment or TYPE.match(entry.code[0]):
                inside = self.section(entry.name(), f"{path}-{entry.name()}")
                section += inside
            inside += prose(entry.comment)
            code = re.sub(r"\nprivate:\n.*?(?=\n};)", "", "\n".join(entry.code), flags=re.S).replace("\n\n};", "\n};")
            inside += nodes.literal_block(code, code, language="cpp")
        return section

    def section(self, title: str, name: str) -> nodes.section:
        section = nodes.section(names=[name])
        section += nodes.title("", "", nodes.literal(title, title))
        self.state.document.note_implicit_target(section)
        return section


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("headers", Headers)
    return {"parallel_read_safe": True}
