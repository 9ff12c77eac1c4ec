"""A program that shows, before anything is cut, that a table helps and does not double the error.

It goes to and fro between two places of one line, three times, each place approached in + direction, and stops there.
A person reads an instrument, first with the compensation off, then with it on: along the axis that moves a laser or a
length bar, across it a dial gauge on a straightedge or square. What the reading changes by from place to place changes
with the table; of the straightedge nothing is left in the difference. With the wrong sign the change is the opposite.
The line is the one through the middle of the volume on which the table moves an axis most.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, InvalidArgument, Machine
from stepdiag.exporting.common import compensated_map, origin_of, tool_of, words
from stepdiag.exporting.left_in_volume import Motors
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export
from stepdiag.parameters import AXES
from stepdiag.program.gcode import Dialect, Writer

FloatArray = npt.NDArray[np.float64]
MARGIN: Final = 0.05  # of an edge, so that both places can be approached in + direction within the volume
SMALLEST: Final = 2e-3  # mm; a dial gauge shows no less
CYCLES: Final = 3
FEED: Final = 1000.0  # mm/min
DIALECTS: Final[dict[str, Dialect]] = {"linuxcnc": "linuxcnc", "siemens": "siemens", "heidenhain": "heidenhain"}


@dataclass(frozen=True)
class Proof:
    """Two places of one line, mm from home, and what an instrument shows from the first to the second, mm: the error of
    `axis`, actual - commanded, without the table, with it, and with its sign turned."""

    axis: str
    along: str
    places: tuple[FloatArray, FloatArray]
    without: float
    with_it: float
    turned: float

    def sentences(self) -> list[str]:
        first, second = (words(place) for place in self.places)
        what = (
            f"laser or length bar along {self.along}"
            if self.axis == self.along
            else f"dial gauge in {self.axis} on a straightedge or square along {self.along}"
        )
        return [
            f"proof of the sign: {what}; zero it at {first} mm from home, read it at {second} mm",
            f"expected, error of {self.axis}, actual - commanded: {_micrometres(self.without)} without the table, "
            f"{_micrometres(self.with_it)} with it; with the wrong sign {_micrometres(self.turned)}",
            f"so the reading must change by {_micrometres(self.with_it - self.without)} when the table is switched on; "
            f"if it changes by {_micrometres(self.turned - self.without)}, the sign is wrong: take the table away",
        ]


def proof_of(calibration: Calibration, done: Export, options: ExportOptions) -> Proof:
    """The line on which the table shows most. Raises InvalidArgument if it moves no axis by what a gauge shows."""
    tool = tool_of(calibration, options)
    machine = Machine(calibration.chain, compensated_map(calibration, options.approach or "positive"), tool)

    def exact(commanded: FloatArray, _: int) -> FloatArray:
        sent = commanded.copy()
        for _ in range(3):
            sent = commanded - machine.error(sent)
        return sent

    motors: Motors = done.motors or exact
    best: Proof | None = None
    for by, letter in enumerate(AXES):
        places = np.tile(calibration.volume / 2.0, (46, 1))
        places[:, by] = np.linspace(2.0 * MARGIN, 1.0, 46) * calibration.volume[by]
        sent = motors(places, 0)
        moved, error, left = sent - places, machine.error(places), sent + machine.error(sent) - places
        back = 2.0 * places - sent
        turned = back + machine.error(back) - places
        for axis, name in enumerate(AXES):
            k = int(np.argmax(np.abs(moved[:, axis] - moved[0, axis])))
            without, with_it, wrong = (float(one[k, axis] - one[0, axis]) for one in (error, left, turned))
            if best is None or abs(with_it - without) > abs(best.with_it - best.without):
                best = Proof(name, letter, (places[0], places[k]), without, with_it, wrong)
    assert best is not None
    if abs(best.with_it - best.without) < SMALLEST:
        raise InvalidArgument(
            f"`proof`: this table moves no axis by more than {_micrometres(abs(best.with_it - best.without))} on lines "
            "through the middle of the volume: no dial gauge shows that"
        )
    return best


def proof_program(calibration: Calibration, done: Export, options: ExportOptions, maker: str) -> tuple[str, list[str]]:
    """The program in the words of this maker's controllers, and what to expect, in sentences."""
    proof = proof_of(calibration, done, options)
    dialect = DIALECTS.get(maker, "iso")
    writer = Writer(dialect, 4, "G53" if dialect in ("linuxcnc", "heidenhain") else "G54")
    origin, by = origin_of(options), AXES.index(proof.along)
    lines = [
        line for text in ["Measuring program to prove a sign", *proof.sentences()] for line in writer.comment(text)
    ]
    lines += writer.comment("first all of it with the compensation off, then all of it with the compensation on")
    lines += writer.comment(
        f"positions are the controller's, with home at {words(origin)} mm; {writer.coordinates} must displace nothing"
    )
    lines += writer.modes(FEED)
    lines += writer.stop("drive near place 1 by hand: all moves are straight, and know of nothing in their way")
    for cycle in range(1, CYCLES + 1):
        for number, place in enumerate(proof.places, 1):
            before = place.copy()
            before[by] -= MARGIN * calibration.volume[by]
            lines += [writer.move(_of(before + origin), FEED), writer.move(_of(place + origin), FEED)]
            what = "zero the instrument" if (cycle, number) == (1, 1) else "write the reading down"
            lines += writer.stop(f"place {number}, cycle {cycle}: {what}")
    return "\n".join(writer.whole(lines, line_numbers=False)) + "\n", proof.sentences()


def _of(place: FloatArray) -> dict[str, float]:
    return dict(zip(AXES, place.tolist(), strict=True))


def _micrometres(value: float) -> str:
    return f"{value * 1e3:+.1f} µm"
