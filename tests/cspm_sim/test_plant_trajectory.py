"""The compiled plant against the same machine written a second time (`independent_plant`)."""

import numpy as np
import pytest
from independent_plant import IndependentPlant
from machines import LINEAR, build, general_content, random_poses

from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.machine import frame_placement
from cspm_model.motion import Motion
from cspm_sim.kernels.plant import make_scratch, plant_rate
from cspm_sim.plant import Plant

MACHINES = ("thesis", "rig", "point", "general", "linear")
AMPLITUDES = np.array([0.02, 0.015, 0.02, 0.03, 0.04, 0.03])


@pytest.fixture(scope="module")
def machines(thesis, rig, point, general):
    linear = build(general_content(LINEAR))
    return dict(zip(MACHINES, (thesis, rig, point, general, linear), strict=True))


def swell(seed=3, share=0.25, spacing=0.05, count=12):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(2, 9, 6) * np.arange(count)[:, None] * spacing + rng.uniform(0, 6, 6)
    rate = (angle[1] - angle[0]) / spacing
    sine, cosine = AMPLITUDES * share * np.sin(angle), AMPLITUDES * share * np.cos(angle)
    return Motion(np.hstack([sine, cosine * rate, -sine * rate**2]), spacing)


def random_motion(seed=5, knots=9, spacing=0.1):
    rng = np.random.default_rng(seed)
    scale = np.concatenate([AMPLITUDES, AMPLITUDES * 4, AMPLITUDES * 16])
    return Motion(rng.uniform(-1, 1, (knots, 18)) * scale, spacing)


def make_plant(testbed, motion, period_ns=1_000_000):
    pose = [0.02, -0.03, 2.0, 0.0, 0.05, 0.04]
    if testbed.name == "point":
        pose = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
    plant = Plant(testbed, motion, period_ns, bar_pose=pose if testbed.bar else None)
    if not testbed.bar:
        plant.unstretched_lengths *= 0.996
        plant._observe()
    return plant


def plant_derivative(plant, state, torque, frame, locked=False):
    p = plant.parameters
    scratch = make_scratch(len(state), len(torque))
    out = np.empty_like(state)
    plant_rate(
        state,
        torque,
        frame_placement(frame),
        locked,
        1e-3,
        p.bar,
        p.cables,
        p.tables,
        p.effects,
        p.effect_parameters,
        scratch.spans,
        scratch.signals,
        out,
    )
    return out


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


def run(plant, torques, hold_ns):
    for torque in torques:
        for _ in range(hold_ns // plant.period_ns):
            plant.step(torque)
    return plant.state.copy()


def torques_about_rest(plant, spread, count, seed=4):
    n = len(plant.tensions)
    wanted = np.maximum(plant.tensions, 2.0)
    change = np.random.default_rng(seed).uniform(-spread, spread, (count, n))
    return plant.parameters.cables[:, RADIUS] * wanted * (1.0 + change)


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
