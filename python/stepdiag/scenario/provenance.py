"""What a calibration is made from, so that one can see from which run and which scenario it came."""

import hashlib
import json
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Final, Literal

from stepdiag import _core
from stepdiag.config.key_types import Section
from stepdiag.io.whole_files import read_bytes
from stepdiag.scenario.description import Scenario
from stepdiag.scenario.known import Known
from stepdiag.wrong_arguments import checked

# Sections of a scenario that choose how readings are evaluated, by method. Others describe machine, plan and head.
_ALWAYS: Final = ("plausible",)
_OF_ADJUSTMENT: Final = ("adjustment", "smoothness", "plausible")


@checked
def provenance_of(
    scenario: Scenario | Known,
    run: str | PathLike[str],
    *,
    method: Literal["conventional", "enhanced", "adjustment"] = "adjustment",
) -> dict[str, str]:
    """Fingerprints (SHA-256) and options of an evaluation, for `Calibration.with_provenance` or `Calibration.write`.

    They depend on the bytes of the files alone, not on their names or the time. The error map of a scenario counts in
    none of them: no evaluation reads it. A run that is no file, but a pipe, has no fingerprint. Raises InvalidArgument
    naming a file that cannot be read.

    Args:
        scenario: as read from its file.
        run: the file of the measurement.
        method: of the evaluation.

    Returns:
        program: name and version.
        run_sha256, scenario_sha256: of the two files, as `sha256sum` prints them.
        heads_sha256: of the descriptions of the scenario's heads, in its order; only if there are any.
        options: the scenario's keys for the evaluation that differ from the defaults, or "default".
    """
    known = scenario.known
    heads = _heads_sha256(known)
    sections = _OF_ADJUSTMENT if method == "adjustment" else _ALWAYS
    options = [text for section in sections for text in _chosen(section, getattr(known.keys, section))]
    found = {
        "program": f"stepdiag {_core.__version__}",
        "run_sha256": "" if Path(run).is_fifo() else _sha256(Path(run)),
        "scenario_sha256": _sha256(known.path),
        "heads_sha256": " ".join(heads),
        "options": "; ".join(options) or "default",
    }
    return {key: text for key, text in found.items() if text}


def _heads_sha256(known: Known) -> list[str]:
    names = dict.fromkeys(head.keys.description for head in known.described.values())
    names.pop(None, None)
    if not names:
        return []
    from stepdiag.head.description import find_head  # slow

    return [_sha256(find_head(name, known.path.parent)) for name in names if name is not None]


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_bytes(path)).hexdigest()


def _chosen(name: str, section: Section) -> Iterator[str]:
    """The keys of a section that differ from the defaults, as TOML with dotted names."""
    if not section.model_fields_set:
        return
    given = section.model_dump(exclude_defaults=True)
    tables = given.pop("by_line", {})
    for place, keys in [(name, given), *((f"{name}.{line}", tables[line]) for line in sorted(tables))]:
        yield from (f"{place}.{key}={json.dumps(value)}" for key, value in keys.items())
