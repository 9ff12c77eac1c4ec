"""Keys of `[report]`: what the header of a report says."""

from typing import Annotated

from pydantic import Field

from stepdiag.config.key_types import Section, key

LONGEST = 400  # characters; more is no header

Words = Annotated[str, Field(min_length=1, max_length=LONGEST)]

_words = f"a text of 1 to {LONGEST} characters"


class ReportSection(Section):
    """Header of a report (`stepdiag report -o report.html`). No evaluation reads it."""

    number: Words | None = key(_words, "Number of the report or certificate.", None, "2026-0042")
    customer: Words | None = key(_words, "Who receives the report.", None, "Example Ltd, Aachen")
    machine: Words | None = key(_words, "Maker and type of the machine.", None, "VMC 800")
    serial_number: Words | None = key(_words, "Serial number of the machine.", None, "0815")
    operator: Words | None = key(_words, "Who measured.", None, "A. Engineer")
    instrument: Words | None = key(_words, "Instrument, with its serial number.", None, "Laser head, no. 42")
    certificate: Words | None = key(_words, "Calibration certificate of the instrument.", None, "D-K-12345, 2026-03")
    conditions: Words | None = key(_words, "Conditions of the measurement.", None, "machine warmed up for 2 h")
    signatures: Words | None = key(
        _words,
        "Who signs, with semicolons between them: lines at the end of the page.",
        None,
        "A. Engineer; B. Manager",
    )
    logo: Words | None = key(
        "the path of a PNG or SVG picture", "Picture in the header, relative to this file.", None, "logo.svg"
    )
