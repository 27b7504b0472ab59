"""Without load cells what is there is named alone, and a healthy machine stays silent."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import SCENARIOS, bundle_of

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import Verdict, verdict_of
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.testbed import EffectEntry
from cspm_run.recorded_run import run

PLANTED = 0.031


def diagnosed(folder, *entries):
    """Diagnose half a minute of the worst sea with the file that knows of no effect."""
    described = bundle_of("worst_case_steep", "duration=30", "seed=7")
    machine = described.testbed.testbed
    machine = machine.model_copy(update={"effects": (*machine.effects, *entries)})
    run(described.concealing(machine), folder)
    measured = read_measurement(folder, SCENARIOS / "testbeds" / "thesis.yaml")
    return diagnose([replace(measured, tension=None)])


@pytest.mark.slow
@pytest.mark.compiled
def test_a_healthy_machine_is_consistent(tmp_path):
    found = diagnosed(tmp_path / "bag")
    assert verdict_of(found) is Verdict.CONSISTENT
    assert not found.reported
    assert not found.unexplained


@pytest.mark.slow
@pytest.mark.compiled
def test_friction_of_one_winch_is_all_that_is_reported(tmp_path):
    entry = EffectEntry(
        effect="winch_coulomb_friction", elements=("surge_2",), parameters={"torque": PLANTED}
    )
    found = diagnosed(tmp_path / "bag", entry)
    (finding,) = found.reported
    assert finding.effect == entry.effect
    assert finding.elements == entry.elements
    assert not found.unexplained
    ((_, value, half, _),) = finding.coefficients
    assert value[0] == pytest.approx(PLANTED, rel=0.02)
    # What noise leaves, beside what the form of a law does.
    form_error = DEFAULT_THRESHOLDS.model_form_error_share
    assert np.sqrt(half[0] ** 2 - form_error * value[0] ** 2) < 0.02 * PLANTED
