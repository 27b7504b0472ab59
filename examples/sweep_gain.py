"""Sweep a gain: how the crossover of the heave controller changes the bar's error."""

import cspm

calm = cspm.load_scenario("calm").with_parameter("duration", 3.0)
print("crossover rad/s   heave RMS mm   largest tension N")
for crossover in (9.0, 15.0, 25.0, 35.0):
    scenario = calm.with_parameter("control.motion.crossover.heave", crossover)
    run = cspm.simulate(scenario)
    error = 1e3 * run.errors["heave"]["rms"]
    print(f"{crossover:15g} {error:14.4f} {run.summary['tension']['max']:19.2f}")
