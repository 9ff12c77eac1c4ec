"""The core's evaluations with their findings in words: the core gives findings as data, files hold sentences."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration
from stepdiag.calibration.largest_by_kind import largest_entries
from stepdiag.findings.reasons import reason_texts
from stepdiag.findings.undetermined import undetermined_text
from stepdiag.findings.unseen import unseen_texts
from stepdiag.wrong_arguments import checked


@checked
def adjust(
    measurement: _core.Measurement,
    plan: _core.Plan,
    head: _core.Head | Mapping[str, _core.Head],
    chain: _core.Chain | str,
    tool: ArrayLike = (0.0, 0.0, 0.0),
    options: _core.AdjustmentOptions | None = None,
    **fields: Any,
) -> Adjustment:
    """The exact adjustment of all readings of a run, with the set-up of every line among the unknowns.

    Of the head only its calibration is used, of the machine only chain and tool offset (mm). The options are
    AdjustmentOptions, or its fields by name. Raises InvalidArgument for readings that do not belong to the plan, and
    for a result that is not plausible."""
    return in_words(_core.adjust(measurement, plan, head, chain, tool, options, **fields))


@checked
def evaluate(
    measurement: _core.Measurement,
    plan: _core.Plan,
    head: _core.Head | Mapping[str, _core.Head],
    chain: _core.Chain | str,
    tool: ArrayLike = (0.0, 0.0, 0.0),
    *,
    method: str = "adjustment",
    uncertainty: _core.ReadingUncertainty | None = None,
    full_covariance: bool = False,
    plausible: _core.PlausibleLimits | None = None,
    expansion: _core.KnownExpansion | None = None,
) -> Calibration:
    """Calibration from a run by the method "conventional", "enhanced" or "adjustment". Arguments as of `adjust`.

    uncertainty: of readings where the run states none. plausible: what a machine can be. expansion: of the scales;
    with it positioning errors are referred to its temperature. None: the defaults of these classes.

    Raises InvalidArgument for readings that do not belong to the plan, for a result that is not plausible, and for a
    pass without temperatures where an expansion is given."""
    options: Any = {
        "uncertainty": uncertainty or _core.ReadingUncertainty(),
        "full_covariance": full_covariance,
        "plausible": plausible or _core.PlausibleLimits(),
        "expansion": expansion,
    }
    if method == "adjustment":
        return adjust(measurement, plan, head, chain, tool, **options).calibration
    found = _core.evaluate(measurement, plan, head, chain, tool, method=method, **options)
    return found.with_sentences(undetermined=list(map(undetermined_text, found.findings)))


def in_words(found: Adjustment) -> Adjustment:
    """The same, with its findings as sentences of its calibration."""
    calibration = found.calibration
    largest = largest_entries(calibration, uncertainty=True)
    return found.with_calibration(
        calibration.with_sentences(
            undetermined=list(map(undetermined_text, calibration.findings)),
            fit_reasons=reason_texts(found.verdict.reasons),
            unseen_faults=unseen_texts(
                found.unseen, {kind: entry.standard_uncertainty for kind, entry in largest.items()}
            ),
        )
    )
