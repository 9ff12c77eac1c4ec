"""Readings that are known as well as their numbers are rounded, or better: no size of machine or noise is refused."""

import numpy as np
import pytest

import stepdiag as sd

LINES = ["ppp", "npp", "pnp", "nnp"]
LAYOUTS = ["ideal", "psd", "multi_beam"]


def head_of(layout: str, size: float) -> sd.Head:
    beams = {"multi_beam": [(0.0, 0.01 * size), (-0.01 * size, -0.005 * size), (0.01 * size, -0.005 * size)]}
    return sd.Head(
        layout,
        standoff=0.3 * size,
        psd_distance=0.1 * size if layout == "psd" else 0.0,
        beam_offsets=beams.get(layout, []),
        aperture=0.5 * size,
    )


def simulated(layout: str, size: float, noise: float, *, seed: int = 1, errors: float = 1.0) -> tuple:
    """A run of a machine of this size (mm), its plan and head; `noise`: of distances, by the size."""
    volume = (0.8 * size, 0.6 * size, 0.5 * size)
    plan = sd.Plan(volume, LINES, 8, scale_lines=["p00", "0p0", "00p"])
    error_map = sd.random_error_map(
        volume,
        seed=seed,
        translation=errors * 2e-5 * size,
        rotation=errors * 6e-5,
        squareness=errors * 6e-5,
        intervals=8,
    )
    machine = sd.Machine("[w X' b Y Z t]", error_map)
    head = head_of(layout, size)
    of_tilts = max(noise, 1e-9)
    run = sd.simulate(
        machine,
        plan,
        head,
        noise=sd.Noise(noise * size, of_tilts, of_tilts * size, seed) if noise else sd.Noise(),
        misalignment={line: sd.Misalignment(reflector=errors * np.array([1e-4, 3e-4])) for line in LINES},
    )
    stated = sd.methods.ReadingUncertainty(distance=(noise or 1e-7) * size, tilt=of_tilts, spot=of_tilts * size)
    return machine, plan, head, run, stated


# Three beams whose constants are unknown crawl along a valley where their arms are 1 mm and noise is below 1 pm.
@pytest.mark.parametrize(
    ("layout", "size", "noise"),
    [
        (layout, size, noise)
        for layout in LAYOUTS
        for size in (1.0, 10.0, 1e3, 1e5)
        for noise in (1e-7, 1e-9, 1e-10, 1e-11)
        if layout != "multi_beam" or (size >= 100.0 or (size == 10.0 and noise > 1e-11))
    ],
)
def test_noise_of_any_size_is_explained_on_machines_of_any_size(layout: str, size: float, noise: float) -> None:
    machine, plan, head, run, stated = simulated(layout, size, noise)
    found = sd.methods.adjust(run, plan, head, machine.chain, uncertainty=stated)
    assert found.verdict.fit == "accepted"
    assert not found.calibration.undetermined
    # Five standard deviations of a variance of that many degrees of freedom.
    scatter = 5.0 * np.sqrt(2.0 / found.degrees_of_freedom)
    if found.rounded:  # beams of unknown constants count for less than stated
        assert layout == "multi_beam"
        assert noise < 1e-9
        assert found.variance_factor < 1.0 + scatter
    else:
        assert abs(found.variance_factor - 1.0) < scatter


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("stated", [1e-12, 1e-9, 1e-7])
def test_what_cannot_be_weighed_is_replaced_and_values_stay_within_their_uncertainties(
    layout: str, stated: float
) -> None:
    # Distances to 1 fm to 0.1 nm of a metre, beside tilts of 10 µrad.
    machine, plan, head, run, _ = simulated(layout, 1e3, 0.0)
    uncertainty = sd.methods.ReadingUncertainty(distance=stated, tilt=1e-5, spot=1e-2)
    found = sd.methods.adjust(run, plan, head, machine.chain, uncertainty=uncertainty)
    distances = [rounded for rounded in found.rounded if rounded.channel.startswith("d")]
    assert len(distances) == (3 if layout == "multi_beam" else 1)
    assert all(rounded.cause == "weights" and rounded.stated == stated < rounded.used for rounded in distances)
    assert found.verdict.fit == "unchecked"
    for name, (position, value, u) in found.calibration.functions.items():
        truth = np.interp(position, *machine.errors.functions[name])
        assert np.all(np.abs(value - truth) <= 0.1 * np.asarray(u) + 1e-12)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("size", [10.0, 1e3, 1e5])
def test_a_simulation_without_noise_is_unchecked(layout: str, size: float) -> None:
    machine, plan, head, run, stated = simulated(layout, size, 0.0)
    verdict = sd.methods.adjust(run, plan, head, machine.chain, uncertainty=stated).verdict
    assert verdict.fit == "unchecked"
    assert [reason.finding for reason in verdict.reasons] == ["no_noise"]


def with_decimals(run: sd.Measurement, step: float) -> sd.Measurement:
    channels = {name: values.copy() for name, values in run.channels.items()}
    channels["distance"] = np.round(channels["distance"] / step) * step
    return sd.Measurement(run.line, run.point, run.position, channels)


def test_the_step_of_decimals_takes_the_place_of_a_smaller_uncertainty() -> None:
    machine, plan, head, run, _ = simulated("ideal", 1e3, 1e-9)
    stated = sd.methods.ReadingUncertainty(distance=1e-6, tilt=1e-9)
    found = sd.methods.adjust(with_decimals(run, 1e-3), plan, head, machine.chain, uncertainty=stated)
    (rounded,) = found.rounded
    assert (rounded.channel, rounded.cause) == ("distance", "decimals")
    assert (rounded.stated, rounded.step) == (1e-6, pytest.approx(1e-3))
    assert rounded.used == pytest.approx(1e-3 / np.sqrt(12.0))
    assert found.verdict.fit == "accepted"


def test_round_numbers_of_a_machine_without_errors_are_no_decimals() -> None:
    machine, plan, head, run, _ = simulated("ideal", 1e3, 0.0, errors=0.0)
    stated = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6)
    found = sd.methods.adjust(run, plan, head, machine.chain, uncertainty=stated)
    assert found.rounded == []
    assert found.verdict.fit == "unchecked"
