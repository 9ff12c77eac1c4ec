"""docs/mistakes.md says what the program says."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from mistaken import changed, moved, rows_of
from places import DOCS, EXAMPLES

import stepdiag as sd
from stepdiag.findings.mistakes import change_rows, mistake_text
from stepdiag.findings.reasons import mistake_reason
from stepdiag.mistakes.catalogue import CATALOGUE

PAGE = (DOCS / "mistakes.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```\n(.*?)```", PAGE, re.DOTALL)


def twice(run: sd.Measurement) -> sd.Measurement:
    rows, source = rows_of(run, "pnp"), np.arange(len(run))
    source[rows[61:]] = rows[60:-1]
    return moved(run, source)


def exchanged(run: sd.Measurement) -> sd.Measurement:
    source = np.arange(len(run))
    source[rows_of(run, "ppp")], source[rows_of(run, "npp")] = rows_of(run, "npp"), rows_of(run, "ppp")
    return moved(run, source)


def without_index(run: sd.Measurement) -> sd.Measurement:
    factors = np.where([line.count("0") == 2 for line in run.line], 1.00027, 1.0)
    return changed(run, {"distance": run.channels["distance"] * factors})


MADE: list[Callable[[sd.Measurement], sd.Measurement]] = [
    lambda run: changed(run, {"alpha": -run.channels["alpha"]}),
    lambda run: changed(run, {name: 2.0 * run.channels[name] for name in ("alpha", "beta")}),
    exchanged,
    twice,
    without_index,
]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(MADE)))
def test_page_says_what_the_program_says(number: int) -> None:
    scenario = sd.read_scenario(EXAMPLES / "scenario.toml")
    found = sd.find_mistakes(scenario, MADE[number](sd.simulate(scenario)))
    what = re.sub(r" \(variance factor [^)]*\)$", "", mistake_text(found))
    said = [f"rejected because {mistake_reason(what)}", *map(": ".join, change_rows(found))]
    assert BLOCKS[number].splitlines() == said


def test_page_lists_every_entry() -> None:
    rows = re.findall(r"^- \*\*([a-z ]+)\*\*", PAGE, re.MULTILINE)
    assert rows == [*(mistake.name for mistake in CATALOGUE), "disturbed"]
