"""The set-up quantities of a line: the core's table, by name."""

from collections.abc import Mapping
from typing import Final

from stepdiag._core import SetupQuantity, adjusted_quantity_count, setup_quantities
from stepdiag.units import UNITS, Unit

SETUP_QUANTITIES: Final[Mapping[str, SetupQuantity]] = {quantity.name: quantity for quantity in setup_quantities()}

# The unknowns of an adjustment, and what a scenario misaligns.
ADJUSTED: Final[tuple[SetupQuantity, ...]] = setup_quantities()[:adjusted_quantity_count]


def report_unit(name: str) -> Unit:
    """The unit in which reports show a quantity."""
    return UNITS[SETUP_QUANTITIES[name].report_unit]


def component_name(name: str, component: int) -> str:
    """What distinguishes a component from the others: "a" or "b", "x" or "y", "d2"; empty for a single one."""
    quantity = SETUP_QUANTITIES[name]
    if quantity.of_beams:
        return f"d{component + 1}"
    return quantity.components[component] if quantity.components else ""
