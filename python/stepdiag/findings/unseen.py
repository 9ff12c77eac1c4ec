"""How large a fault of the readings may be in a calibration without being seen, and what it then does, in words."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

from stepdiag._core import UnseenFault
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units
from stepdiag.units import report_value

FAULT_NAMES: Final = {
    ("reading", "distance"): "wrong distance",
    ("slip", "distance"): "slip of distances",
    ("factor", "distance"): "factor on distances",
    ("reading", "tilt"): "wrong tilt",
    ("slip", "tilt"): "slip of tilts",
    ("reading", "spot"): "wrong spot",
    ("slip", "spot"): "slip of spots",
}
FAULT_UNITS: Final = {"distance": "mm", "tilt": "rad", "spot": "mm"}

# Of the largest standard uncertainty of a kind: what is below it lies within the 95 % interval there.
_WITHIN: Final = 2.0


def unseen_texts(faults: Sequence[UnseenFault], largest_uncertainties: Mapping[Kind, float]) -> list[str]:
    """A sentence for each channel, without a full stop: faults with effects beyond the stated uncertainties first.

    largest_uncertainties: of each kind, mm or rad; a kind of which none is known is absent."""
    texts = []
    for channel in dict.fromkeys(fault.channel for fault in faults):
        own = [_text(fault, largest_uncertainties) for fault in faults if fault.channel == channel]
        said = sorted(own, key=lambda text: not text[0])
        texts.append("; ".join(text for _, text in said))
    return texts


# Sizes and effects are lower bounds: diagnosis/reliability looks at a part of the slips.
ONE_AT_A_TIME: Final = (
    "one at a time, from a part of the possible faults: the true sizes and effects may be larger; evaluate "
    "--reliability computes all, stepdiag observe names a plan that shows more"
)


def _text(fault: UnseenFault, u: Mapping[Kind, float]) -> tuple[bool, str]:
    """Whether it matters, and the sentence."""
    name = f"a {FAULT_NAMES[fault.kind, fault.channel]}"
    value, unit = report_value(FAULT_UNITS[fault.channel], fault.size)
    below = f"below {value:.3g} {unit}" + (" at the line's end" if fault.kind == "factor" else "")
    beyond = [kind for kind in KINDS if fault.hidden[kind] > _WITHIN * u.get(kind, 0.0)]
    shown = [
        f"{in_report_units(kind, fault.hidden[kind]):.2g} {REPORT_UNIT[kind]} in {kind}"
        for kind in beyond
        if math.isfinite(fault.hidden[kind])
    ]
    if not fault.controlled:
        any_size = ", ".join(kind for kind in beyond if math.isinf(fault.hidden[kind]))
        text = f"{name} of any size may stay unseen where no other reading controls it ({any_size})"
        if fault.size > 0.0:
            text += f"; elsewhere one {below}" + (f", with up to {_list(shown)}" if shown else "")
        return True, text
    if shown:
        return True, f"{name} {below} may stay unseen, with up to {_list(shown)}"
    return False, f"{name} {below} may stay unseen, with less than {_WITHIN:g} times the largest standard uncertainties"


def _list(items: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(items[:-1]), items[-1])))
