"""What is known when a run of a scenario is evaluated, and what is asked for: no truth of a simulated run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from stepdiag import _core
from stepdiag.config.scenario_keys import KnownKeys, PlanSection
from stepdiag.config.toml_text import located
from stepdiag.display import Displayed, Facts, lengths_text, point_text, scale_lines_text
from stepdiag.scenario.adjustment import change_priors, machine_drift_of, plausible_limits, setup_priors, smoothness_of
from stepdiag.scenario.heads import DescribedHead, check_alike, check_mirrors, heads_by_line, make_heads, signals_of
from stepdiag.scenario.instrument import KnownInstrument, instrument_of
from stepdiag.scenario.plausible_inputs import implausible_keys
from stepdiag.scenario.setup import weights
from stepdiag.scenario.temperature import known_expansion
from stepdiag.scenario.uncertain_inputs import uncertain_inputs
from stepdiag.units import MICROMETRE


@dataclass(frozen=True, repr=False)
class Known(Displayed):
    """The known half of a scenario, checked and in native units (mm, rad, nm): all that evaluations, reports, measuring
    programs and the acquisition are given. What a run was simulated with is in no attribute of it.

    `described`: the heads by design, by the place of their keys, also those that measure no line. The other fields
    follow from the first four: chain, tool and plan; by line the head that measures it, as it is described and as it
    is by design; the channels of a run; weights of readings, priors of the set-up, smoothness and limits of what is
    plausible; how far the machine may change; what is known of the scales' expansion, None where the scenario has no
    [temperature]; the drift of the functional point, None where it is no unknown; what is uncertain; what is known of
    the instrument's scale and its sensors of the air. `assumed_air`: with whose constant index the instrument counts;
    None where it compensates for the air. `implausible`: what is stated and no workshop has, a sentence each."""

    path: Path
    keys: KnownKeys
    described: Mapping[str, DescribedHead]
    assumed_air: _core.Environment | None = field(compare=False)
    chain: _core.Chain = field(compare=False)
    tool: tuple[float, float, float] = field(compare=False)
    plan: _core.Plan = field(compare=False)
    described_heads: Mapping[str, DescribedHead] = field(compare=False)
    heads: Mapping[str, _core.Head] = field(compare=False)
    signals: tuple[str, ...] = field(compare=False)
    uncertainty: _core.ReadingUncertainty = field(compare=False)
    setup: _core.SetupPriors = field(compare=False)
    setup_by_line: Mapping[str, _core.SetupPriors] = field(compare=False)
    smoothness: _core.Smoothness | None = field(compare=False)
    plausible: _core.PlausibleLimits = field(compare=False)
    change: _core.ChangePriors = field(compare=False)
    expansion: _core.KnownExpansion | None = field(compare=False)
    machine_drift: _core.MachineDrift | None = field(compare=False)
    uncertain: _core.UncertainInputs = field(compare=False)
    implausible: tuple[str, ...] = field(compare=False)
    instrument: KnownInstrument = field(compare=False)

    @property
    def known(self) -> "Known":
        """Itself: what takes a scenario for its known half alone takes this as well."""
        return self

    @property
    def head(self) -> _core.Head:
        """The head of the first line; those of the others have the same readings."""
        return next(iter(self.heads.values()))

    @property
    def between_nodes(self) -> float | None:
        """Standard uncertainty of the functional point by errors between the nodes, mm; None: nothing is stated."""
        stated = self.keys.uncertainty.between_nodes_um
        return None if stated is None else stated * MICROMETRE

    def _facts(self) -> Facts:
        plan = self.plan
        return [
            ("file", str(self.path)),
            ("chain", self.chain.name),
            ("volume", lengths_text(plan.volume)),
            ("lines", f"{', '.join(plan.lines)}, of {plan.steps} steps"),
            ("scale lines", scale_lines_text(plan)),
            ("signals", ", ".join(self.signals)),
            ("tool offset", point_text(self.tool)),
            ("heads", ", ".join(dict.fromkeys(head.layout for head in self.heads.values()))),
        ]


def known_of(
    keys: KnownKeys, described: Mapping[str, DescribedHead], path: Path, assumed_air: _core.Environment | None = None
) -> Known:
    """Makes the core's types, whose own checks get file and section put in front. What is said of the set-up of lines
    that are not measured is passed over."""
    with located(f"{path}: machine.chain"):
        chain = _core.Chain(keys.machine.chain)
    with located(f"{path}: plan"):
        plan = _core.Plan(
            (keys.volume.x_mm, keys.volume.y_mm, keys.volume.z_mm),
            list(keys.plan.lines),
            keys.plan.steps,
            order=_orders(keys.plan),
            scale_lines=list(keys.plan.scale_lines),
            check_points=_core.CheckPoints(keys.plan.check_points, keys.plan.check_point),
            scale_points=keys.plan.scale_points,
            block=keys.plan.block,
        )
    check_mirrors(described, plan, path)
    described_heads = heads_by_line(keys, plan, described, path)
    heads = make_heads(described_heads, {}, path)
    check_alike(described_heads, heads, path)
    head = next(iter(heads.values()))
    with located(str(path)):
        uncertainty = weights(keys)
    signals = signals_of(keys, head, path)
    setup, setup_by_line = setup_priors(keys, head.layout, path)
    with located(str(path)):
        implausible = tuple(implausible_keys(keys, described_heads, heads, assumed_air))
    return Known(
        path=path,
        keys=keys,
        described=MappingProxyType(dict(described)),
        assumed_air=assumed_air,
        chain=chain,
        tool=keys.machine.tool_mm,
        plan=plan,
        described_heads=MappingProxyType(described_heads),
        heads=MappingProxyType(heads),
        signals=tuple(signals),
        uncertainty=uncertainty,
        setup=setup,
        setup_by_line=MappingProxyType({line: own for line, own in setup_by_line.items() if line in heads}),
        smoothness=smoothness_of(keys.smoothness, path),
        plausible=plausible_limits(keys.plausible),
        change=change_priors(keys.change),
        expansion=known_expansion(keys.temperature, path),
        machine_drift=machine_drift_of(keys.adjustment, path),
        uncertain=uncertain_inputs(keys, described_heads, heads, path),
        implausible=implausible,
        instrument=instrument_of(keys.instrument),
    )


def _orders(keys: PlanSection) -> list[str]:
    """By run: a backward run goes the way of the forward run before it."""
    orders = [keys.order] if isinstance(keys.order, str) else keys.order
    return [order for order in orders for _ in range(2 if keys.backward and len(orders) > 1 else 1)]


def runs_of(keys: PlanSection) -> int:
    """How often each line is measured, backward runs not counted."""
    return keys.repeats * (1 if isinstance(keys.order, str) else len(keys.order))
