"""New machine: five questions, and a scenario with which it can be planned and measured."""

from typing import Final

from starlette.responses import HTMLResponse

from stepdiag.app.frame import page
from stepdiag.presentation.page.html import Markup, element, markup

# Chain -> what a person sees.
CHAINS: Final = {
    "[w X' b Y Z t]": "The table moves in X; the spindle in Y and Z",
    "[w Y' b X Z t]": "The table moves in Y; the spindle in X and Z",
    "[w X' Y' b Z t]": "The table moves in X on a saddle that moves in Y; the spindle in Z",
    "[w Y' X' b Z t]": "The table moves in Y on a saddle that moves in X; the spindle in Z",
    "[w b X Y Z t]": "The table stands still; a gantry moves in X and carries Y, which carries Z",
    "[w b Y X Z t]": "The table stands still; a gantry moves in Y and carries X, which carries Z",
}
HEADS: Final = {
    "": "Distance and two tilts, as numbers (layout ideal)",
    "three_beams": "Three parallel beams",
    "beam_and_psd": "One beam and a position sensing device",
    "beam_and_camera": "One beam and a camera",
}


def new_machine_screen() -> HTMLResponse:
    travels = [
        _number(f"travel_{axis}", f"Travel of {axis.upper()}, mm", value)
        for axis, value in zip("xyz", (800, 600, 500), strict=True)
    ]
    chains = [
        _choice("chain", chain, words, _chain_figure(chain), chosen=k == 0)
        for k, (chain, words) in enumerate(CHAINS.items())
    ]
    heads = [_choice("head", head, words, None, chosen=not head) for head, words in HEADS.items()]
    form = element(
        "form",
        _question(
            "Which machine?",
            "The name is that of its folder in the book. The rest stands on its reports.",
            _text("name", "Name", required=True, maxlength=80),
            _text("title", "Maker and type"),
            _text("serial_number", "Serial number"),
            _text("customer", "Customer"),
        ),
        _question(
            "1. How far does it travel?", "The volume that is measured. 800, 600 and 500 mm are examples.", *travels
        ),
        _question(
            "2. Which axis carries what?",
            "Between workpiece and bed stand the axes that move the table, between bed and tool those that move the "
            "spindle.",
            *chains,
            class_="wide",
        ),
        _question(
            "3. Which laser head?",
            "A shipped description can be changed later in the scenario.",
            *heads,
            class_="wide",
        ),
        _question(
            "4. When is it good enough?",
            "The largest error of the tool anywhere in the volume, and how long a calibration may last. Without a "
            "limit there is no verdict on the machine; without an interval it is due when the trend says so.",
            _number("limit", "Limit, µm", None),
            _number("interval", "Days between two calibrations", None),
        ),
        _question(
            "5. How well does the head read?",
            "Standard deviations of a single reading, from the data sheet of the head. 0.1 µm and 1 µrad are those "
            "of a good interferometer in a quiet shop.",
            _number("distance_noise", "Distance, µm", 0.1),
            _number("tilt_noise", "Tilts, µrad", 1.0),
        ),
        element("p", element("button", "Add the machine", class_="main")),
        method="post",
        action="/machines",
    )
    return page(
        "New machine",
        form,
        command=("book", "new", "NAME", "--volume", "800,600,500", "--chain", "[w X' b Y Z t]"),
        path=[("/new", "New machine")],
    )


def _question(title: str, why: str, *fields: Markup, class_: str = "") -> Markup:
    return element(
        "fieldset",
        element("legend", title),
        element("p", why, class_="quiet"),
        element("div", *fields, class_=f"fields {class_}".strip()),
    )


def _text(name: str, label: str, **attributes: object) -> Markup:
    return element("p", element("label", label, for_=name), element("input", id=name, name=name, **attributes))


def _number(name: str, label: str, value: float | None) -> Markup:
    return _text(name, label, type="number", min="0", step="any", value="" if value is None else f"{value:g}")


def _choice(name: str, value: str, words: str, figure: Markup | None, *, chosen: bool) -> Markup:
    identifier = f"{name}-{value}".replace(" ", "").replace("'", "").strip("[]-") or name
    box = element("input", type="radio", id=identifier, name=name, value=value, checked=chosen)
    return element("p", box, element("label", words, figure, for_=identifier), class_="choice")


def _chain_figure(chain: str) -> Markup:
    """The links of a chain from the workpiece to the tool, those of the table and of the spindle apart."""
    names = {"w": "workpiece", "b": "bed", "t": "tool"}
    parts, x = [], 2.0
    before = True
    for link in chain.strip("[]").split():
        words = names.get(link, link.removesuffix("'"))
        width = 16.0 + 8.0 * len(words)
        before = before and link != "b"
        look = "fixed" if link == "b" else "table" if before else "spindle"
        if x > 2.0:
            parts.append(element("line", x1=f"{x - 10.0:g}", x2=f"{x:g}", y1="16", y2="16"))
        parts.append(element("rect", x=f"{x:g}", y="3", width=f"{width:g}", height="26", rx="4", class_=look))
        parts.append(element("text", words, x=f"{x + width / 2.0:g}", y="21", text_anchor="middle"))
        x += width + 10.0
    return markup(
        element("svg", *parts, viewBox=f"0 0 {x:g} 32", width=f"{x:g}", height="32", class_="chain", aria_hidden="true")
    )
