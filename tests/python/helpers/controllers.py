"""What controllers make of exported files, by the rules of their manuals alone; no code is shared with the writers.

Each interpreter reads the files and sends motors: (n, 3) commanded positions in the controller's coordinates, mm, and
the direction of travel of all axes (+1 or -1), to (n, 3) motor positions. `sign=-1` turns the values, as a controller
with the other convention would.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

Vectors = np.ndarray
Motors = Callable[[Path, Vectors, int, float], Vectors]


def variables_of(path: Path) -> dict[str, dict[tuple[str, ...], str]]:
    """Assignments `$NAME[index]=value` of a SINUMERIK file: name -> index -> value. Comments follow a semicolon."""
    first, *lines = path.read_text(encoding="ascii").splitlines()
    assert re.fullmatch(r"%_N_\w+_INI", first)
    found: dict[str, dict[tuple[str, ...], str]] = {}
    code = [line.split(";")[0].strip() for line in lines]
    code = [line for line in code if line]
    assert code[0] == "CHANDATA(1)"
    assert code[-1] == "M17"
    for line in code[1:-1]:
        match = re.fullmatch(r"\$(\w+)\[([\w,]+)\]=(\S+)", line)
        assert match, line
        place = tuple(match[2].split(","))
        assert place not in found.setdefault(match[1], {}), line
        found[match[1]][place] = match[3]
    return found


def _by_steps(position: Vectors, values: Vectors, first: float, step: float, last: float) -> Vectors:
    """Linear between points from MIN by STEP to MAX; the first and the last value hold beyond."""
    assert round((last - first) / step, 9) == len(values) - 1
    place = np.clip((position - first) / step, 0.0, len(values) - 1.0)
    below = np.minimum(place.astype(int), len(values) - 2)
    return np.asarray(values[below] + (place - below) * (values[below + 1] - values[below]))


def enc_comp(path: Path, p: Vectors, _: int, sign: float = 1.0) -> Vectors:
    """A positive value moves the axis in negative direction."""
    found, sent = variables_of(path), p.copy()
    for n, name in enumerate(("AX1", "AX2", "AX3")):
        own = {int(place[1]): float(v) for place, v in found["AA_ENC_COMP"].items() if place[::2] == ("0", name)}
        if not own:
            continue
        values = np.array([own[k] for k in range(len(own))])
        assert len(values) <= 5000
        first, step, last = (float(found[f"AA_ENC_COMP_{what}"]["0", name]) for what in ("MIN", "STEP", "MAX"))
        assert found["AA_ENC_COMP_IS_MODULO"]["0", name] == "0"
        sent[:, n] -= sign * _by_steps(p[:, n], values, first, step, last)
    return sent


def cec(path: Path, p: Vectors, direction: int, sign: float = 1.0) -> Vectors:
    """The sum of all tables that hold for the direction of their input axis."""
    found, sent = variables_of(path), p.copy()
    axes = {"(AX1)": 0, "(AX2)": 1, "(AX3)": 2}
    count = len(found["AN_CEC_STEP"])
    for t in map(str, range(count)):
        own = {int(place[1]): float(v) for place, v in found["AN_CEC"].items() if place[0] == t}
        values = np.array([own[k] for k in range(len(own))])
        assert found["AN_CEC_IS_MODULO"][t,] == found["AN_CEC_MULT_BY_TABLE"][t,] == "0"
        if int(found["AN_CEC_DIRECTION"][t,]) == -direction:
            continue
        first, step, last = (float(found[f"AN_CEC_{what}"][t,]) for what in ("MIN", "STEP", "MAX"))
        by, axis = axes[found["AN_CEC_INPUT_AXIS"][t,]], axes[found["AN_CEC_OUTPUT_AXIS"][t,]]
        sent[:, axis] -= sign * _by_steps(p[:, by], values, first, step, last)
    assert count <= 2 * 31
    return sent


def words_of(path: Path) -> list[dict[str, str]]:
    """Rows of a Heidenhain table: columns begin where their names begin in the head."""
    begin, head, *rows = path.read_text(encoding="ascii").splitlines()
    assert re.fullmatch(rf"BEGIN {path.name.upper()} MM", begin)
    assert rows.pop() == "[END]"
    names = [(match[0], match.start()) for match in re.finditer(r"\S+", head)]
    ends = [start for _, start in names[1:]] + [10_000]
    found = [{name: row[start:end].strip() for (name, start), end in zip(names, ends, strict=True)} for row in rows]
    assert [row["NR"] for row in found] == [str(n) for n in range(len(found))]
    return found


def com_table(path: Path) -> dict[str, Vectors]:
    rows = words_of(path)
    table = {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name != "NR"}
    assert np.all(np.diff(table["AXISPOS"]) > 0.0)
    return table


def com(folder: Path, p: Vectors, direction: int, sign: float = 1.0) -> Vectors:
    """[axis in a column of the .COM] = F(axis in whose column of the .CMA it is entered)."""
    sent = p.copy()
    (active,) = [row for row in words_of(folder / "config.cma") if row["ACTIVE"] == "*"]
    for by, key in enumerate("XYZ"):
        table = com_table(folder / active[key].lower())
        for axis, name in enumerate("XYZ"):
            column = "BACKLASH" if axis == by and direction < 0 else name
            sent[:, axis] -= sign * np.interp(p[:, by], table["AXISPOS"], table[column])
    return sent


def kinematics_comp(folder: Path, p: Vectors, _: int, sign: float = 1.0) -> Vectors:
    """The description from the tool to the workpiece, with and without COMPTAB; the controller compensates the TCP."""
    description = words_of(folder / "kinematics.tab")
    assert len(description) <= 100
    tables = {axis: com_table(folder / f"{axis.lower()}.com") for axis in "XYZ"}
    tool = tool_of((folder / "compensation.txt").read_text(encoding="ascii"))
    point = np.tile(tool, (len(p), 1))
    for row in description:
        axis = row["AXIS"]
        if row["KEY"] == "MachAxis":
            n = "XYZ".index(axis)
            own = tables[axis]
            point[:, n] += p[:, n] + np.interp(p[:, n], own["AXISPOS"], own[axis])
            continue
        assert row["KEY"] == "Trans"
        of, column = row["COMPTAB"].split("..")
        value = np.interp(p[:, "XYZ".index(of)], tables[of]["AXISPOS"], tables[of][column])
        if axis in "XYZ":
            point[:, "XYZ".index(axis)] += value
        else:
            turn = Rotation.from_rotvec(np.radians(value)[:, None] * np.eye(3)["ABC".index(axis)])
            point = turn.apply(point)
    return np.asarray(p - sign * (point - p - tool))


def tool_of(text: str) -> Vectors:
    found = re.search(r"tool offset (\S+) (\S+) (\S+) mm", text)
    assert found
    return np.array([float(one) for one in found.groups()])


def etalon_blocks(path: Path) -> dict[str, tuple[Vectors, Vectors] | float]:
    """[NAME] VALUE = number, or Gridpoints = { lines of position and value }. Comments follow //."""
    text = re.sub(r"//.*", "", path.read_text(encoding="ascii"))
    found: dict[str, tuple[Vectors, Vectors] | float] = {}
    for name, body in re.findall(r"\[(\w+)\]\s*([^\[]*)", text):
        value = re.fullmatch(r"VALUE = (\S+)\s*", body)
        if value:
            found[name] = float(value[1])
            continue
        rows = re.fullmatch(r"Gridpoints = \{\n(.*)\n\}\s*", body, re.DOTALL)
        assert rows, body[:80]
        x, v = np.array([[float(word) for word in row.split()] for row in rows[1].splitlines()]).T
        assert np.all(np.diff(x) > 0.0)
        found[name] = x, v
    return found


def etalon(path: Path, p: Vectors, _: int, sign: float = 1.0) -> Vectors:
    """e = sum of delta + theta x L, every axis on the tool's side, in the order that the compensation list has."""
    text = path.read_text(encoding="ascii")
    chain = re.search(r"compensation list: chain (\w+),", text)
    assert chain
    found = etalon_blocks(path)
    tool = tool_of(text)
    error = np.zeros_like(p)
    for n, axis in enumerate(chain[1]):
        own = p[:, "XYZ".index(axis)]
        moved, turned = (
            np.stack([np.interp(own, *found[f"E{c}{axis}"]) for c in which], axis=1)  # type: ignore[misc]
            for which in ("XYZ", "ABC")
        )
        lever = np.tile(tool, (len(p), 1))
        for after in chain[1][n + 1 :]:
            lever[:, "XYZ".index(after)] += p[:, "XYZ".index(after)]
        error += moved + np.cross(turned, lever)
        for name, (by, moves, turns) in {"C0Y": ("Y", 0, -1), "B0Z": ("Z", 0, 1), "A0Z": ("Z", 1, -1)}.items():
            if name in found and axis == by:
                error[:, moves] += turns * float(found[name]) * own  # type: ignore[arg-type]
    return np.asarray(p - sign * error)


def _commands(path: Path, word: str) -> dict[str, str]:
    comment = re.compile(r"[;#].*")
    lines = [comment.sub("", line).strip() for line in path.read_text(encoding="ascii").splitlines()]
    (line,) = [line for line in lines if line.startswith(word)]
    return dict(re.findall(r"(\w+?)=?(-?[\d.,]+)(?:\s|$)", line[len(word) :]))


def m556(path: Path, p: Vectors, _: int, sign: float = 1.0) -> Vectors:
    """Move::AxisTransform of RepRapFirmware."""
    given = {name: float(value) for name, value in _commands(path, "M556").items()}
    xy, yz, xz = (sign * given[name] / given["S"] for name in "XYZ")
    x, y, z = p.T
    return np.stack([x + xy * y + xz * z, y + yz * z, z], axis=1)


def _skew(p: Vectors, xy: float, xz: float, yz: float) -> Vectors:
    """Planner::skew of Marlin, calc_skew of Klipper."""
    x, y, z = p.T
    return np.stack([x - y * xy - z * (xz - xy * yz), y - z * yz, z], axis=1)


def m852(path: Path, p: Vectors, _: int, sign: float = 1.0) -> Vectors:
    given = _commands(path, "M852")
    assert all(abs(float(one)) <= 1.0 for one in given.values())
    return _skew(p, *(sign * float(given[name]) for name in "IJK"))


def set_skew(path: Path, p: Vectors, _: int, sign: float = 1.0) -> Vectors:
    """calc_skew_factor of Klipper, of AC, BD and AD."""
    given = _commands(path, "SET_SKEW")
    factors = []
    for plane in ("XY", "XZ", "YZ"):
        ac, bd, ad = (float(one) for one in given[plane].split(","))
        side = np.sqrt(2 * ac * ac + 2 * bd * bd - 4 * ad * ad) / 2
        factors.append(sign * np.tan(np.pi / 2 - np.arccos((ac * ac - side * side - ad * ad) / (2 * side * ad))))
    return _skew(p, *factors)


INTERPRETERS: dict[str, Motors] = {
    "siemens-cec": cec,
    "siemens-enc-comp": enc_comp,
    "heidenhain-com": com,
    "heidenhain-kinematics": kinematics_comp,
    "etalon": etalon,
    "rrf": m556,
    "marlin": m852,
    "klipper": set_skew,
}
