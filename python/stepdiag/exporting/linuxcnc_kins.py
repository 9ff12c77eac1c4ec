"""The table for LinuxCNC's kinematics module stepdiagkins (docs/linuxcnc.md).

It is the calibration's CSV, with chain, volume and tool.
"""

import tempfile
import warnings
from pathlib import Path

import numpy as np

from stepdiag._core import Calibration, Compensator
from stepdiag.calibration.parts import parts_of
from stepdiag.exporting.common import FloatArray, origin_of, require, temperature_row, tool_of, words
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of
from stepdiag.findings.meaning import trust_rows
from stepdiag.parameters import FUNCTIONS, SQUARENESSES


def linuxcnc_kins(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The table, and the INI line that loads it."""
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    tool, origin = tool_of(calibration, options), origin_of(options)
    table = _with_tool(calibration, tool)
    # Reports here what the module would refuse. Of its fit the export itself warns.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        loaded = Compensator(
            table,
            calibration.chain,
            origin=origin,
            approach=options.approach or "mean",
            accept_rejected=options.accept_rejected,
            accept_unverified=True,  # the module decides
        )
    # INI files do not pass on quotes; the module derives the primes from the place of the bed.
    arguments = f"table={output.absolute()} chain={''.join(c for c in calibration.chain.name if c.isalpha())}"
    if origin.any():
        arguments += f" origin={','.join(repr(o) for o in origin.tolist())}"
    if options.approach not in (None, "mean"):
        arguments += f" approach={options.approach}"
    if calibration.fit == "rejected":
        arguments += " accept_rejected=1"
    lines = [
        *trust_rows(calibration),
        temperature_row(calibration),
        f"chain {calibration.chain}, volume {words(calibration.volume)} mm, tool offset {words(tool)} mm, home at "
        f"{words(origin)} mm in the controller's coordinates",
        "sign: errors, actual - commanded of the tool relative to the workpiece; the module moves the joints by the "
        "inverse, joints + error = commanded",
        "loss: none, every node is kept",
        f"table id {loaded.fingerprint:016x}, as the module's pins table-id-high and table-id-low tell it",
        *missing,
        f"INI file: [KINS] KINEMATICS = stepdiagkins {arguments}",
    ]
    if calibration.unverified:
        lines.append("unverified: the module refuses this table unless accept_unverified=1 is in that line")
    if calibration.expansion is not None:
        lines.append(
            "scales: with temperatures=LOWEST,HIGHEST (°C) in that line the module takes their temperatures from pins"
        )
    if " " in str(output.absolute()):
        lines.append("note: KINEMATICS takes no space in a path: move the table to where there is none")
    return Export({output: _csv_text(table)}, lines, coverage_of(calibration, [*FUNCTIONS, *SQUARENESSES]))


def _csv_text(calibration: Calibration) -> str:
    with tempfile.TemporaryDirectory(prefix="stepdiag-") as folder:
        path = Path(folder) / "table.csv"
        calibration.write_csv(path)
        return path.read_text(encoding="utf-8")


def _with_tool(calibration: Calibration, tool: FloatArray) -> Calibration:
    if np.array_equal(tool, calibration.tool):
        return calibration
    return Calibration(**{**parts_of(calibration), "tool": tool})
