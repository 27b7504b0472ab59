"""Identify inertia and friction of a winch from its angle, torque and tension."""

import cspm

# In place of your recording: a winch with viscous and Coulomb friction.
machine = cspm.load_testbed("one_winch")
machine = machine.with_effect("winch_viscous_friction", "surge", coefficient=2e-3)
machine = machine.with_effect("winch_coulomb_friction", "surge", torque=0.02)
recording = cspm.simulate("one_winch", testbed=machine, duration=20).save("winch")

# Dry friction sticks where the shaft reverses: leave out the windows with a reversal.
found = cspm.identify_winch(recording, testbed="one_winch", reversals=False)
for parameter in found.parameters.values():
    print(f"{parameter.name}: {parameter.value:.4g} {parameter.unit}, 95 %: {parameter.ci95}")

fitted = found.testbed  # the machine with these numbers, each with its interval
print([entry.effect for entry in fitted.effects])
fitted.save("fitted_testbed.yaml")  # for `cspm run one_winch --testbed fitted_testbed.yaml`
