"""The schemas in docs/json are those of the types, and keys have units."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from stepdiag.presentation.objects.schemas import OBJECTS, schema_text

SCHEMAS = Path(__file__).parents[4] / "docs" / "json"
UNITS = (
    "um",
    "mm",
    "urad",
    "ppm",
    "um_per_h",
    "um_per_k",
    "um_per_m",
    "um_per_m_k",
    "per_mm",
    "c",
    "minutes",
    "h",
    "hpa",
    "percent",
)
# Numbers that have no unit.
OF_UNIT_ONE = {
    "allowed",
    "alpha",
    *("refractive_index", "counted_refractive_index"),
    *("positioning", "straightness", "angle", "squareness"),  # exponents
    "chi_square",
    "chi_square_gain",
    "chi_square_probability",
    "deviation",  # in the `unit` beside it, as allowed
    "fit_chi_square",
    "fit_probability",
    "linear",  # mm of mm
    "limit",
    "normalised",
    "probability",
    "rms_normalised",
    "sum",
    "threshold",
    "told",
    "u_sum",
    "uncertainties_multiplied_by",
    "variance_factor",
    "weight",
    "weighted_square_sum",
}


def numbers(schema: Any, key: str = "") -> Iterator[str]:
    """The keys of all numbers that are not whole, also those in lists."""
    if isinstance(schema, dict):
        if schema.get("type") == "number":
            yield key
        for own, part in schema.get("properties", {}).items():
            yield from numbers(part, own)
        for own in ("$defs", "additionalProperties"):
            for part in schema.get(own, {}).values() if isinstance(schema.get(own), dict) else ():
                yield from numbers(part, key)
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
        schema = json.loads(schema_text(name))
        assert f"json/{name}.schema.json" in text
        assert f"`{schema['properties']['format']['const']}`" in text


@pytest.mark.parametrize("name", OBJECTS)
def test_schema_is_valid_and_refuses_unknown_keys_everywhere(name: str) -> None:
    schema = json.loads(schema_text(name))
    Draft202012Validator.check_schema(schema)
    for described in (schema, *schema.get("$defs", {}).values()):
        if "properties" in described:
            assert described["additionalProperties"] is False
            assert set(described["required"]) == set(described["properties"])


@pytest.mark.parametrize("name", OBJECTS)
def test_object_begins_with_version_format_and_warnings(name: str) -> None:
    required = json.loads(schema_text(name))["required"]
    assert required[:2] == ["stepdiag", "format"]
    assert "warnings" in required


@pytest.mark.parametrize("name", OBJECTS)
def test_key_of_a_number_ends_with_its_unit(name: str) -> None:
    keys = set(numbers(json.loads(schema_text(name))))
    assert keys, "the schema has numbers"
    ending = re.compile(f"_({'|'.join(UNITS)})$")
    assert {key for key in keys if not ending.search(key)} <= OF_UNIT_ONE
