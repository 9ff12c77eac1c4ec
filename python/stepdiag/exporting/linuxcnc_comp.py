"""LinuxCNC's screw compensation: a COMP_FILE of type 0 for each joint (usrmotLoadComp, motmod).

A row is `nominal actual_forward actual_reverse`: the commanded position and the positions reached
in + and in - direction. LinuxCNC moves the motor to position + trim. The trim, nominal - actual, is
interpolated linearly; beyond the table the first or last trim holds. Such a table corrects one
function of one axis, while the error of a point depends on all three axes. The corrected function
is the positioning error along the line on which the other two axes are at `at`,

    E(p) = e_a(p on the line) - e_a(home on the line),

which is EXX plus theta x L of that line (Abbe). Joints of one axis, as the two motors of a
gantry, have the same table. The trims are those of the inverse, c + E(c) =
nominal, and therefore exact at every row. `actual` differs from nominal + E by E times its slope,
which is nanometres.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, Machine
from stepdiag.exporting.common import (
    FloatArray,
    common_nodes,
    in_ascii,
    inside,
    line_point,
    origin_of,
    require,
    temperature_row,
    tool_of,
    words,
)
from stepdiag.exporting.fewest_nodes import best_subset
from stepdiag.exporting.left_in_volume import left_in_volume, what_is_left
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of
from stepdiag.findings.meaning import provenance_rows, trust_rows
from stepdiag.io.comp_set import fingerprint_rows
from stepdiag.io.whole_files import read_text
from stepdiag.parameters import AXES

# EMCMOT_COMP_SIZE; LinuxCNC 2.9 reports an error for more rows, and starts without the rest.
MOST_ROWS: Final = 256
COMPANION: Final = "compensation.ini"
LEFT_OUT: Final = (
    "left out: straightness, squareness, and what the angles do away from the lines; a COMP_FILE cannot correct these, "
    "stepdiagkins (--to linuxcnc-kins) does"
)


def linuxcnc_comp(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The three files, and a companion with the INI lines and the settings."""
    rows = MOST_ROWS if options.rows is None else options.rows
    if not 2 <= rows <= MOST_ROWS:
        raise InvalidArgument(f"`rows`: expected 2 to {MOST_ROWS}, as LinuxCNC takes, got {rows}")
    at = line_point(calibration, options)
    tool = tool_of(calibration, options)
    missing = require(calibration, _needed(), options)
    machine = Machine(calibration.chain, calibration.to_error_map(), tool)
    letters = joints_of(options)
    tables = [JointTable(machine, calibration.volume, axis, at, rows) for axis in AXES]
    joints = [(n, tables[AXES.index(letter)]) for n, letter in enumerate(letters) if letter in AXES]

    head = list(_what_the_files_are(calibration, at, tool, origin_of(options), missing))
    losses = [joint.sentence(n) for n, joint in joints]

    def motors(commanded: FloatArray, direction: int) -> FloatArray:
        trims = [table.trim(commanded[:, n], direction) for n, table in enumerate(tables)]
        return commanded + np.column_stack(trims)

    left = left_in_volume(calibration, tool, motors)
    said = [*what_is_left(calibration, left), LEFT_OUT]
    origin = origin_of(options)
    files = {output / f"joint{n}.comp": joint.text(float(origin[joint.index])) for n, joint in joints}
    texts = {path.name: text for path, text in files.items()}
    files[output / COMPANION] = _companion([*head, *losses, *said], texts, letters)
    positioning = [f"E{axis}{axis}" for axis in AXES]
    coverage = coverage_of(calibration, positioning, [name for name in _needed() if name not in positioning])
    paste = f"note: paste the lines of {output / COMPANION} into the INI file"
    return Export(files, [*head, *losses, *said, paste], coverage, left, motors=motors)


def _needed() -> list[str]:
    """The parameters that determine a positioning error away from home."""
    return [f"E{component}{axis}" for axis in AXES for component in (axis, *"ABC")]


def joints_of(options: ExportOptions) -> str:
    """The axis of each joint. Raises InvalidArgument, also where the INI file has others."""
    given = None if options.coordinates is None else options.coordinates.upper()
    if given is not None and (not re.fullmatch(r"[XYZABCUVW]{3,9}", given) or not set(AXES) <= set(given)):
        raise InvalidArgument(
            f"`coordinates`: expected a letter for each joint, X, Y and Z among them, such as XYYZ, got {given!r}"
        )
    if options.ini is None:
        return given or "".join(AXES)
    found = _coordinates_of(options.ini)
    if given is not None and given != found:
        raise InvalidArgument(f"`coordinates`: expected {found}, as {options.ini} has them, got {given}")
    return found


def _coordinates_of(path: Path) -> str:
    """Of an INI file of LinuxCNC: [KINS] KINEMATICS = trivkins coordinates=XYYZ; without them XYZ."""
    text = read_text(path)
    kins = re.search(r"(?ims)^\s*\[KINS\](.*?)(?=^\s*\[|\Z)", text)
    kinematics = re.search(r"(?im)^\s*KINEMATICS\s*=\s*(\w+)(.*)$", kins[1]) if kins else None
    if kinematics is None:
        raise InvalidArgument(f"{path}: expected an INI file of LinuxCNC with KINEMATICS in [KINS]")
    given = re.search(r"(?i)coordinates\s*=\s*([A-Z]+)", kinematics[2])
    letters = given[1].upper() if given else "".join(AXES)
    joints = re.search(r"(?im)^\s*JOINTS\s*=\s*(\d+)", kins[1] if kins else "")
    if not set(AXES) <= set(letters) or (joints is not None and int(joints[1]) != len(letters)):
        raise InvalidArgument(
            f"{path}: [KINS]: expected X, Y and Z among the coordinates, one for each of JOINTS, got {letters}"
            + (f" for {joints[1]} joints" if joints else "")
        )
    return letters


class JointTable:
    """The table of one joint: kept nodes, trims in both directions, and the loss by resampling."""

    def __init__(self, machine: Machine, volume: FloatArray, axis: str, at: FloatArray, rows: int) -> None:
        self.axis, self.index = axis, AXES.index(axis)
        edge = float(volume[self.index])
        self.nodes = inside(common_nodes(machine.errors, axis), edge)
        line = np.tile(at, (len(self.nodes), 1))
        line[:, self.index] = self.nodes
        there, back = (machine.error(line, self._approach(sign))[:, self.index] for sign in "+-")
        self.error = np.array([there, back]) - there[0]
        self.trims = np.array([self._exact_trim(error, self.nodes) for error in self.error])
        self.kept = best_subset(self.nodes, self.trims, rows)
        self.loss = self._largest_loss()

    def _approach(self, sign: str) -> str:
        return "".join(sign if axis == self.axis else "+" for axis in AXES)

    def _exact_trim(self, error: FloatArray, nominal: FloatArray) -> FloatArray:
        """The correction with which the axis comes to these positions, mm."""
        comes_to = self.nodes + error
        if np.any(np.diff(comes_to) <= 0.0):
            raise InvalidArgument(f"E{self.axis}{self.axis}: so steep that positions of the axis are not distinct")
        beyond = np.clip(nominal, comes_to[0], comes_to[-1])  # the error holds beyond
        return np.asarray(np.interp(beyond, comes_to, self.nodes) - beyond)

    def trim(self, nominal: FloatArray, direction: int) -> FloatArray:
        """What LinuxCNC adds to a position when it moves in direction 0 (+) or 1 (-), mm."""
        return np.asarray(np.interp(nominal, self.nodes[self.kept], self.trims[direction, self.kept]))

    def _largest_loss(self) -> float:
        """Largest deviation of the table's trims from the exact ones, mm.

        Both are linear between the positions compared."""
        where = np.unique(np.concatenate([self.nodes, *(self.nodes + self.error).clip(0.0, self.nodes[-1])]))
        return max(
            float(np.max(np.abs(self.trim(where, d) - self._exact_trim(error, where))))
            for d, error in enumerate(self.error)
        )

    def text(self, origin: float) -> str:
        """Rows with nine digits after the point (picometres)."""
        rows = []
        for p, there, back in zip(self.nodes[self.kept], *self.trims[:, self.kept], strict=True):
            nominal = float(p) + origin
            rows.append(f"{nominal:.9f} {nominal - there:.9f} {nominal - back:.9f}\n")
        return "".join(rows)

    def sentence(self, joint: int) -> str:
        reversal = float(np.max(np.abs(self.error[0] - self.error[1])))
        two = f"reversal up to {reversal * 1e3:.3g} µm" if reversal else "no reversal: both directions alike"
        return (
            f"joint {joint} ({self.axis}): {len(self.kept)} rows of {len(self.nodes)} nodes, error up to "
            f"{np.max(np.abs(self.error)) * 1e3:.4g} µm, {two}; the table deviates from the exact inverse by at most "
            f"{self.loss * 1e3:.2g} µm"
        )


def _what_the_files_are(
    calibration: Calibration, at: FloatArray, tool: FloatArray, origin: FloatArray, missing: list[str]
) -> list[str]:
    return [
        *trust_rows(calibration),
        temperature_row(calibration),
        *provenance_rows(calibration),
        f"chain {calibration.chain}, volume {words(calibration.volume)} mm, home at {words(origin)} mm in the "
        "controller's coordinates",
        f"corrected: the positioning error of each axis along its line through {words(at)} mm from home, for a tool "
        f"offset of {words(tool)} mm; 0 at its home in + direction",
        "sign: actual = where the axis comes to when sent to nominal; LinuxCNC subtracts actual - nominal",
        *missing,
    ]


def _companion(sentences: list[str], tables: Mapping[str, str], letters: str) -> str:
    ini = [f"# {sentence}" for sentence in ["stepdiag export --to linuxcnc-comp", *sentences]]
    ini.append("# LinuxCNC ignores BACKLASH of a joint with a COMP_FILE: what is known of reversal is in the files")
    numbers = " ".join(str(n) for n in range(len(letters)))
    ini.append(
        f"# for LINEAR_UNITS = mm, and joints {numbers} = {' '.join(letters)}; paths are relative to the INI file"
    )
    ini += fingerprint_rows(tables)
    for n in (n for n, letter in enumerate(letters) if letter in AXES):
        ini += ["", f"[JOINT_{n}]", f"COMP_FILE = joint{n}.comp", "COMP_FILE_TYPE = 0"]
    return in_ascii("\n".join(ini)) + "\n"
