"""Figures can be read with any colour vision and in grey, and have the same bytes in every run."""

import subprocess
import sys
import time
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from colorspacious import cspace_convert
from matplotlib.figure import Figure

from stepdiag.style import COLOUR, FORMATS, LINE_STYLES, SERIES, USED_TOGETHER, axis_label, own_style, save, series

VISIONS = {
    "normal": None,
    "deuteranopia": {"name": "sRGB1+CVD", "cvd_type": "deuteranomaly", "severity": 100},
    "protanopia": {"name": "sRGB1+CVD", "cvd_type": "protanomaly", "severity": 100},
}
PAIRS = sorted({pair for names in USED_TOGETHER.values() for pair in combinations(names, 2)})


def rgb(colour: str) -> Any:
    return np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


def distance(one: str, other: str, vision: str) -> float:
    """Distance in CAM02-UCS (a just noticeable difference is about 1) of what a reader sees."""
    seen = [rgb(one), rgb(other)]
    if VISIONS[vision]:
        seen = [np.clip(cspace_convert(colour, VISIONS[vision], "sRGB1"), 0.0, 1.0) for colour in seen]
    a, b = (cspace_convert(colour, "sRGB1", "CAM02-UCS") for colour in seen)
    return float(np.linalg.norm(a - b))


def lightness(colour: str) -> float:
    """L* of CIELAB: what a grey print keeps, 0 to 100."""
    return float(cspace_convert(rgb(colour), "sRGB1", "CIELab")[0])


def contrast_to_white(colour: str) -> float:
    """Contrast ratio of WCAG 2."""
    linear = np.where(rgb(colour) <= 0.04045, rgb(colour) / 12.92, ((rgb(colour) + 0.055) / 1.055) ** 2.4)
    return float(1.05 / (linear @ [0.2126, 0.7152, 0.0722] + 0.05))


@pytest.mark.parametrize("vision", VISIONS)
def test_colours_of_one_figure_are_told_apart(vision: str) -> None:
    # 15: colours of thin lines 1 mm apart are distinguished from about 10 on; two of
    # the seven of Okabe and Ito have 14 for protanopia.
    for one, other in PAIRS:
        assert distance(COLOUR[one], COLOUR[other], vision) > 15.0, (one, other)
    for one, other in combinations(SERIES, 2):
        assert distance(one, other, vision) > 15.0, (one, other)


def test_colours_of_one_figure_are_told_apart_in_grey() -> None:
    # A difference of 7 of 100 in lightness is seen between lines on white paper; what looks alike has another name.
    for one, other in PAIRS:
        assert abs(lightness(COLOUR[one]) - lightness(COLOUR[other])) > 7.0, (one, other)
    shades = [lightness(colour) for colour in SERIES]
    assert np.diff(shades).min() > 6.0, "groups become lighter in their order"


def test_colours_stand_out_from_white() -> None:
    # 3: what WCAG 2.1, 1.4.11, requires of graphics. Members of a series are edged areas or lines with markers.
    for name, colour in COLOUR.items():
        assert contrast_to_white(colour) >= 3.0, name
    for colour in SERIES:
        assert contrast_to_white(colour) >= 1.6, colour
    for vision in VISIONS:
        assert min(distance(colour, "#FFFFFF", vision) for colour in (*COLOUR.values(), *SERIES)) > 25.0


def test_known_distances_are_computed_as_known() -> None:
    """The measure itself: red and green of equal lightness are far apart, and near for who has no M cones."""
    red, green = "#C44E52", "#5E8C31"
    assert distance(red, green, "normal") > 2.5 * distance(red, green, "deuteranopia")
    assert contrast_to_white("#000000") == pytest.approx(21.0, abs=1e-9)
    assert lightness("#FFFFFF") == pytest.approx(100.0, abs=0.01)  # white point of sRGB is rounded


def test_every_name_used_together_has_a_colour() -> None:
    assert {name for names in USED_TOGETHER.values() for name in names} <= COLOUR.keys()


def test_series_repeats_colours_with_another_line_style() -> None:
    seen = [series(k) for k in range(len(SERIES) * len(LINE_STYLES))]
    assert len(set(seen)) == len(seen)


def drawn() -> Figure:
    figure = Figure(figsize=(3.0, 2.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], label="µ")
    axes.fill_between([0.0, 1.0], [0.0, 0.5], [1.0, 1.0], alpha=0.2, hatch="//")
    axes.set_xlabel(axis_label("position", "mm"))
    axes.legend()
    return figure


@pytest.mark.parametrize("suffix", FORMATS)
def test_same_figure_gives_the_same_bytes(suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def content() -> bytes:
        with own_style():
            return save(drawn(), suffix)

    first = content()
    later = time.time() + 1e6
    monkeypatch.setattr(time, "time", lambda: later)  # files that state a time differ
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    assert content() == first
    for mark in (b"Matplotlib v", b"CreationDate", b"matplotlib.org"):
        assert mark not in first


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FORMATS)
def test_same_bytes_in_another_process(suffix: str) -> None:
    """Hash seeds differ between processes."""
    text = (
        "import sys; from stepdiag.style import *; from matplotlib.figure import Figure\n"
        "with own_style():\n f = Figure(); a = f.subplots(); a.plot([0, 1], label='a'); a.legend()\n"
        " sys.stdout.buffer.write(save(f, sys.argv[1]))"
    )
    runs = [
        subprocess.run([sys.executable, "-c", text, suffix], check=True, capture_output=True).stdout for _ in range(2)
    ]
    assert runs[0] == runs[1]
    assert len(runs[0]) > 1000


def test_labels_have_units_in_parentheses() -> None:
    assert axis_label("position", "mm") == "position (mm)"
    assert axis_label("share", "") == "share"


def test_palette_needs_no_matplotlib() -> None:
    text = "import sys, stepdiag.style; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", text], check=True)
