"""The object of `stepdiag observe --json`."""

from collections.abc import Sequence
from typing import Any

from typing_extensions import TypedDict

from stepdiag._core import Adjustment, Measurement
from stepdiag.parameters import KINDS
from stepdiag.planning.fault_control import Extension
from stepdiag.planning.observation import Prospect, extents, growth
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.fault_control import control_blocks, extension_blocks
from stepdiag.presentation.objects.calibration import LargestValue, OpenFinding, findings_of, largest_of
from stepdiag.presentation.objects.evaluation import (
    ByKind,
    Combination,
    Control,
    Readings,
    SetupUnknown,
    by_kind,
    combinations_of,
    readings_of,
    reliability_of,
    setup_of,
)
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.observation import observation_blocks, prospect_blocks
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows
from stepdiag.presentation.quantity import Quantities, Quantity, quantities, stated
from stepdiag.scenario.known import Known


class ObservedPlan(TypedDict):
    volume: Quantities
    lines: list[str]
    scale_lines: list[str]
    scale_points: str
    """Where scale lines are read: at their two "ends", or after all "steps"."""
    steps: int
    block: int
    """So many steps of an axis follow each other."""
    signals: list[str]


class ExtendedPlan(TypedDict):
    name: str
    """What is added to the plan."""
    longer: Quantity
    """How much longer it takes."""
    trouble: str | None
    """Why there is no result."""
    reliability: list[Control]


class StepsObject(TypedDict):
    """What a number of steps would give."""

    steps: int
    mirror: Quantities
    """Width and height of the smallest mirror."""
    trouble: str | None
    """Why there is no result."""
    largest_standard_uncertainty: ByKind


class GrowthExponents(TypedDict):
    """e of u ~ steps^e."""

    positioning: float | None
    straightness: float | None
    angle: float | None
    squareness: float | None


class ObservationObject(Reported):
    """Result of `stepdiag observe`: of a run without errors, so there is no verdict."""

    scenario: str
    plan: ObservedPlan
    readings: Readings
    degrees_of_freedom: int
    determined: list[str]
    """Parameters that are determined as a whole."""
    determined_but_for_slope: list[str]
    determined_in_part: list[str]
    """At some of the positions."""
    undetermined: list[str]
    """A sentence each."""
    findings: list[OpenFinding]
    """The same as data."""
    combinations: list[Combination]
    """What is known of unknowns that are not determined one by one. All values are 0."""
    largest_standard_uncertainties: list[LargestValue]
    setup: list[SetupUnknown]
    """Values are 0."""
    reliability: list[Control]
    """Which faults of the readings would be found and distinguished."""
    extensions: list[ExtendedPlan]
    """Plans with more in them; empty if the plan distinguishes all faults."""
    by_steps: list[StepsObject]
    exponents: GrowthExponents
    notes: list[str]


def observation_object(
    found: Adjustment, run: Measurement, known: Known, tried: Sequence[Extension], table: Sequence[Prospect]
) -> ObservationObject:
    """What a plan determines, which faults it controls, and what other numbers of steps would give."""
    plan, calibration = known.plan, found.calibration
    whole, shapes, parts = extents(calibration, plan)
    exponents: Any = {kind: growth(table, kind) for kind in KINDS}
    return {
        **first_keys("observation", []),
        "report": data_of(
            [
                *observation_blocks(found, run, known),
                *control_blocks(found.reliability),
                *extension_blocks(found.reliability, tried),
                *prospect_blocks(table),
            ]
        ),
        "scenario": str(known.path),
        "plan": {
            "volume": quantities("mm", plan.volume),
            "lines": list(plan.lines),
            "scale_lines": list(plan.scale_lines),
            "scale_points": plan.scale_points,
            "steps": plan.steps,
            "block": plan.block,
            "signals": list(known.signals),
        },
        "readings": readings_of(run, known),
        "degrees_of_freedom": found.degrees_of_freedom,
        "determined": whole,
        "determined_but_for_slope": shapes,
        "determined_in_part": parts,
        "undetermined": list(calibration.undetermined),
        "findings": findings_of(calibration.findings, calibration.undetermined),
        "combinations": combinations_of(found.combinations, value=False),
        "largest_standard_uncertainties": largest_of(calibration, uncertainty=True),
        "setup": setup_of(found.setup),
        "reliability": reliability_of(found.reliability),
        "extensions": [
            {
                "name": extension.name,
                "longer": stated("min", extension.minutes),
                "trouble": extension.trouble or None,
                "reliability": reliability_of(extension.controls),
            }
            for extension in tried
        ],
        "by_steps": [
            {
                "steps": prospect.steps,
                "mirror": quantities("mm", prospect.mirror),
                "trouble": prospect.trouble or None,
                "largest_standard_uncertainty": by_kind(prospect.largest, reason="none is determined"),
            }
            for prospect in table
        ],
        "exponents": exponents,
        "notes": [*cosine_rows(run, known), *drift_rows(run, known)],
    }
