"""The campaign of faults; `./run faults` calls it.

A command is killed, runs out of room, fails or is interrupted at each of its calls that change a file, and interrupted
at random times. So is an acquisition, which then goes on. Instruments and clients of acquisitions are hostile. Files of
every kind are damaged. Afterwards every file must be the old one or the whole new one, every reading must be there,
and what was refused must have one line that says why. Prints a table; ends with 1 if anything was lost, crashed or
hung.
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
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from processes import Outcome

HERE = Path(__file__).resolve().parent
COUNT, KILL, FAIL, INTERRUPT, RUN_FULL = range(5)
KINDS = {
    "killed at a call": (KILL, 0),
    "no room for a call": (FAIL, errno.ENOSPC),
    "disk full from a call on": (RUN_FULL, errno.ENOSPC),
    "a call fails (EIO)": (FAIL, errno.EIO),
    "a call refused (EACCES)": (FAIL, errno.EACCES),
    "Ctrl-C at a call": (INTERRUPT, 0),
}
OVER_OLD = ("killed at a call", "disk full from a call on")  # also tried where an old result stands
AT_RANDOM, READ_ONLY = "Ctrl-C at random", "read-only folder"
ACQUISITION = "acquisition stopped"
INSTRUMENT, CLIENT, DAMAGED = "hostile instrument", "hostile client", "damaged file"
EVERY_KIND = (*KINDS, AT_RANDOM, READ_ONLY, ACQUISITION, INSTRUMENT, CLIENT, DAMAGED)
MOST_CALLS = 40  # of a command; of more these many are chosen
FEW_CALLS = 8  # of a command on a book, which is used after each case; but it is killed at MOST_CALLS
INTERRUPTS = 6  # of each command at random times
CLIENTS = 5  # of each behaviour
DAMAGES = 1200  # of each kind of file
BATCH = 100  # damaged files read by one process
SHORT = 12  # in the short form: two of so many cases of a command, half of one of acquisitions and batches of files
TEMPORARY = re.compile(r".+\.([0-9a-f]{16}|[0-9]+-[0-9]+)")
LONGEST_END = 5.0  # s, for an interrupted command on a loaded computer


@dataclass(frozen=True)
class Case:
    kind: str
    command: int = -1
    over_old: bool = False
    call: int = 0
    seconds: float = 0.0
    name: str = ""  # of the damaged file, of the fault or of the behaviour


class Campaign:
    """Prepared inputs; `prepare` learns what undisturbed commands make of them."""

    def __init__(self, folder: Path) -> None:
        import commands
        from warm import warm, warm_up

        warm()
        self.folder, self.commands = folder, commands.COMMANDS
        self.layer = ctypes.CDLL(os.environ["LD_PRELOAD"])
        self.layer.fault_count.restype = ctypes.c_long
        self.layer.fault_arm.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_long, ctypes.c_int]
        self.make_inputs()
        warm_up(folder / "inputs")
        self.calls: dict[tuple[int, bool], int] = {}
        self.seconds: dict[int, float] = {}
        self.new: dict[int, dict[str, bytes]] = {}
        self.old: dict[int, dict[str, bytes]] = {}

    def prepare(self, number: int, worker: int) -> None:
        """Run a command undisturbed: alone, beside an old result, and with the inputs of the old one."""
        self.old[number] = self.undisturbed(number, "older", {}, worker)[0]
        new, calls, seconds = self.undisturbed(number, "inputs", {}, worker)
        self.new[number] = new
        self.seconds[number] = seconds
        self.calls[number, False] = calls
        if self.commands[number].in_book:  # where nothing replaces an old file
            return
        again, calls_over, _ = self.undisturbed(number, "inputs", self.old[number], worker)
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

    def undisturbed(
        self, number: int, inputs: str, old: dict[str, bytes], worker: int
    ) -> tuple[dict[str, bytes], int, float]:
        """What it writes, its calls and its time; nothing if it refuses to replace an old one."""
        from processes import in_child

        case = self.place(f"case-{worker}", inputs, old)
        done = in_child(self.work(number, case, COUNT, -1, 0), case.with_suffix(".said"))
        if done.status == 2 and old:
            return {}, 0, 0.0
        assert done.status in (0, 3), f"{self.commands[number].arguments}: {done}"
        return self.written(case), int(case.with_suffix(".calls").read_text()), done.seconds

    def written(self, case: Path) -> dict[str, bytes]:
        """The files that are not inputs. Of a book those that count: no index, records and names that are taken."""
        inputs = {str(path.relative_to(self.folder / "inputs")) for path in (self.folder / "inputs").rglob("*")}
        found = {
            str(path.relative_to(case)): path.read_bytes()
            for path in sorted(case.rglob("*"))
            if path.is_file() and str(path.relative_to(case)) not in inputs
        }
        return {
            name: content
            for name, content in found.items()
            if not (name.startswith("book/") and ("sqlite" in name or "/records/" in name or not content))
        }

    def wrong_with_book(self, case: Path) -> str:
        """What is lost of a book: a file that was there, a record, the use of it. Empty: nothing."""
        from processes import in_child

        from stepdiag.book.records import read
        from stepdiag.cli import main

        contents = {path.read_bytes() for path in (case / "book").rglob("*") if path.is_file()}
        for path in (self.folder / "inputs" / "book").rglob("*"):
            if path.is_file() and "sqlite" not in path.name and path.read_bytes() not in contents:
                return f"{path.name} is gone"
        unread: list[str] = []
        for path in (case / "book").rglob("records/*.json"):
            try:
                read(path)
            except ValueError as error:
                unread.append(str(error))
        if unread:
            return f"a record is damaged: {unread[0]}"
        for line in ("book show M --book book", "simulate --machine M --book book -o next.csv"):

            def use(line: str = line) -> int:
                os.chdir(case)
                return main(line.split())

            done = in_child(use, case.with_suffix(".said"))
            if done.status not in (0, 3):
                return f"afterwards `stepdiag {line}` ends with {done.status}: {done.said[-200:]}"
        return ""

    # --- cases ------------------------------------------------------------------------------------------------------
    def of_command(self, number: int) -> Iterator[Case]:
        chance = random.Random(number)
        for over_old in (False, True):
            count = self.calls.get((number, over_old), 0)
            for kind in OVER_OLD if over_old else KINDS:
                few = self.commands[number].in_book and kind != "killed at a call"
                calls = sorted(chance.sample(range(count), min(count, FEW_CALLS if few else MOST_CALLS)))
                yield from (Case(kind, number, over_old, call) for call in calls)
        yield Case(READ_ONLY, number)
        longest = 1.1 * self.seconds[number]
        yield from (Case(AT_RANDOM, number, seconds=chance.uniform(0.003, longest)) for _ in range(INTERRUPTS))

    def others(self, short: bool) -> Iterator[Case]:
        import hostile
        from damage import READERS

        calls = 1 + self.acquisition(0, COUNT, 0, 0)[1]
        yield from (Case(ACQUISITION, call=call, name=kind) for kind in KINDS for call in range(calls))
        self.instruments = list(hostile.instruments(short))
        yield from (Case(INSTRUMENT, call=k) for k in range(len(self.instruments)))
        yield from (Case(CLIENT, call=k, name=name) for name in hostile.CLIENTS for k in range(1 if short else CLIENTS))
        yield from (Case(DAMAGED, name=name, call=k) for name in READERS for k in range(0, DAMAGES, BATCH))

    def run(self, case: Case, worker: int) -> list[tuple[str, str]]:
        """(verdict, what happened) of each try of a case."""
        if case.kind == DAMAGED:
            return self.damaged(case, worker)
        if case.kind in (ACQUISITION, INSTRUMENT, CLIENT):
            return [self.of_acquisition(case, worker)]
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
        if self.commands[case.command].in_book and not verdict.startswith("lost"):
            wrong = self.wrong_with_book(place)
            if wrong:
                return [(f"lost: {wrong}", f"{self.shown(case)} {outcome.status} {outcome.said[:700]}")]
        if verdict.startswith("lost") or outcome.status in (0, 3):
            return [(verdict, f"{self.shown(case)} {outcome.status} {outcome.said[:700]}")]
        return [(self.continued(case, place, found, verdict), self.shown(case))]

    def verdict(self, case: Case, outcome: "object", old: dict[str, bytes], found: dict[str, bytes]) -> str:
        from processes import Outcome

        assert isinstance(outcome, Outcome)
        if outcome.hung:
            return "lost: hung"
        if outcome.crashed:
            return f"lost: crashed with {outcome.status}"
        has_begun = "stepdiag/cli" in outcome.said and "in interruptible" not in outcome.said
        if outcome.interrupted and outcome.status == 70 and not has_begun and not found:
            return "recovered"  # it came in the child before the program had begun
        new, command = self.new[case.command], self.commands[case.command]
        killed = outcome.status == -signal.SIGKILL
        interrupted = case.kind in (AT_RANDOM, "Ctrl-C at a call")
        patience = LONGEST_END + (0.0 if outcome.interrupted else 3.0 * self.seconds[case.command])
        if interrupted and outcome.seconds > patience and outcome.status != 0:
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

    def shown(self, case: Case) -> str:
        return f"{case}, stepdiag {self.commands[case.command].arguments}"

    def read_only(self, case: Case, place: Path, said: Path) -> tuple[str, str]:
        from processes import give_up_privileges, in_child

        work = self.work(case.command, place, COUNT, -1, 0)

        def unprivileged() -> int:
            give_up_privileges()
            return work()

        folders = [place, *(path for path in place.rglob("*") if path.is_dir())]
        for folder in folders:
            folder.chmod(0o555)
        outcome = in_child(unprivileged, said)
        for folder in folders:
            folder.chmod(0o755)
        found = self.written(place)
        sound = outcome.status == 2 and outcome.is_one_line and not found
        what = f"{self.shown(case)} {outcome.status} {outcome.said[-300:]}"
        return "refused" if sound else f"lost: {sorted(found)}", what

    def of_acquisition(self, case: Case, worker: int) -> tuple[str, str]:
        import hostile

        place = self.folder / f"acquired-{worker}"
        shutil.rmtree(place, ignore_errors=True)
        if case.kind == INSTRUMENT:
            return hostile.with_instrument(place, *self.instruments[case.call])
        if case.kind == CLIENT:
            return hostile.with_client(place, case.name, case.call)
        kind, number = KINDS[case.name]
        outcome, _ = self.acquisition(worker, kind, case.call, number)
        wrong = hostile.continued(place, outcome, kind == INTERRUPT)
        verdict = f"lost: {wrong}" if wrong else "refused" if outcome.status == 2 else "recovered"
        return verdict, f"{case} {outcome.status} {outcome.said[-300:]}"

    def acquisition(self, worker: int, kind: int, call: int, number: int) -> tuple["Outcome", int]:
        """An acquisition with this fault, and its calls if it came to its end."""
        import hostile
        from processes import in_child

        place = self.folder / f"acquired-{worker}"
        shutil.rmtree(place, ignore_errors=True)
        hostile.make_place(place)
        counted = place.with_suffix(".calls")
        with hostile.serving("program", "sound", 1) as source:
            arm = partial(self.layer.fault_arm, str(place).encode(), kind, call, number)
            work = hostile.acquiring(place, source, before=arm)

            def counting() -> int:
                status = work()
                counted.write_text(str(self.layer.fault_count()))
                return status

            outcome = in_child(counting, place.with_suffix(".said"))
        return outcome, int(counted.read_text()) if outcome.status == 0 else 0

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
        ("sheet.csv", "sheet.csv"),
        ("sheet.xlsx", "sheet.xlsx"),
    ):
        shutil.copyfile(inputs / source, folder / name)
    from stepdiag.head.description import find_shipped_head

    shutil.copyfile(find_shipped_head("beam_and_psd"), folder / "head.toml")


def part(campaign: Campaign, worker: int, arguments: argparse.Namespace, results: Path) -> None:
    """The cases of one process: those of its commands, and its share of the others."""
    chance = random.Random(worker)
    with results.open("w") as file:

        def note(kind: str, verdict: str, what: str) -> None:
            file.write(json.dumps([kind, verdict, what]) + "\n")
            file.flush()

        cases = [case for k, case in enumerate(campaign.others(arguments.short)) if k % arguments.jobs == worker]
        if arguments.command:
            cases = []  # of commands alone
        if arguments.short:
            cases = [case for case in cases if case.kind in (INSTRUMENT, CLIENT) or chance.random() < 0.5 / SHORT]
        numbers = range(0, len(campaign.commands), 3 if arguments.short else 1)
        for number in numbers[worker :: arguments.jobs]:
            if arguments.command and arguments.command not in campaign.commands[number].arguments:
                continue
            try:
                campaign.prepare(number, worker)
            except Exception as error:
                note(AT_RANDOM, f"lost: the campaign itself: {error!r}", campaign.commands[number].arguments)
                continue
            own = list(campaign.of_command(number))
            cases += chance.sample(own, max(1, len(own) // (SHORT // 2))) if arguments.short else own
        chosen = [case for case in cases if arguments.kind in (None, case.kind)]
        chance.shuffle(chosen)
        for case in chosen:
            try:
                found = campaign.run(case, worker)
            except Exception as error:
                found = [(f"lost: the campaign itself: {error!r}", str(case))]
            for verdict, what in found:
                note(case.kind, verdict, what)


def table(found: list[tuple[str, str, str]]) -> list[str]:
    counts = Counter((kind, verdict.split(":")[0]) for kind, verdict, _ in found)
    columns = ("refused", "recovered", "lost")
    lines = [f"{'kind':<26}{'tried':>8}" + "".join(f"{column:>11}" for column in columns)]
    for kind in (*EVERY_KIND, None):
        row = [sum(n for (k, v), n in counts.items() if (kind is None or k == kind) and v == c) for c in columns]
        lines.append(f"{kind or 'all':<26}{sum(row):>8}" + "".join(f"{count:>11}" for count in row))
    return lines


def results_in(folder: Path) -> list[tuple[str, str, str]]:
    lines = [line for path in folder.glob("results-*.jsonl") for line in path.read_text().splitlines(keepends=True)]
    return [tuple(json.loads(line)) for line in lines if line.endswith("\n")]


def main() -> int:
    parser = argparse.ArgumentParser(prog="./run faults", description=__doc__)
    parser.add_argument("--short", action="store_true", help="a third of the commands, a few of the cases")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--kind", choices=EVERY_KIND, help="only this kind")
    parser.add_argument("--command", help="only commands with this text")
    arguments = parser.parse_args()
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="stepdiag-faults-") as name:
        folder = Path(name)
        campaign = Campaign(folder)
        prepare_originals(campaign)
        print(f"{time.monotonic() - start:.0f} s: inputs are made", file=sys.stderr, flush=True)
        workers = set()
        for worker in range(arguments.jobs):
            child = os.fork()
            if child == 0:
                part(campaign, worker, arguments, folder / f"results-{worker}.jsonl")
                os._exit(0)
            workers.add(child)
        told = time.monotonic()
        crashed = False
        while workers:
            time.sleep(0.2)
            for child in list(workers):
                ended, status = os.waitpid(child, os.WNOHANG)
                if ended:
                    workers.remove(child)
                    crashed |= status != 0
            if time.monotonic() > told + 30.0:
                told = time.monotonic()
                found = results_in(folder)
                lost = sum(verdict.startswith("lost") for _, verdict, _ in found)
                print(f"{told - start:.0f} s: {len(found)} tried, {lost} lost", file=sys.stderr, flush=True)
        found = results_in(folder)
    lost_ones = [each for each in found if each[1].startswith("lost")]
    for kind, verdict, what in lost_ones:
        print(f"{kind}: {verdict}\n  {what}")
    print("\n".join(table(found)))
    print(f"{time.monotonic() - start:.0f} s, {arguments.jobs} processes")
    return 1 if lost_ones or crashed or not found else 0


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
