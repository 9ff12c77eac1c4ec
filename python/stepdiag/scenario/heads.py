"""The heads of a scenario: which there are, and which of them measures which line."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import expectation, show, suggest
from stepdiag.config.scenario_head_keys import DESCRIPTION_KEYS, LAYOUT_KEYS, HeadKeys, PoseErrorKeys
from stepdiag.config.scenario_keys import ScenarioKeys
from stepdiag.config.toml_text import located
from stepdiag.head.description import components, find_head, read_head_design
from stepdiag.units import MICRORADIAN

Shift = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class DescribedHead:
    """One head as its keys say, those of [head] included. `place` is where they stand: head, head.left."""

    place: str
    keys: HeadKeys
    design: _core.HeadDesign | None

    def nominal(self) -> _core.Head:
        """The head as designed: what an evaluation knows of it."""
        return self._make({})

    def actual(self) -> _core.Head:
        """With its components out of their places: what a run is simulated with."""
        return self._make({name: _pose_error(error) for name, error in self.keys.pose_errors.items()})

    def _make(self, pose_errors: dict[str, tuple[Shift, Shift]]) -> _core.Head:
        keys = self.keys
        if self.design is not None:
            return _core.Head.from_design(
                self.design,
                standoff=keys.standoff_mm,
                mirror=keys.mirror_mm,
                pose_errors=pose_errors,
                reading_model=keys.reading_model,
            )
        return _core.Head(
            keys.layout or "ideal",
            standoff=keys.standoff_mm,
            psd_distance=keys.psd_distance_mm or 0.0,
            beam_offsets=list(keys.beam_offsets_mm or ()),
            wavelength=keys.wavelength_nm,
            aperture=keys.aperture_mm,
            mirror=keys.mirror_mm,
        )


def heads_by_line(keys: ScenarioKeys, plan: _core.Plan, path: Path) -> dict[str, DescribedHead]:
    """The head of every line of the plan, scale lines included. Raises InvalidArgument."""
    default, named = _describe(keys, plan, path)
    lines = [*plan.lines, *plan.scale_lines]
    for line in keys.line:
        if line not in lines:
            raise InvalidArgument(f"{path}: line.{line}: not a line of the plan; {suggest(line, lines)}")
    heads = {}
    for line in lines:
        if line in keys.line:
            name = keys.line[line].head
            if name not in named:
                known = f"expected one of {', '.join(named)}" if named else "there is no [head.NAME]"
                raise InvalidArgument(f"{path}: line.{line}.head: no head of this scenario; {known}, got {show(name)}")
            heads[line] = named[name]
        elif default is not None:
            heads[line] = default
        else:
            raise InvalidArgument(
                f"{path}: line.{line}.head: missing; expected one of {', '.join(named)}, "
                "or a layout or description in [head] for lines without"
            )
    return heads


def nominal_heads(heads: Mapping[str, DescribedHead], path: Path) -> dict[str, _core.Head]:
    """What each line's head is by design, one object for each head. Raises InvalidArgument where layouts are mixed."""
    made: dict[str, _core.Head] = {}
    for head in heads.values():
        if head.place not in made:
            with located(f"{path}: {head.place}"):
                made[head.place] = head.nominal()
    first = next(iter(heads))
    expected = made[heads[first].place]
    for line, head in heads.items():
        got = made[head.place]
        if (got.layout, got.signals) != (expected.layout, expected.signals):
            raise InvalidArgument(
                f"{path}: {head.place}: expected heads of one layout and number of beams: that of {first} reads "
                f"{_readings(expected)}, got one that reads {_readings(got)} for {line}"
            )
    return {line: made[head.place] for line, head in heads.items()}


def actual_heads(heads: Mapping[str, DescribedHead], path: Path) -> dict[str, _core.Head]:
    """The heads as they are, components out of their places."""
    made: dict[str, _core.Head] = {}
    for head in heads.values():
        if head.place not in made:
            with located(f"{path}: {head.place}"):
                made[head.place] = head.actual()
    return {line: made[head.place] for line, head in heads.items()}


def signals_of(keys: ScenarioKeys, head: _core.Head, path: Path) -> list[str]:
    """The channels of a run. Raises InvalidArgument where there is nothing but tilts to leave out of them."""
    if keys.head.tilts:
        return head.signals
    if head.layout == "multi_beam":
        raise InvalidArgument(f'{path}: head.tilts: goes with the layouts "ideal" and "psd"; beams are distances all')
    return ["distance"]


def of_run(heads: Mapping[str, _core.Head]) -> _core.Head | dict[str, _core.Head]:
    """One head where all lines have the same."""
    several = {id(head) for head in heads.values()}
    return next(iter(heads.values())) if len(several) == 1 else dict(heads)


def _readings(head: _core.Head) -> str:
    return f"{', '.join(head.signals)} ({head.layout})"


def _describe(
    keys: ScenarioKeys, plan: _core.Plan, path: Path
) -> tuple[DescribedHead | None, dict[str, DescribedHead]]:
    shared = {name: getattr(keys.head, name) for name in keys.head.model_fields_set & HeadKeys.model_fields.keys()}
    default = None
    if not keys.head.by_head or {"layout", "description"} & shared.keys():
        default = _one(shared, "head", plan, path)
    named = {name: _one(_inherited(shared, own), f"head.{name}", plan, path) for name, own in keys.head.by_head.items()}
    described = [head for head in (default, *named.values()) if head is not None and head.design is not None]
    if "verified_share" in keys.head.model_fields_set and not described:
        raise InvalidArgument(f"{path}: head.verified_share: goes with a description; a layout replays nothing")
    return default, named


def _inherited(shared: Mapping[str, Any], own: HeadKeys) -> dict[str, Any]:
    """The keys of [head.NAME], the others from [head]; a layout drives out a description, and the other way round."""
    mine = {name: getattr(own, name) for name in own.model_fields_set}
    unfit: set[str] = set()
    if "description" in mine:
        unfit |= {"layout", *LAYOUT_KEYS}
    if "layout" in mine:
        unfit |= {"description", *DESCRIPTION_KEYS}
    values = {name: value for name, value in shared.items() if name not in unfit} | mine
    if {"pose_errors"} <= mine.keys() & shared.keys() and "pose_errors" not in unfit:
        values["pose_errors"] = shared["pose_errors"] | mine["pose_errors"]
    return values


def _one(values: Mapping[str, Any], place: str, plan: _core.Plan, path: Path) -> DescribedHead:
    keys = HeadKeys.model_validate(dict(values))
    where = f"{path}: {place}"
    if keys.layout is None and keys.description is None:
        expected = expectation(HeadKeys.model_fields["layout"])
        raise InvalidArgument(f"{where}.layout: missing; expected {expected}, or a description")
    if keys.layout is not None and keys.description is not None:
        raise InvalidArgument(f"{where}: expected layout or description, got both")
    for name in DESCRIPTION_KEYS if keys.description is None else LAYOUT_KEYS:
        if name in keys.model_fields_set:
            other = "a description" if keys.description is None else "a layout; a description has its own"
            raise InvalidArgument(f"{where}.{name}: goes with {other}")
    _check_layout(keys, where)
    _check_mirror(keys, plan, where, path)
    if keys.description is None:
        return DescribedHead(place, keys, None)
    with located(f"{where}.description"):
        design = read_head_design(find_head(keys.description, path.parent))
    known = components(design)
    for name in keys.pose_errors:
        if name not in known:
            raise InvalidArgument(
                f"{where}.pose_errors.{name}: no component of the head {show(design.name)}; "
                f"expected one of {', '.join(known)}"
            )
    return DescribedHead(place, keys, design)


def _check_layout(keys: HeadKeys, where: str) -> None:
    if keys.layout == "psd" and keys.psd_distance_mm is None:
        raise InvalidArgument(f'{where}.psd_distance_mm: missing; the layout "psd" needs it')
    if keys.layout == "multi_beam" and keys.beam_offsets_mm is None:
        raise InvalidArgument(f'{where}.beam_offsets_mm: missing; the layout "multi_beam" needs it')


def _check_mirror(keys: HeadKeys, plan: _core.Plan, where: str, path: Path) -> None:
    with located(f"{path}: plan"):  # it may find the steps too small
        smallest = plan.smallest_mirror()
    if keys.mirror_mm is not None and (keys.mirror_mm[0] < smallest[0] or keys.mirror_mm[1] < smallest[1]):
        least = [math.ceil(10.0 * edge) / 10.0 for edge in smallest]  # so that what is named will do
        raise InvalidArgument(
            f"{where}.mirror_mm: too small for this plan: expected at least {least}, got {show(keys.mirror_mm)}"
        )


def _pose_error(keys: PoseErrorKeys) -> tuple[Shift, Shift]:
    a, b, c = keys.rotation_urad
    return keys.shift_mm, (a * MICRORADIAN, b * MICRORADIAN, c * MICRORADIAN)
