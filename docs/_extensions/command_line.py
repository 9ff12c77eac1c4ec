"""Directives of the command line: `console` runs commands while the site is built; `commands` prints every help."""

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any, ClassVar

import click
from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

COLUMNS = 100
FOLDER = "console"  # of the build: a folder for each page, empty at its first command


def environment(folder: Path) -> dict[str, str]:
    """PATH with a `stepdiag` that runs this package; 100 columns, no colours."""
    program = folder / "bin" / "stepdiag"
    program.parent.mkdir(parents=True, exist_ok=True)
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -P -m stepdiag "$@"\n')
    program.chmod(0o755)
    here = {"PATH": f"{program.parent}:{os.environ['PATH']}", "COLUMNS": str(COLUMNS), "NO_COLOR": "1"}
    return {**os.environ, **here, "STEPDIAG_SOURCE": str(Path(__file__).parents[2])}


class Console(SphinxDirective):
    """Commands and what they print. All of a page run in one folder, which is empty at first.

    A command that fails, or does not end with the stated exit code, fails the build. Lines that begin
    with `#` are remarks. `hide-output` shows the commands alone, `hide` nothing. `keep` names a file that is published
    beside the page, under the same name.
    """

    has_content = True
    option_spec: ClassVar[Any] = {
        "exit": directives.nonnegative_int,
        "hide": directives.flag,
        "hide-output": directives.flag,
        "keep": directives.unchanged,
        "last": directives.positive_int,
        "first": directives.positive_int,
    }

    def run(self) -> list[nodes.Node]:
        base = Path(self.env.app.doctreedir).parent / FOLDER
        folder = base / self.env.docname
        if self.env.temp_data.setdefault("console", False) is False:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            self.env.temp_data["console"] = True
        script = "\n".join(self.content)
        done = subprocess.run(
            ["bash", "-e", "-c", script],
            cwd=folder,
            env=environment(base),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        expected = self.options.get("exit", 0)
        if done.returncode != expected:
            raise self.error(f"expected exit code {expected}, got {done.returncode} from\n{script}\n{done.stdout}")
        if kept := self.options.get("keep"):
            target = Path(self.env.app.outdir) / Path(self.env.docname).parent / kept
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder / kept, target)
        if "hide" in self.options:
            return []
        shown: list[nodes.Node] = [nodes.literal_block(script, script, language="sh")]
        # Long sentences are folded, as terminals do; tables have shorter lines.
        lines = [
            part
            for line in done.stdout.rstrip().splitlines()
            for part in ([line] if len(line) <= COLUMNS else textwrap.wrap(line, COLUMNS, subsequent_indent="  "))
        ]
        if "first" in self.options and len(lines) > self.options["first"]:
            lines = [*lines[: self.options["first"]], "..."]
        if "last" in self.options and len(lines) > self.options["last"]:
            lines = ["...", *lines[-self.options["last"] :]]
        if lines and "hide-output" not in self.options:
            text = "\n".join(lines)
            shown.append(nodes.literal_block(text, text, language="none", classes=["output"]))
        return shown


class Commands(SphinxDirective):
    """The help of every command, a section each."""

    def run(self) -> list[nodes.Node]:
        from stepdiag.cli.command_line import cli

        sections: list[nodes.Node] = []

        def collect(command: click.Command, path: str, parent: click.Context | None) -> None:
            context = click.Context(command, info_name=path.split()[-1], parent=parent, terminal_width=90)
            text = command.get_help(context)
            section = nodes.section(ids=[nodes.make_id(path)], names=[path])
            section += [nodes.title(path, path), nodes.literal_block(text, text, language="none")]
            sections.append(section)
            if isinstance(command, click.Group):
                for name in command.list_commands(context):
                    child = command.get_command(context, name)
                    if child is not None and not child.hidden:
                        collect(child, f"{path} {name}", context)

        collect(cli, "stepdiag", None)
        return sections


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("console", Console)
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
