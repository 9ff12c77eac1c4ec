"""Wrong arguments of public callables are one line that says which one, what is expected and what came."""

import inspect
from operator import attrgetter
from typing import Any

import pytest
from public_names import public_names

import stepdiag as sd
from stepdiag.wrong_arguments import expected, fits

CALLABLES = [name for name in public_names() if callable(attrgetter(name)(sd))]
# They take anything, or are called so often that nothing is checked.
ANYTHING = ("kind_of", "in_report_units", "LinuxcncError", "Progress")


class Strange:
    """What no function expects."""


def is_made_by_its_package(value: Any) -> bool:
    """Whether it is a class of results, which nobody calls."""
    return isinstance(value, type) and (value.__module__ == "stepdiag._core" and "__init__" not in vars(value))


@pytest.mark.parametrize("name", CALLABLES)
def test_an_unknown_name_is_one_line(name: str) -> None:
    value = attrgetter(name)(sd)
    with pytest.raises((TypeError, sd.InvalidArgument)) as refused:
        value(**{"no_such_argument": Strange()})
    message = str(refused.value)
    assert "\n" not in message
    assert "0x" not in message


@pytest.mark.parametrize("name", [name for name in CALLABLES if name.split(".")[-1] not in ANYTHING])
def test_a_value_of_another_kind_is_one_line(name: str) -> None:
    value = attrgetter(name)(sd)
    if isinstance(value, type) and (is_made_by_its_package(value) or hasattr(value, "__dataclass_fields__")):
        pytest.skip("nobody calls it, or it is checked where it is used")
    try:
        takes_any = not inspect.signature(value).parameters
    except (ValueError, TypeError):
        takes_any = False
    if takes_any:
        pytest.skip("takes nothing")
    with pytest.raises((TypeError, sd.InvalidArgument)) as refused:
        value(Strange())
    message = str(refused.value)
    assert "\n" not in message
    assert "0x" not in message


PLAN = sd.Plan((1, 2, 3), ["ppp"], 2)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sd.Plan((1, 2, 3), ["ppp"], "ten"), "Plan(): steps: expected a whole number, got 'ten'"),
        (lambda: sd.Plan((1, 2, 3), ["ppp"], 2, stps=3), "Plan(): unexpected argument 'stps'; did you mean 'steps'?"),
        (lambda: sd.Plan((1, 2, 3)), "Plan(): missing argument 'lines' (a sequence (a text each))"),
        (lambda: sd.Plan((1, 2, 3), "ppp", 2), "Plan(): lines: expected a sequence (a text each), got 'ppp'"),
        (
            lambda: sd.Plan((1, 2, 3), ["ppp", 3], 2),
            "Plan(): lines: expected a sequence (a text each), got one with 3 in it",
        ),
        (lambda: PLAN.points(3), "Plan.points(): line: expected a text, got 3"),
        (lambda: sd.methods.adjust(1, PLAN), "adjust(): measurement: expected a Measurement, got 1"),
        (lambda: sd.Noise(distance="a"), "Noise(): distance: expected a number, got 'a'"),
        (
            lambda: sd.judge("scenario.toml", 1),
            "judge(): scenario: expected a Scenario or a Known, got 'scenario.toml'",
        ),
        (lambda: sd.volume(PLAN), "volume(): source: expected a Calibration or a Machine, got a Plan"),
        (lambda: sd.volume(), "volume(): missing argument 'source' (a Calibration or a Machine)"),
        (lambda: sd.simulate(1), "simulate(): expected a Scenario or a Machine, got int"),
    ],
)
def test_the_line_names_the_argument(call: Any, message: str) -> None:
    with pytest.raises(TypeError) as refused:
        call()
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (1, "typing.SupportsFloat | typing.SupportsIndex"),
        (None, "stepdiag._core.Chain | None"),
        ("x", "str | os.PathLike[str]"),
        ({"ppp": 1}, "collections.abc.Mapping[str, typing.SupportsFloat]"),
        ((1.0, 2.0), 'typing.Annotated[collections.abc.Sequence[typing.SupportsFloat], "FixedSize(2)"]'),
        ("enhanced", "typing.Literal['enhanced', 'conventional']"),
    ],
)
def test_what_fits_is_taken(value: object, kind: str) -> None:
    assert fits(value, kind)
    assert not fits(Strange(), kind)
    assert expected(kind)


def test_a_value_that_no_text_can_show_is_refused_all_the_same() -> None:
    class Unprintable:
        def __repr__(self) -> str:
            return "\udcff"  # half of a surrogate pair

    with pytest.raises((TypeError, UnicodeError)):
        sd.Plan(Unprintable(), Unprintable(), Unprintable())  # type: ignore[arg-type]
