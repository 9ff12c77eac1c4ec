"""A distribution as a value of a key: a standard deviation, or a table that says which distribution it is."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, NoReturn

from pydantic import PlainValidator
from pydantic_core import PydanticCustomError

from stepdiag import _core
from stepdiag.config.key_errors import OWN_WORDS, show, suggest

# Of each kind the key that says how wide it is, and those that it has beside it (in brackets: that it may have).
WIDTHS: Final[Mapping[str, str]] = {
    "normal": "standard",
    "rectangular": "half_width",
    "triangular": "half_width",
    "arcsine": "half_width",
    "t": "scale",
    "curvilinear_trapezoid": "half_width",
}
REQUIRED: Final[Mapping[str, tuple[str, ...]]] = {"t": ("degrees_of_freedom",), "curvilinear_trapezoid": ("edge",)}
OPTIONAL: Final = ("expectation", "degrees_of_freedom")

LARGEST: Final = 1e9
SPREAD: Final = "a standard deviation or a distribution"
POSITIVE_SPREAD: Final = "a positive standard deviation or a distribution"

_WIDTH: Final = "a number of at least 0"
_EXPECTED: Final[Mapping[str, str]] = {
    "standard": _WIDTH,
    "half_width": _WIDTH,
    "scale": _WIDTH,
    "edge": "a number from 0 to half_width",
    "expectation": "a number",
    "degrees_of_freedom": "a number above 0",
}


@dataclass(frozen=True)
class StatedDistribution:
    """A distribution in the unit of the key that states it; `spread` as the core's Distribution has it."""

    kind: str
    spread: float
    expectation: float = 0.0
    degrees_of_freedom: float = math.inf
    edge: float = 0.0

    @property
    def is_certain(self) -> bool:
        """Nothing but 0: no reason to draw it."""
        return self.spread == 0.0 and self.expectation == 0.0

    def native(self, unit: float) -> _core.Distribution:
        """With `unit`, that of the key, in native ones."""
        return _core.Distribution(
            self.kind,
            spread=self.spread * unit,
            expectation=self.expectation * unit,
            degrees_of_freedom=self.degrees_of_freedom,
            edge=self.edge * unit,
        )


def _fail(said: str, below: str = "") -> NoReturn:
    raise PydanticCustomError(OWN_WORDS, "{below}: {said}", {"below": f".{below}" if below else "", "said": said})


def _number(value: Any) -> float | None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number and math.isfinite(value) and abs(value) <= LARGEST else None


def _stated(value: Any, expected: str) -> StatedDistribution:
    if isinstance(value, StatedDistribution):
        return value
    if isinstance(value, dict):
        return _of_table(value)
    number = _number(value)
    if number is None or number < 0.0:
        _fail(f"expected {expected}, got {show(value)}")
    return StatedDistribution("normal", number)


def _of_table(table: Mapping[str, Any]) -> StatedDistribution:
    kind = table.get("distribution")
    if kind is None:
        _fail(f"missing; expected one of {', '.join(WIDTHS)}", "distribution")
    if kind not in WIDTHS:
        hint = suggest(kind, list(WIDTHS)) if isinstance(kind, str) else f"expected one of {', '.join(WIDTHS)}"
        _fail(f"no distribution; {hint}; got {show(kind)}", "distribution")
    required = (WIDTHS[kind], *REQUIRED.get(kind, ()))
    known = list(dict.fromkeys((*required, *OPTIONAL)))
    for name in table:
        if name != "distribution" and name not in known:
            _fail(f'unknown key of the distribution "{kind}"; {suggest(name, known)}', name)
    for name in required:
        if name not in table:
            _fail(f'missing; the distribution "{kind}" needs it', name)
    values = {name: _checked(name, table[name]) for name in known if name in table}
    return _consistent(kind, values)


def _checked(name: str, value: Any) -> float:
    number = _number(value)
    too_small = number is not None and (
        number <= 0.0 if name == "degrees_of_freedom" else number < 0.0 and name != "expectation"
    )
    if number is None or too_small:
        _fail(f"expected {_EXPECTED[name]}, got {show(value)}", name)
    return number


def _consistent(kind: str, values: Mapping[str, float]) -> StatedDistribution:
    freedom, edge, width = values.get("degrees_of_freedom", math.inf), values.get("edge", 0.0), values[WIDTHS[kind]]
    if kind == "t" and freedom <= 2.0:
        _fail(
            f"expected a number above 2, for with fewer there is no standard uncertainty, got {show(freedom)}",
            "degrees_of_freedom",
        )
    if edge > width:
        _fail(f"expected {_EXPECTED['edge']}, got {show(edge)} beside {show(width)}", "edge")
    return StatedDistribution(kind, width, values.get("expectation", 0.0), freedom, edge)


def _spread(value: Any) -> StatedDistribution:
    return _stated(value, SPREAD)


def _positive(value: Any) -> StatedDistribution:
    stated = _stated(value, POSITIVE_SPREAD)
    if stated.spread <= 0.0:
        _fail(f"expected {POSITIVE_SPREAD}, got {show(value)}")
    return stated


def _by_channel(value: Any) -> dict[str, StatedDistribution]:
    if not isinstance(value, dict):
        _fail(f"expected a table of distributions by channel, got {show(value)}")
    result = {}
    for name, one in value.items():
        try:
            result[name] = _spread(one)
        except PydanticCustomError as error:
            context = error.context or {}
            _fail(str(context["said"]), f"{name}{context['below']}")
    return result


Spread = Annotated[StatedDistribution, PlainValidator(_spread)]
PositiveSpread = Annotated[StatedDistribution, PlainValidator(_positive)]
SpreadsByChannel = Annotated[dict[str, StatedDistribution], PlainValidator(_by_channel)]
