"""What is odd about a scenario, and about an error map that is used as given."""

import math
from collections.abc import Iterator, Sequence

from stepdiag._core import Chain, ErrorMap, InvalidArgument
from stepdiag.findings.error_map import frame_deviation_texts, implausible_texts
from stepdiag.findings.meaning import UNVERIFIED
from stepdiag.scenario.description import Scenario, implausible_truth
from stepdiag.scenario.known import Known


def scenario_warnings(scenario: Scenario) -> Iterator[str]:
    """What is stated and no workshop has, and the oddities of the error map that a scenario names: one sentence each,
    with the file's path in front."""
    for warning in (*scenario.known.implausible, *implausible_truth(scenario.truth, scenario.known)):
        yield f"{scenario.path}: {warning}"
    file = scenario.truth.error_map
    if file is None:
        return
    for warning in map_warnings(scenario.machine().errors, scenario.known):
        yield f"{file}: {warning}"


def map_warnings(errors: ErrorMap, known: Known) -> Iterator[str]:
    """The map against the frame's zeros and what is plausible, its leading lines against the machine that uses it."""
    yield from frame_deviation_texts(errors, known.plan.volume)
    yield from implausible_texts(errors, known.plan.volume, known.plausible)
    header = errors.header
    if "unverified" in header:
        yield UNVERIFIED
    chain = header.get("chain")
    if chain is not None and not _is_chain(chain, known.chain):
        yield f"is for the chain {chain}, the scenario has {known.chain.name}; used as given"
    for key, what, wanted in (
        ("volume_mm", "volume", known.plan.volume.tolist()),
        ("tool_mm", "tool offset", known.tool),
    ):
        if key in header and not _are_numbers(header[key], wanted):
            mine = " ".join(f"{number:g}" for number in wanted)
            yield f"is for the {what} {header[key]} mm, the scenario has {mine} mm; used as given"
    slopes = header.get("undetermined_slopes", "").split()
    if slopes:
        yield f"is a calibration that leaves the slopes of {', '.join(slopes)} open; used as if they were 0"


def _is_chain(text: str, chain: Chain) -> bool:
    try:
        return Chain(text) == chain
    except InvalidArgument:
        return False


def _are_numbers(text: str, wanted: Sequence[float]) -> bool:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return False
    # A nanometre: somebody else's writer may have rounded.
    return len(numbers) == len(wanted) and all(
        math.isclose(a, b, rel_tol=0.0, abs_tol=1e-6) for a, b in zip(numbers, wanted, strict=True)
    )
