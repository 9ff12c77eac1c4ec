"""Commands that read calibrations: report one, compare two, test one with new readings."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stepdiag._core import InvalidArgument, read_error_map
from stepdiag.cli.in_book import Kept, OfMachine
from stepdiag.cli.options import (
    NOT_TO_BE_TRUSTED,
    PATH,
    Command,
    Writes,
    input_warnings,
    is_untrusted,
    json_option,
    tell,
    tell_trust,
    trust_warnings,
)
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import CALIBRATION, COMPARISON, FUNCTIONAL_POINT, PAGE, PDF, OutputFile
from stepdiag.progress import Progress

if TYPE_CHECKING:
    from stepdiag.presentation.page.contents import Contents

_WORDS = {
    "number": "Number of the report or certificate.",
    "customer": "Who receives the report.",
    "machine_type": "Maker and type of the machine.",
    "serial_number": "Serial number of the machine.",
    "operator": "Who measured.",
    "instrument": "Instrument, with its serial number.",
    "certificate": "Calibration certificate of the instrument.",
    "conditions": "Conditions of the measurement.",
    "signatures": "Who signs, with semicolons between them: lines at the end of the page.",
}


def _header_options(command: Command) -> Command:
    for name, meaning in reversed(_WORDS.items()):
        option = click.option(f"--{name.replace('_', '-')}", metavar="TEXT", help=meaning)
        command = option(command)
    return command


@click.command(
    cls=OfMachine,
    makes={"output": Kept("reports"), "functional_point": Kept("reports")},
    about=True,
    groups={
        "Output": ["output", "functional_point", "as_json"],
        "Workpiece": ["workpiece_expansion", "workpiece_temperature"],
        "Content of a page": ["scenario", "run", "uncertainty", "limit", "language"],
        "Header of a page (by default that of the scenario)": [*_WORDS, "logo"],
    },
    epilog="\b\nExample: stepdiag report calibration.nc --scenario scenario.toml --run run.csv -o report.html",
)
@click.argument("calibrations", nargs=-1, required=True, type=PATH, metavar="[BEFORE] CALIBRATION")
@click.option(
    "-o",
    "output",
    type=Writes(PAGE, PDF),
    metavar="FILE",
    help="Page to write (.html, one file that needs no network), or a PDF of it (.pdf, printed by Chromium).",
)
@click.option(
    "--functional-point",
    type=Writes(FUNCTIONAL_POINT),
    metavar="FILE",
    help="Also write the straightness of the functional point and that of the table (CSV).",
)
@click.option(
    "--workpiece-expansion",
    type=click.FloatRange(-1000.0, 1000.0),
    metavar="A",
    help="Also report what a part of this expansion coefficient, µm/(m K), measures at 20 °C.",
)
@click.option(
    "--workpiece-temperature",
    type=click.FloatRange(-273.15, 1000.0),
    metavar="T",
    help="Temperature in °C at which that part is machined.",
)
@click.option("--scenario", type=PATH, metavar="FILE", help="Scenario: header ([report]) and measured lines.")
@click.option("--run", type=PATH, metavar="FILE", help="Run: temperatures, and residuals of a CSV calibration.")
@click.option("--uncertainty", type=PATH, metavar="FILE", help="Uncertainty result (.nc): the budget.")
@click.option("--limit", type=float, metavar="UM", help="Limit of the largest error in the volume, in µm.")
@_header_options
@click.option("--logo", type=PATH, metavar="FILE", help="PNG or SVG picture.")
@click.option(
    "--language", type=click.Choice(["en", "de"]), default="en", show_default=True, help="Language of the page."
)
@json_option
@click.pass_context
def report(
    context: click.Context,
    /,
    calibrations: tuple[Path, ...],
    output: OutputFile | None,
    functional_point: OutputFile | None,
    workpiece_expansion: float | None,
    workpiece_temperature: float | None,
    scenario: Path | None,
    run: Path | None,
    uncertainty: Path | None,
    limit: float | None,
    logo: Path | None,
    language: str,
    as_json: bool,
    **words: str | None,
) -> None:
    """Summarise a CALIBRATION (CSV or netCDF), or write it as a page to hand over.

    Reports the largest values and uncertainties, and the point to which straightness refers. The
    tables refer to the axes' own frames. For an axis that carries the workpiece, or with a tool
    offset, the straightness of the functional point differs; netCDF files contain it as well.

    With -o the report is a page: verdict of the fit, summary, all curves with 95 % intervals, the
    volume in three dimensions, residuals, set-up and provenance. With an earlier calibration BEFORE
    it shows before and after. Calibrations in CSV have no residuals; --scenario and --run give them.
    """
    from stepdiag.findings.temperature import workpiece_rows
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.whole_files import check_input, write_whole
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.calibration import calibration_blocks, functional_point_csv

    if len(calibrations) > 2:
        raise InvalidArgument(f"expected one calibration, or an earlier one before it, got {len(calibrations)}")
    if (workpiece_expansion is None) != (workpiece_temperature is None):
        raise InvalidArgument("`workpiece_expansion`, `workpiece_temperature`: expected both, got one")
    calibration = calibrations[-1]
    path = None if functional_point is None else functional_point.claim(*calibrations)
    page = None
    if output is not None:
        page = _write_page(output, calibrations, scenario, run, uncertainty, limit, logo, language, words)
    else:
        given = {"scenario": scenario, "run": run, "uncertainty": uncertainty, "limit": limit, "logo": logo} | words
        for name, value in given.items():
            if value is not None:
                raise InvalidArgument(f"`{name}`: goes with a page (`output` report.html)")
        if len(calibrations) == 2:
            raise InvalidArgument(
                "two calibrations make a page (`output` report.html); stepdiag compare lists differences"
            )
    check_input(calibration)
    read = read_calibration(calibration) if page is None else page.calibration
    before = None if page is None else page.before
    if path is not None:
        write_whole(path, functional_point_csv(read))
    if as_json:
        from stepdiag.presentation.objects.report import report_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(report_object(read, calibration, trust_warnings(calibration, read))))
    else:
        for line in text_of(calibration_blocks(read)):
            say(line)
        if workpiece_expansion is not None and workpiece_temperature is not None:
            for line in workpiece_rows(read, workpiece_expansion, workpiece_temperature):
                say(line)
    if before is not None:
        for warning in trust_warnings(calibrations[0], before):
            tell("warning", warning)
    tell_trust(context, calibration, read)
    if before is not None and is_untrusted(before):
        context.exit(NOT_TO_BE_TRUSTED)


def _write_page(
    output: OutputFile,
    calibrations: tuple[Path, ...],
    scenario: Path | None,
    run: Path | None,
    uncertainty: Path | None,
    limit: float | None,
    logo: Path | None,
    language: str,
    words: Mapping[str, str | None],
) -> "Contents":
    """Write the page; what it shows."""
    from stepdiag.presentation.page.contents import ReportRequest
    from stepdiag.presentation.page.document import write_report
    from stepdiag.units import MICROMETRE

    before = calibrations[0] if len(calibrations) == 2 else None
    tolerance = None if limit is None else limit * MICROMETRE
    request = ReportRequest(calibrations[-1], before, scenario, run, uncertainty, tolerance, words, logo, language)
    path = output.claim(*request.inputs)
    with Progress("report"):
        contents = write_report(request, path)
    for note in contents.notes:
        tell("warning", note)
    return contents


@click.command(
    cls=OfMachine,
    makes={"output": Kept("reports")},
    epilog="\b\nExample: stepdiag compare before.csv after.nc -o differences.csv",
)
@click.argument("a", type=PATH)
@click.argument("b", type=PATH)
@click.option(
    "-o", "output", type=Writes(COMPARISON), metavar="FILE", help="Differences to write, CSV or netCDF (.nc)."
)
@click.option(
    "--limit",
    type=float,
    default=0.05,
    show_default=True,
    metavar="P",
    help="A difference is significant if its probability by chance is smaller than this (for all values together).",
)
@json_option
@click.pass_context
def compare(context: click.Context, a: Path, b: Path, output: OutputFile | None, limit: float, as_json: bool) -> None:
    """Compare two calibrations A and B (CSV or netCDF), or a calibration and an error map.

    Reports the error of the tool in the volume by A and by B, whether it became better or worse, and
    which parameters matter most there.

    Reports for every parameter the largest difference B - A, its position, its standard uncertainty
    sqrt(u_A^2 + u_B^2), and whether a difference is significant. The probability of each difference
    is multiplied by the number of values compared (Bonferroni). If nodes differ, the longer table
    is interpolated. Functions whose slope is not determined in both are compared by shape.
    """
    from stepdiag.calibration.comparison import compare
    from stepdiag.calibration.volume_change import volume_change
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.file_kind import kind_of_file
    from stepdiag.io.whole_files import check_input
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.comparison import comparison_blocks

    written = None if output is None else output.claim(a, b)
    if not 0.0 < limit < 1.0:
        raise InvalidArgument(f"--limit: expected a probability between 0 and 1, got {limit:g}")
    for path in (a, b):
        check_input(path)
    one, other = (
        read_error_map(path) if kind_of_file(path) == "error map" else read_calibration(path) for path in (a, b)
    )
    try:
        comparison = compare(one, other, limit=limit)
    except InvalidArgument as error:
        raise InvalidArgument(f"{a}, {b}: {error}") from None
    with Progress("volumes of A and B"):
        change = volume_change(comparison)
    if written is not None:
        from stepdiag.presentation.comparison import write_comparison

        write_comparison(comparison, written)
    warnings = [*trust_warnings(a, comparison.a), *trust_warnings(b, comparison.b)]
    if as_json:
        from stepdiag.presentation.objects.comparison import comparison_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(comparison_object(comparison, change, (a, b), warnings)))
    else:
        for line in text_of(comparison_blocks(comparison, change, str(a), str(b))):
            say(line)
    for warning in warnings:
        tell("warning", warning)
    if is_untrusted(comparison.a, comparison.b):
        context.exit(NOT_TO_BE_TRUSTED)


@click.command(
    cls=OfMachine,
    other_run=True,
    epilog="\b\nExample: stepdiag verify calibration.nc scenario.toml other_lines.csv",
)
@click.argument("calibration", type=PATH)
@click.argument("scenario", type=PATH)
@click.argument("run", type=PATH)
@click.option(
    "--alpha",
    type=float,
    default=0.001,
    show_default=True,
    metavar="P",
    help="Share of tests in which a right calibration may be refused.",
)
@click.option(
    "--compensated",
    "tables",
    type=PATH,
    multiple=True,
    metavar="TABLE",
    help="RUN was measured with this table of `export` in force; of Heidenhain's give each .com file.",
)
@json_option
@click.pass_context
def verify(
    context: click.Context,
    calibration: Path,
    scenario: Path,
    run: Path,
    alpha: float,
    tables: tuple[Path, ...],
    as_json: bool,
) -> None:
    """Test a CALIBRATION (netCDF) with the readings of RUN, from which it was not made.

    SCENARIO has plan, head and uncertainties of RUN: other diagonals, a line once more, another
    day. Each reading is predicted from the calibration, with the uncertainty of calibration, set-up
    and noise. The report says by chi-square whether all agree, by E_n (ISO 17043) how each line
    does, and which reading deviates most. How head and mirror stand is estimated from the readings.

    Where the readings do not agree, those that the tests of `evaluate` find wrong are named and left
    out. If the rest does not agree, or readings were left out, the command ends with a warning and
    exit code 3.

    With --compensated RUN is one of the compensated machine. It is also said whether the readings go
    with the table, with none, or with one of the opposite sign.
    """
    from stepdiag.config.toml_text import located
    from stepdiag.findings.faults import fault_text
    from stepdiag.io.data_files import read_calibration, read_measurement
    from stepdiag.io.whole_files import check_input
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.verification import agrees, verification_blocks
    from stepdiag.rechecking.verification import check_other_run, verify, verify_compensated
    from stepdiag.scenario.description import read_scenario

    if not 0.0 < alpha < 1.0:
        raise InvalidArgument(f"--alpha: expected a probability between 0 and 1, got {alpha:g}")
    for path in (calibration, run):
        check_input(path)
    known = read_scenario(scenario).known
    tested = read_calibration(calibration)
    check_other_run(tested, run)
    measurement = read_measurement(run)
    with located(f"{calibration}, {run}"), Progress("verify"):
        if tables:
            from stepdiag.importing.controller_tables import machine_of_tables

            table = machine_of_tables(tables, tested)
            verification, compensated = verify_compensated(tested, known, measurement, table)
        else:
            verification, compensated = verify(tested, known, measurement), None
    warnings = trust_warnings(calibration, tested)
    warnings += input_warnings(known, run, measurement)
    if not agrees(verification, alpha):
        warnings = [
            f"{run}: does not agree with {calibration}: do not use the calibration until you know why",
            *warnings,
        ]
    warnings += [f"{run}: {fault_text(found)}" for found in verification.left_out]
    if compensated is not None and compensated.acts != "as it is":
        warnings = [f"{tables[0]}: {compensated.sentence()}", *warnings]
    if as_json:
        from stepdiag.presentation.objects.verification import verification_object
        from stepdiag.presentation.objects.writer import json_text

        files = (calibration, run)
        found = verification_object(
            verification, tested, measurement, alpha, files, warnings, compensated=compensated, tables=tables
        )
        click.echo(json_text(found))
    else:
        if compensated is not None and compensated.acts == "as it is":
            say(compensated.sentence())
        for line in text_of(verification_blocks(verification, measurement, alpha)):
            say(line)
    for warning in warnings:
        tell("warning", warning)
    if not agrees(verification, alpha) or verification.left_out or is_untrusted(tested):
        context.exit(NOT_TO_BE_TRUSTED)


@click.command(
    cls=OfMachine,
    makes={"update": Kept("calibrations")},
    other_run=True,
    epilog="\b\nExample: stepdiag recheck calibration.nc short.toml monday.csv --update monday.nc",
)
@click.argument("baseline", type=PATH)
@click.argument("scenario", type=PATH)
@click.argument("run", type=PATH)
@click.option(
    "--alpha",
    type=float,
    default=0.001,
    show_default=True,
    metavar="P",
    help="Share of rechecks in which each of the two tests (change, explained) refuses an unchanged machine.",
)
@click.option(
    "--update",
    type=Writes(CALIBRATION),
    metavar="FILE",
    help="Calibration to write: the baseline with the change and their joint covariance, netCDF (.nc) or CSV.",
)
@json_option
@click.pass_context
def recheck(
    context: click.Context,
    baseline: Path,
    scenario: Path,
    run: Path,
    alpha: float,
    update: OutputFile | None,
    as_json: bool,
) -> None:
    """Test with a short RUN whether the machine has changed since the calibration BASELINE (netCDF).

    SCENARIO has plan, head and uncertainties of RUN, and in [change] how far the machine may have
    changed: scales, squarenesses, bows of straightnesses, slopes of angles. Reports whether it has
    changed, which changes the readings determine one by one, which only together, what may be hidden in
    the volume, and the error there now.

    Readings that the tests of `evaluate` find wrong are named and left out. If the machine has
    changed, no such change explains the readings (changed, unexplained), or readings were left out,
    the command ends with a warning and exit code 3.
    """
    from stepdiag.calibration.volume import volume
    from stepdiag.config.toml_text import located
    from stepdiag.findings.faults import fault_text
    from stepdiag.io.data_files import read_calibration, read_measurement, write_calibration
    from stepdiag.io.whole_files import check_input
    from stepdiag.presentation.blocks import text_of
    from stepdiag.presentation.verification import recheck_blocks
    from stepdiag.rechecking.recheck import Judged, recheck
    from stepdiag.rechecking.verification import check_other_run
    from stepdiag.scenario.description import read_scenario
    from stepdiag.scenario.provenance import provenance_of

    if not 0.0 < alpha < 1.0:
        raise InvalidArgument(f"--alpha: expected a probability between 0 and 1, got {alpha:g}")
    for path in (baseline, run):
        check_input(path)
    described = read_scenario(scenario)
    target = None if update is None else update.claim(baseline, scenario, run, error_map=described.truth.error_map)
    known = described.known
    before = read_calibration(baseline)
    check_other_run(before, run)
    measurement = read_measurement(run)
    with located(f"{baseline}, {run}"), Progress("recheck"):
        judged = Judged(recheck(before, known, measurement), before, alpha)
        after = volume(judged.updated, ranking=False)
    if target is not None:
        write_calibration(judged.updated, target, provenance=provenance_of(known, run))
    warnings = trust_warnings(baseline, before)
    warnings += input_warnings(known, run, measurement)
    if judged.verdict == "unexplained":
        warnings.append(
            f"{run}: the machine has changed, unexplained: no change of low order explains these readings; "
            f"do not use {baseline}, and evaluate the run to see why"
        )
    elif judged.verdict == "changed":
        warnings.append(f"{baseline}: the machine has changed since: do not use it as it is")
    warnings += [f"{run}: {fault_text(found)}" for found in judged.recheck.left_out]
    if as_json:
        from stepdiag.presentation.objects.recheck import recheck_object
        from stepdiag.presentation.objects.writer import json_text

        click.echo(json_text(recheck_object(judged, measurement, after, (baseline, run, target), warnings)))
    else:
        for line in text_of(recheck_blocks(judged, measurement, after)):
            say(line)
    for warning in warnings:
        tell("warning", warning)
    if not judged.is_sound or is_untrusted(before):
        context.exit(NOT_TO_BE_TRUSTED)
