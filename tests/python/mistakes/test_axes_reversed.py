"""Lines with the names of their mirror images are named as such."""

import numpy as np
import pytest
from mistaken import NOISE, described, set_ups

import stepdiag as sd

STEPS = 6
OPPOSITE = str.maketrans("pn", "np")


def image(line: str, axes: str) -> str:
    return "".join(sign.translate(OPPOSITE) if axis in axes else sign for axis, sign in zip("XYZ", line, strict=True))


def mirrored(head: str, axes: str, *, scale_lines: bool) -> sd.Measurement:
    """What was measured as the images of the lines, and has their names."""
    scenario = described(head, steps=STEPS)
    known = scenario.known
    plan = known.plan
    real = {line: image(line, axes) for line in plan.lines}
    real |= {line: image(line, axes) if scale_lines else line for line in plan.scale_lines}
    stated = {name: line for line, name in real.items()}
    drawn = set_ups(known.head.layout, list(real), seed=4)
    run = sd.simulate(
        sd.Machine(known.chain, sd.random_error_map(plan.volume, seed=4, intervals=STEPS)),
        sd.Plan(
            plan.volume,
            [real[line] for line in plan.lines],
            STEPS,
            scale_lines=[real[line] for line in plan.scale_lines],
        ),
        known.head,
        misalignment={real[line]: own for line, own in drawn.items()},
        noise=sd.Noise(seed=4, **NOISE),
    )
    lines = [stated[line] for line in run.line]
    position = np.array([plan.points(line)[point] for line, point in zip(lines, run.point, strict=True)])
    return sd.Measurement(lines, run.point.tolist(), position, dict(run.channels))


@pytest.mark.slow
@pytest.mark.parametrize("scale_lines", [False, True])
@pytest.mark.parametrize("axes", ["X", "Y", "Z", "XY", "XZ", "YZ", "XYZ"])
@pytest.mark.parametrize("head", ["ideal", "psd", "multi_beam"])
def test_axes_that_run_the_other_way_reject_the_run_and_are_named(head: str, axes: str, scale_lines: bool) -> None:
    judged = sd.judge(described(head, steps=STEPS), mirrored(head, axes, scale_lines=scale_lines))
    assert judged.fit == "rejected"
    assert judged.reasons[0].startswith("a mistake explains the readings: ")
    said = " and ".join(", ".join(axes).rsplit(", ", 1))
    which = "scale lines too" if scale_lines else "scale lines not"
    assert any(f"as if {said} ran the other way ({which})" in found.text for found in judged.mistakes)
