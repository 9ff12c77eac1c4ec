"""Common style of all figures: colours by meaning, labels with units, files with the same bytes in every run.

Every colour has a name by what it means. The sets in USED_TOGETHER appear in one figure; a test
simulates red-green colour blindness and grey prints for them. Where a set has more members, line
styles and markers distinguish them as well. Importing this module does not import matplotlib.
"""

import io
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DARK_BLUE: Final = "#0B3C91"
_VERMILLION: Final = "#D4401C"
_TEAL: Final = "#1F9FA6"
_BLACK: Final = "#000000"
_GREY: Final = "#8C8C8C"

# By meaning; all have a contrast of at least 3 to white.
COLOUR: Final[Mapping[str, str]] = {
    "X": _DARK_BLUE,
    "Y": _VERMILLION,
    "Z": _TEAL,
    "truth": _BLACK,
    "adjustment": _DARK_BLUE,
    "enhanced": _VERMILLION,
    "conventional": _TEAL,
    "accepted": "#006680",
    "doubtful": "#C08A00",
    "rejected": "#8E0B1E",
    "unchecked": "#787878",
    "before": _GREY,
    "after": _DARK_BLUE,
    "forward": _DARK_BLUE,
    "backward": _TEAL,
    "outlier": _VERMILLION,
    "slip": _BLACK,
    "significant": _BLACK,
    "limit": "#666666",
}
# Groups without a meaning of their own, such as parts of a budget. They become lighter in this order.
SERIES: Final = ("#3F0F52", "#2450C4", "#D63A5E", "#2C9A8C", "#6DB3EC", "#F0BE28")
LINE_STYLES: Final = ("-", (0, (4, 1.6)), (0, (1, 1.4)))  # of the first SERIES, of its repetition, ...
BAND: Final = 0.22  # opacity of an uncertainty band

USED_TOGETHER: Final[Mapping[str, tuple[str, ...]]] = {
    "axes": ("X", "Y", "Z", "truth"),
    "methods": ("truth", "adjustment", "enhanced", "conventional"),
    "verdicts": ("accepted", "doubtful", "rejected", "unchecked"),
    "change": ("before", "after", "outlier"),
    "comparison": ("X", "Y", "Z", "significant"),
    "readings": ("forward", "backward", "outlier", "slip"),
}

STYLE: Final[Any] = {
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # fixed: finding a place for each title takes a third of the time
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "pdf.fonttype": 42,  # text that can be searched and copied
    "svg.hashsalt": "stepdiag",  # same names inside the file in every run
}

# Metadata that would differ from run to run or from version to version.
_UNWANTED: Final = {"svg": ("Date", "Creator"), "pdf": ("CreationDate", "Creator", "Producer")}
FORMATS: Final = ("png", *_UNWANTED)
DPI: Final = 160
MADE_BY: Final = "stepdiag"  # in the metadata of our PNG files


def series(number: int) -> tuple[str, Any]:
    """Colour and line style of a member of a series, counted from 0."""
    return SERIES[number % len(SERIES)], LINE_STYLES[number // len(SERIES) % len(LINE_STYLES)]


def axis_label(quantity: str, unit: str) -> str:
    """Text beside an axis: "position (mm)"; without a unit the quantity alone."""
    return f"{quantity} ({unit})" if unit else quantity


def plain(text: str) -> str:
    """A text from a file, with its dollar signs escaped: matplotlib reads formulas between them."""
    return text.replace("$", r"\$")


_drawing: list[Callable[..., "Figure"]] = []


def draw_values_with(draw: Callable[..., "Figure"]) -> None:
    """Set the function behind `plot()` of results; the rooms that define them do not import figures."""
    _drawing[:] = [draw]


def drawn(value: Any, **options: Any) -> "Figure":
    """The figure of a result."""
    return _drawing[0](value, **options)


@contextmanager
def own_style() -> Iterator[None]:
    """Use stepdiag's style instead of the user's for what is drawn inside the block."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def save(figure: "Figure", suffix: str) -> bytes:
    """The content of a file of this figure, in one of FORMATS ("png", "svg", "pdf").

    Call it inside `own_style()`. Equal figures give the same bytes."""
    buffer = io.BytesIO()
    if suffix == "png":
        figure.savefig(buffer, format="rgba", dpi=DPI)
        width, height = (int(DPI * inches) for inches in figure.get_size_inches())
        return _png(buffer.getvalue(), (width, height))
    figure.savefig(buffer, format=suffix, metadata=dict.fromkeys(_UNWANTED[suffix]))
    return buffer.getvalue()


def _png(pixels: bytes, size: tuple[int, int]) -> bytes:
    """A picture of 256 colours, which has a third of the size and looks the same.

    No pixel changes by more than about 10 of 255; other methods of choice lose rare colours."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    picture = Image.frombytes("RGBA", size, pixels).convert("RGB")
    picture = picture.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    text = PngInfo()
    text.add_text("Software", MADE_BY)
    buffer = io.BytesIO()
    # Level 9 makes the file a tenth smaller, and takes seven times as long: a tenth of the whole command.
    picture.save(buffer, "PNG", compress_level=6, dpi=(DPI, DPI), pnginfo=text)
    return buffer.getvalue()
