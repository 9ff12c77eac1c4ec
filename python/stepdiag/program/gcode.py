"""The words of a measuring program: LinuxCNC's G-code, or the common part of ISO 6983."""

import textwrap
import unicodedata
from dataclasses import dataclass
from typing import Final, Literal

Dialect = Literal["linuxcnc", "iso"]
Trigger = Literal["handshake", "pulse", "dwell", "code"]
DwellWord = Literal["P", "X", "F", "PMS"]

WIDTH: Final = 100  # columns of a comment; LinuxCNC accepts 255 per line
PULSE: Final = 0.05  # s

# A reading in LinuxCNC: states its number, requests it by output 0, and waits until input 0 shows
# that it is stored.
HANDSHAKE: Final = """\
o<reading> sub
  M68 E0 Q#1
  M68 E1 Q#2
  o<ask> do
    M64 P0
    M66 P0 L3 Q{timeout}
    #3 = #5399
    M65 P0
    o<missed> if [#3 LT 0]
      (DEBUG, no reading of visit #1 point #2: see to the acquisition, cycle start asks again)
      M0
    o<missed> endif
  o<ask> while [#3 LT 0]
  M66 P0 L4 Q{timeout}
o<reading> endsub
""".splitlines()


@dataclass(frozen=True)
class Writer:
    """Words, lines and comments in one dialect."""

    dialect: Dialect
    decimals: int
    coordinates: str  # G53 (machine coordinates) or G54 to G59
    dwell_word: DwellWord = "P"

    def number(self, value: float) -> str:
        """A number with a decimal point: without it some controllers count increments."""
        text = f"{value:.{self.decimals}f}".rstrip("0")
        text = text + "0" if text.endswith(".") else text
        return "0.0" if text == "-0.0" else text

    def move(self, code: str, words: dict[str, float]) -> str:
        machine = "G53 " if self.coordinates == "G53" else ""
        return f"{machine}{code} " + " ".join(f"{name}{self.number(value)}" for name, value in words.items())

    def dwell(self, seconds: float) -> list[str]:
        if seconds == 0.0:
            return []
        if self.dwell_word == "PMS":
            return [f"G4 P{max(1, round(seconds * 1e3))}"]
        return [f"G4 {self.dwell_word}{round(seconds, 3)}"]

    def comment(self, text: str) -> list[str]:
        return [f"({line})" for line in _wrapped(self._plain(text))]

    def stop(self, text: str) -> list[str]:
        """Stop until cycle start, with a message if the dialect has messages."""
        message = f"MSG, {self._plain(text)}" if self.dialect == "linuxcnc" else self._plain(text)
        return [*([f"({message})"] if self.dialect == "linuxcnc" else self.comment(text)), "M0"]

    def _plain(self, text: str) -> str:
        """The text without characters that end a comment or the program.

        ASCII; no parentheses, no %; capitals in the dialect iso."""
        text = unicodedata.normalize("NFKD", text.replace("µ", "u"))
        text = text.replace("(", "[").replace(")", "]").replace("%", "?")
        text = "".join(c if " " <= c <= "~" else "?" for c in text if not unicodedata.combining(c))
        return text.upper() if self.dialect == "iso" else text


def _wrapped(text: str) -> list[str]:
    # A continued word does not begin a line: LinuxCNC executes (MSG, ...), (PY, ...) and the like.
    return textwrap.wrap(text, WIDTH, subsequent_indent="... ") or [""]


def numbered(lines: list[str]) -> list[str]:
    """Add block numbers N10, N20, ... to the lines that are not comments only."""
    result, number = [], 0
    for line in lines:
        if line and line[0] not in "(%:O":
            number += 10
            line = f"N{number} {line}"
        result.append(line)
    return result
