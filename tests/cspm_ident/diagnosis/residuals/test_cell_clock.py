"""A rig's load cells whose clock runs away from the drives': found, taken out, distinguished."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import run_to

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.residuals.load_cell_clock import cell_drift, on_drives_clock
from cspm_ident.diagnosis.residuals.winch_torque import shaft_equations
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples

OFFSET = 8e-5  # of the two clocks when the recording begins [s]


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig") / "healthy"
    run_to(folder, "one_winch", "duration=20")
    return read_measurement(folder)


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sea") / "healthy"
    run_to(folder, "worst_case_steep", "duration=2")
    return read_measurement(folder)


@pytest.fixture(scope="module")
def unplaced(rig):
    """The same, said to be of a winch without exit and attachment."""
    (cable,) = rig.machine.cables
    parts = ("exit", "attachment", "stiffness", "damping", "tension_limits")
    bare = cable.model_copy(update=dict.fromkeys(parts))
    return rig.with_machine(rig.machine.model_copy(update={"cables": (bare,)}))


def drifting(measurement, rate, offset=OFFSET):
    times = measurement.tension.times
    late = Samples(times * (1.0 + rate) + offset, measurement.tension.values)
    return measurement.with_samples("tension", late)


@pytest.mark.parametrize("rate", [-6e-6, 0.0, 6e-6])
def test_a_drift_is_found_beside_clocks_that_lie_apart(rig, rate):
    found = cell_drift(drifting(rig, rate))
    assert found.rate == pytest.approx(rate, abs=5e-7)
    assert found.interval[1] - found.interval[0] < 2e-6


def test_what_is_late_at_the_beginning_stays_and_what_grows_is_taken_out(rig):
    back = on_drives_clock(drifting(rig, 6e-6))
    np.testing.assert_allclose(back.tension.times - rig.tension.times, OFFSET, atol=1e-5)
    whole = drifting(rig, 6e-6).tension.times - rig.tension.times
    assert whole[-1] - whole[0] > 1.1e-4


def test_what_runs_away_faster_than_healthy_clocks_is_left_to_be_reported(rig):
    fast = drifting(rig, 1e-4)
    assert on_drives_clock(fast) is fast
    assert cell_drift(fast).rate == pytest.approx(1e-4, rel=0.05)


def test_a_clock_that_does_not_drift_and_machines_with_a_bar_are_left_alone(rig, sea):
    assert on_drives_clock(rig) is rig
    moved = drifting(sea, 1e-5)
    assert on_drives_clock(moved) is moved
    blind = replace(rig, tension=None)
    assert on_drives_clock(blind) is blind


def test_a_load_cell_counts_though_nobody_knows_where_the_cable_goes(rig, unplaced):
    (known,), (found,) = (
        shaft_equations(each, (), (), None, each.machine.cable_names) for each in (rig, unplaced)
    )
    np.testing.assert_array_equal(found.target, known.target)
    assert np.std(found.target) < 0.05 * np.std(0.025 * found.signals["tension [N]"])
    assert cell_drift(drifting(unplaced, 6e-6)) == cell_drift(drifting(rig, 6e-6))


def test_a_winch_without_cable_shows_no_drift(unplaced):
    times = unplaced.tension.times
    idle = unplaced.with_samples("tension", Samples(times, np.zeros((len(times), 1))))
    assert cell_drift(idle) is None
    assert on_drives_clock(idle) is idle


@pytest.mark.slow
def test_a_healthy_winch_with_a_load_cell_alone_is_consistent(unplaced):
    found = diagnose([unplaced])
    assert not found.reported
    assert not found.unexplained


def test_too_short_a_recording_shows_no_drift(rig):
    short = rig.within(5.0, 5.06)
    assert cell_drift(short) is None
    assert on_drives_clock(short) is short


@pytest.mark.slow
def test_a_healthy_rig_with_clocks_of_its_own_is_consistent(rig):
    found = diagnose([drifting(rig, 6e-6)])
    assert not found.reported
    assert not found.unexplained


def test_the_jerk_of_a_rope_pulled_taut_leaves_nothing_in_a_healthy_rig(tmp_path):
    """Trapezoids, and a force that is read at instants, would miss a thousandth of it."""
    run_to(tmp_path / "ideal", "one_winch", "duration=3", "sensors=ideal")
    ideal = read_measurement(tmp_path / "ideal")
    (equation,) = shaft_equations(ideal, (), (), None, ideal.machine.cable_names)
    jerk = equation.times < 0.5
    pulled = np.ptp(equation.measured[jerk])
    assert pulled > 0.1
    assert np.abs(equation.target[jerk]).max() < 5e-5 * np.ptp(equation.signals["tension [N]"])
