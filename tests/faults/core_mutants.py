"""What the self-test does not see of the core: constants of C++ sources are changed, one at a time.

    ./run python tests/faults/core_mutants.py [--all]

One build holds all mutants: each constant x of a copy of the sources becomes `mutant(n, x)`, which is 1.01 x if the
environment names n, and x otherwise. A mutant is seen if the self-test fails, or does not run. Without --all these are
the constants of nature and of publications (PUBLISHED), and it takes 15 minutes; with it those of the whole core, most
of which are tolerances, thresholds, or belong to instruments and methods of which the self-test has no case.
"""

import argparse
import multiprocessing
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
FOLDER: Final = ROOT / "build" / "mutants"
PUBLISHED: Final = ("core/air.cpp", "core/rotation-inl.hpp", "optics/medium.cpp")
# What may stay unseen: file, part of the line, and why (docs/selftest.md).
ALLOWED: Final = {
    ("core/air.cpp", "require_range"): "limits of an input",
    ("optics/medium.cpp", "lowest = 334.0"): "limits of an input",
    ("optics/medium.cpp", "longest_in_air"): "beyond it the index of air has no equation",
    ("core/air.cpp", "relative_error"): "a factor of 1 that is not used",
    ("core/air.cpp", "M_a ="): "cancels: a quotient of two densities of dry air",
    ("core/rotation-inl.hpp", "_series[]"): "terms that the angles of machines do not reach",
    ("core/rotation-inl.hpp", "largest_angle2"): "where the series end; machines do not reach it",
    ("core/rotation-inl.hpp", "half_sine"): "beyond the series",
}
SEEN: Final = 0.95
CONSTANT: Final = re.compile(r"(?<![\w.'])\d+(?:\.\d*(?:[eE][-+]?\d+)?|[eE][-+]?\d+)(?![\w.])")
TEXT: Final = re.compile(r'"(?:[^"\\]|\\.)*"')
IN_CLASS: Final = re.compile(r"\bstatic constexpr (?=double \w+ =)")
AT_COMPILATION: Final = re.compile(r"\bconstexpr (?=double(?! \w+::)|[A-Z]\w* \w+(\[\])?( =|\{))")
HEADER: Final = """#pragma once
#include <cstdlib>
namespace stepdiag {
inline double mutant(int n, double value) {
    static const int changed = std::getenv("STEPDIAG_MUTANT") ? std::atoi(std::getenv("STEPDIAG_MUTANT")) : -1;
    return n == changed ? 1.01 * value : value;
}
}  // namespace stepdiag
"""
LONGEST: Final = 120.0  # s of a mutant


def turned(folder: Path, only: Sequence[str]) -> list[tuple[str, str, str]]:
    """Turns these sources, or all, in this copy of the tree; file, line and constant of each mutant."""
    mutants: list[tuple[str, str, str]] = []
    (folder / "cpp" / "include" / "stepdiag" / "mutant.hpp").write_text(HEADER, encoding="utf-8")
    for path in sorted((folder / "cpp" / "src").rglob("*.?pp")):
        name = str(path.relative_to(folder / "cpp" / "src"))
        if "bindings" in path.parts or (only and name not in only):
            continue
        lines, found = path.read_text(encoding="utf-8").splitlines(), len(mutants)
        for k, line in enumerate(lines):
            code, slashes, remark = line.partition("//")
            if "static_assert" in code or code.startswith("#"):
                continue

            def change(match: re.Match[str], code: str = code, name: str = name) -> str:
                within = any(one.start() < match.start() < one.end() for one in TEXT.finditer(code))
                if within or float(match[0]) == 0.0:
                    return match[0]
                mutants.append((name, code.strip(), match[0]))
                return f"stepdiag::mutant({len(mutants) - 1}, {match[0]})"

            lines[k] = CONSTANT.sub(change, code) + slashes + remark
        if len(mutants) > found:
            lines = [IN_CLASS.sub("inline static const ", one) for one in lines]
            lines = [AT_COMPILATION.sub("const ", one) for one in lines]
            first = 1 if lines[0].startswith("#pragma once") else 0
            lines.insert(first, '#include "stepdiag/mutant.hpp"')
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return mutants


def is_seen(number: int) -> bool:
    environment = os.environ | {"PYTHONPATH": str(FOLDER / "python"), "STEPDIAG_MUTANT": str(number)}
    try:
        run = subprocess.run(
            [sys.executable, "-m", "stepdiag", "selftest"],
            env=environment | {"OPENBLAS_NUM_THREADS": "1"},
            cwd=FOLDER,
            capture_output=True,
            timeout=LONGEST,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return True
    return run.returncode != 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--all", action="store_true", help="all constants of the core")
    every = parser.parse_args().all
    for part in ("cpp", "python", "cmake", "CMakeLists.txt", "CMakePresets.json", "pyproject.toml", "README.md"):
        source, copy = ROOT / part, FOLDER / part
        if source.is_dir():
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__", "_core*.so"))
        else:
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, copy)
    mutants = turned(FOLDER, () if every else PUBLISHED)
    off = [f"-DSTEPDIAG_BUILD_{part}=OFF" for part in ("TESTS", "BENCHMARKS")]
    python = f"-DPython_EXECUTABLE={sys.executable}"
    subprocess.run(["cmake", "--preset", "release", python, *off], cwd=FOLDER, check=True)
    subprocess.run(["cmake", "--build", FOLDER / "build" / "release", "--target", "_core"], check=True)
    if is_seen(-1):
        raise SystemExit("the self-test fails without a mutant")
    with multiprocessing.Pool() as pool:
        seen = pool.map(is_seen, range(len(mutants)), chunksize=1)
    unseen = [mutant for mutant, one in zip(mutants, seen, strict=True) if not one]
    reasons = [
        next((why for (name, part), why in ALLOWED.items() if name == mutant[0] and part in mutant[1]), "")
        for mutant in unseen
    ]
    for (name, code, constant), why in zip(unseen, reasons, strict=True):
        print(f"unseen: {name}: {constant} of {code[:70]}: {why or 'NOBODY SAYS WHY'}")
    print(f"{sum(seen)} of {len(seen)} mutants seen")
    matter = len(seen) - sum(bool(why) for why in reasons)
    share = sum(seen) / matter
    print(f"{100.0 * share:.1f} % of the {matter} that have no reason to stay unseen")
    if not every and share < SEEN:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
