"""Recognises stepdiag's files by their first lines."""

import re
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.io.whole_files import read_beginning

CHECKPOINT_BEGINS: Final = "stepdiag checkpoint "
PAGE_BEGINS: Final = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="generator" content="stepdiag report">
"""
# Kind by the format that a table states.
_FORMATS: Final = {
    "measurement": "measurement",
    "calibration": "calibration",
    "error map": "error map",
    "comparison": "comparison",
    "functional point": "functional point table",
    "uncertainty": "uncertainty result",
    "study": "study result",
    "error grid": "error grid",
    "squareness": "squareness table",
    "position error": "position error table",
    "selftest": "self-test",
}
_NUMBER: Final = r"[-+]?[\d.]+(?:e[-+]?\d+)?"
_TOML_LINE: Final = r"""\s*(?:\[|[\w."'-]+\s*=)"""
# Other kinds, by a pattern for the beginning of the file.
_BEGINNINGS: Final = {
    "checkpoint": CHECKPOINT_BEGINS,
    "PNG picture": "\ufffdPNG\r\n\x1a\n",
    "SVG picture": r"(?:<\?xml[^>]*>\s*)?(?:<!DOCTYPE svg[^>]*>\s*)?<svg\b",
    "report page": re.escape(PAGE_BEGINS).replace("en", "[a-z]{2}", 1),
    "PDF document": "%PDF-",
    "measuring program": r"(?i:%\n)?\((?i:measuring program)\b|; Measuring program |0 BEGIN PGM STEPDIAG ",
    "ISG table": "// stepdiag export --to isg\n",
    "file of HAL lines": "# stepdiag export --to (?:matrix|calibxyzkins)\n",
    "compensation.ini": "# stepdiag export --to linuxcnc-comp\n",
    "SINUMERIK table": r"%_N_(?:AX_EEC|NC_CEC)_INI\n; stepdiag export --to siemens-",
    "Heidenhain table": r"BEGIN (?:[XYZ]\.COM|CONFIG\.CMA|KINEMATICS\.TAB) MM\nNR ",
    "notes beside Heidenhain tables": "stepdiag export --to heidenhain-",
    "Etalon Exchange Format": "// stepdiag export --to etalon\n",
    "firmware command": "[;#] stepdiag export --to (?:rrf|marlin|klipper)\n",
    "COMP_FILE": rf"(?:{_NUMBER} {_NUMBER} {_NUMBER}\n)+\Z",
    "study cells": r"(?s:.*\n)?[0-9a-f]{64} \{|\s*[0-9a-f]{1,64} ?\Z",  # also a torn first line
    "table of steps": "steps,mirror_width_mm,",
    "table of plans": "minutes,lines,scale_lines,",
    "table of points": "case,points,x_mm,",
    "report of the demonstration": "Largest remaining errors at the nodes|The closed loop, moved by ",
}
NETCDF_BEGINS: Final = ("\ufffdHDF", "CDF")


def kind_of_file(path: Path) -> str | None:
    """The kind of a file by its beginning, whatever its name; None if it is not recognised.

    The file may still be damaged. Raises InvalidArgument if it cannot be read."""
    text = read_beginning(path)
    if not text.startswith(NETCDF_BEGINS):
        return kind_of_text(text)
    from stepdiag.io.netcdf_read import kind_of_netcdf

    try:
        return _FORMATS.get(kind_of_netcdf(path))
    except InvalidArgument:
        return None


def kind_of_text(text: str) -> str | None:
    """The kind of a file by the beginning of its text."""
    comments, header = head_of(text)
    leading = dict(re.findall(r"(?m)^#\s*(\w+)\s*=\s*(.*?)\s*$", "\n".join(comments)))
    columns = {column.strip().strip('"') for column in header.split(",")}
    for name, kind in _FORMATS.items():
        if leading.get("format", "").startswith(f"stepdiag {name}"):
            return kind
    for kind, beginning in _BEGINNINGS.items():
        if re.match(beginning, text):
            return kind
    if {"parameter", "value"} & columns:
        return "calibration" if "method" in leading else "error map"
    if "target_mm" in columns:
        return "table of target readings"
    if header.startswith("{"):
        return "raw readings"
    if {"line", "point"} & columns:
        return "measurement"
    return "TOML file" if re.match(_TOML_LINE, header) else None


def head_of(text: str) -> tuple[list[str], str]:
    """The leading comments, and the first other line."""
    comments: list[str] = []
    for line in text.splitlines():
        if line.strip() and not line.startswith("#"):
            return comments, line
        comments.append(line)
    return comments, ""
