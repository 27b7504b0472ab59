"""Plant dry friction in one winch, record a run, and find the friction again."""

import cspm

thesis = cspm.load_testbed("thesis")
worn = thesis.with_effect("winch_coulomb_friction", "sway_3", torque=0.03)  # N·m at the motor
recording = cspm.simulate("worst_case_steep", testbed=worn, duration=20).save("worn")

# The recording carries the worn machine: say which machine is believed in.
found = cspm.diagnose(recording, testbed=thesis, closed_loop=False)
print("verdict:", found.verdict)
for finding in found.findings:
    print(finding.status, finding.effect, finding.elements)
    for parameter in finding.parameters.values():
        print(f"  {parameter.name} = {parameter.value:.4g} {parameter.unit}, {parameter.ci95}")

found.write("verdict")  # a page, diagnosis.json, and the improved test-bed
