"""The header of a report: who, which machine, with what. From `[report]` of the scenario, and from flags before it."""

import base64
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

from stepdiag._core import InvalidArgument
from stepdiag.config.report_keys import LONGEST, ReportSection
from stepdiag.io.whole_files import read_bytes

TITLES: Final[Mapping[str, str]] = {
    "number": "Number",
    "customer": "Customer",
    "machine": "Machine",
    "serial_number": "Serial number",
    "operator": "Operator",
    "instrument": "Instrument",
    "certificate": "Certificate",
    "conditions": "Conditions",
    "signatures": "Signatures",
}
_FLAGS: Final = {"machine": "machine_type"}  # --machine is that of the machine book
LARGEST_LOGO: Final = 512 * 1024  # bytes; the page is to stay small


class ReportHeader(NamedTuple):
    """What is known of each title, in their order, and the picture as a data URI (or nothing)."""

    words: Mapping[str, str]
    logo: str = ""


def header_of(
    section: ReportSection | None, folder: Path, given: Mapping[str, str | None], logo: Path | None
) -> ReportHeader:
    """The header; what is `given` goes before the section's. `folder`: that of the scenario, where its logo is.

    Raises InvalidArgument for texts that are empty or too long, and for a logo that is no picture."""
    words = {}
    for key in TITLES:
        flag = _FLAGS.get(key, key)
        text = given.get(flag)
        if text is not None and not 1 <= len(text) <= LONGEST:
            raise InvalidArgument(f"`{flag}`: expected a text of 1 to {LONGEST} characters, got {len(text)}")
        own = None if section is None else getattr(section, key)
        if text or own:
            words[key] = str(text or own)
    if logo is None and section is not None and section.logo is not None:
        logo = folder / section.logo
    return ReportHeader(words, "" if logo is None else _data_uri(logo))


def _data_uri(path: Path) -> str:
    content = read_bytes(path)
    if len(content) > LARGEST_LOGO:
        raise InvalidArgument(
            f"{path}: expected a logo of at most {LARGEST_LOGO // 1024} KiB, got {len(content) // 1024} KiB"
        )
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        kind = "png"
    elif re.match(rb"\s*(<\?xml[^>]*>\s*)?(<!--.*?-->\s*)*(<!DOCTYPE svg[^>]*>\s*)?<svg\b", content, re.DOTALL):
        kind = "svg+xml"  # shown by <img>, which runs no script of it and loads nothing
    else:
        raise InvalidArgument(f"{path}: expected a PNG or SVG picture")
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"
