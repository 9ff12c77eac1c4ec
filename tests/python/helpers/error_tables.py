"""Texts of error maps, which need no checksum, for the tests of the compensator: random ones of every kind, and edits
of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from usual import CHAIN, VOLUME

COLUMNS = "parameter,position_mm,value,unit,standard_uncertainty"
NAMES = [f"E{component}{axis}" for axis in "XYZ" for component in "XYZABC"]
SQUARENESSES = ["C0Y", "B0Z", "A0Z"]
TOOL = (12.5, -30.0, 80.0)


@dataclass(frozen=True)
class RandomTable:
    """Nodes of its own for each function: not equidistant, some beyond the travel, some short of its ends."""

    seed: int
    chain: str = CHAIN
    volume: tuple[float, float, float] = VOLUME
    tool: tuple[float, float, float] = TOOL
    translation_um: float = 40.0
    rotation_urad: float = 15.0
    directed: bool = False

    def text(self) -> str:
        random = np.random.default_rng(self.seed)
        lines = [*leading_lines(self.chain, self.volume, self.tool), COLUMNS + (",direction" if self.directed else "")]
        for name in NAMES:
            size = self.translation_um if name[1] in "XYZ" else self.rotation_urad
            unit = "um" if name[1] in "XYZ" else "urad"
            for direction in "+-" if self.directed and random.uniform() < 0.5 else [""]:
                for p in self.nodes(random, self.volume["XYZ".index(name[2])]):
                    row = f"{name},{p},{random.uniform(-size, size)},{unit},"
                    lines.append(row + (f",{direction}" if self.directed else ""))
        for name in SQUARENESSES:
            value = random.uniform(-self.rotation_urad, self.rotation_urad)
            lines.append(f"{name},,{value},urad," + ("," if self.directed else ""))
        return "\n".join(lines) + "\n"

    @staticmethod
    def nodes(random: np.random.Generator, edge: float) -> list[float]:
        # At least 7.5 mm apart: with the amplitudes above, errors change by less than the compensator's 0.1 mm/mm.
        low, high = random.choice([0.0, 0.0, -20.0, 0.2 * edge]), random.choice([edge, edge, edge + 15.0, 0.8 * edge])
        inner = random.choice(np.arange(1, 40), int(random.integers(0, 15)), replace=False)
        return [float(low + (high - low) * k / 40.0) for k in sorted([0, *inner, 40])]


def leading_lines(chain: str, volume: tuple[float, ...], tool: tuple[float, ...]) -> list[str]:
    return [
        "# format=stepdiag error map 1",
        f"# chain={chain}",
        "# volume_mm=" + " ".join(map(str, volume)),
        "# tool_mm=" + " ".join(map(str, tool)),
    ]
