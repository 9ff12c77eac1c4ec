"""From the text of a TOML file to checked keys."""

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

from pydantic import ValidationError

from stepdiag._core import InvalidArgument
from stepdiag.key_errors import explain
from stepdiag.sections import Section

Keys = TypeVar("Keys", bound=Section)


def parse_toml(text: str, file: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises InvalidArgument, with `file` in front."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InvalidArgument(f"{file}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        raise InvalidArgument(f"{file}: not valid TOML: {message[:1].lower()}{message[1:]}") from None
    except ValueError:  # Python reads integers of up to 4300 digits
        raise InvalidArgument(f"{file}: not valid TOML: a number has too many digits") from None


def check_keys(content: Mapping[str, Any], root: type[Keys], file: str) -> Keys:
    """The keys of a whole file. Raises InvalidArgument naming the first that is wrong."""
    try:
        return root.model_validate(_tuples(content))
    except ValidationError as error:
        raise explain(error, content, file, root) from None


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
