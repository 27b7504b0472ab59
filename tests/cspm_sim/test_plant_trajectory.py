"""The compiled plant against the same machine written a second time (`independent_plant`)."""

import numpy as np
import pytest
from independent_plant import IndependentPlant
from machines import LINEAR, build, general_content, random_poses
from plant_samples import (
    make_plant,
    plant_derivative,
    random_motion,
    run,
    swell,
    torques_about_rest,
)

MACHINES = ("thesis", "rig", "point", "general", "linear")


@pytest.fixture(scope="module")
def machines(thesis, rig, point, general):
    linear = build(general_content(LINEAR))
    return dict(zip(MACHINES, (thesis, rig, point, general, linear), strict=True))


@pytest.mark.parametrize("name", MACHINES)
def test_the_rate_of_every_state_agrees_at_random_states(machines, name):
    motion = random_motion()
    testbed = machines[name]
    plant = make_plant(testbed, motion)
    other = IndependentPlant(testbed, motion)
    rng = np.random.default_rng(11)
    first, n = len(plant.bar_state), len(testbed.cables)
    slack = taut = 0
    for k, pose in enumerate(random_poses(25, seed=2, reach=0.05, angle=0.1)):
        time = 0.03 + 0.029 * k
        state = plant.state.copy()
        if testbed.bar:
            state[:6] = pose
            state[6:12] = rng.normal(size=6) * 0.5
        frame = motion.at(time)
        plant.state[:first], plant.frame[:] = state[:first], frame
        plant._observe()
        state[first : first + n] = plant.lengths * (1.0 - rng.uniform(-0.001, 0.006, n))
        state[first + 2 * n :] = rng.normal(size=n) * 4.0
        torque = rng.normal(size=n) * 1.5
        expected = other.rate_of_plant_state(time, state, torque)
        found = plant_derivative(plant, state, torque, frame)
        scale = np.maximum(np.abs(expected), 1.0)
        assert np.abs(found - expected) / scale == pytest.approx(0.0, abs=2e-7)
        tensions = other.tensions(time, other.import_state(state))[0]
        slack, taut = slack + np.sum(tensions == 0.0), taut + np.sum(tensions > 0.0)
    assert taut > 0
    assert slack > 0


@pytest.mark.parametrize("name", MACHINES)
def test_trajectories_converge_to_those_of_a_high_order_integrator_with_order_four(machines, name):
    testbed, motion = machines[name], swell()
    errors = []
    for period_ns in (1_000_000, 500_000, 250_000):
        plant = make_plant(testbed, motion, period_ns)
        if not errors:
            torques = torques_about_rest(plant, 0.1, count=10)
            expected = IndependentPlant(testbed, motion).run(plant.state, torques, 0.01)
        errors.append(np.abs(run(plant, torques, 10_000_000) - expected).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.25)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.35)
    assert errors[2] < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("name", ["thesis", "rig", "general"])
def test_trajectories_agree_where_cables_slacken_and_catch(machines, name):
    testbed, motion = machines[name], random_motion(seed=8)
    plant = make_plant(testbed, motion, 25_000)
    if testbed.bar:
        plant.bar_state[6:] = np.random.default_rng(4).normal(size=6) * 0.05
    torques = torques_about_rest(plant, 0.5, count=10)
    expected = IndependentPlant(testbed, motion).run(plant.state, torques, 0.01)
    slack, taut = np.zeros(len(torques[0]), dtype=bool), np.zeros(len(torques[0]), dtype=bool)
    for torque in torques:
        for _ in range(400):
            plant.step(torque)
            slack |= plant.tensions == 0.0
            taut |= plant.tensions > 0.5
    assert (slack & taut).any()
    # Where the tension has a corner, the order of every fixed-step scheme drops.
    assert np.abs(plant.state - expected).max() < 1e-5
