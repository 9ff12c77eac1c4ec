"""Reference of the Python package: signatures, types and fields as autodoc cannot see them itself.

- The extension's signatures and the types of its properties are those of the stub, in short form.
- The remark behind a field of a class (`name: type  # mm`) is the field's description.
- A type is linked to the public name, wherever it is defined.
"""

import ast
import re
from functools import cache
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config, GoogleDocstring
from sphinx.pycode import ModuleAnalyzer

import stepdiag

STUB = Path(stepdiag.__file__).with_name("_core.pyi")
SHORT = {
    r"typing\.Supports(Float|Complex) \| typing\.SupportsIndex": "float",
    r"typing\.SupportsInt \| typing\.SupportsIndex": "int",
    r"typing\.SupportsIndex": "int",
    r"str \| os\.PathLike\[str\]": "path",
    r"\b(typing|numpy\.typing|numpy|collections\.abc|matplotlib\.figure|xarray|stepdiag\.io\.displays)\.": "",
}
PYBIND_SIGNATURE = re.compile(r"\w*\((self: |arg0: |\*).*\) -> .*$|[a-z_]+\(.*\) -> .*$")
NAPOLEON = Config()
FIELD = re.compile(r"^(    \w+: [^#\n]+?)  # (?=\S)", re.M)


def _short(annotation: ast.expr | None) -> str:
    text = ast.unparse(annotation) if annotation else ""
    for pattern, short in SHORT.items():
        text = re.sub(pattern, short, text)
    return text


def _signature(function: ast.FunctionDef) -> tuple[str, str]:
    arguments = function.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    for argument in every:
        argument.annotation = ast.Name(_short(argument.annotation)) if argument.annotation else None
    for some in (arguments.posonlyargs, arguments.args):
        if some and some[0].arg == "self":
            del some[0]
    return f"({ast.unparse(arguments)})", _short(function.returns)


@cache
def stub() -> dict[str, tuple[str, str]]:
    """Of every function, method and property of the extension: its arguments and what it returns."""
    found = {}

    def collect(body: list[ast.stmt], prefix: str) -> None:
        for node in body:
            if isinstance(node, ast.ClassDef):
                collect(node.body, f"{node.name}.")
            elif isinstance(node, ast.FunctionDef) and prefix + node.name not in found:
                found[prefix + node.name] = _signature(node)

    collect(ast.parse(STUB.read_text(encoding="utf-8")).body, "")
    return found


def signature_of(app: Sphinx, what: str, name: str, *_: Any) -> tuple[str, str] | None:
    name = name.removeprefix("stepdiag.")
    if what == "class":
        arguments = stub().get(f"{name}.__init__")
        return (arguments[0], "") if arguments else None
    return stub().get(name)


def docstring_of(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text with `names`, and sections as Google writes them: bars and stars are no markup.

    pybind11's signatures are left out.
    """
    lines[:] = [line for line in lines if not PYBIND_SIGNATURE.match(line)]
    if lines and lines[0] == "Overloaded function.":
        lines[:] = [re.sub(r"^\d+\. (\w+\(.*?[,)]).*", r"`\1 ...`", line) for line in lines[2:]]
    text = re.sub(r"[|*]", r"\\\g<0>", "\n".join(lines))
    # Of a property Google's form is "type: description", which is not ours.
    lines[:] = text.splitlines() if what == "property" else GoogleDocstring(text, NAPOLEON).lines()


def fields_described(analyzer: type[ModuleAnalyzer]) -> None:
    read = analyzer.get_module_source

    def with_descriptions(modname: str) -> tuple[Any, str]:
        filename, source = read(modname)
        return filename, FIELD.sub(r"\1  #: ", source) if modname.startswith("stepdiag") else source

    analyzer.get_module_source = staticmethod(with_descriptions)  # type: ignore[method-assign]


def resolve(app: Sphinx, env: Any, node: pending_xref, contnode: nodes.Element) -> nodes.Element | None:
    if node.get("refdomain") != "py":
        return None
    name = node["reftarget"].rsplit(".", 1)[-1]
    if name not in stepdiag.__all__:
        return contnode  # types of Python, NumPy and of rooms: told, not linked
    domain = env.get_domain("py")
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", f"stepdiag.{name}", node, contnode)


def setup(app: Sphinx) -> dict[str, bool]:
    fields_described(ModuleAnalyzer)
    app.connect("autodoc-process-signature", signature_of)
    app.connect("autodoc-process-docstring", docstring_of)
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True}
