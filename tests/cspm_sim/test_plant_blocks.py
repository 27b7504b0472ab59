"""Blocks with given inputs, against the plant that made the signals."""

from dataclasses import dataclass

import numpy as np
import pytest
from machines import build, entry, general_content
from run_samples import SCENARIOS

from cspm_model.kernels.cable import RADIUS
from cspm_model.motion import Motion
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.plant import Plant
from cspm_sim.plant_blocks import PlantBlocks
from cspm_sim.step_stability import axial_modes, steps_needed

PERIOD_NS = 1_000_000
STEPS = 1500
STEEL_POSE = [0, 0, 1.2, 0, 0, 0]


@dataclass
class Simulated:
    plant: Plant
    motion: Motion
    states: np.ndarray
    tensions: np.ndarray
    torques: np.ndarray


def swaying_frame():
    """A frame that goes to and fro in surge and yaw, 2 cm and 0.02 rad at 0.5 Hz."""
    times = np.arange(101) * 0.05
    rate = 2 * np.pi * 0.5
    knots = np.zeros((101, 18))
    for axis in (0, 5):
        for order, (factor, phase) in enumerate(((1, 0), (rate, np.pi / 2), (rate**2, np.pi))):
            knots[:, 6 * order + axis] = 0.02 * factor * np.sin(rate * times + phase)
    return Motion(knots, 0.05)


@pytest.fixture(scope="module")
def simulated():
    testbed = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml").testbed
    motion = swaying_frame()
    plant = Plant(testbed, motion, PERIOD_NS, bar_pose=[0, 0, 2, 0, 0, 0])
    balance = plant.tensions * plant.parameters.cables[:, RADIUS]
    states, tensions, torques = [plant.state.copy()], [plant.tensions.copy()], []
    for k in range(STEPS):
        sway = np.sin(2 * np.pi * 1.3 * k * 1e-3 + np.arange(len(balance)))
        torques.append(balance * (1 + 0.02 * sway))
        plant.step(torques[-1])
        states.append(plant.state.copy())
        tensions.append(plant.tensions.copy())
    return Simulated(plant, motion, np.array(states), np.array(tensions), np.array(torques))


@pytest.fixture
def blocks(simulated):
    return PlantBlocks(simulated.plant.parameters, simulated.motion, PERIOD_NS)


def parts(simulated, start=0):
    """Angles and speeds from a step on."""
    first, n = 12, len(simulated.tensions[0])
    states = simulated.states[start:]
    return states[:, first + n : first + 2 * n], states[:, first + 2 * n : first + 3 * n]


@pytest.mark.parametrize("start", [0, 700])
def test_from_torques_it_is_the_plant_itself(simulated, blocks, start):
    found = blocks.by_torques(start, simulated.states[start], simulated.torques[start:])
    assert found.good == STEPS - start + 1
    np.testing.assert_array_equal(found.states, simulated.states[start:])
    np.testing.assert_array_equal(found.tensions, simulated.tensions[start:])


def test_from_winches_the_bar_follows(simulated, blocks):
    found = blocks.by_winches(0, simulated.states[0], *parts(simulated))
    # Between samples the angle is a cubic; its error falls with the fourth power of 1 ms.
    np.testing.assert_allclose(found.states[:, :12], simulated.states[:, :12], atol=1e-6)
    np.testing.assert_allclose(found.tensions, simulated.tensions, atol=1e-5)


def test_winches_that_wind_the_other_way_lead_elsewhere(simulated, blocks):
    angles, speeds = parts(simulated)
    mirrored = 2 * angles[0] - angles
    found = blocks.by_winches(0, simulated.states[0], mirrored, -speeds)
    assert np.abs(found.tensions - simulated.tensions).max() > 0.1


def test_cables_alone_follow_winches_and_bar(simulated, blocks):
    angles, speeds = parts(simulated)
    bars = simulated.states[:, :12]
    found = blocks.by_winches(0, simulated.states[0], angles, speeds, bars)
    # The bar goes in straight lines between steps, with 5 m/s² at most: micrometres.
    np.testing.assert_allclose(found.tensions, simulated.tensions, atol=5e-3)
    still = np.repeat(bars[:1], len(bars), axis=0)
    resting = blocks.by_winches(0, simulated.states[0], angles, speeds, still)
    assert np.abs(resting.tensions - simulated.tensions).max() > 0.1


def test_from_tensions_the_bar_moves_as_it_did(simulated, blocks):
    found = blocks.by_tensions(0, simulated.states[0], simulated.tensions)
    np.testing.assert_allclose(found.states[:, :12], simulated.states[:, :12], atol=1e-4)


def test_without_tension_the_bar_falls(simulated, blocks):
    none = np.zeros((501, len(simulated.tensions[0])))
    found = blocks.by_tensions(0, simulated.states[0], none)
    fallen = found.states[-1, 2] - found.states[0, 2]
    assert fallen == pytest.approx(0.5 * 9.81 * 0.5**2, rel=1e-6)


@pytest.mark.parametrize(
    "effects",
    [
        [],
        [
            entry("winch_coulomb_friction", torque=0.03),
            entry("winch_drum_eccentricity", eccentricity=1e-3, phase=0.4),
        ],
    ],
    ids=["bare", "with friction and an eccentric drum"],
)
def test_winches_alone_turn_as_they_did(effects):
    content = {**general_content(), "effects": effects}
    plant = Plant(build(content), swaying_frame(), PERIOD_NS, bar_pose=[0, 0, 2, 0, 0, 0])
    states, tensions, torques = [plant.state.copy()], [plant.tensions.copy()], []
    balance = plant.tensions * plant.parameters.cables[:, RADIUS]
    for k in range(400):
        torques.append(balance + 0.05 * np.sin(2 * np.pi * 3 * k * 1e-3 + np.arange(8)))
        plant.step(torques[-1])
        states.append(plant.state.copy())
        tensions.append(plant.tensions.copy())
    blocks = PlantBlocks(plant.parameters, plant.frame_motion, PERIOD_NS)
    found = blocks.shafts(states[0], np.array(torques), np.array(tensions)).states
    turned = np.array(states)[:, 20:36]
    moved = np.abs(turned - turned[0]).max(axis=0)
    # Tensions are joined by straight lines, and sampled at the ends of each step.
    assert (np.abs(found[:, 20:36] - turned).max(axis=0) < 0.01 * moved.max()).all()
    other = blocks.shafts(states[0], -np.array(torques), np.array(tensions)).states
    assert np.abs(other[:, 20:36] - turned).max() > moved.max()


def test_a_window_in_the_middle_sees_the_frame_where_it_is_then(simulated, blocks):
    start = 900
    angles, speeds = parts(simulated, start)
    found = blocks.by_winches(start, simulated.states[start], angles, speeds)
    np.testing.assert_allclose(found.tensions, simulated.tensions[start:], atol=1e-5)
    early = blocks.by_winches(0, simulated.states[start], angles, speeds)
    assert np.abs(early.tensions - simulated.tensions[start:]).max() > 0.1


def test_rows_after_a_divergence_are_not_numbers(simulated, blocks):
    state = simulated.states[0].copy()
    state[6] = np.inf
    found = blocks.by_torques(0, state, simulated.torques[:10])
    assert found.good == 0
    assert np.isnan(found.states).all()


def steel_motion(steps):
    """A plant on steel ropes of 5 mm, its states and the torques that moved it."""
    testbed = load_testbed(SCENARIOS / "testbeds" / "suspended_four.yaml").testbed
    rope = testbed.cables[0].stiffness.model_copy(
        update={"youngs_modulus": 2.0e11, "diameter": 5.0e-3}
    )
    cables = tuple(cable.model_copy(update={"stiffness": rope}) for cable in testbed.cables)
    testbed = testbed.model_copy(update={"cables": cables})
    plant = Plant(testbed, swaying_frame(), PERIOD_NS, bar_pose=STEEL_POSE)
    lengths = plant.unstretched_lengths, plant.lengths
    modes = axial_modes(
        plant.parameters, plant.bar_state[:6], plant.frame[:6], lengths, None, locked=False
    )
    plant.substeps = steps_needed(modes, 1000)
    balance = plant.tensions * plant.parameters.cables[:, RADIUS]
    states, torques = [plant.state.copy()], []
    for k in range(steps):
        torques.append(balance * (1 + 0.02 * np.sin(8e-3 * k + np.arange(len(balance)))))
        plant.step(torques[-1])
        states.append(plant.state.copy())
    return plant, np.array(states), np.array(torques)


def test_stiff_cables_take_as_many_steps_in_blocks():
    plant, states, torques = steel_motion(300)
    assert plant.substeps > 1
    blocks, n = PlantBlocks(plant.parameters, plant.frame_motion, PERIOD_NS), len(torques[0])
    found = blocks.by_torques(0, states[0], torques)
    assert found.good == len(states)
    np.testing.assert_allclose(found.states, states, atol=1e-9)
    turned = states[:, 12 + n : 12 + 2 * n], states[:, 12 + 2 * n : 12 + 3 * n]
    wound = blocks.by_winches(0, states[0], *turned)
    assert wound.good == len(states)
    np.testing.assert_allclose(wound.states[:, :3], states[:, :3], atol=1e-5)
