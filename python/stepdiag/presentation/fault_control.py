"""Which faults of the readings a plan or a run controls, in blocks."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Final

from stepdiag._core import FaultControl
from stepdiag.findings.unseen import FAULT_NAMES, FAULT_UNITS
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units
from stepdiag.presentation.blocks import Block, NoteBlock, TableBlock
from stepdiag.units import report_value

if TYPE_CHECKING:
    from stepdiag.planning.fault_control import Extension

ROUNDING: Final = 1e-6  # µm or µrad for each µm or µrad of a fault


def control_blocks(controls: Sequence[FaultControl]) -> Iterator[Block]:
    """Each kind of fault: from which size on one is found, what it may do up to there, and whether it is distinguished
    from others."""
    rows = [("", "", *(REPORT_UNIT[kind] for kind in KINDS), "")]
    for c in controls:
        cells = (_hidden(c, kind) for kind in KINDS)
        rows.append((name(c), _size(c, c.found_from), *cells, distinguished(c)))
    yield NoteBlock(
        "faults that the readings control, one at a time: found (99 %) from which size on, the largest effect"
    )
    yield TableBlock(
        tuple(rows),
        ("", "found from", *KINDS, "distinguished"),
        "of a fault just not found, and the size from which it is distinguished from all others",
        left=(0, 2 + len(KINDS)),
    )
    for c in controls:
        if c.uncontrolled:
            count = f"{c.uncontrolled} of {c.count + c.uncontrolled}"
            yield NoteBlock(f"{name(c)}: {count} that no other reading controls", indented=True)
    for c in controls:
        if c.twins:
            yield NoteBlock(f"{name(c)} not distinguished from a twin: by {_unit(c)} of it {_shared(c)}", indented=True)


def extension_blocks(own: Sequence[FaultControl], tried: "Iterable[Extension]") -> Iterator[Block]:
    """What would distinguish or control what the plan does not; nothing where it does."""
    from stepdiag.planning.fault_control import distinguishes_all  # reports of evaluations need none of that room

    if distinguishes_all(own):
        return
    for extension in tried:
        if extension.trouble:
            yield NoteBlock(f"{extension.name}: {extension.trouble}", indented=True)
            continue
        said = "; ".join(f"{name(c)} {distinguished(c)}" for c in extension.controls)
        minutes = f"{extension.minutes:+.1f} minutes"
        yield NoteBlock(f"{extension.name} ({minutes}), distinguished: {said}", indented=True)


def name(control: FaultControl) -> str:
    """What happened, in words."""
    return FAULT_NAMES[control.kind, control.channel]


def distinguished(control: FaultControl) -> str:
    """Which of the faults are, and from which size on."""
    if control.count == 0 or control.twins == control.count:
        return "none"
    share = "all" if control.twins == 0 else f"{100 * (control.count - control.twins) // control.count} %"
    return f"{share} from {_size(control, control.distinguished_from)}"


def _size(control: FaultControl, size: float) -> str:
    value, unit = report_value(FAULT_UNITS[control.channel], size)
    return f"{value:.3g} {unit}" if control.count else "-"


def _unit(control: FaultControl) -> str:
    return report_value(FAULT_UNITS[control.channel], 1.0)[1]


def _hidden(control: FaultControl, kind: Kind) -> str:
    value = control.hidden[kind]
    return "any" if math.isinf(value) else f"{in_report_units(kind, value):.3g}"


def _shared(control: FaultControl) -> str:
    scale = report_value(FAULT_UNITS[control.channel], 1.0)[0]
    shares = [(kind, in_report_units(kind, control.shared[kind]) / scale) for kind in KINDS]
    said = [f"{kind} {share:.2g} {REPORT_UNIT[kind]}" for kind, share in shares if share > ROUNDING]
    return ", ".join(said) or "nothing"
