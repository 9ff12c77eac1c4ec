"""All benchmarks in one table, each beside its peer where it has one, in some minutes.

    ./run bench [--peers] [--only PART] [--plot PICTURE]

The C++ benchmarks check their answers as they time; commands are run as users run them, on the example. Times are of
the processor: of a command all of it, of the others what a row's name says (a reading, a sample, an adjustment).
A peer does the same work by other means, or is the least that the work takes. Other programs (Ceres, SciPy, raysect,
optiland, NumPy) have scripts of their own, with more to say (benchmarks/peers); --peers runs those that can be.

Every run is added to build/bench/history.csv: date, commit, processor, row, seconds. --plot draws it.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import json
import math
import os
import platform
import resource
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HISTORY = ROOT / "build/bench/history.csv"
COLUMNS = ["date", "commit", "processor", "row", "seconds"]
UNITS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
IMPORTS = "python: import numpy"
MARKERS = "osD^v<>pX*"
PEERS = {  # row: its peer
    "adjustment: solve/50": "adjustment_ceres: solve/50",
    "adjustment: solve/1000": "adjustment_ceres: solve/1000",
    "adjustment: variances/50": "adjustment_ceres: variances/50",
    "compensator: error_vector": "compensator: trilinear/51",
    "compensator: errors_at_once/50": "compensator: floor/50",
    "peers: replay_with_moving_mirror": "replay: embree_with_moving_mirror",
    "trace: scene_with_another_mirror/40": "trace: new_scene/40",
    "statistics: statistics/of_every_output": "statistics: model_alone",
    "stepdiag evaluate": IMPORTS,
    "stepdiag volume": IMPORTS,
    "stepdiag report": IMPORTS,
}


def seconds_of(result: dict[str, float]) -> float:
    """Of what a benchmark counts, or of one turn of it."""
    for counter, unit in {"each": 1.0, "interaction": 1.0, "us_a_sample": 1e-6}.items():
        if counter in result:
            return result[counter] * unit
    for rate in ("items_per_second", "calibrations/s"):
        if rate in result:
            return 1.0 / result[rate]
    return result["cpu_time"] * UNITS[str(result["time_unit"])]


def executables(build: Path, only: str) -> dict[str, float]:
    rows: dict[str, float] = {}
    for path in sorted(build.glob("bench_*")):
        name = path.name.removeprefix("bench_")
        if path.suffix or only not in name:
            continue
        print(f"{name} ...", file=sys.stderr, flush=True)
        command = [path, "--benchmark_format=json", "--benchmark_min_time=0.2", "--benchmark_filter=-^(slow|answer)/"]
        output = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
        for result in json.loads(output)["benchmarks"]:
            if result.get("error_occurred"):
                sys.exit(f"{name}: {result['name']}: {result['error_message']}")
            label = result["name"].removesuffix("/process_time").removesuffix("/iterations:1")
            if "exponent" not in result:
                rows[f"{name}: {label}"] = seconds_of(result)
    return rows


def cpu_seconds(command: list[str], folder: Path) -> float:
    # Modules are compiled once, as they are for users.
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands(only: str) -> dict[str, float]:
    """The least of three, or of one where it takes longer."""
    scenario = str(ROOT / "examples/scenario.toml")
    start = [sys.executable, "-P", "-m", "stepdiag"]
    # Each writes a file of its own: none is replaced.
    jobs = {
        "simulate": ([scenario, "-o", "run.csv", "--overwrite"], 3),
        "evaluate": ([scenario, "run.csv", "-o"], 3),
        "volume": (["cal0.csv"], 3),
        "report": (["cal0.csv", "-o"], 3),
        "plan": ([scenario, "--minutes", "30"], 1),
    }
    rows = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if only in "stepdiag":
            rows[IMPORTS] = min(cpu_seconds([sys.executable, "-c", "import numpy"], folder) for _ in range(3))
            for job, (arguments, repeats) in jobs.items():
                print(f"stepdiag {job} ...", file=sys.stderr, flush=True)
                outputs = [f"cal{k}.csv" if job == "evaluate" else f"report{k}.html" for k in range(repeats)]
                rows[f"stepdiag {job}"] = min(
                    cpu_seconds([*start, job, *arguments, *([output] if arguments[-1] == "-o" else [])], folder)
                    for output in outputs
                )
    return rows


def text_of(seconds: float) -> str:
    unit = next((unit for unit, size in reversed(UNITS.items()) if seconds >= size), "ns")
    return f"{seconds / UNITS[unit]:.3g} {unit}"


def print_table(rows: dict[str, float]) -> None:
    width = max(map(len, rows)) + 2
    print(f"{'row':{width}}{'time':>10}   {'its peer':{width}}{'time':>10}{'peer/row':>10}")
    for row, seconds in rows.items():
        line = f"{row:{width}}{text_of(seconds):>10}"
        if (peer := PEERS.get(row)) in rows:
            line += f"   {peer:{width}}{text_of(rows[peer]):>10}{rows[peer] / seconds:10.2g}"
        print(line)


def processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def remember(rows: dict[str, float]) -> None:
    git = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--exclude=*"]
    commit = subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip() or "unknown"
    date = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    HISTORY.parent.mkdir(parents=True, exist_ok=True)
    is_new = not HISTORY.exists()
    with HISTORY.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        if is_new:
            writer.writerow(COLUMNS)
        writer.writerows([date, commit, processor(), row, f"{seconds:.4g}"] for row, seconds in rows.items())


def plot(picture: Path) -> None:
    from matplotlib.figure import Figure

    times: dict[str, list[tuple[datetime.datetime, float]]] = defaultdict(list)
    with HISTORY.open(newline="", encoding="utf-8") as file:
        for entry in csv.DictReader(file):
            if entry["processor"] == processor():
                times[entry["row"]].append((datetime.datetime.fromisoformat(entry["date"]), float(entry["seconds"])))

    def change(row: str) -> float:
        return times[row][-1][1] / times[row][0][1]

    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    axes = figure.subplots()
    named = sorted(times, key=lambda row: abs(math.log(change(row))))[-len(MARKERS) :]
    for row in sorted(times, key=named.__contains__):  # those are drawn over the others
        dates, seconds = zip(*times[row], strict=True)
        style = {"color": "0.85", "marker": "."}
        if row in named:
            style = {"label": f"{change(row):.2g} × {row}", "marker": MARKERS[named.index(row)]}
        axes.semilogy(dates, [s / seconds[0] for s in seconds], linewidth=1.0, markersize=5, **style)
    axes.set_ylabel("processor time, by the first on this processor")
    axes.set_title(f"{len(times)} rows on {processor()}; in colour what changed most", loc="left", fontsize=9)
    axes.yaxis.set_minor_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    figure.autofmt_xdate()
    figure.legend(loc="outside right upper", fontsize=7)
    figure.savefig(picture)


def run_peers(build: Path) -> None:
    own = build.parents[1] / "peers-venv/bin/python"
    for name in ("adjustment", "compensator", "uncertainty", "peers"):
        python = own if name in ("uncertainty", "peers") else Path(sys.executable)
        print(f"\n== benchmarks/peers/{name}.py", flush=True)
        if python.exists():
            subprocess.run([python, ROOT / f"benchmarks/peers/{name}.py", "--build", build], check=True)
        else:
            print("not run: raysect and optiland have an environment of their own (benchmarks/peers/README.md)")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--build", type=Path, default=ROOT / "build/release/benchmarks", help="folder of the benchmarks"
    )
    parser.add_argument("--only", default="", metavar="PART", help="the executables of this name, or stepdiag")
    parser.add_argument("--peers", action="store_true", help="then the scripts of benchmarks/peers")
    parser.add_argument("--plot", type=Path, metavar="PICTURE", help="draw the history, this run included")
    arguments = parser.parse_args()
    rows = executables(arguments.build, arguments.only) | commands(arguments.only)
    if not rows:
        parser.error(f"--only: no benchmark is called {arguments.only}")
    print_table(rows)
    remember(rows)
    if arguments.plot:
        plot(arguments.plot)
    if arguments.peers:
        run_peers(arguments.build)
    return 0


if __name__ == "__main__":
    sys.exit(main())
