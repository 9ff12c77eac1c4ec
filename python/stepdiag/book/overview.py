"""How a machine is now, and when it is due."""

from dataclasses import dataclass
from datetime import date, timedelta

from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.index import Progress
from stepdiag.book.machine_keys import AboutMachine
from stepdiag.calibration.volume import Verdict


@dataclass(frozen=True)
class Overview:
    """A machine at its last calibration. Calibrations whose fit is rejected do not count, nor damaged files."""

    name: str
    about: AboutMachine
    last: Entry | None
    verdict: Verdict | None  # of the last calibration against the limit; none: cannot be said
    due: date | None


def overview(machine: MachineFolder, progress: Progress | None = None) -> Overview:
    about = machine.about
    sound = [
        one
        for one in machine.entries("calibrations", progress=progress)
        if one.facts.calibration is not None and one.facts.calibration.fit != "rejected"
    ]
    last = sound[-1] if sound else None
    facts = last.facts.calibration if last else None
    verdict = facts.verdict(about.limit_um) if facts else None
    return Overview(machine.name, about, last, verdict, _due(last, about))


def _due(last: Entry | None, about: AboutMachine) -> date | None:
    if last is None or about.interval_days is None:
        return None
    return date.fromisoformat(last.date[:10]) + timedelta(days=about.interval_days)
