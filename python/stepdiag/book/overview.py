"""How a machine is now, and when it is due."""

from dataclasses import dataclass
from typing import Final

from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.index import Progress
from stepdiag.book.machine_keys import AboutMachine
from stepdiag.book.trend import Due, due, trends
from stepdiag.calibration.volume import Verdict

KIND: Final = "calibration"
_OF_TREND: Final = 20  # calibrations, the last ones


@dataclass(frozen=True)
class Overview:
    """A machine at its last calibration. Calibrations whose fit is rejected do not count, nor damaged files."""

    name: str
    about: AboutMachine
    last: Entry | None
    verdict: Verdict | None  # of the last calibration against the limit; none: cannot be said
    due: Due


def is_usable(calibration: Entry) -> bool:
    """Whether its fit is not rejected."""
    facts = calibration.facts.calibration
    return facts is not None and facts.fit != "rejected"


def overview(machine: MachineFolder, progress: Progress | None = None) -> Overview:
    about = machine.about
    calibrations = [one for one in machine.entries("calibrations", progress=progress) if one.kind == KIND]
    last = next((one for one in reversed(calibrations) if is_usable(one)), None)
    facts = last.facts.calibration if last else None
    verdict = facts.verdict(about.limit_um) if facts else None
    found = trends(calibrations[-_OF_TREND:])
    largest = found[0] if found and found[0].name == "largest error" else None
    return Overview(machine.name, about, last, verdict, due(largest, last, about.limit_um, about.interval_days))
