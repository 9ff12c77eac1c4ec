"""Error maps in the formats of controllers and of other software: Etalon, ISG, Siemens, Heidenhain, LinuxCNC, firmware.

What `export` writes is read back, and the same of others as far as it says the same: values are errors, actual -
commanded, of the tool relative to the workpiece. Positions become those from home. Formats that take every axis as one
that carries the tool (docs/exports.md) have straightnesses of the functional point; those of the map are of the origin
of each axis's own frame.
"""

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, Chain, ErrorMap, InvalidArgument, Machine, read_error_map
from stepdiag.findings.error_map import check_angles
from stepdiag.io.whole_files import read_text
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES
from stepdiag.units import MICROMETRE, MICRORADIAN

FloatArray = npt.NDArray[np.float64]
Table = tuple[FloatArray, FloatArray]  # positions in the controller's coordinates, mm; values, mm or rad
Triple = tuple[float, float, float]
IMPORTED: Final = "import"  # the method of a calibration that was a table of others
_NUMBER: Final = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


@dataclass
class _Read:
    """What a file has. `tool_side`: every axis as one that carries the tool; `ignored`: names of other axes."""

    form: str
    functions: dict[str, Table] = field(default_factory=dict)
    negative: dict[str, Table] = field(default_factory=dict)
    squareness: dict[str, float] = field(default_factory=dict)
    tool_side: bool = False
    ignored: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class ImportedMap:
    """An error map, the machine that it is of, and what the files were taken for."""

    errors: ErrorMap
    chain: str
    volume: Triple
    tool: Triple
    text: Sequence[str]

    def as_calibration(self, lengths: float, angles: float) -> Calibration:
        """The map as a calibration whose values have these standard uncertainties, mm and rad, uncorrelated.

        Raises InvalidArgument unless both are above 0."""
        if not (0.0 < lengths < np.inf and 0.0 < angles < np.inf):
            raise InvalidArgument("`uncertainty`: expected a length and an angle above 0")
        of = {"X": lengths, "Y": lengths, "Z": lengths}
        functions = {
            name: (x, value, np.full(len(x), of.get(name[1], angles)))
            for name, (x, value) in self.errors.functions.items()
        }
        reversal = {
            name: (
                x,
                self.errors.function(name, x, "+") - value,
                np.full(len(x), np.sqrt(2.0) * of.get(name[1], angles)),
            )
            for name, (x, value) in self.errors.negative_functions.items()
        }
        squareness = {name: (angle, angles) for name, angle in self.errors.squareness.items()}
        in_order = [functions[name][2] for name in FUNCTIONS if name in functions]
        in_order.append(np.full(len(squareness), angles))
        return Calibration(
            IMPORTED,
            Chain(self.chain),
            self.volume,
            self.tool,
            functions,
            squareness,
            reversal=reversal,
            reversal_negative_uncertainty={name: functions[name][2] for name in reversal},
            covariance=np.diag(np.concatenate(in_order) ** 2),
            conditions=[
                f"standard uncertainties stated at import: {lengths / MICROMETRE:g} µm, {angles / MICRORADIAN:g} µrad, "
                "uncorrelated"
            ],
        )


def is_controller_table(path: Path) -> bool:
    """Whether a file is one of these tables; it may still be damaged."""
    if path.suffix.lower() in (".xlsx", ".ods"):
        return False
    try:
        return _form_of(read_text(path)) is not None
    except InvalidArgument:
        return False


def read_controller_tables(
    files: Sequence[Path],
    *,
    chain: str | None = None,
    volume: Triple | None = None,
    tool: Triple | None = None,
    origin: Triple | None = None,
) -> ImportedMap:
    """The error map of these files, which together are of one machine.

    What stepdiag wrote says chain, volume, tool and home; of others `chain` is needed, home is the lowest position of
    each axis, the volume ends with the tables, and the tool offset is 0, unless given (mm). Raises InvalidArgument
    naming file and line or block."""
    texts = {path: read_text(path) for path in files}
    said = _said("\n".join(texts.values()))
    reads = [(path, _read(path, text)) for path, text in texts.items()]
    named = chain or said.get("chain")
    if named is None:
        raise InvalidArgument(f"{files[0]}: does not say the machine's chain; give `chain`, such as \"[w X' b Y Z t]\"")
    home = np.array(origin or _triple(said, "home") or [_lowest(reads, axis) for axis in AXES])
    offset = tool or _triple(said, "tool") or (0.0, 0.0, 0.0)
    functions: dict[str, Table] = {}
    negative: dict[str, Table] = {}
    squareness: dict[str, float] = {}
    for path, read in reads:
        for name in (*read.functions, *read.squareness):
            if name in functions or name in squareness:
                raise InvalidArgument(f"{path}: {name} is in the files twice")
        squareness |= read.squareness
        for own, into in ((read.functions, functions), (read.negative, negative)):
            into |= {name: (x - home[AXES.index(name[2])], value) for name, (x, value) in own.items()}
    edges = volume or _triple(said, "volume") or tuple(_end(functions, axis) for axis in AXES)
    errors = ErrorMap(functions, squareness, negative_functions=negative)
    check_angles(errors, str(files[0]))
    if any(read.tool_side for _, read in reads):
        errors = _of_own_frames(errors, Chain(named), home)
    errors, moved = _with_squarenesses(errors)
    text = [f"{path}: {read.form}" for path, read in reads]
    text += [f"{path}: left out, as no error of X, Y or Z: {', '.join(r.ignored)}" for path, r in reads if r.ignored]
    text.append(
        f"chain {named}, volume {_words(edges)} mm, tool offset {_words(offset)} mm, home at {_words(home)} mm "
        "of the file"
    )
    text += [f"squareness was in the straightnesses; from end to end of them: {', '.join(moved)}"] if moved else []
    known = {*errors.functions, *errors.squareness}
    lacking = [name for name in (*FUNCTIONS, *SQUARENESSES) if name not in known]
    text += [f"not in the file: {', '.join(lacking)}"] if lacking else []
    text.append("sign: values are taken as errors, actual - commanded; a table of corrections has the opposite sign")
    return ImportedMap(errors, Chain(named).name, (edges[0], edges[1], edges[2]), offset, text)


def machine_of_tables(files: Sequence[Path], calibration: Calibration) -> Machine:
    """A machine with the errors that these tables, made for the calibration, compensate; or with those of a file of it.

    What files of others do not say of the machine is that of the calibration; home is where their tables begin."""
    if not all(is_controller_table(file) for file in files):
        if len(files) != 1:
            raise InvalidArgument(f"{files[0]}: expected one calibration, or tables of a controller")
        return Machine(calibration.chain, read_error_map(files[0]), calibration.tool)
    found = read_controller_tables(
        files,
        chain=calibration.chain.name,
        volume=_three(calibration.volume),
        tool=None if _says_tool(files) else _three(calibration.tool),
    )
    return Machine(found.chain, found.errors, found.tool)


def _three(values: FloatArray) -> Triple:
    return float(values[0]), float(values[1]), float(values[2])


def _says_tool(files: Sequence[Path]) -> bool:
    return "tool" in _said("\n".join(read_text(file) for file in files))


def _said(text: str) -> Mapping[str, str]:
    """What the comments of stepdiag's own tables say of the machine."""
    if "stepdiag export --to" not in text and "# format=stepdiag" not in text:
        return {}
    leading = dict(re.findall(r"(?m)^# (chain|volume|tool|home)(?:_mm)?=(.*)$", text))
    found = re.search(rf"chain (\[[^\]]*\]), volume ((?:{_NUMBER} ?){{3}}) mm", text)
    tool = re.search(rf"tool offset (?:of )?((?:{_NUMBER} ?){{3}}) mm", text)
    home = re.search(rf"home at ((?:{_NUMBER} ?){{3}}) mm", text)
    words = {"chain": found[1], "volume": found[2]} if found else {}
    return leading | words | ({"tool": tool[1]} if tool else {}) | ({"home": home[1]} if home else {})


def _triple(said: Mapping[str, str], name: str) -> Triple | None:
    words = said.get(name, "").replace(",", " ").split()
    if not all(re.fullmatch(_NUMBER, word) for word in words):
        raise InvalidArgument(f"{name}: expected three numbers, got {said[name]!r}")
    return (float(words[0]), float(words[1]), float(words[2])) if len(words) == 3 else None


def _lowest(reads: Sequence[tuple[Path, _Read]], axis: str) -> float:
    tables = [table for _, read in reads for name, table in read.functions.items() if name[2] == axis]
    return min((float(position[0]) for position, _ in tables), default=0.0)


def _end(functions: Mapping[str, Table], axis: str) -> float:
    ends = [float(position[-1]) for name, (position, _) in functions.items() if name[2] == axis]
    if not ends or max(ends) <= 0.0:
        raise InvalidArgument(f"no table says how far {axis} goes; give `volume`")
    return max(ends)


def _of_own_frames(errors: ErrorMap, chain: Chain, home: FloatArray) -> ErrorMap:
    """The map whose straightnesses refer to the own frames, from one of which every axis carries the tool.

    What the rotations of an axis that carries the workpiece do at its own position, and the controller's 0 as a lever
    arm, are taken from its straightnesses; a squareness that was counted from the controller's 0 is added."""
    letters = [letter for letter in chain.name if letter in AXES]
    functions = dict(errors.functions)
    for axis in AXES:
        turned = {name: table for name, table in functions.items() if name[1] in "ABC" and name[2] == axis}
        moved = {name: table for name, table in functions.items() if name[1] in AXES and name[2] == axis}
        lever = np.zeros(3)
        after = [AXES.index(letter) for letter in letters[letters.index(axis) + 1 :]]
        lever[after] = -home[after]
        slopes = ErrorMap({}, {name: angle for name, angle in errors.squareness.items() if name[2] == axis})
        at_home = Machine(chain, slopes).first_order_error(np.where(np.arange(3) == AXES.index(axis), home, 0.0)[None])
        for name, (position, value) in moved.items():
            line = np.zeros((len(position), 3))
            line[:, AXES.index(axis)] = position
            by_turns = Machine(chain, ErrorMap(turned), lever).first_order_error(line)
            functions[name] = position, value - (by_turns - at_home)[:, AXES.index(name[1])]
    return ErrorMap(functions, errors.squareness)


# Of a squareness, the straightness whose slope it is, and the sign.
_SLOPE_OF: Final = {"C0Y": ("EXY", -1.0), "B0Z": ("EXZ", 1.0), "A0Z": ("EYZ", -1.0)}


def _with_squarenesses(errors: ErrorMap) -> tuple[ErrorMap, list[str]]:
    """The same errors with squarenesses, if a file has none: the slopes of straightnesses, from their first to their
    last node, which then are 0 at both ends. Also their names and values."""
    if errors.squareness:
        return errors, []
    functions, negative, squareness = dict(errors.functions), dict(errors.negative_functions), {}
    for name, (straightness, sign) in _SLOPE_OF.items():
        if straightness in functions:
            position, value = functions[straightness]
            slope = float((value[-1] - value[0]) / (position[-1] - position[0])) if len(position) > 1 else 0.0
            squareness[name] = sign * slope
            for tables in (functions, negative):
                if straightness in tables:
                    x, own = tables[straightness]
                    tables[straightness] = x, own - slope * x
    said = [f"{name} {angle / MICRORADIAN:.4g} µrad" for name, angle in squareness.items()]
    return ErrorMap(functions, squareness, negative_functions=negative), said


# --- the formats ---


def _form_of(text: str) -> str | None:
    """By the first line that is no comment, or by what stands in a file of one form alone."""
    lines = (line.strip() for line in text.splitlines())
    first = next((line for line in lines if line and not line.startswith(("//", ";", "#"))), "")
    beginnings = {
        "etalon": r"\[(?:E[XYZABC][XYZABC]|[XYZABC]0[XYZABC])\]",
        "isg": r"(?:[XYZ]\s+)+E[XYZABC][XYZ]\b|(?:P0X|C0Y|B0Z|A0Z)\b",
        "heidenhain": r"BEGIN +\w+\.COM MM",
        "firmware": r"(?:M556|M852|SET_SKEW)\s",
        "hal": r"setp (?:matrixkins|calibxyzkins)\.",
    }
    if "$AN_CEC" in text or "$AA_ENC_COMP" in text:
        return "siemens"
    if "[JOINT_" in text and "COMP_FILE" in text:
        return "comp"
    if text.startswith(("# format=stepdiag squareness", "# format=stepdiag position error")):
        return "own"
    return next((form for form, pattern in beginnings.items() if re.match(pattern, first)), None)


def _read(path: Path, text: str) -> _Read:
    form = _form_of(text)
    if form is None:
        raise InvalidArgument(f"{path}: is no table of a controller that stepdiag knows")
    try:
        with np.errstate(all="raise"):
            read = _READERS[form](path, text)
    except KeyError as missing:
        raise InvalidArgument(f"{path}: {missing} is missing") from None
    except (ValueError, IndexError, TypeError, ArithmeticError, np.linalg.LinAlgError) as wrong:
        raise InvalidArgument(f"{path}: cannot be read as a table of this form: {wrong}") from None
    unknown = {*read.functions, *read.negative, *read.squareness} - {*FUNCTIONS, *SQUARENESSES}
    if unknown:
        raise InvalidArgument(f"{path}: expected errors of X, Y and Z, got {', '.join(sorted(unknown))}")
    return read


def _etalon(path: Path, text: str) -> _Read:
    read = _Read("Etalon Exchange Format", tool_side=True)
    text = re.sub(r"//[^\n]*", "", text)
    for match in re.finditer(r"\[(\w+)\]([^\[]*)", text):
        name, body = match[1], match[2].strip()
        where = f"{path}, line {text.count(chr(10), 0, match.start()) + 1}: [{name}]"
        value = re.fullmatch(rf"VALUE\s*=\s*({_NUMBER})", body)
        grid = re.fullmatch(r"Gridpoints\s*=\s*\{(.*)\}", body, re.DOTALL)
        if name not in (*FUNCTIONS, *SQUARENESSES):
            read.ignored.append(name)
        elif name in read.functions or name in read.squareness:
            raise InvalidArgument(f"{where}: is there twice")
        elif value and name in SQUARENESSES:
            read.squareness[name] = float(value[1])
        elif grid and name in FUNCTIONS:
            read.functions[name] = _rows(where, [line.split() for line in grid[1].strip().splitlines()], 2)[0]
        else:
            raise InvalidArgument(f"{where}: expected VALUE = number, or Gridpoints = {{ position value … }}")
    return read


def _isg(path: Path, text: str) -> _Read:
    read = _Read("ISG CSV", tool_side=True)
    line = 1
    for block in re.sub(r"//[^\n]*", "", text).split("#"):
        rows = [words.split() for words in block.strip().splitlines()]
        where, line = f"{path}, block after line {line}", line + block.count("\n")
        if not rows:
            continue
        names, *rows = rows
        if names[0] not in AXES:
            if len(rows) != 1:
                raise InvalidArgument(f"{where}: expected one row below {' '.join(names)}, got {len(rows)}")
            constants = dict(zip(names, _numbers(where, rows, len(names))[0].tolist(), strict=True))
            read.squareness |= {name: angle for name, angle in constants.items() if name in SQUARENESSES}
            read.ignored += [name for name in names if name not in SQUARENESSES and not name.startswith("P0")]
            continue
        if names[1] in AXES:
            raise InvalidArgument(
                f"{where}: depends on {names[0]} and {names[1]}; an error map has one position a table"
            )
        for name, table in zip(names[1:], _rows(where, rows, len(names)), strict=True):
            if name in FUNCTIONS and name[2] == names[0]:
                read.functions[name] = table
            else:
                read.ignored.append(name)
    return read


def _siemens(path: Path, text: str) -> _Read:
    read = _Read("SINUMERIK tables")
    values: dict[str, dict[str, str]] = {}
    for number, line in enumerate(text.splitlines(), 1):
        code = line.split(";")[0].strip()
        if not code.startswith("$"):
            continue
        match = re.fullmatch(r"\$(A[AN]_\w+)\s*\[([\w, ]+)\]\s*=\s*\(?([^()]+)\)?", code)
        if match is None:
            raise InvalidArgument(f"{path}, line {number}: expected $NAME[index]=value, got {code!r}")
        values.setdefault(match[1], {})[match[2].replace(" ", "")] = match[3].strip().strip('"')
    axes = _axes_of(text)
    for index in values.get("AN_CEC_STEP", {}):
        by, axis = (_axis(path, index, axes, values, f"AN_CEC_{which}_AXIS") for which in ("INPUT", "OUTPUT"))
        back = float(values.get("AN_CEC_DIRECTION", {}).get(index, "0")) < 0.0
        into = read.negative if back else read.functions
        if f"E{axis}{by}" in into:
            raise InvalidArgument(f"{path}: table {index}: a second one of {axis} by {by}")
        into[f"E{axis}{by}"] = _equidistant(path, "AN_CEC", index, f"{index},", values)
    for index in values.get("AA_ENC_COMP_STEP", {}):
        system, name = index.split(",")
        if name not in axes:
            raise InvalidArgument(f"{path}: axis {name}: expected one of {', '.join(axes)}")
        table = _equidistant(path, "AA_ENC_COMP", index, f"{system},", values, f",{name}")
        read.functions[f"E{axes[name]}{axes[name]}"] = table
    return read


Variables = Mapping[str, Mapping[str, str]]  # name -> index -> value


def _equidistant(path: Path, of: str, index: str, before: str, values: Variables, after: str = "") -> Table:
    """The points of a table: those whose index begins and ends so, with the point's number between."""
    for what in ("IS_MODULO", "MULT_BY_TABLE"):
        if float(values.get(f"{of}_{what}", {}).get(index, "0")):
            raise InvalidArgument(f"{path}: table {index}: {of}_{what} is set: that is no error map")
    points = {key for key in values.get(of, {}) if key.startswith(before) and key.endswith(after)}
    try:
        step, first = (float(values[f"{of}_{what}"][index]) for what in ("STEP", "MIN"))
        table = [float(values[of][f"{before}{n}{after}"]) for n in range(len(points))]
    except (KeyError, ValueError) as wrong:
        raise InvalidArgument(f"{path}: table {index}: {wrong} is missing, or is no number") from None
    if not table or not step > 0.0:
        raise InvalidArgument(f"{path}: table {index}: expected points and a step above 0")
    return np.asarray(first + step * np.arange(len(table)), dtype=np.float64), np.array(table)


def _axis(path: Path, index: str, axes: Mapping[str, str], values: Variables, variable: str) -> str:
    name = values.get(variable, {}).get(index, "")
    if name not in axes:
        raise InvalidArgument(f"{path}: table {index}: {variable}: expected one of {', '.join(axes)}, got {name!r}")
    return axes[name]


def _axes_of(text: str) -> Mapping[str, str]:
    named = re.search(r"machine axes X, Y, Z: (\w+), (\w+), (\w+)", text)
    names = named.groups() if named else ("AX1", "AX2", "AX3")
    return dict(zip(names, AXES, strict=True)) | {f"{axis}{end}": axis for axis in AXES for end in ("", "1")}


def _heidenhain(path: Path, text: str) -> _Read:
    begin, head, *lines = text.splitlines()
    axis = begin.split()[1].removesuffix(".COM")
    if axis not in AXES:
        raise InvalidArgument(f"{path}: expected BEGIN X.COM, Y.COM or Z.COM, got {begin!r}")
    names = [(match[0], match.start()) for match in re.finditer(r"\S+", head)]
    ends = [*(start for _, start in names[1:]), None]
    cells = [
        {name: line[start:end].strip() for (name, start), end in zip(names, ends, strict=True)}
        for line in lines
        if not line.startswith("[END]")
    ]
    heads = ["AXISPOS", *(name for name, _ in names if name not in ("NR", "AXISPOS"))]
    if axis not in heads:
        raise InvalidArgument(f"{path}: expected a column {axis}, got {head!r}")
    rows = [[row.get(name, "") for name in heads] for row in cells]
    columns = dict(zip(heads[1:], _rows(str(path), rows, len(heads)), strict=True))
    read = _Read(f"Heidenhain table of {axis}", tool_side="C2" in columns)
    if read.tool_side:
        read.functions[f"E{axis}{axis}"] = columns[axis]
        for k, name in enumerate([*(one for one in AXES if one != axis), *"ABC"], start=2):
            position, value = columns[f"C{k}"]
            read.functions[f"E{name}{axis}"] = position, np.radians(value) if name in "ABC" else value
        return read
    read.functions = {f"E{name}{axis}": columns[name] for name in AXES if name in columns}
    if "BACKLASH" in columns and not np.array_equal(columns["BACKLASH"][1], columns[axis][1]):
        read.negative = {f"E{axis}{axis}": columns["BACKLASH"]}
    return read


def _comp(path: Path, text: str) -> _Read:
    read = _Read("COMP_FILEs of LinuxCNC")
    joints = re.search(r"joints ([\d ]+) = ([A-Z ]+);", text)
    numbers, letters = (joints[1].split(), joints[2].split()) if joints else (list("012"), list(AXES))
    axis_of = dict(zip(numbers, letters, strict=True))
    line = r"\[JOINT_(\d)\]\s*COMP_FILE\s*=\s*(\S+)\s*COMP_FILE_TYPE\s*=\s*(\d)"
    for joint, name, kind in re.findall(line, text):
        if kind != "0":
            raise InvalidArgument(f"{path}: [JOINT_{joint}]: only COMP_FILE_TYPE 0 is read: signs of type 1 differ")
        rows = [line.split() for line in read_text(path.parent / name).splitlines()]
        there, back = _rows(str(path.parent / name), rows, 3)
        axis = axis_of[joint]
        if f"E{axis}{axis}" not in read.functions:  # the motors of a gantry have one table
            nominal = there[0]
            read.functions[f"E{axis}{axis}"] = nominal, there[1] - nominal
            if not np.array_equal(there[1], back[1]):
                read.negative[f"E{axis}{axis}"] = nominal, back[1] - nominal
    return read


def _firmware(path: Path, text: str) -> _Read:
    read = _Read("command of a firmware")
    code = "\n".join(line.split(";")[0] if not line.startswith("#") else "" for line in text.splitlines())
    given = dict(re.findall(rf"\b([A-Z]{{1,2}})=?((?:{_NUMBER},?)+)", code))
    if "M556" in code:
        xy, yz, xz = (float(given[name]) / float(given["S"]) for name in "XYZ")
    elif "M852" in code:
        xy, xz, yz = (-float(given[name]) for name in "IJK")
    else:
        xy, xz, yz = (-_klipper(*(float(word) for word in given[plane].split(","))) for plane in ("XY", "XZ", "YZ"))
    read.squareness = {"C0Y": xy, "B0Z": -xz, "A0Z": yz}
    return read


def _hal(path: Path, text: str) -> _Read:
    """position = A joints + B joints^2; each function is linear, or has 101 nodes."""
    read = _Read("HAL lines of a polynomial", tool_side=False)
    given = {name: float(value) for name, value in re.findall(rf"(?m)^setp \w+\.([\w.-]+) ({_NUMBER})$", text)}
    said = _said(text)
    edges, home = _triple(said, "volume"), np.array(_triple(said, "home"))
    if edges is None:
        raise InvalidArgument(f"{path}: does not say the volume, as HAL lines of stepdiag do")

    def matrix_of(name: str) -> FloatArray:
        return np.array([[given[f"{name}{a}{b}"] for b in "xyz"] for a in "xyz"])

    if "C_xx" in given:
        linear, quadratic = np.linalg.inv(matrix_of("C_")), np.zeros((3, 3))
    else:
        linear, quadratic = matrix_of("calib-a."), matrix_of("calib-b.")
    for a, b in np.ndindex(3, 3):
        place = home[b] + np.linspace(0.0, edges[b], 101 if quadratic.any() else 2)
        error = (linear[a, b] - (a == b)) * place + quadratic[a, b] * place**2
        read.functions[f"E{AXES[a]}{AXES[b]}"] = place, error - error[0]
    return read


def _own_csv(path: Path, text: str) -> _Read:
    """The tables squareness and position-error of stepdiag."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    if "squareness" in text.splitlines()[0]:
        angles = {row["parameter"]: float(row["value_urad"]) * MICRORADIAN for row in rows}
        return _Read("squarenesses", squareness=angles)
    leading = dict(re.findall(r"(?m)^# (axis|depends_on)=(\w)$", text))
    cells = [[row["position_mm"], row["error_um"]] for row in rows]
    ((position, value),) = _rows(str(path), cells, 2)
    return _Read("rows of one function", {f"E{leading['axis']}{leading['depends_on']}": (position, value * MICROMETRE)})


def _klipper(ac: float, bd: float, ad: float) -> float:
    """Its factor, from the diagonals and a side of a parallelogram."""
    side = np.sqrt(2.0 * ac**2 + 2.0 * bd**2 - 4.0 * ad**2) / 2.0
    return float(np.tan(np.arcsin((ac**2 - side**2 - ad**2) / (2.0 * side * ad))))


def _rows(where: str, rows: Sequence[Sequence[str]], columns: int) -> list[Table]:
    """The tables of rows of a position and values."""
    data = _numbers(where, rows, columns)
    if len(data) == 0 or np.any(np.diff(data[:, 0]) <= 0.0):
        raise InvalidArgument(f"{where}: expected rows with ascending positions")
    return [(data[:, 0], data[:, k]) for k in range(1, columns)]


def _numbers(where: str, rows: Sequence[Sequence[str]], columns: int) -> FloatArray:
    for n, row in enumerate(rows, 1):
        if len(row) != columns or not all(re.fullmatch(_NUMBER, word) for word in row):
            raise InvalidArgument(f"{where}, row {n}: expected {columns} numbers, got {' '.join(row)!r}")
    return np.array(rows, dtype=float).reshape(-1, columns)


def _words(values: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{float(value):g}" for value in values)


_READERS: Final[Mapping[str, Callable[[Path, str], _Read]]] = {
    "etalon": _etalon,
    "isg": _isg,
    "siemens": _siemens,
    "heidenhain": _heidenhain,
    "comp": _comp,
    "firmware": _firmware,
    "hal": _hal,
    "own": _own_csv,
}
