"""A recorded closed loop simulated again: its differences, and what each finding costs."""

import numpy as np
import pytest
from measured_samples import measured_with

from cspm_ident.diagnosis.reporting.finding_statement import consequence_words
from cspm_ident.diagnosis.validation.closed_loop import simulate_closed_loop
from cspm_msgs_py.testbed import parse_testbed

HEAVY = """  - effect: winch_coulomb_friction
    elements: [hoist_1, hoist_2]
    parameters: {torque: 0.5}
"""


@pytest.fixture(scope="module")
def loop(tmp_path_factory):
    folder = tmp_path_factory.mktemp("loop") / "bag"
    measured = measured_with(HEAVY, folder, "worst_case", "duration=3")
    worn = parse_testbed(measured.testbed.text + HEAVY, "worn")
    return simulate_closed_loop(measured, worn, [measured.testbed, worn])


def test_with_what_was_found_it_repeats_the_recording(loop):
    assert all(fit.after < 0.5 * fit.before for fit in loop.fits if fit.name == "bar/pose/heave")


def test_each_finding_has_the_error_of_the_machine_without_it(loop):
    """Of the second machine nothing is left out."""
    without, same = loop.without
    assert same == loop.tracking
    assert without.position_m < 0.99 * loop.tracking.position_m


def test_a_machine_that_cannot_run_has_no_error(tmp_path):
    measured = measured_with("", tmp_path / "bag", "one_winch", "duration=2")
    nothing = simulate_closed_loop(measured, measured.testbed, [measured.testbed])
    assert (nothing.fits, nothing.tracking, nothing.without) == ((), None, ())


def test_what_it_costs_is_said_where_it_is_known():
    costs = {
        "with": {"position_m": 2e-3, "angle_rad": 1e-3},
        "without": {"position_m": 5e-4, "angle_rad": np.float64(2e-4)},
    }
    assert consequence_words(costs) == (
        " The tracking error is 2 mm and 1 mrad RMS with it, 0.5 mm and 0.2 mrad without it."
    )
    assert consequence_words(None) == ""
