"""The mistakes that are looked for: one record each, in the order in which equally good ones are named.

An entry makes hypotheses of a run: changed copies of the readings or of the scenario, each with its sentence and an
edit to offer. Channels and lines are called by their names. To add a mistake, add a record to `CATALOGUE` and a test to
tests/python/mistakes/test_catalogue.py."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, permutations
from typing import Any, Final, TypedDict

import numpy as np

from stepdiag import _core
from stepdiag.mistakes.copies import (
    Copy,
    Family,
    Hypothesis,
    Values,
    all_lines,
    distances_of,
    head_like,
    in_turn,
    moved_rows,
    passes_of,
    permuted,
    places,
    rows_of,
    scaled,
    tilts_of,
    with_heads,
    with_plan,
)
from stepdiag.mistakes.nominal_way import axis_lengths, shift_of, ways_of

Hypotheses = Iterator[Hypothesis]
Families = Iterator[Family]


def _none(entry: str, copy: Copy) -> Iterator[Any]:
    return iter(())


@dataclass(frozen=True)
class Mistake:
    """An entry: its name, and what it makes of a run; hypotheses with a number of their own are families."""

    name: str
    hypotheses: Callable[[str, Copy], Hypotheses] = _none
    families: Callable[[str, Copy], Families] = _none

    def of(self, copy: Copy) -> Hypotheses:
        return self.hypotheses(self.name, copy)

    def families_of(self, copy: Copy) -> Families:
        return self.families(self.name, copy)


# Readings that are this much too large, and why they might be.
TILT_FACTORS: Final = (
    (2.0, "angles of the beam, which turns by twice the mirror's tilt, in place of the mirror's"),
    (0.5, "halved although they were the mirror's already"),
    (4.84813681109536, "µrad that were converted as if they were seconds of arc"),
    (1 / 4.84813681109536, "seconds of arc in place of µrad"),
    (10.0, "another range of the instrument"),
    (0.1, "another range of the instrument"),
    (1000.0, "another unit"),
    (1e-3, "another unit"),
)
DISTANCE_FACTORS: Final = (
    (2.0, "the whole way to the mirror and back"),
    (0.5, "halved twice"),
    (10.0, "another unit"),
    (0.1, "in cm"),
    (1000.0, "in µm"),
    (1e-3, "in m"),
    (1 / 25.4, "in inches"),
)
# How sensor axes that are turned about the beam show: what alpha and beta (spot_x and spot_y) take.
TURNS: Final = {90: (True, -1.0, 1.0), -90: (True, 1.0, -1.0), 180: (False, -1.0, -1.0)}


def columns(copy: Copy, channels: Sequence[str]) -> str:
    """How the columns of channels are called in a file."""
    units = {"alpha": "_urad", "beta": "_urad"}
    return ", ".join(f"{name}{units.get(name, '_mm')}" for name in channels)


def _both(channels: Sequence[str]) -> str:
    return " and ".join(channels) if len(channels) < 3 else f"{', '.join(channels[:-1])} and {channels[-1]}"


def _rows(lines: Sequence[str] | None) -> str:
    return "" if lines is None else f" in the rows of {_both(lines)}"


def _signs(entry: str, copy: Copy) -> Hypotheses:
    pair, distances = tilts_of(copy.known), distances_of(copy.known)
    groups = [[name] for name in pair or ()]
    lengths = [distances] + ([[name] for name in distances] if len(distances) > 1 else [])
    for of_lengths, some in ((False, groups), (True, lengths)):
        for lines, where in places(copy.known, scale_lines=of_lengths):
            for channels in some:
                verb = "has" if len(channels) == 1 else "have"
                yield Hypothesis(
                    entry,
                    f"{_both(channels)} {verb} the wrong sign {where}",
                    f"in the run multiply {columns(copy, channels)} by -1{_rows(lines)}",
                    scaled(channels, -1.0, lines),
                )


def _exchanged(entry: str, copy: Copy) -> Hypotheses:
    pair, distances = tilts_of(copy.known), distances_of(copy.known)
    pairs = [pair] if pair else []
    pairs += combinations(distances, 2)
    for lines, where in places(copy.known):
        for a, b in pairs:
            yield Hypothesis(
                entry,
                f"{a} and {b} are exchanged {where}",
                f"in the run exchange the columns {columns(copy, [a])} and {columns(copy, [b])}{_rows(lines)}",
                permuted({a: b, b: a}, lines),
            )
        if pair:
            a, b = pair
            yield Hypothesis(
                entry,
                f"{a} and {b} are exchanged and both have the wrong sign {where}",
                f"in the run exchange {columns(copy, [a])} and {columns(copy, [b])} and multiply both by -1"
                f"{_rows(lines)}",
                in_turn(permuted({a: b, b: a}, lines), scaled(pair, -1.0, lines)),
            )
        for order in _cycles(distances):
            yield Hypothesis(
                entry,
                f"{_both(distances)} are exchanged {where}: in their columns stand "
                f"{', '.join({v: k for k, v in order.items()}[name] for name in distances)}",
                f"in the run rename the columns{_rows(lines)}",
                permuted(order, lines),
            )


def _cycles(names: Sequence[str]) -> Iterator[dict[str, str]]:
    """Orders in which no beam of three stands in its own column."""
    if len(names) == 3:
        for order in permutations(names):
            if all(a != b for a, b in zip(names, order, strict=True)):
                yield dict(zip(names, order, strict=True))


def _turned(entry: str, copy: Copy) -> Hypotheses:
    pair = tilts_of(copy.known)
    for lines, where in places(copy.known):
        heads = "the head is" if lines or len({id(head) for head in copy.known.heads.values()}) == 1 else "heads are"
        for degrees, (exchanged, first, second) in TURNS.items():
            as_said = " (upside down)" if degrees == 180 else ""
            said = f"{heads} turned by {degrees}° about its beam{as_said} {where}"
            if pair:
                a, b = pair
                turn = permuted({a: b, b: a}, lines) if exchanged else _same
                signs = in_turn(scaled([a], first, lines), scaled([b], second, lines))
                negative = [name for name, sign in ((a, first), (b, second)) if sign < 0.0]
                yield Hypothesis(
                    entry,
                    f"{said}, so that {a} and {b} are exchanged and {negative[0]} has the wrong sign"
                    if exchanged
                    else f"{said}, so that {a} and {b} have the wrong sign",
                    "turn the head, or in the run "
                    + (f"exchange {columns(copy, [a])} and {columns(copy, [b])}, then " if exchanged else "")
                    + f"multiply {columns(copy, negative)} by -1{_rows(lines)}",
                    in_turn(turn, signs),
                )
            elif _has_beams(copy):
                yield Hypothesis(
                    entry,
                    f"{said}, so that its beams stand elsewhere than beam_offsets_mm says",
                    f"in [head] turn beam_offsets_mm by {degrees}°",
                    with_heads(partial(_with_beams, by=_rotation(degrees)), lines),
                )


def _same(copy: Copy) -> Copy:
    return copy


def _has_beams(copy: Copy) -> bool:
    """Whether the scenario says where the beams stand, and not a description."""
    return all(head.layout == "multi_beam" and head.design is None for head in copy.known.heads.values())


def _rotation(degrees: int) -> Values:
    cosine, sine = round(np.cos(np.radians(degrees))), round(np.sin(np.radians(degrees)))
    return np.array([[cosine, -sine], [sine, cosine]], dtype=float)


def _with_beams(head: _core.Head, by: Values) -> _core.Head:
    return head_like(head, beam_offsets=head.beam_offsets @ by.T)


def _mirrored_beams(entry: str, copy: Copy) -> Hypotheses:
    if not _has_beams(copy):
        return
    for axis, name in enumerate(("x", "y")):
        signs = np.eye(2)
        signs[axis, axis] = -1.0
        yield Hypothesis(
            entry,
            f"the {name} coordinates in beam_offsets_mm have the wrong sign",
            f"in [head] change the sign of {name} in beam_offsets_mm",
            with_heads(partial(_with_beams, by=signs)),
        )


def _factors(entry: str, copy: Copy) -> Hypotheses:
    pair, distances = tilts_of(copy.known), distances_of(copy.known)
    for lines, where in places(copy.known):
        if pair:
            # Of one line, or of one channel, another factor than that of the optics is far-fetched.
            for factor, why in TILT_FACTORS if lines is None else TILT_FACTORS[:2]:
                yield _factor(entry, copy, pair, factor, where, why, lines)
            for channel in pair if lines is None else ():
                for factor, why in TILT_FACTORS[:2]:
                    yield _factor(entry, copy, [channel], factor, where, why, lines)
    for lines, where in places(copy.known, scale_lines=True):
        for factor, why in DISTANCE_FACTORS:
            yield _factor(entry, copy, distances, factor, where, why, lines)
    if _has_beams(copy):
        for factor, why in ((0.5, "half of what it is"), (2.0, "twice what it is"), (10.0, "ten times what it is")):
            yield Hypothesis(
                entry,
                f"beam_offsets_mm is too large by a factor of {factor:g}: {why}"
                if factor > 1.0
                else f"beam_offsets_mm is too small by a factor of {1 / factor:g}: {why}",
                f"in [head] divide beam_offsets_mm by {factor:g}",
                with_heads(partial(_with_beams, by=np.eye(2) / factor)),
            )


def _factor(
    entry: str,
    copy: Copy,
    channels: Sequence[str],
    factor: float,
    where: str,
    why: str,
    lines: Sequence[str] | None,
    chosen: int = 0,
) -> Hypothesis:
    verb = "is" if len(channels) == 1 else "are"
    count = len(copy.run) if lines is None else len(rows_of(copy.run, lines))
    size = f"large by a factor of {factor:.6g}" if factor > 1.0 else f"small by a factor of {1.0 / factor:.6g}"
    return Hypothesis(
        entry,
        f"{_both(channels)} {verb} too {size} {where}: {why}",
        f"in the run multiply {columns(copy, channels)} by {1.0 / factor:.6g}{_rows(lines)}",
        scaled(channels, 1.0 / factor, lines),
        # A factor makes the residuals of tilts smaller by itself. Distances with a factor contradict the plan.
        chosen
        + (0.0 if channels[0] in distances_of(copy.known) else len(channels) * count * max(0.0, 1.0 - factor**-2)),
    )


def _lines_exchanged(entry: str, copy: Copy) -> Hypotheses:
    passes = passes_of(copy.run)
    for a, b in combinations(all_lines(copy.known), 2):
        numbers = [number for number, line in passes if line == a and (number, b) in passes]
        if not numbers or any(len(passes[n, a]) != len(passes[n, b]) for n in numbers):
            continue
        source = np.arange(len(copy.run))
        for n in numbers:
            source[passes[n, a]], source[passes[n, b]] = passes[n, b], passes[n, a]
        yield Hypothesis(
            entry,
            f"lines {a} and {b} are exchanged: each has the readings of the other",
            f"in the run exchange the readings of {a} and {b}",
            moved_rows(source),
        )


def _reversed(entry: str, copy: Copy) -> Hypotheses:
    passes = passes_of(copy.run)
    taken = set(all_lines(copy.known))
    for line in all_lines(copy.known):
        source = np.arange(len(copy.run))
        for (_, name), rows in passes.items():
            if name == line:
                source[rows] = rows[::-1]
        yield Hypothesis(
            entry,
            f"line {line} is reversed: its points stand from its end to its start",
            f"in the run turn the order of the readings of {line}",
            moved_rows(source),
        )
        opposite = line.translate(str.maketrans("pn", "np"))
        if opposite not in taken:
            yield Hypothesis(
                entry,
                f"line {line} is reversed: it was measured as {opposite}, with the head at its other end",
                f"in [plan] write {opposite} in place of {line}, and take the positions of {opposite} into the run",
                with_plan(names={line: opposite}),
            )


def _axes_reversed(entry: str, copy: Copy) -> Hypotheses:
    """All lines with the names of their mirror images; scale lines, which are mostly measured by themselves, too or
    not."""
    plan, opposite, seen = copy.known.plan, str.maketrans("pn", "np"), list[dict[str, str]]()
    for count in (1, 2, 3):
        for axes in combinations("XYZ", count):
            for of_scales in (False, True) if plan.scale_lines else (False,):
                lines = all_lines(copy.known) if of_scales else plan.lines
                names = {
                    line: "".join(s.translate(opposite) if a in axes else s for a, s in zip("XYZ", line, strict=True))
                    for line in lines
                }
                names = {line: name for line, name in names.items() if name != line}
                if len(names) < 2 or names in seen:  # one line is one that is reversed
                    continue
                seen.append(names)
                scales = " (scale lines too)" if of_scales else " (scale lines not)" if plan.scale_lines else ""
                renamed = ", ".join(f"{name} in place of {line}" for line, name in names.items())
                yield Hypothesis(
                    entry,
                    f"lines have the names of their mirror images, as if {_both(axes)} ran the other way{scales}: "
                    f"{next(iter(names))} was measured as {next(iter(names.values()))}",
                    f"in [plan] and in the run write {renamed}, and take the positions of these lines into the run",
                    with_plan(names=names),
                )


def _orders(entry: str, copy: Copy) -> Hypotheses:
    stated = copy.known.plan.orders
    for order in map("".join, permutations("XYZ")):
        if stated != [order]:
            yield Hypothesis(
                entry,
                f"the step order is {order}, not {', '.join(dict.fromkeys(stated))}",
                f'in [plan] order = "{order}", and take the positions of that plan into the run',
                with_plan(order=[order]),
            )


def _chains(entry: str, copy: Copy) -> Hypotheses:
    """The order of the axes alone: no reading shows where the bed stands between them."""
    chain = copy.known.chain
    words = chain.name.split()[1:-1]  # without w and t
    bed = words.index("b")
    stated = [word[0] for word in words if word != "b"]
    for order in permutations("XYZ"):
        if list(order) == stated:
            continue
        axes = [axis + "'" for axis in order[:bed]] + ["b"] + list(order[bed:])
        name = f"[w {' '.join(axes)} t]"
        yield Hypothesis(
            entry,
            f"the chain has its axes in the order {' '.join(order)} from workpiece to tool, not {' '.join(stated)}",
            f'in [machine] write the chain as it is, such as chain = "{name}"; no reading shows where b stands',
            partial(_with_chain, chain=_core.Chain(name)),
        )


def _with_chain(copy: Copy, chain: _core.Chain) -> Copy:
    return replace(copy, known=replace(copy.known, chain=chain))


def _other_heads(entry: str, copy: Copy) -> Hypotheses:
    described = copy.known.described_heads
    # A line that is there because another one may have been measured from its end has no head of its own.
    heads = {described[line].place: head for line, head in copy.known.heads.items() if line in described}
    for line in filter(described.__contains__, all_lines(copy.known)):
        for place, head in heads.items():
            if place != described[line].place:
                name = place.removeprefix("head.")
                yield Hypothesis(
                    entry,
                    f"line {line} was measured by the head {name}",
                    f'in [line.{line}] head = "{name}"',
                    with_heads(partial(_replaced, by=head), [line]),
                )


def _replaced(_: _core.Head, by: _core.Head) -> _core.Head:
    return by


def _shifted(entry: str, copy: Copy) -> Hypotheses:
    for way in ways_of(copy.known, copy.run):
        for shift in shift_of(way):
            source = np.arange(len(copy.run))
            source[way.rows] = np.where(shift.source >= 0, way.rows[shift.source], -1)
            point = copy.run.point[way.rows[shift.place]]
            run = f" (run {way.run})" if way.run else ""
            yield Hypothesis(
                entry,
                f"line {way.line}{run}: a point was {'read twice' if shift.twice else 'skipped'} before point {point}, "
                "so that the readings from there on stand one row too "
                f"{'late' if shift.twice else 'early'}",
                f"in the run move the readings of {way.line} from point {point} on "
                + (f"one row up; what stands at point {point} is a repetition" if shift.twice else "one row down"),
                moved_rows(source),
            )


def _volume(entry: str, copy: Copy) -> Hypotheses:
    plan = copy.known.plan
    found = axis_lengths(copy.known, ways_of(copy.known, copy.run))
    if found is None:
        return
    stated = np.array(plan.volume)
    # What machine and set-up may make of a length is no other length; steps are of round numbers.
    other = np.abs(found - stated) > 1e-3 * stated
    if not other.any():
        return
    edges = np.where(other, plan.steps * np.round(found / plan.steps, 2), stated)
    for whole in (np.round(edges), edges):
        if np.all(np.abs(whole - found)[other] < 1e-3 * stated[other]):
            edges = np.where(other, whole, stated)
            break
    said = " and ".join(
        f"{name} = {edge:g} (steps of {edge / plan.steps:g} mm), not {old:g}"
        for name, edge, old in zip(("x_mm", "y_mm", "z_mm"), edges, stated, strict=True)
        if edge != old
    )
    yield Hypothesis(
        entry,
        f"the volume that was measured is another: {said}",
        f"in [volume] {said.split(',')[0] if ' and ' not in said else 'write these'}, "
        "and take the positions of that plan into the run",
        with_plan(volume=list(map(float, edges))),
        free=float(np.count_nonzero(other)),
    )


def _near(entry: str, copy: Copy) -> Families:
    """Factors that are no round numbers."""
    known = copy.known
    pair, distances = tilts_of(known), distances_of(known)
    plan = known.plan
    groups = [[line] for line in plan.lines] if len(plan.lines) > 1 else []
    if plan.lines and plan.scale_lines:
        groups.insert(0, list(plan.scale_lines))
    for lines in groups:
        yield Family(
            partial(_of_distances, entry, copy, distances, lines),
            near=2e-5,
            limit=1e-3,
            far=(-2.7e-4, 2.7e-4),  # the index of air
            fault=lines[0] if len(lines) == 1 else None,
        )
    if pair:
        yield Family(
            lambda log: _factor(
                entry, copy, pair, math.exp(log), "on all lines", "a gain that is not applied", None, 1
            ),
            **_LOGARITHM,
        )
    elif _has_beams(copy):
        yield Family(lambda log: _wide_beams(entry, math.exp(log)), **_LOGARITHM)


class _Sought(TypedDict):
    near: float
    limit: float
    far: tuple[float, ...]


_LOGARITHM: Final[_Sought] = {"near": 0.02, "limit": 0.4, "far": (-0.3, -0.1, 0.1, 0.3)}


def _of_distances(entry: str, copy: Copy, channels: Sequence[str], lines: Sequence[str], excess: float) -> Hypothesis:
    where = f"line {lines[0]}" if len(lines) == 1 else "the scale lines"
    return Hypothesis(
        entry,
        f"{_both(channels)} on {where} {'has' if len(channels) == 1 else 'have'} a factor of {1.0 + excess:.6f} "
        "against the other lines: wavelength or refractive index (air: 1.00027) was not applied alike, or they drift",
        f"in the run multiply {columns(copy, channels)} by {1.0 / (1.0 + excess):.6f}{_rows(lines)}",
        scaled(channels, 1.0 / (1.0 + excess), lines),
        free=1.0,
    )


def _wide_beams(entry: str, factor: float) -> Hypothesis:
    return Hypothesis(
        entry,
        f"beam_offsets_mm is wrong by a factor: the beams stand {factor:.4g} times as far apart",
        f"in [head] multiply beam_offsets_mm by {factor:.4g}",
        with_heads(partial(_with_beams, by=np.eye(2) * factor)),
        free=1.0,
    )


def _psd_distances(entry: str, copy: Copy) -> Families:
    heads = copy.known.heads.values()
    if not all(head.layout == "psd" and head.design is None for head in heads):
        return
    stated = next(iter(heads)).psd_distance
    if stated <= 0.0 or any(head.psd_distance != stated for head in heads):
        return

    def make(log: float) -> Hypothesis:
        distance = stated * math.exp(log)
        return Hypothesis(
            entry,
            f"psd_distance_mm is about {distance:.3g}, not {stated:g}: the spots have another lever",
            f"in [head] write psd_distance_mm as it is; {distance:.3g} fits best",
            with_heads(lambda head: head_like(head, psd_distance=distance)),
            free=1.0,
        )

    yield Family(make, near=0.1, limit=2.5, far=(-2.3, -0.7, -0.3, 0.3, 0.7, 1.4, 2.3))


CATALOGUE: Final = (
    Mistake("sign", _signs),
    Mistake("exchanged", _exchanged),
    Mistake("turned", _turned),
    Mistake("mirrored", _mirrored_beams),
    Mistake("factor", _factors),
    Mistake("lines exchanged", _lines_exchanged),
    Mistake("reversed", _reversed),
    Mistake("axes reversed", _axes_reversed),
    Mistake("order", _orders),
    Mistake("chain", _chains),
    Mistake("other head", _other_heads),
    Mistake("shifted", _shifted),
    Mistake("volume", _volume),
    Mistake("psd distance", families=_psd_distances),
    Mistake("near factor", families=_near),
)
