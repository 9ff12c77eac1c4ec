"""Simulate a machine, calibrate it by each method, and compare with what is known of it.

python examples/quickstart.py
"""

import stepdiag as sd

volume = (800, 600, 500)  # mm
machine = sd.Machine("[w X' b Y Z t]", sd.random_error_map(volume, seed=0))
plan = sd.Plan(volume, ["ppp", "npp", "pnp", "nnp"], 50, scale_lines=["p00", "0p0", "00p"])
head = sd.Head("ideal")

# The mirror is tilted by 100 and 300 µrad on every diagonal.
misalignment = {line: sd.Misalignment(reflector=(100e-6, 300e-6)) for line in plan.lines}
run = sd.simulate(machine, plan, head, misalignment=misalignment)

for method in ("conventional", "enhanced", "adjustment"):
    calibration = sd.methods.evaluate(run, plan, head, machine.chain, method=method)
    worst = sd.largest_deviations(calibration, machine.errors)["positioning"]
    print(f"{method}: positioning known to {abs(worst.value) * 1e3:.6f} µm")

found = sd.methods.adjust(run, plan, head, machine.chain)
tilts = [e.value * 1e6 for e in found.setup if e.line == "ppp" and e.quantity == "reflector"]
print(f"the mirror stood at {tilts[0]:.3f}, {tilts[1]:.3f} µrad on ppp")

scenario = sd.read_scenario("examples/scenario.toml")
judged = sd.judge(scenario, sd.simulate(scenario))
print(f"the run of examples/scenario.toml is {judged.fit}")
