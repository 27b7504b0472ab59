"""Compare two recordings with each other, and one of them with the model."""

import cspm

thesis = cspm.load_testbed("thesis")
heavy = thesis.with_parameter("bar.mass", 5.2)
first = cspm.simulate("calm", duration=5).save("usual")
second = cspm.simulate("calm", testbed=heavy, duration=5).save("heavy")

print("first difference:", first.difference(second))
for cable in thesis.cables:
    gap = second.tension[cable] - first.tension[cable]
    print(f"{cable}: {gap.mean():+.3f} N more with the heavy bar")

# The second recording beside a simulation of the usual machine, driven by its motor angles.
compared = cspm.compare(second, testbed=thesis)
for channel in compared.channels:
    print(f"{channel.block:6} {channel.name:24} RMS error {channel.rms:.3g} {channel.unit}")
