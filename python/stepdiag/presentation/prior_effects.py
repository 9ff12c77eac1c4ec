"""What angles and drifts that only priors know may do to a result, in words."""

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Final

import numpy as np

from stepdiag._core import Measurement, RoundedChannel
from stepdiag.scenario.adjustment import scale_line_angle
from stepdiag.scenario.known import Known
from stepdiag.setup_quantities import SETUP_QUANTITIES
from stepdiag.units import HOUR, MICRO, MICROMETRE, UNITS, report_value

FOURFOLD: Final = 4.0  # a machine that has not warmed up, against the default
SQUARENESS_OF: Final[Mapping[str, str]] = {"XY": "C0Y", "XZ": "B0Z", "YZ": "A0Z"}


def rounding_rows(rounded: Iterable[RoundedChannel]) -> Iterator[str]:
    """Channels that were stated to be better known than their numbers, or double precision, can bear."""
    for channel in rounded:
        native = "rad" if channel.channel in ("alpha", "beta") else "mm"
        stated, unit = report_value(native, channel.stated)
        used, step = (report_value(native, value)[0] for value in (channel.used, channel.step))
        because = {
            "doubles": "the readings are rounded as double-precision numbers",
            "decimals": f"the readings have decimals of {step:g} {unit}",
            "weights": "the tilts or the laser are known so much worse that double precision cannot weigh both",
        }[channel.cause]
        yield f"{channel.channel}: {stated:.3g} {unit} is stated, {used:.3g} {unit} is used: {because}"


def cosine_rows(measurement: Measurement, known: Known) -> Iterator[str]:
    """What angles that no reading determines may do to lengths."""
    if known.signals == ("distance",):
        yield (
            "lines without tilts: a laser at an angle to its line reads wrong by the square of it; laser_urad in "
            "[adjustment] says how well it stands (2000 if it is free), and that is in the uncertainties"
        )
    keys = known.keys.adjustment
    lines: dict[tuple[bool, float, float], list[str]] = {}
    for line in known.plan.scale_lines:
        is_known = _tilts_determine(measurement, known, line)
        laser = scale_line_angle(keys, line, "laser")
        mirror = scale_line_angle(keys, line, "reflector", is_known=is_known)
        if not is_known and mirror == 0.0:
            is_known, mirror = True, math.inf  # tied to the beam
        if mirror > 0.0 and (laser > 0.0 or not is_known):
            lines.setdefault((is_known, laser, mirror), []).append(line)
    for (is_known, laser, mirror), names in lines.items():
        which = f"scale lines {', '.join(names)}: "
        if not is_known:
            # D^2 - D l - l^2/2 of two directions.
            mean = 2.0 * mirror**2 - laser**2
            yield (
                f"{which}the readings do not determine the angle of the mirror to the beam, taken to be known to "
                f"{mirror * MICRO:g} µrad (reflector_urad), and the laser along the axis to {laser * MICRO:g} µrad: "
                f"they read {abs(mean) * MICRO:.2g} µm/m too {'long' if mean > 0.0 else 'short'} on average; that is "
                "in the uncertainties, not corrected"
            )
            continue
        # (a^2 + b^2)/2 of two normal angles, of this variance each once a tilt determines their difference.
        short = 1.0 / (laser**-2 + mirror**-2)
        known_of_mirror = f", the mirror square to it to {mirror * MICRO:g} µrad; beyond what their tilts show it reads"
        yield (
            f"{which}a laser that stands along the axis to {laser * MICRO:g} µrad"
            f"{known_of_mirror if math.isfinite(mirror) else ' reads'} too short, never too long, by "
            f"{short * MICRO:.2g} µm/m on average; that is in the uncertainties, not corrected"
        )


def _tilts_determine(measurement: Measurement, known: Known, line: str) -> bool:
    """Whether reflector less laser is known on a line."""
    if known.head.layout == "multi_beam":
        keys = known.keys.adjustment
        own = keys.by_line[line].beam_constants_um if line in keys.by_line else None
        return (own or keys.beam_constants_um) == "fixed"
    rows = np.array(measurement.line) == line
    tilts = [value for name, value in measurement.channels.items() if name in ("alpha", "beta", "spot_x", "spot_y")]
    return any(bool(np.isfinite(tilt[rows]).any()) for tilt in tilts)


def drift_rows(measurement: Measurement, known: Known) -> Iterator[str]:
    """What a drift of the distances does to squarenesses, or would do."""
    if "backward" in measurement.direction:
        return  # there and back again a drift shows
    time = measurement.channels.get("time")
    is_timed = time is not None and bool(np.isfinite(time).all())
    choice = known.keys.adjustment.drift_um_per_h
    usual = SETUP_QUANTITIES["drift"].prior / UNITS["um_per_h"].native
    pace = usual if choice is None or isinstance(choice, str) else choice
    effects = {name: pace * u for name, u in _squareness_by_drift(measurement, known).items()}
    if not effects or choice == "free":
        return
    worst = max(effects, key=lambda name: effects[name])
    size = f"about {effects[worst] * MICRO:.2g} µrad of {worst}"
    if is_timed and choice != "fixed":
        yield (
            f"drift: squarenesses assume that the distances of a line drift by at most {pace:g} µm/h (1 sigma, "
            f"drift_um_per_h); that is {size}, in the uncertainties; {FOURFOLD * pace:g} µm/h would be "
            f"{FOURFOLD * effects[worst] * MICRO:.2g} µrad, and single runs hardly show it"
        )
    else:
        yield f"drift: not in the uncertainties; {pace:g} µm/h of each line's distances would be {size}"


def _squareness_by_drift(measurement: Measurement, known: Known) -> dict[str, float]:
    """By squareness: rad for a drift of 1 µm/h, a standard uncertainty of each line by itself.

    A squareness changes the length of a line that moves both axes, edges A and B, by A B/length of it."""
    edges = dict(zip("XYZ", known.plan.volume, strict=True))
    weight = dict.fromkeys(SQUARENESS_OF.values(), 0.0)
    for line in known.plan.lines:
        moved = [axis for axis, sign in zip("XYZ", line, strict=True) if sign != "0"]
        drifted = _duration(measurement, known, line) / HOUR * MICROMETRE
        for pair in combinations(moved, 2):
            if drifted > 0.0:
                seen = edges[pair[0]] * edges[pair[1]] / math.hypot(*(edges[axis] for axis in moved))
                weight[SQUARENESS_OF["".join(pair)]] += (seen / drifted) ** 2
    return {name: w**-0.5 for name, w in weight.items() if w > 0.0}


def _duration(measurement: Measurement, known: Known, line: str) -> float:
    """Of one run of a line, s; 0 where it is not known."""
    rows = (np.array(measurement.line) == line) & (measurement.run == 0)
    time = measurement.channels.get("time")
    if not rows.any():
        return 0.0
    if time is not None and bool(np.isfinite(time[rows]).all()):
        return float(np.ptp(time[rows]))
    return (known.keys.plan.seconds_per_reading or 0.0) * (int(rows.sum()) - 1)
