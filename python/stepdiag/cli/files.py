"""Commands that create a user's first files, take in those of spreadsheets, and check files and the installation."""

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

import click
import numpy as np

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, Writes, json_option, out_file, tell
from stepdiag.cli.terminal import plain, say
from stepdiag.io.outputs import IMPORTED_CALIBRATION, IMPORTED_MAP, MEASUREMENT, SELFTEST, OutputFile
from stepdiag.progress import Progress

HEADS: Final = ("ideal", "psd", "multi_beam")
Result = TypeVar("Result")


@click.command(epilog="\b\nExample: stepdiag check scenario.toml run.csv")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@json_option
@click.pass_context
def check(context: click.Context, files: tuple[Path, ...], as_json: bool) -> None:
    """Check each FILE: report its kind and whether it is valid.

    Accepts scenarios, heads and studies (TOML), measurements and calibrations (CSV or netCDF),
    error maps (CSV), raw readings (JSON lines) and the compensation.ini of an export to
    linuxcnc-comp, with the tables beside it. A scenario is checked together with its error
    map. If there is one scenario among the files, each measurement is adjusted with it. The command
    reports whether lines, points and distances belong to that plan, and the verdict of the fit.

    Exit code 2 if a file is invalid or two do not belong together, 3 if a fit is rejected or a
    calibration is unverified (without a checksum).
    """
    from stepdiag.findings.meaning import UNVERIFIED
    from stepdiag.presentation.file_check import Finding, examine
    from stepdiag.presentation.scenario_and_run import FoundTogether, adjust_run

    tell_found = _silent if as_json else say
    found: list[tuple[Path, Finding | InvalidArgument]] = []
    for file in files:
        with Progress(f"check {file.name}"):
            finding = _found_or_refused(examine, file)
        found.append((file, finding))
        if isinstance(finding, Finding):
            tell_found(f"{file}: {finding.kind}: {finding.summary}")
            for warning in finding.warnings:
                tell_found(f"{file}: warning: {warning}")
    of_kind: dict[str, list[Path]] = {}
    for file, finding in found:
        if isinstance(finding, Finding):
            of_kind.setdefault(finding.kind, []).append(file)
    runs: list[tuple[Path, FoundTogether | InvalidArgument]] = []
    scenario = of_kind["scenario"][0] if len(of_kind.get("scenario", [])) == 1 else None
    if scenario is not None:
        for run in of_kind.get("measurement", []):
            with Progress(f"adjust {run.name}"):
                together = _found_or_refused(adjust_run, scenario, run)
            runs.append((run, together))
            if isinstance(together, FoundTogether):
                for line in together.text:
                    tell_found(f"{run} with {scenario}: {line}")
    results = [result for _, result in (*found, *runs)]
    sound = not any(isinstance(result, InvalidArgument) for result in results)
    judged = [result for result in results if isinstance(result, Finding | FoundTogether)]
    warnings = ["a fit is rejected: do not use results from it"] if any(r.fit == "rejected" for r in judged) else []
    warnings += [f"{path}: {UNVERIFIED}" for path, r in found if isinstance(r, Finding) and r.unverified]
    warnings = warnings if sound else []
    if as_json:
        from stepdiag.presentation.objects.check import check_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(check_object(found, scenario, runs, warnings)))
    for warning in warnings:
        tell("warning", warning)
    if not sound:
        context.exit(2)
    if warnings:
        context.exit(NOT_TO_BE_TRUSTED)


def _silent(line: str) -> None:
    """Print nothing."""


def _found_or_refused(function: Callable[..., Result], *files: Path) -> Result | InvalidArgument:
    """What the function returns, or its refusal, which is told."""
    try:
        return function(*files)
    except InvalidArgument as error:
        tell("error", str(error))
        return InvalidArgument(plain(str(error)))


@click.command(epilog="\b\nExample: stepdiag init -o machine")
@click.option("-o", "output", required=True, type=Writes(), metavar="DIR", help="Folder to write.")
@click.option(
    "--sheet-for",
    "scenario",
    type=PATH,
    metavar="SCENARIO",
    help="Write only measurement.csv, for the plan and head of this scenario.",
)
@click.option("--head", "head_name", metavar="NAME", help="Start from a copy of this shipped head (see head list).")
@click.option("--volume", type=float, nargs=3, metavar="X Y Z", help="Travels to measure, mm.")
@click.option("--chain", metavar="CHAIN", help='Kinematic chain, such as "[w X\' b Y Z t]".')
@click.option("--layout", type=click.Choice(HEADS), help="What the head reads.")
@click.option("--steps", type=int, metavar="N", help="Steps per axis on each line.")
@click.option("--all-keys", is_flag=True, help="Write every key of a scenario, with comments.")
def init(
    output: OutputFile,
    scenario: Path | None,
    head_name: str | None,
    volume: tuple[float, float, float] | None,
    chain: str | None,
    layout: str | None,
    steps: int | None,
    all_keys: bool,
) -> None:
    """Start with your own machine: a scenario to edit and a sheet to fill in.

    Writes scenario.toml, and measurement.csv with all commanded points and empty fields for the
    readings of your instrument. On a terminal it asks what no option says. With --head, the
    scenario uses head.toml, a copy of a shipped description, instead of a layout.

    Nothing is overwritten but a sheet without any reading: after changing the scenario, --sheet-for
    writes it again.
    """
    from stepdiag.config.scenario_template import LAYOUTS, short_template, template
    from stepdiag.head.description import find_shipped_head
    from stepdiag.io.data_files import write_measurement
    from stepdiag.io.whole_files import make_folder, read_text, write_whole
    from stepdiag.scenario.description import parse_scenario, read_scenario
    from stepdiag.scenario.known import runs_of
    from stepdiag.scenario.planned_readings import empty_sheet

    of_scenario = {
        "head": head_name,
        "volume": volume,
        "chain": chain,
        "layout": layout,
        "steps": steps,
        "all-keys": all_keys or None,
    }
    for option, value in of_scenario.items():
        if scenario is not None and value is not None:
            raise InvalidArgument(f"--{option}: goes with a new scenario, not with --sheet-for")
    if layout is not None and head_name is not None:
        raise InvalidArgument("--layout: goes with a head that has no description, not with --head")
    folder = output.path
    texts = {}
    if scenario is not None:
        known = read_scenario(scenario).known
    else:
        _check_free(folder, ["scenario.toml", *(["head.toml"] if head_name else [])])
        if sys.stdin.isatty() and sys.stdout.isatty():
            volume, chain, layout, steps = _asked(volume, chain, layout, steps, has_head=head_name is not None)
        values: dict[tuple[str, str], Any] = {
            ("machine", "chain"): chain,
            ("plan", "steps"): steps,
            ("head", "layout"): layout,
        }
        if volume is not None:
            values |= {("volume", f"{axis}_mm"): travel for axis, travel in zip("xyz", volume, strict=True)}
        values = LAYOUTS.get(layout or "", {}) | {place: value for place, value in values.items() if value is not None}
        write = template if all_keys else short_template
        texts["scenario.toml"] = write("head.toml" if head_name else None, values)
        shipped = find_shipped_head(head_name) if head_name else None
        if shipped is not None:
            texts["head.toml"] = read_text(shipped)
        # Checked as in its new folder, which does not contain the head's copy yet.
        known = parse_scenario(write(head_name, values), "the new scenario").known
    written = [folder / name for name in (*texts, "measurement.csv")]
    _check_free(folder, texts)
    if (folder / "measurement.csv").exists():
        _check_empty(folder / "measurement.csv")
    make_folder(folder)
    keys = known.keys.plan
    sheet = empty_sheet(known.plan, known.signals, repeats=runs_of(keys), backward=keys.backward)
    write_measurement(sheet, folder / "measurement.csv")  # first: it is the largest, where a disk is full
    for name, text in texts.items():
        write_whole(folder / name, text)
    for path in written:
        click.echo(f"wrote {path}")


def _asked(
    volume: tuple[float, float, float] | None,
    chain: str | None,
    layout: str | None,
    steps: int | None,
    *,
    has_head: bool,
) -> tuple[tuple[float, float, float], str, str | None, int]:
    """What a person at a terminal says of what no option has said."""
    if volume is None:
        travels = [click.prompt(f"Travel of {axis}, mm", 1000.0, type=float) for axis in "XYZ"]
        volume = (travels[0], travels[1], travels[2])
    if chain is None:
        click.echo(
            "Kinematic chain from the workpiece w over the bed b to the tool t; a prime marks the axes before b."
        )
        chain = click.prompt("Chain", "[w X' b Y Z t]")
    if layout is None and not has_head:
        click.echo("ideal: distance and two tilts; psd: distance and spot; multi_beam: three or more distances.")
        layout = click.prompt("What the head reads", "ideal", type=click.Choice(HEADS))
    if steps is None:
        steps = int(click.prompt("Steps per axis on each line", 10, type=int))
    return volume, str(chain), layout, steps


def _check_free(folder: Path, names: Iterable[str]) -> None:
    for path in (folder / name for name in names):
        if path.exists() or path.is_symlink():
            again = f'; after a change of it, "stepdiag init --sheet-for {path} -o {folder}" writes its sheet again'
            more = again if path.name == "scenario.toml" else ""
            raise InvalidArgument(f"{path}: exists already, and is not overwritten{more}")


def _check_empty(sheet: Path) -> None:
    """Raise InvalidArgument where a sheet has a reading, or is none."""
    from stepdiag.io.data_files import read_measurement

    try:
        values = read_measurement(sheet).channels.values()
    except InvalidArgument as error:
        raise InvalidArgument(f"{sheet}: exists already, and is not overwritten ({error})") from None
    if sheet.is_symlink() or not all(np.isnan(one).all() for one in values):
        raise InvalidArgument(f"{sheet}: exists already, and is not overwritten: it has readings")


@click.command(epilog="\b\nExample: stepdiag selftest -o selftest.txt")
@click.option("-o", "output", type=Writes(SELFTEST), metavar="FILE", help="Also write the record (.txt).")
@json_option
@click.pass_context
def selftest(context: click.Context, output: OutputFile | None, as_json: bool) -> None:
    """Run cases with a known truth on this installation, and print the record.

    Compares evaluations, the compensator, indices of air and glass, and uncertainties with values
    that do not come from stepdiag, and tries files that must be refused. The table says for each
    case what is compared, the largest deviation, what is allowed, and where the truth comes from.

    Ends with exit code 3 if a case fails: do not use this installation.
    """
    from stepdiag.io.whole_files import write_whole
    from stepdiag.selftest.cases import run_selftest

    path = None if output is None else output.claim()
    with Progress("self-test"):
        found = run_selftest()
    failed = sorted({row.case for row in found.rows if not row.passed})
    warnings = [] if found.passed else [f"the self-test failed ({', '.join(failed)}): do not use this installation"]
    text = found.text
    if as_json:
        from stepdiag.presentation.objects.selftest import selftest_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(selftest_object(found, warnings)))
    else:
        click.echo(text, nl=False)
    if path is not None:
        write_whole(path, text)
    for warning in warnings:
        tell("warning", warning)
    if warnings:
        context.exit(NOT_TO_BE_TRUSTED)


@click.command("import", epilog="\b\nExample: stepdiag import readings.xlsx -o run.csv")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@out_file("Measurement to write, CSV or netCDF (.nc).", MEASUREMENT)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="HEAD=NAME",
    help='What a head means: "Distance [µm]=distance", "Tilt A=-alpha [µrad]"; "HEAD=" leaves it out.',
)
@click.option("--separator", type=click.Choice(["comma", "semicolon", "tab"]), help="Separator of fields.")
@click.option("--decimal", type=click.Choice(["point", "comma"]), help="Decimal mark of numbers.")
@click.option("--sheet", metavar="NAME", help="Sheet of the workbook.  [default: the one with the heads]")
@click.option("--hidden", type=click.Choice(["take", "leave"]), help="Hidden rows and columns of workbooks.")
@click.option("--first-point", type=click.IntRange(0, 1), metavar="0|1", help="Number of the first point of a line.")
@click.option(
    "--origin",
    type=float,
    nargs=3,
    metavar="X Y Z",
    help="The file's coordinates of home, mm.  [default: 0 0 0; tables of controllers: as they say, or their first]",
)
@click.option("--chain", metavar="CHAIN", help="Chain of the machine, for tables of controllers that do not say it.")
@click.option("--volume", type=float, nargs=3, metavar="X Y Z", help="Volume, mm, likewise.  [default: their end]")
@click.option("--tool", type=float, nargs=3, metavar="X Y Z", help="Tool offset, mm, likewise.  [default: 0 0 0]")
@click.option(
    "--uncertainty",
    type=float,
    nargs=2,
    metavar="UM URAD",
    help="Standard uncertainty of a table, lengths and angles: makes a calibration (.nc) that `verify` takes.",
)
@click.option("--scenario", type=PATH, metavar="FILE", help="Take the commanded positions from this scenario's plan.")
@click.option("--overwrite", is_flag=True, help="Replace an existing measurement of this name.")
def import_(
    files: tuple[Path, ...],
    output: OutputFile,
    columns: tuple[str, ...],
    separator: str | None,
    decimal: str | None,
    sheet: str | None,
    hidden: Literal["take", "leave"] | None,
    first_point: int | None,
    origin: tuple[float, float, float] | None,
    chain: str | None,
    volume: tuple[float, float, float] | None,
    tool: tuple[float, float, float] | None,
    uncertainty: tuple[float, float] | None,
    scenario: Path | None,
    overwrite: bool,
) -> None:
    """Read the measurement in each FILE in the form that spreadsheet programs give it.

    FILE is text with commas, semicolons or tabs (UTF-8, UTF-16 or Latin-1), or a workbook (.xlsx,
    .ods). Heads may have any case, and units in brackets: "Spot X [µm]". The command prints what
    it took each column for. Where a file can be read in two ways it says which, and does not
    choose. Several files become one measurement.

    Or FILE is an error map in the form of a controller or of another program, which becomes one of
    stepdiag: Etalon Exchange Format (TRAC-CAL), ISG CSV, SINUMERIK, Heidenhain .COM, COMP_FILEs by
    their compensation.ini, a firmware's command. It can be plotted, compared and exported; with
    --uncertainty, which such tables do not state, it is a calibration that `verify` takes too.
    """
    from stepdiag.importing.controller_tables import is_controller_table, read_controller_tables
    from stepdiag.io.data_files import write_calibration
    from stepdiag.units import MICROMETRE, MICRORADIAN

    tables = [is_controller_table(file) for file in files]
    if all(tables):
        given = {"column": columns, "separator": separator, "decimal": decimal, "sheet": sheet, "scenario": scenario}
        if other := next((name for name, value in given.items() if value), None):
            raise InvalidArgument(f"`{other}`: belongs to sheets of readings; {files[0]} is a controller's table")
        path = OutputFile(output.path, (IMPORTED_MAP,) if uncertainty is None else (IMPORTED_CALIBRATION,)).claim(
            *files
        )
        found_map = read_controller_tables(files, chain=chain, volume=volume, tool=tool, origin=origin)
        if uncertainty is None:
            found_map.errors.write(path, chain=found_map.chain, volume=found_map.volume, tool=found_map.tool)
        else:
            lengths, angles = uncertainty
            write_calibration(found_map.as_calibration(lengths * MICROMETRE, angles * MICRORADIAN), path)
        for line in found_map.text:
            say(line)
        return
    if any((chain, volume, tool, uncertainty)):
        raise InvalidArgument(
            f"{files[tables.index(False)]}: no table of a controller; `chain`, `volume`, `tool`, `uncertainty` go with "
            "one"
        )
    from stepdiag.importing.run import import_files
    from stepdiag.io.data_files import write_measurement
    from stepdiag.scenario.description import read_scenario
    from stepdiag.scenario.plausible_inputs import odd_columns

    described = read_scenario(scenario) if scenario is not None else None
    path = output.claim(
        *files,
        *([scenario] if scenario is not None else []),
        error_map=described.truth.error_map if described else None,
        overwrite=overwrite,
    )
    with Progress("import"):
        found = import_files(
            files,
            column=columns,
            separator=separator,
            decimal=decimal,
            sheet=sheet,
            hidden=hidden,
            first_point=first_point,
            origin=origin or (0.0, 0.0, 0.0),
            plan=described.known.plan if described else None,
        )
    write_measurement(found.measurement, path)
    for line in found.text:
        say(line)
    for warning in odd_columns(found.measurement, described.known.keys if described else None):
        tell("warning", f"{path}: {warning}")
