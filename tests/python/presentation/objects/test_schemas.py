"""The schemas in docs/json are those of the types, and keys have units."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from jsonschema import Draft202012Validator

from stepdiag.presentation.objects.schemas import OBJECTS, schema_text
from stepdiag.presentation.quantity import Unit

SCHEMAS = Path(__file__).parents[4] / "docs" / "json"
# Numbers that are no quantities: of statistics, with the unit 1.
OF_UNIT_ONE = {
    "alpha",
    "chi_square",
    "chi_square_gain",
    "chi_square_probability",
    *("chi_square_turned", "chi_square_without"),
    "determined",
    "fit_chi_square",
    "fit_probability",
    "limit",  # of a probability
    "normalised",
    *("positioning", "straightness", "angle", "squareness"),  # exponents
    "probability",
    "rms_normalised",
    "threshold",
    "uncertainties_multiplied_by",
    "variance_factor",
    "weight",
    "weighted_square_sum",
}
QUANTITIES = {"Quantity", "Quantities"}


def numbers(schema: Any, key: str = "") -> Iterator[str]:
    """The keys of all numbers that are not whole and in no quantity, also those in lists."""
    if isinstance(schema, dict):
        if schema.get("type") == "number":
            yield key
        for own, part in schema.get("properties", {}).items():
            yield from numbers(part, own)
        for name, part in schema.get("$defs", {}).items():
            yield from numbers(part, key) if name not in QUANTITIES else ()
        yield from numbers(schema.get("additionalProperties"), key)
        yield from numbers([schema.get("items"), *schema.get("prefixItems", ()), *schema.get("anyOf", ())], key)
    elif isinstance(schema, list):
        for part in schema:
            yield from numbers(part, key)


@pytest.mark.parametrize("name", OBJECTS)
def test_schema_in_the_documentation_is_that_of_the_types(name: str) -> None:
    text = (SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8")
    assert text == schema_text(name), (
        f"./run python -m stepdiag.presentation.objects.schemas {name} > docs/json/{name}.schema.json"
    )


def test_documentation_has_no_other_schema_and_names_each() -> None:
    assert {file.name for file in SCHEMAS.iterdir()} == {f"{name}.schema.json" for name in OBJECTS}
    text = (SCHEMAS.parent / "json.md").read_text(encoding="utf-8")
    for name in OBJECTS:
        assert f"json/{name}.schema.json" in text
        assert f"`stepdiag {name}`" in text


@pytest.mark.parametrize("name", OBJECTS)
def test_schema_is_valid_requires_its_keys_and_allows_others(name: str) -> None:
    schema = json.loads(schema_text(name))
    Draft202012Validator.check_schema(schema)
    for name, described in (("", schema), *schema["$defs"].items()):
        if "properties" in described:
            assert described.get("additionalProperties", True) is True
            optional = set(described["properties"]) - set(described["required"])
            assert optional <= {"interval", "reason"} or name == "BlockObject"


@pytest.mark.parametrize("name", OBJECTS)
def test_object_begins_with_version_format_and_warnings(name: str) -> None:
    schema = json.loads(schema_text(name))
    assert schema["required"][:3] == ["stepdiag", "format", "warnings"]
    assert schema["$defs"]["Format"]["properties"]["version"]["const"] == 2


@pytest.mark.parametrize("name", OBJECTS)
def test_every_number_with_a_unit_is_a_quantity(name: str) -> None:
    schema = json.loads(schema_text(name))
    assert set(numbers(schema)) <= OF_UNIT_ONE
    for quantity in QUANTITIES & schema["$defs"].keys():
        units = schema["$defs"][quantity]["properties"]["unit"]["enum"]
        assert sorted(units) == sorted(get_args(Unit))  # the closed list


def test_documentation_lists_the_codes_of_all_reasons() -> None:
    header = (SCHEMAS.parents[1] / "cpp/include/stepdiag/adjustment/results.hpp").read_text(encoding="utf-8")
    names = re.findall(r"^ +(\w+),", header.partition("enum class FitFinding {")[2].partition("};")[0], re.MULTILINE)
    assert "misfit" in names
    own = ["method_by_itself", "not_adjustable", "recheck_unexplained"]  # of the package
    table = (SCHEMAS.parent / "json.md").read_text(encoding="utf-8").partition("## Codes of reasons")[2]
    listed = [code for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for code in re.findall(r"`(\w+)`", row)]
    assert sorted(listed) == sorted([*names, *own, "null"])
