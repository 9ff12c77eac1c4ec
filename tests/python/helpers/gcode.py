"""A strict little reader of measuring programs: what is not in it, a program must not use."""

import re
from dataclasses import dataclass, field

import numpy as np

WORD = re.compile(r"([A-Z])([-+]?\d+(?:\.\d*)?)")
COMMENT = re.compile(r"\([^()]*\)")
CODES = {
    "G": {0, 1, 4, 17, 21, 40, 49, 53, 54, 55, 56, 57, 58, 59, 61, 61.1, 80, 90, 94},
    "M": {0, 2, 5, 9, 30, 64, 65, 80},
}
# Words of ISO 6983 that a program may have; O, # and [ ] are languages of single controllers.
LETTERS = set("GMXYZFNP")
CALL = re.compile(r"o<reading> call \[(\d+)\] \[(\d+)\]")


@dataclass
class Trace:
    """What the axes did: of every reading the position and how each axis had last moved; rapids; all positions."""

    readings: list[tuple[tuple[int, int] | None, np.ndarray]] = field(default_factory=list)
    came: list[np.ndarray] = field(default_factory=list)
    rapids: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)  # from, to
    ways: list[np.ndarray] = field(default_factory=list)  # every position, in order
    stops: int = 0
    messages: list[str] = field(default_factory=list)


def trace(text: str, *, iso: bool, readings_by: str = "call", letters: set[str] = LETTERS) -> Trace:
    """Runs a program. `readings_by`: call (of the handshake), or the code, G4 or M80, that is a reading."""
    result = Trace()
    place, last = np.full(3, np.nan), np.zeros(3)
    in_subroutine = False
    lines = text.split("\n")
    assert lines.pop() == ""
    if iso:
        assert lines[0] == lines[-1] == "%"
        assert text == text.upper()
        assert text.isascii()
        lines = lines[1:-1]
    ended = False
    for line in lines:
        assert not ended
        assert len(line) <= 120
        in_subroutine = in_subroutine or line == "o<reading> sub"
        if in_subroutine:
            assert not iso
            in_subroutine = line != "o<reading> endsub"
            continue
        if not iso and (call := CALL.fullmatch(line)):
            assert readings_by == "call"
            result.readings.append(((int(call[1]), int(call[2])), place.copy()))
            result.came.append(last.copy())
            continue
        result.messages += [comment[1:-1] for comment in COMMENT.findall(line)]
        words = COMMENT.sub("", line).split()
        found = [WORD.fullmatch(word) for word in words]
        assert all(found), line
        pairs = [(match[1], match[2]) for match in found if match]
        assert {letter for letter, _ in pairs} <= letters, line
        codes = [(letter, float(number)) for letter, number in pairs if letter in CODES]
        for letter, number in codes:
            assert number in CODES[letter], line
        axes = {letter: number for letter, number in pairs if letter in "XYZ"}
        if ("G", 4.0) in codes:
            axes = {}
        assert all("." in number for number in axes.values()), line
        if axes:
            assert ("G", 0.0) in codes or ("G", 1.0) in codes, line
            there = place.copy()
            for letter, number in axes.items():
                there["XYZ".index(letter)] = float(number)
            if ("G", 0.0) in codes:
                result.rapids.append((place, there))
            moved = ~np.isclose(there, place, rtol=0.0, atol=1e-12) & ~np.isnan(place)
            last = np.where(moved, np.sign(there - place), last)
            place = there
            result.ways.append(place.copy())
        reading = {"G4": ("G", 4.0), "M80": ("M", 80.0), "M64": ("M", 64.0)}.get(readings_by)
        if reading in codes:
            result.readings.append((None, place.copy()))
            result.came.append(last.copy())
        result.stops += ("M", 0.0) in codes
        ended = ("M", 2.0) in codes or ("M", 30.0) in codes
    assert ended
    assert not in_subroutine
    return result
