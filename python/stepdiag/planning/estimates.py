"""What plans with few steps give, for thousands of choices of lines: from what each line tells, where that is all."""

from collections.abc import Callable, Sequence
from typing import Final

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.calibration.volume import GRID
from stepdiag.planning.plan_by_time import Candidate, Evaluated, evaluate, evaluated, says_more, usual
from stepdiag.scenario.description import Scenario, adjustment_options, reduced_run, simulate_scenario
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known

ANY_LINE: Final = "ppp"  # a plan has at least one that is no scale line


class Estimates:
    """Of the adjustment of runs of plans with some of these lines and scale lines, each found once."""

    def __init__(self, scenario: Scenario, lines: Sequence[str], scales: Sequence[str], *, faults: bool) -> None:
        self.scenario, self.lines, self.scales, self.faults = scenario, tuple(lines), tuple(scales), faults
        # Uncertain inputs and faults take whole runs.
        self.by_line = not faults and not says_more(scenario.known)
        self.found: dict[Candidate, Evaluated] = {}
        self.tells: dict[Candidate, _core.LineInformation | None] = {}

    def of(self, candidate: Candidate, between: Callable[[Candidate], float]) -> Evaluated:
        """`between`: seconds from a reading to the next one."""
        if candidate not in self.found:
            tells = self._tells(candidate, between) if self.by_line else None
            if tells is None:
                self.found[candidate] = evaluate(self.scenario, candidate, between(candidate), faults=self.faults)
            else:
                self.found[candidate] = evaluated(tells.known_by(candidate.lines, candidate.scale_lines))
        return self.found[candidate]

    def _tells(self, candidate: Candidate, between: Callable[[Candidate], float]) -> _core.LineInformation | None:
        """Each line's information with the settings of a candidate; None where lines have more in common than the
        machine, or no run of all of them can be made."""
        key = candidate.with_lines(self.lines, self.scales)
        if key not in self.tells:
            try:
                self.tells[key] = self._run_of_each(key, between(candidate))
            except InvalidArgument:
                self.tells[key] = None
        return self.tells[key]

    def _run_of_each(self, every: Candidate, between: float) -> _core.LineInformation:
        known, run, options = self._planned(every.with_lines(self.lines, ()), between)
        tells = _core.LineInformation(run, known.plan, of_run(known.heads), known.chain, known.tool, options, grid=GRID)
        known, run, options = self._planned(every.with_lines((ANY_LINE,), self.scales), between)
        tells.add(run, known.plan, of_run(known.heads), options)
        return tells

    def _planned(
        self, candidate: Candidate, between: float
    ) -> tuple[Known, _core.Measurement, _core.AdjustmentOptions]:
        scenario = usual(self.scenario, candidate, between)
        run = reduced_run(scenario.known, simulate_scenario(scenario))
        return scenario.known, run, adjustment_options(scenario.known, run)
