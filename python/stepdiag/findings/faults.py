"""Faults of readings that were found (`FaultClass`), and what was done about them, in words."""

from collections.abc import Iterator, Sequence

from stepdiag._core import Fault, FaultClass
from stepdiag.units import MICRO


def fault_rows(faults: Sequence[FaultClass]) -> Iterator[tuple[str, str]]:
    """Each class of faults by its number, and what was done about it."""
    for number, found in enumerate(faults, 1):
        yield f"fault {number}", fault_text(found)


def fault_text(found: FaultClass) -> str:
    """What may have happened, whether the readings determine which, and what was done about it; without a full stop."""
    shown = 4
    best, *others = found.members
    texts = [_fault(best), *map(_alternative, others[: shown - 1])]
    if len(others) >= shown:
        texts.append(f"one of {len(others) - shown + 1} more")
    return "; ".join(filter(None, (", or ".join(texts), _doubt(found), _treatment(found))))


def _fault(fault: Fault) -> str:
    is_angle = fault.channel in ("alpha", "beta")
    factor, unit = (MICRO, "µrad") if is_angle else (1e3, "µm")
    size = (
        f"{abs(fault.size) * factor:.4g} ± {fault.standard_uncertainty * factor:.2g} {unit} "
        f"too {'much' if fault.size > 0 else 'little'}"
    )
    run = f" (run {fault.run})" if fault.run else ""
    if fault.kind == "factor":
        return f"a factor on distances: {fault.channel} on {fault.line}{run} reads {size} where the line is farthest"
    if fault.kind == "slip":
        name = "an offset" if is_angle or fault.channel.startswith("spot") else "a slip of the fringe counter"
        return f"{name}: {fault.channel} on {fault.line}{run} reads {size} from point {fault.point} on"
    return f"a wrong reading: {fault.channel} of {fault.line} point {fault.point}{run} is {size}"


def _alternative(fault: Fault) -> str:
    is_angle = fault.channel in ("alpha", "beta")
    size = f"{fault.size * (MICRO if is_angle else 1e3):+.4g} {'µrad' if is_angle else 'µm'}"
    run = f" (run {fault.run})" if fault.run else ""
    where = {"slip": f" from point {fault.point} on", "factor": " growing along the line"}
    return f"{fault.channel} of {fault.line}{where.get(fault.kind, f' point {fault.point}')}{run} ({size})"


def _doubt(found: FaultClass) -> str:
    if found.distinguished:
        return ""
    return "the readings do not distinguish them (stepdiag observe says which plan would)"


def _treatment(found: FaultClass) -> str:
    match found.treatment:
        case "left_out":
            if found.distinguished:
                return "left out"
            if any(fault.kind == "slip" for fault in found.members):
                return "the single readings among these are left out, which removes the slips, too"
            return "all of these readings are left out"
        case "estimated" if found.distinguished:
            return "its size is an unknown of the adjustment"
        case "estimated":
            return "the size is shared, and the spread of the alternatives is in the uncertainty"
        case _:
            return "nothing was done about it"
