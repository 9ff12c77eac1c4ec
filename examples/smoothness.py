"""What smoothness does to noise, to uncertainty, and to a screw error of 10 mm pitch that it must not hide.

python examples/smoothness.py
"""

import numpy as np
import numpy.typing as npt

import stepdiag as sd

VOLUME = (800.0, 600.0, 500.0)  # mm
STEPS = 50
PLAN = sd.Plan(VOLUME, ["ppp", "npp", "pnp", "nnp"], STEPS, scale_lines=["p00", "0p0", "00p"])
CHAIN = sd.Chain("[w X' b Y Z t]")
SEEDS = range(8)

CHOICES = {
    "none": None,
    "1 µm, 3 µrad": sd.methods.Smoothness(translation=1e-3, rotation=3e-6),
    "0.5 µm, 1 µrad": sd.methods.Smoothness(translation=0.5e-3, rotation=1e-6),
    "0.1 µm, 0.3 µrad": sd.methods.Smoothness(translation=0.1e-3, rotation=0.3e-6),
    "cross-validated": sd.methods.Smoothness(cross_validated=True),
}

FloatArray = npt.NDArray[np.float64]


def machine(**screw: float) -> sd.Machine:
    return sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=0, intervals=STEPS, **screw))


def adjusted(virtual: sd.Machine, seed: int, smoothness: sd.methods.Smoothness | None) -> sd.Adjustment:
    """Of a run with noise of 0.1 µm and 1 µrad."""
    run = sd.simulate(virtual, PLAN, sd.Head(), noise=sd.Noise(distance=0.1e-3, tilt=1e-6, seed=seed))
    return sd.methods.adjust(run, PLAN, sd.Head(), CHAIN, smoothness=smoothness)


def uncertainties(found: list[sd.Adjustment], angles: bool) -> list[FloatArray]:
    """Standard uncertainties of all angles (µrad) or lengths (µm), by run and function."""
    functions = [one.calibration.functions for one in found]
    return [
        in_micro(name, u) for by_name in functions for name, (_, _, u) in by_name.items() if is_angle(name) == angles
    ]


def errors(found: list[sd.Adjustment], truth: sd.ErrorMap, angles: bool) -> list[FloatArray]:
    """What the calibrations say beyond the truth."""
    functions = [one.calibration.functions for one in found]
    return [
        in_micro(name, value - truth.function(name, position))
        for by_name in functions
        for name, (position, value, _) in by_name.items()
        if is_angle(name) == angles
    ]


def in_micro(name: str, values: FloatArray) -> FloatArray:
    return values * (1e6 if is_angle(name) else 1e3)


def rms(arrays: list[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([values**2 for values in arrays]))))


def main() -> None:
    plain, screwed = machine(), machine(screw_pitch=10.0, screw_amplitude=3e-3)
    ripple = {
        name: np.asarray(screwed.errors.functions[name][1] - plain.errors.functions[name][1]) for name in ("EXX", "EYY")
    }
    print(
        "| Smoothness | largest u | | rms u | | rms error | | from node to node | | variance factor | ripple found | |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    print("| | µm | µrad | µm | µrad | µm | µrad | µm | µrad | with screw | EXX | EYY |")
    for name, smoothness in CHOICES.items():
        without = [adjusted(plain, seed, smoothness) for seed in SEEDS]
        with_screw = [adjusted(screwed, seed, smoothness) for seed in SEEDS]
        uncertainty = [uncertainties(without, angles) for angles in (False, True)]
        error = [errors(without, plain.errors, angles) for angles in (False, True)]
        numbers = [
            *(float(np.max(np.concatenate(u))) for u in uncertainty),
            *(rms(u) for u in uncertainty),
            *(rms(e) for e in error),
            *(rms([np.diff(row) for row in e]) for e in error),
        ]
        cells = [f"{number:.2f}" for number in numbers]
        cells.append(f"{np.mean([found.variance_factor for found in with_screw]):.1f}")
        for function, true in ripple.items():
            # The same noise in both runs: what differs is the answer to the screw error.
            pairs = zip(with_screw, without, strict=True)
            answers = [
                one.calibration.functions[function][1] - other.calibration.functions[function][1]
                for one, other in pairs
            ]
            curved = np.diff(true, 2)
            share = np.mean([np.diff(answer, 2) @ curved for answer in answers]) / (curved @ curved)
            cells.append(f"{100.0 * share:.0f} %")
        print(f"| {name} | {' | '.join(cells)} |")


def is_angle(name: str) -> bool:
    return sd.kind_of(name) == "angle"


if __name__ == "__main__":
    main()
