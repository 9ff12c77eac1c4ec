"""The campaign of faults; `./run faults` calls it.

A command is killed, runs out of room, fails or is interrupted at each of its calls that change a file, and interrupted
at random times; files of every kind are damaged. Afterwards every file must be the old one or the whole new one. Prints
a table; ends with 1 if anything was lost, crashed or hung.
"""

import argparse
import ctypes
import errno
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
NOBODY = 65534
COUNT, KILL, FAIL, INTERRUPT, RUN_FULL = range(5)
KINDS = {
    "killed at a call": (KILL, 0),
    "no room for a call": (FAIL, errno.ENOSPC),
    "disk full from a call on": (RUN_FULL, errno.ENOSPC),
    "a call fails (EIO)": (FAIL, errno.EIO),
    "a call refused (EACCES)": (FAIL, errno.EACCES),
    "Ctrl-C at a call": (INTERRUPT, 0),
}
AT_RANDOM, READ_ONLY, DAMAGED = "Ctrl-C at random", "read-only folder", "damaged file"
MOST_CALLS = 40  # of a command; of more these many are chosen
INTERRUPTS = 12  # of each command at random times
DAMAGES = 1200  # of each kind of file
BATCH = 100  # damaged files read by one process
TEMPORARY = re.compile(r".+\.([0-9a-f]{16}|[0-9]+-[0-9]+)")
LONGEST_END = 5.0  # s, for an interrupted command on a loaded computer


@dataclass(frozen=True)
class Case:
    kind: str
    command: int = -1
    over_old: bool = False
    call: int = 0
    seconds: float = 0.0
    name: str = ""  # of the damaged file


class Campaign:
    """Prepared inputs, and what undisturbed commands make of them."""

    def __init__(self, folder: Path) -> None:
        import commands
        from warm import warm

        warm()
        self.folder, self.commands = folder, commands.COMMANDS
        self.layer = ctypes.CDLL(os.environ["LD_PRELOAD"])
        self.layer.fault_count.restype = ctypes.c_long
        self.layer.fault_arm.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_long, ctypes.c_int]
        self.make_inputs()
        self.calls: dict[tuple[int, bool], int] = {}
        self.seconds: list[float] = []
        self.new: list[dict[str, bytes]] = []
        self.old: list[dict[str, bytes]] = []
        for number in range(len(self.commands)):
            self.old.append(self.undisturbed(number, "older", {})[0])
            new, calls, seconds = self.undisturbed(number, "inputs", {})
            again, calls_over, _ = self.undisturbed(number, "inputs", self.old[number])
            self.new.append(new)
            self.seconds.append(seconds)
            self.calls[number, False] = calls
            if again:
                assert again == new, f"{self.commands[number].arguments}: another result beside an old one"
                self.calls[number, True] = calls_over

    def make_inputs(self) -> None:
        from commands import make_inputs
        from processes import in_child
        from small_scenario import SCENARIO

        from stepdiag.cli import main

        for name, seed in (("inputs", "seed = 7"), ("older", "seed = 8")):
            made = in_child(
                lambda name=name, seed=seed: make_inputs(  # type: ignore[misc]
                    self.folder / name, SCENARIO.replace("seed = 7", seed), main
                ),
                self.folder / "said",
            )
            assert made.status == 0, made.said

    def work(self, number: int, case: Path, kind: int, call: int, number_of_error: int) -> Callable[[], int]:
        from stepdiag.cli import main

        words = self.commands[number].words

        def work() -> int:
            os.chdir(case)
            sys.argv = ["stepdiag", *words]
            self.layer.fault_arm(str(case).encode(), kind, call, number_of_error)
            status = main()
            calls = self.layer.fault_count()
            self.layer.fault_arm(b"", COUNT, -1, 0)
            case.with_suffix(".calls").write_text(str(calls))
            return status

        return work

    def place(self, name: str, inputs: str, old: dict[str, bytes]) -> Path:
        case = self.folder / name
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(self.folder / inputs, case)
        for path, content in old.items():
            (case / path).parent.mkdir(exist_ok=True)
            (case / path).write_bytes(content)
        return case

    def undisturbed(self, number: int, inputs: str, old: dict[str, bytes]) -> tuple[dict[str, bytes], int, float]:
        """What it writes, its calls and its time; nothing if it refuses to replace an old one."""
        from processes import in_child

        case = self.place("undisturbed", inputs, old)
        done = in_child(self.work(number, case, COUNT, -1, 0), case.with_suffix(".said"))
        if done.status == 2 and old:
            return {}, 0, 0.0
        assert done.status in (0, 3), f"{self.commands[number].arguments}: {done}"
        return self.written(case), int(case.with_suffix(".calls").read_text()), done.seconds

    def written(self, case: Path) -> dict[str, bytes]:
        """The files that are not inputs."""
        inputs = {path.name for path in (self.folder / "inputs").iterdir()}
        return {
            str(path.relative_to(case)): path.read_bytes()
            for path in sorted(case.rglob("*"))
            if path.is_file() and str(path.relative_to(case)) not in inputs
        }

    # --- cases ------------------------------------------------------------------------------------------------------
    def cases(self) -> Iterator[Case]:
        chance = random.Random(1)
        for (number, over_old), count in self.calls.items():
            calls = sorted(chance.sample(range(count), min(count, MOST_CALLS)))
            yield from (Case(kind, number, over_old, call) for kind in KINDS for call in calls)
            if not over_old:
                yield Case(READ_ONLY, number)
                longest = 1.1 * self.seconds[number]
                yield from (Case(AT_RANDOM, number, False, 0, chance.uniform(0, longest)) for _ in range(INTERRUPTS))
        from damage import READERS

        yield from (Case(DAMAGED, name=name, call=k) for name in READERS for k in range(0, DAMAGES, BATCH))

    def run(self, case: Case, worker: int) -> list[tuple[str, str]]:
        """(verdict, what happened) of each try of a case."""
        if case.kind == DAMAGED:
            return self.damaged(case, worker)
        from processes import in_child

        old = self.old[case.command] if case.over_old else {}
        place = self.place(f"case-{worker}", "inputs", old)
        said = place.with_suffix(".said")
        place.with_suffix(".calls").unlink(missing_ok=True)
        if case.kind == READ_ONLY:
            return [self.read_only(case, place, said)]
        if case.kind == AT_RANDOM:
            work = self.work(case.command, place, COUNT, -1, 0)
            outcome = in_child(work, said, interrupt=case.seconds)
        else:
            kind, number = KINDS[case.kind]
            outcome = in_child(self.work(case.command, place, kind, case.call, number), said)
        found = self.written(place)
        verdict = self.verdict(case, outcome, old, found)
        if verdict.startswith("lost") or (outcome.status in (0, 3, 130)):
            return [(verdict, f"{case} {outcome.status} {outcome.said[-400:]}")]
        return [(self.continued(case, place, found, verdict), f"{case}")]

    def verdict(self, case: Case, outcome: "object", old: dict[str, bytes], found: dict[str, bytes]) -> str:
        from processes import Outcome

        assert isinstance(outcome, Outcome)
        if outcome.hung:
            return "lost: hung"
        if outcome.crashed:
            return f"lost: crashed with {outcome.status}"
        new, command = self.new[case.command], self.commands[case.command]
        killed = outcome.status == -signal.SIGKILL
        interrupted = case.kind in (AT_RANDOM, "Ctrl-C at a call")
        if interrupted and outcome.seconds > LONGEST_END + (
            0 if case.kind == AT_RANDOM else self.seconds[case.command]
        ):
            return f"lost: took {outcome.seconds:.1f} s to end"
        torn, mixed = [], set()
        for name, content in found.items():
            if name in command.kept or (killed and TEMPORARY.fullmatch(name)):
                continue
            if content == old.get(name) == new.get(name):
                continue
            if content == new.get(name):
                mixed.add("new")
            elif content == old.get(name):
                mixed.add("old")
            else:
                torn.append(name)
        if torn:
            return f"lost: neither old nor new: {torn}"
        gone = [name for name in old if name not in found]
        if gone:
            return f"lost: gone: {gone}"
        whole = all(found.get(name) == content for name, content in new.items())
        if not killed and outcome.status not in (0, 3) and not outcome.is_one_line:
            return f"lost: not one line: {outcome.said[-300:]!r}"
        if outcome.status in (0, 3):
            return "recovered" if whole else "lost: done, but not all is new"
        expected = (130,) if interrupted else (-signal.SIGKILL,) if case.kind == "killed at a call" else (2,)
        if outcome.status not in expected:
            return f"lost: status {outcome.status}"
        return "recovered" if killed or interrupted else "refused"

    def continued(self, case: Case, place: Path, found: dict[str, bytes], verdict: str) -> str:
        """After a kill: what goes on with --resume comes to the undisturbed result; a mixed set is told."""
        from processes import in_child

        from stepdiag.cli import main

        command = self.commands[case.command]
        new = self.new[case.command]
        if any((place / name).exists() for name in command.kept) and command.resumed is not None:
            words = [*command.words, command.resumed]

            def resume() -> int:
                os.chdir(place)
                return main(words)

            done = in_child(resume, place.with_suffix(".said"))
            after = self.written(place)
            if done.status not in (0, 3) or any(after.get(name) != content for name, content in new.items()):
                return f"lost: --resume: {done.status} {done.said[-200:]}"
        sets = {name: content for name, content in found.items() if name.startswith("comp/")}
        ini = "comp/compensation.ini"
        if ini in sets:
            whole = [
                files for files in (new, self.old[case.command]) if all(sets.get(n) == c for n, c in files.items())
            ]
            checked = in_child(lambda: main(["check", str(place / ini)]), place.with_suffix(".said"))
            if (checked.status == 0) != bool(whole):
                return f"lost: a mixed set passes check: {checked.status}"
        return verdict

    def read_only(self, case: Case, place: Path, said: Path) -> tuple[str, str]:
        from processes import in_child

        work = self.work(case.command, place, COUNT, -1, 0)

        def unprivileged() -> int:
            if os.geteuid() == 0:
                os.setgroups([])
                os.setgid(NOBODY)
                os.setuid(NOBODY)
            os.environ["HOME"] = "/nonexistent"
            return work()

        place.chmod(0o555)
        said.touch()
        said.chmod(0o666)
        outcome = in_child(unprivileged, said)
        place.chmod(0o755)
        found = self.written(place)
        sound = outcome.status == 2 and outcome.is_one_line and not found
        return "refused" if sound else f"lost: {sorted(found)}", f"{case} {outcome.status} {outcome.said[-300:]}"

    def damaged(self, case: Case, worker: int) -> list[tuple[str, str]]:
        from damage import try_one
        from processes import in_child

        place = self.folder / f"damaged-{worker}"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        original = self.folder / "originals" / case.name
        content, results = original.read_bytes(), place / "results"

        def work() -> int:
            plain = {".nc": ".csv"}.get(original.suffix, original.suffix)
            with results.open("a") as file:
                for seed in range(case.call, case.call + BATCH):
                    verdict = try_one(case.name, content, seed, place, original.with_suffix(plain))
                    file.write(json.dumps([verdict, f"{case.name} seed {seed}"]) + "\n")
                    file.flush()
            return 0

        outcome = in_child(work, place.with_suffix(".said"), patience=120.0)
        found = [(v, w) for v, w in map(json.loads, results.read_text().splitlines())] if results.exists() else []
        if outcome.status != 0 or outcome.hung:
            what = "hung" if outcome.hung else f"crashed with {outcome.status}"
            found.append((f"lost: {what}", f"{case.name} seed {case.call + len(found)} {outcome.said[-500:]}"))
        return found


def prepare_originals(campaign: Campaign) -> None:
    """Whole files of every kind that is damaged."""
    import openpyxl

    folder = campaign.folder / "originals"
    folder.mkdir()
    inputs = campaign.folder / "inputs"
    for name, source in (
        ("measurement.csv", "run.csv"),
        ("measurement.nc", "run.nc"),
        ("calibration.csv", "calibration.csv"),
        ("calibration.nc", "calibration.nc"),
        ("map.csv", "map.csv"),
        ("scenario.toml", "scenario.toml"),
    ):
        shutil.copyfile(inputs / source, folder / name)
    from stepdiag.head.description import find_shipped_head

    shutil.copyfile(find_shipped_head("beam_and_psd"), folder / "head.toml")
    rows = [line.split(",") for line in (inputs / "run.csv").read_text().splitlines() if not line.startswith("#")]
    (folder / "sheet.csv").write_text("\n".join(";".join(row).replace(".", ",") for row in rows))
    book = openpyxl.Workbook()
    for k, row in enumerate(rows):
        book.active.append(row if k == 0 else [row[0], *(float(value) if value else None for value in row[1:])])
    book.save(folder / "sheet.xlsx")


def part(campaign: Campaign, cases: list[Case], worker: int, results: Path) -> None:
    with results.open("w") as file:
        for case in cases:
            try:
                found = campaign.run(case, worker)
            except Exception as error:
                found = [(f"lost: the campaign itself: {error!r}", str(case))]
            for verdict, what in found:
                file.write(json.dumps([case.kind, verdict, what]) + "\n")


def table(found: list[tuple[str, str, str]]) -> list[str]:
    kinds = [*KINDS, AT_RANDOM, READ_ONLY, DAMAGED]
    counts = Counter((kind, verdict.split(":")[0]) for kind, verdict, _ in found)
    columns = ("refused", "recovered", "lost")
    lines = [f"{'kind':<26}{'tried':>8}" + "".join(f"{column:>11}" for column in columns)]
    for kind in (*kinds, None):
        row = [sum(n for (k, v), n in counts.items() if (kind is None or k == kind) and v == c) for c in columns]
        lines.append(f"{kind or 'all':<26}{sum(row):>8}" + "".join(f"{count:>11}" for count in row))
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="a twentieth of the cases")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--kind", help="only this kind")
    arguments = parser.parse_args()
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="stepdiag-faults-") as name:
        folder = Path(name)
        folder.chmod(0o755)
        campaign = Campaign(folder)
        prepare_originals(campaign)
        cases = [case for case in campaign.cases() if arguments.kind in (None, case.kind)]
        if arguments.short:
            cases = random.Random(2).sample(cases, max(1, len(cases) // 20))
        random.Random(3).shuffle(cases)
        workers = []
        for worker in range(arguments.jobs):
            child = os.fork()
            if child == 0:
                part(campaign, cases[worker :: arguments.jobs], worker, folder / f"results-{worker}")
                os._exit(0)
            workers.append(child)
        for child in workers:
            os.waitpid(child, 0)
        found = [
            (kind, verdict, what)
            for worker in range(arguments.jobs)
            for kind, verdict, what in map(json.loads, (folder / f"results-{worker}").read_text().splitlines())
        ]
    lost = [(kind, verdict, what) for kind, verdict, what in found if verdict.startswith("lost")]
    for kind, verdict, what in lost:
        print(f"{kind}: {verdict}\n  {what}")
    print("\n".join(table(found)))
    print(f"{time.monotonic() - start:.0f} s")
    return 1 if lost or not found else 0


if __name__ == "__main__":
    if "fault" not in os.environ.get("LD_PRELOAD", ""):
        library = Path(tempfile.mkdtemp(prefix="stepdiag-faults-")) / "fault.so"
        compile_it = [
            os.environ.get("CC", "cc"),
            "-shared",
            "-fPIC",
            "-O1",
            "-o",
            str(library),
            str(HERE / "layer.c"),
            "-ldl",
        ]
        subprocess.run(compile_it, check=True)
        environment = {**os.environ, "LD_PRELOAD": str(library), "SOURCE_DATE_EPOCH": "1790000000"}
        environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLCONFIGDIR": str(library.parent)}
        done = subprocess.run([sys.executable, *sys.argv], env=environment, check=False)
        shutil.rmtree(library.parent)
        sys.exit(done.returncode)
    sys.path[:0] = [str(HERE), str(HERE.parent / "python" / "helpers")]
    sys.exit(main())
