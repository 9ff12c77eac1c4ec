"""Options of a command from the fields of an option class (option_field.py), and the class from what was given."""

from collections.abc import Callable, Iterator
from dataclasses import Field, fields
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import click

Command = TypeVar("Command", bound=Callable[..., None])
Options = TypeVar("Options")


def options_of(*classes: type) -> Callable[[Command], Command]:
    """Decorator of a command: an option for each field with a meaning."""

    def decorate(command: Command) -> Command:
        for kind in reversed(classes):
            types = get_type_hints(kind)
            for field in reversed(list(_described(kind))):
                command = _option(field, types[field.name])(command)
        return command

    return decorate


def made_of(kind: type[Options], given: dict[str, Any], **others: Any) -> Options:
    """The class from the options of a command, and from other fields."""
    values = {field.name: _value(field, given[_name(field)]) for field in _described(kind)}
    return kind(**values, **others)


def _described(kind: type) -> Iterator[Field[Any]]:
    return (field for field in fields(kind) if "meaning" in field.metadata)


def _name(field: Field[Any]) -> str:
    return field.metadata["name"] or field.name


def _option(field: Field[Any], kind: Any) -> Callable[[Command], Command]:
    about, flag = field.metadata, f"--{_name(field).replace('_', '-')}"
    if kind is bool:
        return click.option(flag, is_flag=True, help=about["meaning"])
    default = field.default
    if about["words"]:
        default = next(word for word, value in about["words"].items() if value == default)
    elif kind is float:
        default = default / about["factor"]
    shown = default is not None
    return click.option(
        flag,
        type=_type(about, kind),
        default=default,
        show_default=shown,
        metavar=about["metavar"],
        help=about["meaning"],
    )


def _type(about: Any, kind: Any) -> Any:
    least, above = about["least"], about["above"]
    if about["words"]:
        return click.Choice(list(about["words"]))
    if get_origin(kind) is Literal:
        return click.Choice(list(get_args(kind)))
    if kind is int:
        return click.IntRange(least)
    if kind is float:
        return click.FloatRange(min=least if above is None else above, min_open=above is not None)
    return str


def _value(field: Field[Any], given: Any) -> Any:
    about = field.metadata
    if about["words"]:
        return about["words"][given]
    if about["parse"]:
        return None if given is None else about["parse"](given)
    return given * about["factor"] if isinstance(given, float) else given
