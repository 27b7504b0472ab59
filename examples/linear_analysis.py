"""Linearise the machine and go on with python-control: modes, a loop's gain and margins."""

import control
import numpy as np

import cspm

linear = cspm.analyze_linear("worst_case", pose=[0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
for mode in linear.modes[:4]:
    print(f"{mode.frequency:7.3f} rad/s, damping ratio {abs(mode.damping):.3f}: {mode.words}")

plant = linear.to_control("tension")  # motor torques [N·m] to tensions [N]
print(plant.ninputs, "inputs:", plant.input_labels)
one = plant["tension of sway_3", "torque of sway_3"]  # the other torques held
gain = np.abs(one(1j * np.array([10.0, 100.0])))
print("gain at 10 and 100 rad/s:", gain.round(2), "N per N·m")
crossover = control.margin(0.05 * one)[-1]  # of a proportional controller, 0.05 N·m per N
print(f"a gain of 0.05 N·m per N crosses over at {crossover:.1f} rad/s")
