"""From the text of a TOML file to checked keys."""

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final, TypeVar

from pydantic import ValidationError, create_model

from stepdiag._core import InvalidArgument, newer_format
from stepdiag.config.key_errors import explain
from stepdiag.config.key_types import FILE_FORMAT, Section

Keys = TypeVar("Keys", bound=Section)

DEEPEST: Final = 32  # tables and lists in each other; our keys have six, and far more exhausts Python's stack


def parse_toml(text: str, file: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises InvalidArgument, with `file` in front, also for a newer `format`."""
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise InvalidArgument(f"{file}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        raise InvalidArgument(f"{file}: not valid TOML: {message[:1].lower()}{message[1:]}") from None
    except ValueError:  # Python reads integers of up to 4300 digits
        raise InvalidArgument(f"{file}: not valid TOML: a number has too many digits") from None
    if _too_deep(content):  # dotted names of tables, which tomllib reads at any length
        raise InvalidArgument(f"{file}: not valid TOML: nested too deeply")
    _check_not_newer(content, file)
    return content


def _check_not_newer(content: Mapping[str, Any], file: str) -> None:
    """Before the keys, of which such a file may have others."""
    given = content.get("format")
    newer = newer_format(str(FILE_FORMAT), str(given)) if type(given) is int else ""
    if newer:
        raise InvalidArgument(f"{file}: format: expected {FILE_FORMAT}, got {given}{newer}")


def check_keys(content: Mapping[str, Any], root: type[Keys], file: str) -> Keys:
    """The keys of a whole file. Raises InvalidArgument naming the first that is wrong."""
    try:
        given = _given(root, content).model_validate(_tuples(content))
    except ValidationError as error:
        raise explain(error, content, file, root) from None
    return root.model_construct(given.model_fields_set, **dict(given))


def _given(root: type[Section], content: Mapping[str, Any]) -> type[Section]:
    """`root` without the sections that a file leaves out: to build their validators takes longer than all checks."""
    fields = root.model_fields.items()
    given: dict[str, Any] = {
        name: (key.annotation, key) for name, key in fields if name in content or key.is_required()
    }
    return create_model(root.__name__, __base__=Section, **given)


def _too_deep(content: dict[str, Any]) -> bool:
    """Level by level, for recursion would fail where it matters."""
    level: list[Any] = [content]
    for _ in range(DEEPEST):
        inner = [item for value in level for item in (value.values() if isinstance(value, dict) else value)]
        level = [item for item in inner if isinstance(item, dict | list)]
    return bool(level)


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


@contextmanager
def located(place: str) -> Iterator[None]:
    """Puts `place` in front of what the core has to say about its arguments."""
    try:
        yield
    except InvalidArgument as error:
        raise InvalidArgument(f"{place}: {error}") from None
