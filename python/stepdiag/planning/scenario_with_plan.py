"""A scenario with another plan: the text of its file stays, comments too, but for what belongs to the plan."""

from pathlib import Path
from typing import Any

import tomlkit

from stepdiag.config.scenario_keys import SECTIONS_BY_LINE
from stepdiag.io.whole_files import read_text
from stepdiag.planning.plan_by_time import Candidate, own_candidate
from stepdiag.scenario.description import parse_scenario
from stepdiag.scenario.known import Known


def scenario_with_plan(known: Known, candidate: Candidate, path: Path) -> str:
    """The text of a scenario's file with the plan of `candidate`, to be written to `path`.

    What it says of single lines that are not measured any more is left out. Raises InvalidArgument where the text is no
    scenario there: files that it names are not beside `path`, or a line has no head."""
    document: dict[str, Any] = tomlkit.parse(read_text(known.path))
    plan, own = document["plan"], own_candidate(known)
    for name in ("lines", "scale_lines", "steps", "repeats", "check_points", "scale_points", "backward"):
        value = getattr(candidate, name)
        if value != getattr(own, name):
            plan[name] = list(value) if isinstance(value, tuple) else value
    for name in ("block", "check_point"):
        if name in plan:
            plan[name] = min(plan[name], candidate.steps)
    for section in (*SECTIONS_BY_LINE, "line"):
        for line in {*known.plan.lines, *known.plan.scale_lines} - {*candidate.lines, *candidate.scale_lines}:
            document.get(section, {}).pop(line, None)
    text = tomlkit.dumps(document)
    parse_scenario(text, path)
    return text
