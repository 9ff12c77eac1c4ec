"""New scenarios: a short one, and one with a comment on every key, made from the scenario's keys."""

import textwrap
from collections.abc import Mapping
from typing import Any, Final

from pydantic.fields import FieldInfo

from stepdiag.config.key_errors import expectation
from stepdiag.config.key_reference import Part, keys, paragraphs, sections, show_full
from stepdiag.config.scenario_keys import ScenarioKeys

# The plan of a new scenario: the best one for 45 minutes that `stepdiag plan` finds for it (a test searches).
PLAN: Final = {
    ("plan", "lines"): ("ppp", "npp", "pnp", "nnp", "pp0"),
    ("plan", "steps"): 10,
    ("plan", "scale_lines"): ("p00", "0p0", "00p"),
    ("plan", "scale_points"): "steps",
    ("plan", "repeats"): 2,
}
WHY: Final = (
    "The best plan for 45 minutes with nodes 80 mm apart (`stepdiag plan scenario.toml --minutes 45`), by noise alone "
    "of 0.1 µm and 1 µrad: it takes 42.1 minutes, the functional point has u of at most 0.9 µm in the volume, and "
    "all kinds of faults of readings are distinguished. Once, without pp0 and with scale lines read at their ends: "
    "27.8 minutes, 1.52 µm, and a wrong distance is not distinguished from its twin."
)


# Of the short one: what its values are, in a few words.
_WORDS: Final = {
    "volume": "travels to measure; home is the corner (0, 0, 0)",
    "plan": "stepdiag plan FILE --minutes N looks for the best one for your machine and your time",
    "noise": "standard deviations of the instrument's readings",
    ("machine", "chain"): "from workpiece w over bed b to tool t; a prime marks the axes before b",
    ("machine", "tool_mm"): "from the tool's origin to the centre of the mirror",
    ("plan", "steps"): "per axis on each line",
    ("plan", "scale_lines"): "along one axis, with the laser aligned to it",
    ("plan", "scale_points"): 'read after every step, or at "ends"',
    ("plan", "repeats"): "runs of each line",
    (
        "head",
        "layout",
    ): '"ideal": distance and two tilts; "psd": distance and spot; "multi_beam": three or more distances',
    ("head", "psd_distance_mm"): "from reference plane to position sensing device",
    ("head", "beam_offsets_mm"): "(u, v) of each beam in the reference plane",
    ("head", "description"): "its optics",
}
# What a new scenario states where nobody says anything else, in the order of the file; None: only if it is said.
_SHORT: Final[Mapping[tuple[str, str], Any]] = {
    ("volume", "x_mm"): 800.0,
    ("volume", "y_mm"): 600.0,
    ("volume", "z_mm"): 500.0,
    ("machine", "chain"): "[w X' b Y Z t]",
    ("machine", "tool_mm"): (0.0, 0.0, 0.0),
    **PLAN,
    ("head", "layout"): "ideal",
    ("head", "psd_distance_mm"): None,
    ("head", "beam_offsets_mm"): None,
    ("head", "description"): None,
    ("noise", "distance_um"): None,
    ("noise", "tilt_urad"): None,
}
# What a layout needs beside its name.
LAYOUTS: Final[Mapping[str, dict[tuple[str, str], Any]]] = {
    "ideal": {},
    "psd": {("head", "psd_distance_mm"): 50.0},
    "multi_beam": {("head", "beam_offsets_mm"): [[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]]},
}


def short_template(head: str | None = None, values: Mapping[tuple[str, str], Any] | None = None) -> str:
    """A scenario of the keys that everybody needs. head: a description, in place of a layout. values: of keys, by
    section and name."""
    of_head = {("head", "layout"): None, ("head", "description"): head} if head is not None else {}
    given = {**_SHORT, **of_head, **(values or {})}
    lines = [
        "# A scenario for stepdiag: machine, plan and head. The end of a key is its unit.",
        "# There are more keys: docs/scenario.md; stepdiag init --all-keys writes all of them, with comments.",
    ]
    section = ""
    for (of, name), value in given.items():
        if value is None:
            continue
        if of != section:
            section = of
            lines += ["", f"[{section}]" + _behind(section)]
        lines.append(f"{name} = {show_full(value)}" + _behind((of, name)))
    return "\n".join(lines) + "\n"


def _behind(key: str | tuple[str, str]) -> str:
    words = _WORDS.get(key)
    return "" if words is None else f"  # {words}"


def template(head: str | None = None, values: Mapping[tuple[str, str], Any] | None = None) -> str:
    """A complete scenario with a comment on every key; optional keys are commented out.

    head: a description. values: of keys, by section and name, in place of the examples."""
    stated = dict(values or {})
    given = PLAN | ({("head", "layout"): None, ("head", "description"): head} if head else {}) | stated
    offered = {*PLAN, ("head", "description" if head else "layout"), *stated}
    lines = [
        "# A scenario for stepdiag: machine, plan and head. The end of a key is its unit.",
        "",
    ]
    for name, field in keys(ScenarioKeys):
        lines += [*_comment(field.description or ""), f"{name} = {show_full(field.default)}", ""]
    for part in sections(ScenarioKeys):
        active = (part.required and "." not in part.title) or any(section == part.title for section, _ in stated)
        is_own = not any(
            section in ("volume", "plan") for section, _ in stated
        )  # another machine has another best plan
        why = _comment(WHY) if part.title == "plan" and is_own else []
        lines += [*_comment(paragraphs(part.model)), *why, f"{'' if active else '# '}[{_named(part)}]"]
        for name, field in keys(part.model):
            place = (part.title, name)
            is_given = (active and field.is_required()) or place in offered
            lines += _comment(f"{field.description} Expected: {expectation(field)}.")
            value = given.get(place) or _example(field)
            lines.append(f"{'' if is_given else '# '}{name} = {show_full(value)}")
        lines.append("")
    return "\n".join(lines)


def _named(part: Part) -> str:
    return part.title.replace("LINE", "ppp").replace("COMPONENT", "window")


def _example(field: FieldInfo) -> Any:
    extra = field.json_schema_extra
    example = extra.get("example") if isinstance(extra, dict) else None
    return field.default if example is None else example


def _comment(text: str) -> list[str]:
    plain = text.replace("**", "").replace("`", "")
    return [f"# {line}" for paragraph in plain.split("\n\n") for line in textwrap.wrap(paragraph, 110)]
