"""Who may include whom: the rooms of the C++ library, and the third-party headers that stay inside it."""

import re
from pathlib import Path

import pytest

CPP = Path(__file__).parents[2] / "cpp"
INCLUDE_DIR = CPP / "include" / "stepdiag"

# The rooms directly below each room; a room may include these and whatever is below them.
BELOW: dict[str, set[str]] = {
    "core": set(),
    "machine": {"core"},
    "plan": {"core"},
    "optics": {"core"},
    "monte_carlo": {"core"},
    "measurement": {"plan"},
    "head": {"optics", "measurement"},
    "simulation": {"machine", "plan", "head", "measurement"},
    "evaluation": {"machine", "plan", "measurement"},
    "adjustment": {"evaluation"},
    "diagnosis": {"adjustment"},
    "recheck": {"diagnosis"},
    "batch": {"diagnosis"},
    "uncertainty": {"simulation", "batch", "monte_carlo"},
    "controller": {"machine"},
}


def may_include(room: str) -> set[str]:
    return {room}.union(*(may_include(lower) for lower in BELOW[room]))


def includes(file: Path) -> list[str]:
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', file.read_text(encoding="utf-8"), re.MULTILINE)


def room_of(include: str) -> str | None:
    """`stepdiag/plan/line.hpp` (public) and `plan/detail.hpp` (private) are both in the room plan."""
    first = include.removeprefix("stepdiag/").split("/")[0]
    return first if first in BELOW else None


def files_of(room: str) -> list[Path]:
    return sorted(file for base in (INCLUDE_DIR, CPP / "src") for file in (base / room).glob("*.[ch]pp"))


def test_every_room_is_in_the_table() -> None:
    rooms = {entry.name for base in (INCLUDE_DIR, CPP / "src") for entry in base.iterdir() if entry.is_dir()}
    assert rooms - {"bindings"} <= set(BELOW)


@pytest.mark.parametrize("room", BELOW)
def test_room_includes_only_rooms_below(room: str) -> None:
    allowed = may_include(room)
    offences = [
        f"{file.relative_to(CPP)} includes {include}"
        for file in files_of(room)
        for include in includes(file)
        if (target := room_of(include)) is not None and target not in allowed
    ]
    assert not offences, "\n".join(offences)


def test_only_the_scene_includes_embree() -> None:
    offences = {
        str(file.relative_to(CPP))
        for file in CPP.rglob("*.[ch]pp")
        for include in includes(file)
        if include.startswith("embree")
    }
    assert offences <= {"src/optics/scene.cpp"}


def test_public_headers_show_no_private_dependency() -> None:
    private = re.compile(r"embree|csv\.h$|Random123|hwy")
    offences = [
        f"{file.relative_to(CPP)} includes {include}"
        for file in INCLUDE_DIR.rglob("*.hpp")
        for include in includes(file)
        if private.match(include) or (room_of(include) is not None and not include.startswith("stepdiag/"))
    ]
    assert not offences, "\n".join(offences)


def test_nothing_calls_std_hypot() -> None:
    """It needs glibc 2.35; wheels are for 2.34 (DEVELOPERS.md, Wheels)."""
    for file in [*(CPP / "src").rglob("*"), *INCLUDE_DIR.rglob("*")]:
        if file.is_file():
            assert not re.search(r"\bhypotf?\(", file.read_text(encoding="utf-8")), file
