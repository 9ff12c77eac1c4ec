"""From files to a labelled table: the way of somebody who measured with an instrument of their own.

python examples/own_measurement.py SCENARIO.toml RUN.csv
"""

import sys

import stepdiag as sd


def main(scenario_file: str, run_file: str) -> None:
    scenario = sd.read_scenario(scenario_file)
    calibration = sd.methods.evaluate_scenario(scenario, sd.read_measurement(run_file))
    for sentence in calibration.undetermined:
        print("not determined:", sentence)

    table = calibration.to_xarray()
    middle = table.sel(x=scenario.known.plan.volume[0] / 2, method="nearest")
    value, uncertainty = float(middle["EXX"]) * 1e3, float(middle["EXX_u"]) * 1e3
    print(f"EXX at x = {float(middle['x']):g} mm: {value:.2f} µm, standard uncertainty {uncertainty:.2f} µm")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python own_measurement.py SCENARIO.toml RUN.csv")
    main(sys.argv[1], sys.argv[2])
