"""Sound runs: how many are not accepted, for which reasons, and what an evaluation costs.

    ./run python benchmarks/sound_runs.py [--runs 3000] [-o COUNTS.json] [--baseline COUNTS.json] [--workers N]

Nine plans and heads; sizes from 10 mm to 10 m, noise from 1 nm to 1 µm, set-ups, machines and temperatures drawn from
fixed seeds, so that every version evaluates the same runs. With the counts of another version the exit status is 1
where more than 0.2 % more are doubtful, or any more are rejected or refused.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)

import stepdiag as sd

BODY, FACES, SCALES = ["ppp", "npp", "pnp", "nnp"], ["pp0", "p0p", "0pp", "np0", "n0p", "0np"], ["p00", "0p0", "00p"]
TEMPERATURE = {"expansion_um_per_m_k": 11.5, "u_expansion_um_per_m_k": 1.0, "u_temperature_c": 0.1}
AIR = {
    "readings": "constant_index",
    "assumed": {"temperature_c": 20.0, "pressure_hpa": 1013.25, "humidity_percent": 50.0},
}
TIMED = {"seconds_per_reading": 4.0}
# plan, head and what else is stated
PLANS: dict[str, tuple[str, dict[str, Any], dict[str, dict[str, Any]]]] = {
    "body diagonals, ideal": ("ideal", {"lines": BODY}, {}),
    "body diagonals, psd": ("psd", {"lines": BODY}, {}),
    "body diagonals, multi_beam": ("multi_beam", {"lines": BODY}, {}),
    "faces, psd": ("psd", {"lines": FACES}, {}),
    "body and faces, ideal, temperatures": (
        "ideal",
        {"lines": BODY + FACES[:3], **TIMED},
        {"temperature": TEMPERATURE},
    ),
    "body and faces, multi_beam, air": ("multi_beam", {"lines": BODY + FACES[:3], **TIMED}, {"environment": AIR}),
    "repeats, backward, ideal": ("ideal", {"lines": BODY, "repeats": 2, "backward": True}, {}),
    "backward, psd, temperatures, air": (
        "psd",
        {"lines": BODY, "backward": True, **TIMED},
        {"temperature": TEMPERATURE, "environment": AIR},
    ),
    "check points, ideal, temperatures": (
        "ideal",
        {"lines": BODY + FACES[:3], "check_points": 2, **TIMED},
        {"temperature": TEMPERATURE},
    ),
}


def toml(table: dict[str, Any], prefix: str = "") -> str:
    own = "".join(f"{key} = {json.dumps(value)}\n" for key, value in table.items() if not isinstance(value, dict))
    deeper = (toml(v, f"{prefix}.{k}" if prefix else k) for k, v in table.items() if isinstance(v, dict))
    return (f"[{prefix}]\n" if prefix else "") + own + "".join(deeper)


def scenario(plan: str, number: int) -> sd.Scenario:
    layout, of_plan, more = PLANS[plan]
    rng = np.random.default_rng([32, list(PLANS).index(plan), number])
    size = 10.0 ** rng.uniform(1.0, 4.0)  # mm, the longest edge
    noise = 10.0 ** rng.uniform(-3.0, 0.0) * max(1.0, size / 1e3)  # µm; that of large machines is larger
    share = min(1.0, size / 100.0)  # small machines have small heads and errors
    head = {
        "ideal": {},
        "psd": {"psd_distance_mm": 100.0 * share},
        "multi_beam": {
            "beam_offsets_mm": [[0.0, 50.0 * share], [-43.3 * share, -25.0 * share], [43.3 * share, -25.0 * share]]
        },
    }[layout]
    lines = {
        line: {
            "reflector_urad": list(300.0 * rng.normal(size=2)),
            "laser_urad": list(300.0 * rng.normal(size=2)),
            "distance_constant_mm": 0.1 * share * rng.normal(),
            **({"psd_zero_mm": list(0.1 * share * rng.normal(size=2))} if layout == "psd" else {}),
        }
        for line in of_plan["lines"]
    }
    sections = {
        "volume": {"x_mm": size, "y_mm": 0.75 * size, "z_mm": 0.625 * size},
        "machine": {
            "chain": "[w X' b Y Z t]",
            "random": {
                "seed": number,
                "translation_um": 20.0 * size / 800.0,
                "rotation_urad": 60.0,
                "squareness_urad": 60.0,
            },
        },
        "plan": {**of_plan, "steps": int(rng.integers(4, 7)), "scale_lines": SCALES},
        "head": {"layout": layout, "standoff_mm": 100.0 * share, **head},
        "misalignment": lines,
        "noise": {
            "distance_um": noise,
            "tilt_urad": 10.0 ** rng.uniform(-1.0, 1.0),
            "spot_um": max(1.0, 10.0 * noise) * share,
            "seed": number,
        },
        **more,
    }
    if "temperature" in more:
        sections["temperature"] = {
            **TEMPERATURE,
            "axes_c": list(rng.uniform(18.0, 26.0) + rng.normal(size=3)),
            "axes_c_per_h": float(rng.uniform(-1.0, 1.0)),
        }
    if "environment" in more:
        sections["environment"] = {
            **AIR,
            "temperature_c": rng.uniform(18.0, 26.0),
            "pressure_hpa": rng.uniform(970.0, 1030.0),
            "humidity_percent": rng.uniform(20.0, 70.0),
        }
    return sd.parse_scenario(toml(sections))


def one(number: int) -> tuple[str, str, list[str], float, str]:
    """Plan, fit ("refused": no result), codes of the reasons, processor seconds of the evaluation, what was refused."""
    plan = list(PLANS)[number % len(PLANS)]
    described = scenario(plan, number)
    run = sd.simulate(described)
    start = time.process_time()
    try:
        verdict = sd.methods.adjust_scenario(described, run).verdict
    except sd.InvalidArgument as error:
        return plan, "refused", [], time.process_time() - start, f"run {number}: {error}"
    codes = sorted({reason.finding for reason in verdict.reasons})
    return plan, verdict.fit, codes, time.process_time() - start, ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3000)
    parser.add_argument("-o", "--output", type=Path, help="counts to compare others with")
    parser.add_argument("--baseline", type=Path, help="counts of another version")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start = time.monotonic()
    fits = {plan: Counter[str]() for plan in PLANS}
    codes = {plan: Counter[str]() for plan in PLANS}
    seconds = dict.fromkeys(PLANS, 0.0)
    outcomes: list[str] = []
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        for plan, fit, reasons, spent, refusal in pool.imap(one, range(given.runs), chunksize=9):
            fits[plan][fit] += 1
            outcomes.append(fit)
            codes[plan].update(f"{fit}: {code}" for code in reasons)
            seconds[plan] += spent
            if refusal:
                print(refusal[:300].replace("\n", " "), file=sys.stderr)
    names = ["accepted", "doubtful", "rejected", "unchecked", "refused"]
    print(f"stepdiag {sd.__version__}\n")
    print(f"| plan and head | {' | '.join(names)} | ms a run | reasons |\n|{'---|' * (len(names) + 3)}")
    for plan, counted in fits.items():
        reasons = ", ".join(f"{code} {n}" for code, n in codes[plan].most_common())
        shares = " | ".join(str(counted[name]) for name in names)
        print(f"| {plan} | {shares} | {1e3 * seconds[plan] / max(1, counted.total()):.1f} | {reasons} |")
    total = sum(fits.values(), Counter[str]())
    print(
        f"| all | {' | '.join(str(total[name]) for name in names)} | {1e3 * sum(seconds.values()) / given.runs:.1f} | |"
    )
    print(f"\n{sum(seconds.values()):.1f} s of processor time, {time.monotonic() - start:.0f} s")
    now = {
        "version": sd.__version__,
        "runs": given.runs,
        "fits": fits,
        "reasons": codes,
        "outcomes": outcomes,
        "seconds": sum(seconds.values()),
    }
    if given.output:
        given.output.write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")
    return 0 if given.baseline is None else compared(now, json.loads(given.baseline.read_text(encoding="utf-8")))


def compared(now: dict[str, Any], before: dict[str, Any]) -> int:
    if now["runs"] != before["runs"]:
        print(f"expected {before['runs']} runs, as the baseline has, got {now['runs']}")
        return 2
    total, was = (
        {name: kind["outcomes"].count(name) for name in ("doubtful", "rejected", "refused", "unchecked")}
        for kind in (now, before)
    )
    more = {name: total[name] - was[name] for name in total}
    changed = Counter(f"{a} → {b}" for a, b in zip(before["outcomes"], now["outcomes"], strict=True) if a != b)
    good = more["doubtful"] <= math.floor(0.002 * now["runs"]) and max(more["rejected"], more["refused"]) <= 0
    print(
        f"against {before['version']}: {more['doubtful']:+d} doubtful, {more['rejected']:+d} rejected, "
        f"{more['refused']:+d} refused; processor time times {now['seconds'] / before['seconds']:.3f}"
    )
    print("changed: " + (", ".join(f"{n} {what}" for what, n in changed.most_common()) or "none"))
    print("as it must be" if good else "**not as it must be**")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
