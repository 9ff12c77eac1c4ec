"""The words of a measuring program: LinuxCNC's G-code, the common part of ISO 6983, Siemens' own G-code, or
Heidenhain's Klartext."""

import textwrap
import unicodedata
from dataclasses import dataclass
from typing import Final, Literal

Dialect = Literal["linuxcnc", "iso", "siemens", "heidenhain"]
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
    coordinates: str  # G53 (machine coordinates) or G54 to G59; G54 of Klartext is the active preset
    dwell_word: DwellWord = "P"

    def number(self, value: float) -> str:
        """A number with a decimal point: without it some controllers count increments."""
        text = f"{value:.{self.decimals}f}".rstrip("0")
        text = text + "0" if text.endswith(".") else text
        return "0.0" if text == "-0.0" else text

    def move(self, words: dict[str, float], feed: float | None = None) -> str:
        """A straight move at this feed, mm/min; None: rapid."""
        if self.dialect == "heidenhain":
            places = " ".join(
                f"{name}{'' if value < 0.0 else '+'}{self.number(value)}" for name, value in words.items()
            )
            speed = "FMAX" if feed is None else f"F{self.number(feed)}"
            return f"L {places} R0 {speed}" + (" M91" if self.coordinates == "G53" else "")
        code = "G0" if feed is None else "G1"
        machine = "G53 " if self.coordinates == "G53" else ""
        return f"{machine}{code} " + " ".join(f"{name}{self.number(value)}" for name, value in words.items())

    def dwell(self, seconds: float) -> list[str]:
        if seconds == 0.0:
            return []
        if self.dialect == "heidenhain":
            return ["CYCL DEF 9.0 DWELL TIME", f"CYCL DEF 9.1 DWELL {round(seconds, 3)}"]
        if self.dialect == "siemens":
            return [f"G4 F{round(seconds, 3)}"]
        if self.dwell_word == "PMS":
            return [f"G4 P{max(1, round(seconds * 1e3))}"]
        return [f"G4 {self.dwell_word}{round(seconds, 3)}"]

    def comment(self, text: str) -> list[str]:
        begin, end = ("; ", "") if self.dialect in ("siemens", "heidenhain") else ("(", ")")
        return [f"{begin}{line}{end}" for line in _wrapped(self._plain(text))]

    def stop(self, text: str) -> list[str]:
        """Stop until cycle start, with a message if the dialect has messages."""
        plain = self._plain(text)
        match self.dialect:
            case "linuxcnc":
                return [f"(MSG, {plain})", "M0"]
            case "siemens":
                return [f'MSG("{plain}")', "M0", "MSG()"]
            case "heidenhain":
                return [*self.comment(text), "STOP"]
            case "iso":
                return [*self.comment(text), "M0"]

    def modes(self, feed: float) -> list[str]:
        """Millimetres, absolute, exact stop, no compensation of radius and length, at the beginning of a program."""
        if self.dialect == "heidenhain":
            return self.comment("no tool is called: the length of the tool that is active counts, and must be 0")
        own = [] if self.coordinates == "G53" else [self.coordinates]
        exact = {"linuxcnc": "G61.1", "iso": "G61", "siemens": "G601"}[self.dialect]
        comment = self.comment("mm, absolute, mm/min, exact stop, no radius or length compensation: axis positions")
        code = "G710 G90 G94 G17 G40 D0 G60" if self.dialect == "siemens" else "G21 G90 G94 G17 G40 G49 G80"
        return [*comment, f"{code} {exact}", *own, f"F{self.number(feed)}"]

    def whole(self, lines: list[str], *, line_numbers: bool) -> list[str]:
        """The program of these lines, with its beginning and end."""
        match self.dialect:
            case "linuxcnc":
                lines = [*lines, *self.comment("end"), "M2"]
            case "iso":
                lines = ["%", *lines, *self.comment("end"), "M30", "%"]
            case "siemens":
                lines = [*lines, *self.comment("end"), "M30"]
            case "heidenhain":
                whole = ["BEGIN PGM STEPDIAG MM", *filter(None, lines), "M30", "END PGM STEPDIAG MM"]
                return [f"{number} {line}" for number, line in enumerate(whole)]
        return numbered(lines) if line_numbers else lines

    def _plain(self, text: str) -> str:
        """The text without characters that end a comment, a message or the program.

        ASCII; no parentheses, quotes and %; capitals in the dialect iso."""
        text = unicodedata.normalize("NFKD", text.replace("µ", "u"))
        text = text.replace("(", "[").replace(")", "]").replace("%", "?").replace('"', "'")
        text = "".join(c if " " <= c <= "~" else "?" for c in text if not unicodedata.combining(c))
        return text.upper() if self.dialect == "iso" else text


def _wrapped(text: str) -> list[str]:
    # A continued word does not begin a line: LinuxCNC executes (MSG, ...), (PY, ...) and the like.
    return textwrap.wrap(text, WIDTH, subsequent_indent="... ") or [""]


def numbered(lines: list[str]) -> list[str]:
    """Add block numbers N10, N20, ... to the lines that are not comments only."""
    result, number = [], 0
    for line in lines:
        if line and line[0] not in "(%:O;":
            number += 10
            line = f"N{number} {line}"
        result.append(line)
    return result
