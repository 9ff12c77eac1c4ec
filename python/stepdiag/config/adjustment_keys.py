"""The keys of a scenario that say what an adjustment takes for unknown: `[adjustment]`, `[smoothness]`."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from stepdiag.config.key_types import AMPLITUDE, Amplitude, Section, key, tables


def _weighs(choice: str | float) -> str | float:
    if isinstance(choice, str) or 0.0 < choice <= 1e9:
        return choice
    raise ValueError("not positive")


Choice = Annotated[Literal["free", "fixed"] | float, AfterValidator(_weighs)]

_choice = '"free", "fixed" or a positive standard uncertainty'


class AdjustmentKeys(Section):
    """What an adjustment takes each unknown of a line's set-up for."""

    reflector_urad: Choice | None = key(
        _choice, "Tilt (a, b) of the mirror about local x and y; by default free.", None, "free"
    )
    laser_urad: Choice | None = key(
        _choice,
        "Tilt (a, b) of the beam and the sensor's axes; by default free, but 2000 for a layout `multi_beam` whose "
        "`beam_constants_um` are not fixed.",
        None,
        "free",
    )
    distance_constant_mm: Choice | None = key(
        _choice, "What every distance of a line reads too much; by default free.", None, "free"
    )
    beam_constants_um: Choice | None = key(
        _choice, "Layout `multi_beam`: what d2, d3, ... read too much, against d1; by default free.", None, "free"
    )
    psd_zero_mm: Choice | None = key(_choice, "Layout `psd`: what a centred spot reads; by default free.", None, "free")
    lateral_mm: Choice | None = key(
        _choice, "The beam's origin beside its nominal place, along local x and y; by default 1.", None, 1.0
    )
    roll_urad: Choice | None = key(_choice, "Roll of the head about its beam; by default 20000.", None, 20000.0)
    gain: Choice | None = key(
        _choice,
        "Tilts (spots; the beams' offsets) read 1 + gain times themselves; by default 0.01.",
        None,
        0.01,
    )
    drift_um_per_h: Choice | None = key(
        _choice,
        "What distances read too much for every hour since the set-up's first reading; by default fixed. It takes "
        "the column `time_s` of the measurement.",
        None,
        "fixed",
    )


class AdjustmentSection(AdjustmentKeys):
    """What the adjustment takes each unknown of the set-up for. Other methods use nothing of it.

    That is "free", "fixed" at 0, or a number: the standard uncertainty with which it is known to be 0. (Lateral
    offset, roll and gain act on tilts only; "free" is for them 1 m, 1 rad and 1.)
    `[adjustment.LINE]` replaces, for one line, the keys it names. Scale lines take only `distance_constant_mm` and
    `lateral_mm` from here. Of the others they have, unless a table of their own names them, `reflector_urad` (their
    tilts then are not used), `roll_urad`, `gain` and drift fixed and beams with a constant each; their laser stands
    along the axis, and `laser_urad` (by default 500, never "free") says how well: the length reads short as a cosine
    does. So it does on lines without tilts and on measured single axes, with a `laser_urad` of at most 2000."""

    angles: Literal["free", "fixed"] = key(
        '"free" or "fixed"', "Rotations of the machine's axes; fixed: it has none.", "free"
    )
    one_setup_per_line: bool = key(
        "true or false",
        "Head and mirror stay on a line for all of its runs; otherwise each run of a line has a set-up of its own, "
        "which its backward run shares.",
        False,
    )
    reversal: bool = key(
        "true or false", "Where there are backward runs: errors of their own for nodes approached backward.", True
    )
    outlier_probability: Annotated[float, Field(ge=0.0, le=0.5)] = key(
        "a probability from 0 to 0.5",
        "Readings that do not fit are left out at this probability of any false alarm in a run; 0: none is.",
        0.01,
    )
    by_line: dict[str, AdjustmentKeys] = tables("LINE")


class SmoothnessSection(Section):
    """How smooth the adjustment takes the machine's errors for: the standard deviation with which second differences of
    neighbouring nodes are known to be 0.

    Without this section nothing is smoothed. It is for axes whose errors are known to be smooth over a step, and it
    trades an error of fine pitch for noise; docs/method.md shows what it does to both."""

    translation_um: Amplitude = key(AMPLITUDE, "Of positioning errors and straightnesses; 0: not smoothed.", 0.0, 0.5)
    rotation_urad: Amplitude = key(AMPLITUDE, "Of angular errors; 0: not smoothed.", 0.0, 1.0)
    cross_validated: bool = key(
        "true or false",
        "Finds the deviation of each function from the readings, by generalised cross-validation; the two above then "
        "are the smallest that it may find.",
        False,
    )
