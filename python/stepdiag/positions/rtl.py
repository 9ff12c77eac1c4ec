"""Files of Renishaw's linear positioning tests (.rtl).

A text of sections (`TARGET DATA::`). Its form is known from programs that read it, not from its maker: targets in mm,
deviations in µm, rows of run, target and deviation in the order in which they were read. A run that comes to its
targets upwards is one in + direction.
"""

import math
import re
from itertools import pairwise
from typing import Final

from stepdiag._core import InvalidArgument

_SECTION: Final = re.compile(r"([A-Z][A-Z0-9 -]*)::\s*")
_KEY: Final = re.compile(r"([A-Za-z][\w -]*?)\s*:\s*(.*)")
_OTHERS: Final = re.compile(r"ang|straight|square|flat|rot|dynamic|rt[as]", re.IGNORECASE)
Reading = tuple[str, float, str, int, float]  # where, target (mm), direction, cycle, deviation (µm)


def is_rtl(content: bytes) -> bool:
    """Whether a file has the sections of such a one."""
    return b"TARGET DATA::" in content and b"DEVIATIONS::" in content


def readings_of_rtl(text: str, path: str) -> tuple[list[Reading], str]:
    """The readings, and what was measured, in words. Raises InvalidArgument naming file and line."""
    said: dict[str, str] = {}
    targets: list[float] = []
    rows: list[tuple[str, int, int, float]] = []  # where, run, target, deviation
    section = key = ""
    for number, line in enumerate(map(str.strip, text.splitlines()), start=1):
        where = f"{path}, line {number}"
        if found := _SECTION.fullmatch(line):
            section, key = found[1].strip(), ""
        elif found := _KEY.fullmatch(line):
            key = found[1].casefold()
            said.setdefault(key, found[2].strip())
            if (section, key) == ("TARGET DATA", "targets"):
                targets += _numbers(found[2], where)
        elif (section, key) == ("TARGET DATA", "targets"):
            targets += _numbers(line, where)
        elif (section, key) == ("DEVIATIONS", "run target data") and line:
            words = line.split()
            if len(words) != 3 or not all(re.fullmatch(r"\d{1,6}", word, re.ASCII) for word in words[:2]):
                raise InvalidArgument(f"{where}: expected run, target and deviation, got {line[:60]!r}")
            rows.append((where, int(words[0]), int(words[1]), _numbers(words[2], where)[0]))
    kind = said.get("filetype", "")
    if _OTHERS.search(kind):
        raise InvalidArgument(f"{path}: expected a linear positioning test, got Filetype: {kind[:60]}")
    for name, count in (("target-count", len(targets)), ("run-count", len({run for _, run, _, _ in rows}))):
        if said.get(name, str(count)) != str(count):
            raise InvalidArgument(f"{path}: expected {said[name][:20]} by {name}, got {count}; the file is not whole")
    about = ", ".join(said[name] for name in ("machine", "serial no", "axis") if said.get(name))
    return list(_directed(rows, targets, path)), about


def _directed(rows: list[tuple[str, int, int, float]], targets: list[float], path: str) -> list[Reading]:
    found: list[Reading] = []
    cycles = {"+": 0, "-": 0}
    for run in dict.fromkeys(run for _, run, _, _ in rows):
        own = [row for row in rows if row[1] == run]
        for where, _, target, _ in own:
            if not 1 <= target <= len(targets):
                raise InvalidArgument(f"{where}: expected a target from 1 to {len(targets)}, got {target}")
        steps = {targets[b[2] - 1] > targets[a[2] - 1] for a, b in pairwise(own)}
        if len(steps) != 1:
            raise InvalidArgument(f"{path}: run {run}: expected its targets upwards or downwards, got them in turn")
        direction = "+" if steps.pop() else "-"
        cycles[direction] += 1
        found += [(where, targets[k - 1], direction, cycles[direction], value) for where, _, k, value in own]
    return found


def _numbers(text: str, where: str) -> list[float]:
    numbers = []
    for word in text.split():
        try:
            value = float(word.replace(",", "."))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InvalidArgument(f"{where}: expected a number, got {word[:30]!r}")
        numbers.append(value)
    return numbers
