"""The set-up quantities: keys of scenarios and the table of docs/method.md are those of the core's table."""

import math

from places import DOCS

from stepdiag.config.adjustment_keys import AdjustmentKeys
from stepdiag.config.scenario_keys import MisalignmentKeys
from stepdiag.config.uncertainty_keys import SetupUncertaintyKeys
from stepdiag.setup_quantities import ADJUSTED, SETUP_QUANTITIES
from stepdiag.units import UNITS, unit_of


def test_keys_of_scenarios_are_those_of_the_table() -> None:
    adjusted = {quantity.key for quantity in ADJUSTED}
    assert AdjustmentKeys.model_fields.keys() == adjusted
    assert MisalignmentKeys.model_fields.keys() == adjusted
    assert SetupUncertaintyKeys.model_fields.keys() == {quantity.key for quantity in SETUP_QUANTITIES.values()}


def test_pairs_of_the_table_are_pairs_of_numbers_in_a_scenario() -> None:
    for quantity in ADJUSTED:
        default = MisalignmentKeys.model_fields[quantity.key].default
        assert default == (None if quantity.of_beams else (0.0, 0.0) if quantity.components else 0.0)


def test_units_of_keys_and_reports_are_of_the_quantity() -> None:
    native = {"um": "mm", "mm": "mm", "urad": "rad", "ppm": "1", "": "1", "um_per_h": "mm s-1"}
    for quantity in SETUP_QUANTITIES.values():
        ending = next((e for e, unit in UNITS.items() if unit == unit_of(quantity.key)), "")
        assert native[ending] == native[quantity.report_unit] == quantity.unit


def test_method_page_says_what_the_table_says() -> None:
    page = " ".join((DOCS / "method.md").read_text(encoding="utf-8").split())
    for quantity in ADJUSTED:
        unit = unit_of(quantity.key)
        known = f"known to {quantity.prior / unit.native:,g} {unit.name}".rstrip()
        default = {math.inf: "free", 0.0: "fixed at 0"}.get(quantity.prior, known)
        where = f"layout `{quantity.layout}`: " if quantity.layout else ""
        assert f"- `{quantity.key}`: {where}{quantity.meaning}. Default: {default}" in page
