"""The closed cascade on the linear model: stable, continuous and sampled, but for the roll."""

from pathlib import Path

import numpy as np
import pytest
from cascade import CROSSOVER, SCENARIO, Cascade

from cspm_control.design.force_gains import design_force_gains
from cspm_control.design.gains import design_motion_gains
from cspm_msgs_py.control_spec.force import ForceControl, PiGains
from cspm_msgs_py.scenario import PidGains
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.parameters import plant_parameters

TESTBEDS = Path(__file__).resolve().parents[2] / "scenarios" / "testbeds"
THESIS = load_testbed(TESTBEDS / "thesis.yaml").testbed.model_copy(update={"effects": ()})
PARAMETERS = plant_parameters(THESIS)
CENTRE = SCENARIO.design_pose


@pytest.fixture(scope="module")
def motion_gains():
    return design_motion_gains(THESIS, PARAMETERS, CENTRE, CROSSOVER)


@pytest.fixture(scope="module")
def force_gains():
    return design_force_gains(THESIS, PARAMETERS, CENTRE, ForceControl().bandwidth)


def split_roll(poles):
    """Return the two poles of the uncontrolled roll, slow or near 27 rad/s, and all others."""
    rolls = (np.abs(poles) < 0.01) | ((np.abs(poles.imag) > 20.0) & (poles.real > -0.1))
    return poles[rolls], poles[~rolls]


@pytest.mark.parametrize("height", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("exact", [False, True])
def test_closed_cascade_is_stable_but_for_roll(exact, height, motion_gains, force_gains):
    pose = (0.0, 0.0, height, 0.0, 0.0, 0.0)
    cascade = Cascade(THESIS, pose, motion_gains, force_gains, exact=exact)
    loops = {
        "continuous": np.linalg.eigvals(cascade.continuous()),
        "1000 Hz": cascade.sampled(1),
        "100 Hz": cascade.sampled(10),
    }
    for name, poles in loops.items():
        rolls, others = split_roll(poles)
        assert len(rolls) == 2, name
        # The slowest are the integral actions at a fortieth of the crossover frequency.
        assert others.real.max() == pytest.approx(-0.249, abs=0.001), name
        damping = -others.real / np.abs(others)
        assert damping.min() > (0.6 if name == "100 Hz" else 0.45), name
        if exact:
            assert np.abs(rolls).max() == pytest.approx(26.7, abs=0.1), name


def test_roll_creeps_up_where_the_motion_loop_is_fast(motion_gains, force_gains):
    """No controller sees roll; how the tensions follow the measured pose moves it a little."""
    cascade = Cascade(THESIS, CENTRE, motion_gains, force_gains, exact=True)
    growth = [split_roll(cascade.sampled(every))[0].real.max() for every in (1, 10)]
    np.testing.assert_allclose(growth, [0.0059, -0.0090], atol=2e-4)


def test_inverted_gains_are_unstable(motion_gains, force_gains):
    inverted = {
        dof: PidGains(kp=-g.kp, ki=-g.ki, kd=-g.kd) if dof == "surge" else g
        for dof, g in motion_gains.items()
    }
    backward = {
        name: PiGains(kp=-g.kp, integral_frequency=g.integral_frequency)
        for name, g in force_gains.items()
    }
    for motion, force in ((inverted, force_gains), (motion_gains, backward)):
        cascade = Cascade(THESIS, CENTRE, motion, force, exact=False)
        assert np.linalg.eigvals(cascade.continuous()).real.max() > 1.0
