"""Recordings of a machine that is not the one described, made by a plant of another make."""

import dataclasses

from run_samples import bundle_of

from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.testbed import parse_testbed
from cspm_run.recorded_run import run

# Text of the thesis's file by what it is in the machine that was recorded.
CHANGES = {
    "mass: {value: 4.06,": "mass: {value: 4.35,",
    "factor: {value: 6.0,": "factor: {value: 4.0,",
    "surge: 0.0": "surge: 1.5",
}
TRUE = {"bar.mass": 4.35, "axial_damping": 4.0 / 6.0, "bar_damping.surge": 1.5}


def other_machine(bundle, changes):
    """Return the same run with a changed machine."""
    text = bundle.testbed.text
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    return dataclasses.replace(bundle, testbed=parse_testbed(text, "other machine"))


def record_other(folder, scenario, *overrides, plant="mujoco", changes=CHANGES):
    """Record the changed machine; return what was measured, said to be the described one."""
    bundle = bundle_of(scenario, *overrides)
    described = bundle.testbed
    changed = dataclasses.replace(other_machine(bundle, changes), plant=plant)
    assert not run(changed, folder, lambda now: None).failure
    return read_measurement(folder).with_testbed(described)
