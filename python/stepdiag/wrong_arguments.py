"""The line for arguments that a function does not take: which one, what is expected, and what came."""

import difflib
import functools
import inspect
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import UnionType
from typing import Any, Final, Literal, NamedTuple, ParamSpec, TypeVar, Union, get_args, get_origin

P = ParamSpec("P")
R = TypeVar("R")

_LONGEST: Final = 40  # characters of a value that a message shows
_CLOSE: Final = {"(": ")", "[": "]", "{": "}", "<": ">"}


class Parameter(NamedTuple):
    """A parameter by the text of its type, as signatures of the extension and annotations have it."""

    name: str
    type: str
    is_required: bool
    by_name_alone: bool


class Signature(NamedTuple):
    """What a callable takes; `takes_any_name`: more arguments by name, which it checks itself."""

    name: str
    parameters: list[Parameter]
    takes_any_name: bool


def wrong_arguments(text: str, arguments: tuple[Any, ...], keywords: Mapping[str, Any]) -> str:
    """The line for a call of the extension; `text`: pybind11's, with the signatures."""
    function = text.split("(", 1)[0]
    signatures = [_parsed(line, function) for line in re.findall(r"^ +\d+\. (.*)$", text, re.MULTILINE)]
    # Of overloads the one of which the most arguments fit.
    trouble = [_trouble(signature, _without_self(signature, function, arguments), keywords) for signature in signatures]
    return max(trouble)[1]


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator of public functions: a call with arguments of other types than annotated is one line, a TypeError."""
    signature: Signature | None = None

    @functools.wraps(function)
    def call(*arguments: P.args, **keywords: P.kwargs) -> R:
        nonlocal signature
        signature = signature or _annotated(function)
        fitting, line = _trouble(signature, arguments, keywords)
        if fitting < _ALL:
            raise TypeError(line)
        return function(*arguments, **keywords)

    return call


_ALL: Final = 1_000  # more parameters than any function has


def _trouble(signature: Signature, arguments: tuple[Any, ...], keywords: Mapping[str, Any]) -> tuple[int, str]:
    """How many arguments fit before the first that does not (_ALL: they all do), and what is wrong with that."""
    name, parameters, takes_any_name = signature
    by_place = [parameter for parameter in parameters if not parameter.by_name_alone]
    known = {parameter.name for parameter in parameters}
    for given in keywords:
        if given not in known and not takes_any_name:
            close = difflib.get_close_matches(given, known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"expected {', '.join(sorted(known)) or 'none'}"
            return 0, f"{name}: unexpected argument {given!r}; {hint}"
    if len(arguments) > len(by_place):
        return 0, f"{name}: expected at most {len(by_place)} arguments without a name, got {len(arguments)}"
    values = dict(zip((parameter.name for parameter in by_place), arguments, strict=False))
    for given in keywords:
        if given in values:
            return 0, f"{name}: got two values for the argument {given!r}"
    values |= keywords
    for count, parameter in enumerate(parameters):
        if parameter.name not in values:
            if parameter.is_required:
                return count, f"{name}: missing argument {parameter.name!r} ({expected(parameter.type)})"
        elif not fits(values[parameter.name], parameter.type):
            came = _came(values[parameter.name], parameter.type)
            return count, f"{name}: {parameter.name}: expected {expected(parameter.type)}, got {came}"
    return _ALL, f"{name}: expected ({', '.join(p.name for p in parameters)}), got values of other kinds"


# --- types by their texts ---
def fits(value: Any, type_text: str) -> bool:
    """Whether a value is of a type; True for what is not known here, and for arrays, which are checked elsewhere."""
    return any(_fits_one(value, one) for one in _split(type_text, "|"))


def _fits_one(value: Any, text: str) -> bool:
    name, inside = _generic(text)
    match name:
        case "None":
            return value is None
        case "bool":
            return isinstance(value, bool) or type(value).__name__ in ("bool_", "bool")
        case "str":
            return isinstance(value, str)
        case "float" | "SupportsFloat":
            return not isinstance(value, str) and (hasattr(value, "__float__") or hasattr(value, "__index__"))
        case "int" | "SupportsIndex" | "SupportsInt":
            return not isinstance(value, str) and hasattr(value, "__index__")
        case "PathLike" | "Path":
            return isinstance(value, os.PathLike)
        case "Annotated":
            return fits(value, inside[0])
        case "Literal":
            return repr(value) in (word.replace('"', "'") for word in inside)
        case "Sequence" | "list" | "tuple" | "Iterable":
            if isinstance(value, str | bytes) or not hasattr(value, "__iter__"):
                return False
            return not inside or not isinstance(value, Sequence) or all(fits(one, inside[0]) for one in value)
        case "Mapping" | "dict":
            return isinstance(value, Mapping) and all(
                fits(key, inside[0]) and fits(item, inside[1]) for key, item in value.items() if len(inside) > 1
            )
        case "Callable":
            return callable(value)
        case "object" | "Any" | "ArrayLike" | "NDArray" | "ndarray":
            return True
    if not re.fullmatch(r"[A-Z]\w+", name):
        return True
    return any(kind.__name__ == name for kind in type(value).__mro__)


_WORDS: Final = {
    "None": "None",
    "bool": "True or False",
    "str": "a text",
    "float": "a number",
    "SupportsFloat": "a number",
    "int": "a whole number",
    "SupportsIndex": "a whole number",
    "SupportsInt": "a whole number",
    "PathLike": "a path",
    "Path": "a pathlib.Path",
    "ArrayLike": "an array of numbers",
    "Callable": "a function",
}


def expected(type_text: str) -> str:
    """A type in words: "a Chain or a text"."""
    words: list[str] = []
    for one in _split(type_text, "|"):
        name, inside = _generic(one)
        if name == "SupportsIndex" and "a number" in words:
            continue
        if name in ("Sequence", "list", "tuple", "Iterable"):
            said = "a sequence" + (f" ({expected(inside[0])} each)" if inside else "")
        elif name in ("Mapping", "dict"):
            said = f"a mapping (to {expected(inside[1])} each)" if len(inside) > 1 else "a mapping"
        elif name == "Annotated":
            said = expected(inside[0])
        elif name == "Literal":
            said = "one of " + ", ".join(inside)
        else:
            said = _WORDS.get(name) or f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"
        if said not in words:
            words.append(said)
    return " or ".join(words)


def _came(value: Any, type_text: str) -> str:
    if isinstance(value, str | int | float | None):
        text = repr(value)
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
    if isinstance(value, Mapping | Sequence):
        for one in _split(type_text, "|"):
            name, inside = _generic(one)
            of = {"Sequence": 0, "list": 0, "tuple": 0, "Mapping": 1, "dict": 1}.get(name)
            items = value.values() if isinstance(value, Mapping) else value
            if of is not None and len(inside) > of:
                for item in items:
                    if not fits(item, inside[of]):
                        return f"one with {_came(item, inside[of])} in it"
    kind = type(value).__name__
    return f"{'an' if kind[:1].lower() in 'aeiou' else 'a'} {kind}"


# --- signatures from texts ---
def _parsed(line: str, function: str) -> Signature:
    """`(self: stepdiag._core.Plan, line: str) -> int`, or that of a constructor, which begins with its class."""
    start = line.index("(")
    owner = line[:start].split(".")[-1]
    inside = line[start + 1 : _end(line, start)]
    parameters, by_name_alone, takes_any_name = [], False, False
    for part in _split(inside, ","):
        if part in ("*", "/") or part.startswith("*"):
            by_name_alone = by_name_alone or part == "*"
            takes_any_name = takes_any_name or part.startswith("**")
            continue
        name, _, rest = part.partition(":")
        kind, *default = _split(rest, "=")
        if name == "self":
            owner = kind.split(".")[-1]
            continue
        parameters.append(Parameter(name, kind, not default, by_name_alone))
    called = f"{owner}()" if function == "__init__" else f"{owner}.{function}()" if owner else f"{function}()"
    return Signature(called, parameters, takes_any_name)


def _without_self(signature: Signature, function: str, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    is_method = function == "__init__" or "." in signature.name
    return arguments[1:] if is_method else arguments


def _annotated(function: Callable[..., Any]) -> Signature:
    parameters, takes_any_name = [], False
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
            takes_any_name = takes_any_name or parameter.kind == parameter.VAR_KEYWORD
            continue
        kind = parameter.annotation
        text = "object" if kind is parameter.empty else kind if isinstance(kind, str) else _text_of(kind)
        by_name_alone = parameter.kind == parameter.KEYWORD_ONLY
        parameters.append(Parameter(parameter.name, text, parameter.default is parameter.empty, by_name_alone))
    return Signature(f"{function.__name__}()", parameters, takes_any_name)


def _text_of(kind: Any) -> str:
    """The text of an annotation; a protocol is whatever has its methods."""
    if "_SupportsArray" in str(kind):
        return "ArrayLike"
    if getattr(kind, "_is_protocol", False):
        return "object"
    if kind is type(None):
        return "None"
    origin, inside = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return " | ".join(map(_text_of, inside))
    if origin in (None, Literal, Callable) or not inside:
        return kind.__name__ if isinstance(kind, type) else str(kind)
    return f"{origin.__name__}[{', '.join(map(_text_of, inside))}]"


def _generic(text: str) -> tuple[str, list[str]]:
    """`Sequence` and [`str`] of collections.abc.Sequence[str]."""
    name, bracket, rest = text.strip().strip("\"'").partition("[")
    inside = _split(rest.rsplit("]", 1)[0], ",") if bracket else []
    return name.split(".")[-1], inside


def _split(text: str, at: str) -> list[str]:
    """At this character, but not inside brackets or quotes."""
    return [part.strip() for part in _parts(text, at) if part.strip()]


def _parts(text: str, at: str) -> Iterator[str]:
    start, closing, quote = 0, list[str](), ""
    for i, c in enumerate(text):
        if quote:
            quote = "" if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c in _CLOSE:
            closing.append(_CLOSE[c])
        elif closing and c == closing[-1]:
            closing.pop()
        elif c == at and not closing:
            yield text[start:i]
            start = i + 1
    yield text[start:]


def _end(text: str, start: int) -> int:
    """Where the bracket that begins at `start` ends."""
    return start + 1 + len(next(_parts(text[start + 1 :], ")")))
