"""The text made from the scenario's keys: the reference page and the commented template."""

from pathlib import Path

from stepdiag.scenario import parse_scenario
from stepdiag.scenario_text import key_table, keys, sections, template


def test_reference_page_is_what_the_keys_say() -> None:
    page = (Path(__file__).parents[2] / "docs" / "scenario.md").read_text(encoding="utf-8")
    assert key_table().strip() in page, "the page is older than the keys: see python -m stepdiag.scenario_text"


def test_every_key_has_a_meaning() -> None:
    for name, section in sections():
        assert section.__doc__, name
        for key, field in keys(section):
            assert field.description, f"{name}.{key}"


def test_template_is_a_scenario_and_stays_one_with_every_key_uncommented() -> None:
    assert parse_scenario(template()).plan.lines == ["ppp", "npp", "pnp", "nnp"]
    is_key_or_section = [line for line in template().splitlines() if " = " in line or line.strip("# ").startswith("[")]
    everything = "\n".join(line.removeprefix("# ") for line in is_key_or_section if "Expected" not in line)
    everything = everything.replace('errors = "truth.csv"\n', "").replace("[misalignment.LINE] replaces", "#")
    everything = "\n".join(line for line in everything.splitlines() if "[adjustment.LINE]" not in line)
    assert parse_scenario(everything).keys.adjustment.laser_urad == "free"
