"""How a machine is now, and when it is due."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.facts import CalibrationFacts
from stepdiag.book.index import Progress
from stepdiag.book.machine_keys import AboutMachine
from stepdiag.book.trend import Due, due, trends
from stepdiag.calibration.volume import Verdict

KIND: Final = "calibration"
_OF_TREND: Final = 20  # calibrations, the last ones


@dataclass(frozen=True)
class Overview:
    """A machine at its last calibration that counts: neither damaged, rejected nor unverified."""

    name: str
    about: AboutMachine
    last: Entry | None
    verdict: Verdict | None  # of the last calibration against the limit; none: cannot be said
    caution: str  # why not to rely on that verdict; empty: nothing is against it
    due: Due


def overview(machine: MachineFolder, progress: Progress | None = None) -> Overview:
    about = machine.about
    calibrations = [one for one in machine.entries("calibrations", progress=progress) if one.kind == KIND]
    last = next((one for one in reversed(calibrations) if not _facts(one).not_counted), None)
    verdict = _facts(last).verdict(about.limit_um) if last else None
    found = trends(calibrations[-_OF_TREND:])
    largest = found[0] if found and found[0].name == "largest error" else None
    when = due(largest, last, about.limit_um, about.interval_days)
    return Overview(machine.name, about, last, verdict, _caution(calibrations, last), when)


def _caution(calibrations: Sequence[Entry], last: Entry | None) -> str:
    latest = calibrations[-1] if calibrations else None
    if latest is not None and latest is not last:
        return f"the latest calibration, {latest.name}, is {_facts(latest).not_counted} and does not count"
    fit = _facts(last).fit if last else "accepted"
    return "" if fit == "accepted" else f"the fit of {last.name if last else ''} is {fit or 'not judged'}"


def _facts(calibration: Entry) -> CalibrationFacts:
    facts = calibration.facts.calibration
    assert facts is not None, calibration.file
    return facts
