"""The heads of a scenario: which there are, and which of them measures which line."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import expectation, show, suggest
from stepdiag.config.key_types import narrowed
from stepdiag.config.scenario_head_keys import (
    DESCRIPTION_KEYS,
    LAYOUT_KEYS,
    HeadKeys,
    HeadSection,
    NominalHeadKeys,
    PoseErrorKeys,
)
from stepdiag.config.scenario_keys import KnownKeys
from stepdiag.config.toml_text import located
from stepdiag.units import MICRORADIAN

Triple = tuple[float, float, float]
# Of the components of one head that are out of their places: shift (mm) and rotation vector (rad).
PoseErrors = Mapping[str, tuple[Triple, Triple]]


@dataclass(frozen=True)
class DescribedHead:
    """One head by design, as its keys say, those of [head] included. `place` is where they stand: head, head.left."""

    place: str
    keys: NominalHeadKeys
    design: _core.HeadDesign | None = field(compare=False)  # what the description in `keys` says

    @property
    def components(self) -> list[str]:
        """Names of the components that can have pose errors; a layout has none."""
        if self.design is None:
            return []
        parts: list[_core.HeadBody | _core.HeadBeam | _core.SpotSensor]
        parts = [*self.design.bodies, *self.design.beams, *self.design.sensors]
        return [part.name for part in parts]

    def make(self, pose_errors: PoseErrors) -> _core.Head:
        keys = self.keys
        if self.design is not None:
            return _core.Head.from_design(
                self.design,
                standoff=keys.standoff_mm,
                mirror=keys.mirror_mm,
                pose_errors=dict(pose_errors),
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


def heads_by_line(
    keys: KnownKeys, plan: _core.Plan, described: Mapping[str, DescribedHead], path: Path
) -> dict[str, DescribedHead]:
    """The head of every line of the plan, scale lines included. Raises InvalidArgument."""
    lines = [*plan.lines, *plan.scale_lines]
    for line in keys.line:
        if line not in lines:
            raise InvalidArgument(f"{path}: line.{line}: not a line of the plan; {suggest(line, lines)}")
    named = [place.removeprefix("head.") for place in described if place != "head"]
    heads = {}
    for line in lines:
        name = keys.line[line].head if line in keys.line else None
        place = "head" if name is None else f"head.{name}"
        if place in described:
            heads[line] = described[place]
        elif name is None:
            raise InvalidArgument(
                f"{path}: line.{line}.head: missing; expected one of {', '.join(named)}, "
                "or a layout or description in [head] for lines without"
            )
        else:
            known = f"expected one of {', '.join(named)}" if named else "there is no [head.NAME]"
            raise InvalidArgument(f"{path}: line.{line}.head: no head of this scenario; {known}, got {show(name)}")
    return heads


def make_heads(
    described: Mapping[str, DescribedHead], pose_errors: Mapping[str, PoseErrors], path: Path
) -> dict[str, _core.Head]:
    """By line, one object for each head: as designed, or with components out of their places (by the head's own)."""
    made: dict[str, _core.Head] = {}
    for head in described.values():
        if head.place not in made:
            with located(f"{path}: {head.place}"):
                made[head.place] = head.make(pose_errors.get(head.place, {}))
    return {line: made[head.place] for line, head in described.items()}


def check_alike(described: Mapping[str, DescribedHead], heads: Mapping[str, _core.Head], path: Path) -> None:
    """Raises InvalidArgument where layouts are mixed."""
    first, expected = next(iter(heads.items()))
    for line, got in heads.items():
        if (got.layout, got.signals) != (expected.layout, expected.signals):
            raise InvalidArgument(
                f"{path}: {described[line].place}: expected heads of one layout and number of beams: that of {first} "
                f"reads {_readings(expected)}, got one that reads {_readings(got)} for {line}"
            )


def signals_of(keys: KnownKeys, head: _core.Head, path: Path) -> list[str]:
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


def describe_heads(keys: HeadSection, path: Path) -> tuple[dict[str, DescribedHead], dict[str, PoseErrors]]:
    """By their places, of all heads of a scenario: how they are by design, and what is out of its place in them."""
    shared = {name: getattr(keys, name) for name in keys.model_fields_set & HeadKeys.model_fields.keys()}
    by_place = {}
    if not keys.by_head or {"layout", "description"} & shared.keys():
        by_place["head"] = shared
    by_place |= {f"head.{name}": _inherited(shared, own) for name, own in keys.by_head.items()}
    own_keys = {place: HeadKeys.model_validate(values) for place, values in by_place.items()}
    described = {place: _described(own, place, path) for place, own in own_keys.items()}
    if "verified_share" in keys.model_fields_set and not any(head.design is not None for head in described.values()):
        raise InvalidArgument(f"{path}: head.verified_share: goes with a description; a layout replays nothing")
    return described, {
        place: {name: _pose_error(error) for name, error in own.pose_errors.items()} for place, own in own_keys.items()
    }


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


def _described(keys: HeadKeys, place: str, path: Path) -> DescribedHead:
    nominal = narrowed(keys, NominalHeadKeys)
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
    if keys.description is None:
        return DescribedHead(place, nominal, None)
    # Here, because the keys of bodies take a sixth of a command's time that most scenarios do not need.
    from stepdiag.head.description import find_head, read_head_design

    with located(f"{where}.description"):
        design = read_head_design(find_head(keys.description, path.parent))
    head = DescribedHead(place, nominal, design)
    for name in keys.pose_errors:
        if name not in head.components:
            raise InvalidArgument(
                f"{where}.pose_errors.{name}: no component of the head {show(design.name)}; "
                f"expected one of {', '.join(head.components)}"
            )
    return head


def _check_layout(keys: HeadKeys, where: str) -> None:
    if keys.layout == "psd" and keys.psd_distance_mm is None:
        raise InvalidArgument(f'{where}.psd_distance_mm: missing; the layout "psd" needs it')
    if keys.layout == "multi_beam" and keys.beam_offsets_mm is None:
        raise InvalidArgument(f'{where}.beam_offsets_mm: missing; the layout "multi_beam" needs it')


def check_mirrors(described: Mapping[str, DescribedHead], plan: _core.Plan, path: Path) -> None:
    """Raises InvalidArgument where a mirror is smaller than the plan's steps take it to be."""
    with located(f"{path}: plan"):  # it may find the steps too small
        smallest = plan.smallest_mirror()
    for place, head in described.items():
        mirror = head.keys.mirror_mm
        if mirror is not None and (mirror[0] < smallest[0] or mirror[1] < smallest[1]):
            least = [math.ceil(10.0 * edge) / 10.0 for edge in smallest]  # so that what is named will do
            raise InvalidArgument(
                f"{path}: {place}.mirror_mm: too small for this plan: expected at least {least}, got {show(mirror)}"
            )


def _pose_error(keys: PoseErrorKeys) -> tuple[Triple, Triple]:
    a, b, c = keys.rotation_urad
    return keys.shift_mm, (a * MICRORADIAN, b * MICRORADIAN, c * MICRORADIAN)
