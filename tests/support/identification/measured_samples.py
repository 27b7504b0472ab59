"""Recordings of machines with effects that the file they are read with does not know."""

from dataclasses import replace

from run_samples import bundle_of

from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.testbed import parse_testbed
from cspm_run.recorded_run import run


def measured_with(effects, folder, scenario, *overrides):
    """Run a scenario of the library with entries behind its file's `effects`; read it without."""
    bundle = bundle_of(scenario, *overrides)
    testbed = parse_testbed(bundle.testbed.text + effects, "with effects")
    assert not run(replace(bundle, testbed=testbed), folder).failure
    return read_measurement(folder).with_testbed(bundle.testbed)
