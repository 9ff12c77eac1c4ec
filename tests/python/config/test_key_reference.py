"""The text made from the keys of scenarios and heads: the reference pages and the commented template."""

import pytest
from places import DOCS

from stepdiag.config.head_keys import HeadFile
from stepdiag.config.key_reference import key_list, keys, sections
from stepdiag.config.key_types import Section
from stepdiag.config.scenario_keys import ScenarioKeys
from stepdiag.config.scenario_template import template
from stepdiag.scenario.description import parse_scenario

# Of two things that exclude each other the template can have one; these are the other ones.
OTHERS = ("layout", "psd_distance_mm", "beam_offsets_mm", "wavelength_nm", "aperture_mm", "errors", "head")
OTHERS += ("refractive_index", "beam_constants_um", "beam_offsets_um")


@pytest.mark.parametrize(("page", "root"), [("scenario.md", ScenarioKeys), ("head.md", HeadFile)])
def test_reference_page_is_what_the_keys_say(page: str, root: type[Section]) -> None:
    said = (DOCS / page).read_text(encoding="utf-8")
    assert key_list(root).strip() in said, "the page is older than the keys: it says how it is made"


@pytest.mark.parametrize("root", [ScenarioKeys, HeadFile])
def test_every_key_has_a_meaning(root: type[Section]) -> None:
    for part in sections(root):
        assert part.model.__doc__, part.title
        for key, field in keys(part.model):
            assert field.description, f"{part.title}.{key}"


def uncommented(text: str) -> str:
    """Every section and key of the template, without its remarks and without one of two that exclude each other."""
    lines = [line.removeprefix("# ") for line in text.splitlines()]
    is_section = [line.startswith("[") and line.endswith("]") for line in lines]
    is_key = [line.split(" = ")[0].isidentifier() and " = " in line for line in lines]
    kept = [line for line, a, b in zip(lines, is_section, is_key, strict=True) if a or b]
    return "\n".join(line for line in kept if line.split(" = ")[0] not in OTHERS and line != "[line.ppp]")


def test_template_is_a_scenario_and_stays_one_with_every_key_uncommented() -> None:
    assert parse_scenario(template()).known.plan.lines == ["ppp", "npp", "pnp", "nnp", "pp0"]
    everything = parse_scenario(uncommented(template()))
    assert everything.known.keys.adjustment.laser_urad == "free"
    assert everything.known.head.design.name == "beam and PSD"
    assert everything.truth.pose_errors["head"].keys() == {"window"}


def test_template_for_a_head_has_its_description_and_no_layout() -> None:
    scenario = parse_scenario(template("three_beams"))
    assert scenario.known.head.signals == ["d1", "d2", "d3"]
    assert scenario.known.described["head"].keys.layout is None
