"""Springs on the bar: which way they push, and how fast a bar on them swings."""

import numpy as np
import pytest
from machines import build, changed, general_content

from cspm_model.motion import Motion
from cspm_sim.effects import catalogue
from cspm_sim.plant import Plant

STILL = Motion.still(np.zeros(6))
DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
POSE = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
MASS, INERTIA, PERIOD = 5.0, 0.1, 1e-3


def floating(height=2.0, **values):
    """A bar on slack cables, without gravity, that only springs hold."""
    stiffness = dict.fromkeys((*DOFS, "rest_heave"), 0.0) | values
    content = changed({**general_content(), "gravity": 0.0}, "bar.mass", MASS)
    content = changed(content, "bar.com", [0.0, 0.0, 0.0])
    content = changed(content, "bar.inertia", dict.fromkeys(("ixx", "iyy", "izz"), INERTIA))
    content["effects"] = [{"effect": "bar_restoring", "parameters": stiffness}]
    plant = Plant(build(content), STILL, 1_000_000, bar_pose=[0, 0, height, 0, 0, 0], locked=True)
    plant.unstretched_lengths += 2.0
    return plant


def after(plant, seconds):
    for _ in range(round(seconds / PERIOD)):
        plant.step(np.zeros(8))
    return plant.bar_state


@pytest.mark.parametrize(("dof", "axis"), [("surge", 0), ("sway", 1)])
def test_a_bar_off_its_rest_swings_as_a_spring_and_mass_do(dof, axis):
    plant = floating(**{dof: 20.0})
    plant.bar_state[axis] = 0.05
    turn = np.sqrt(20.0 / MASS)
    assert after(plant, 0.7)[axis] == pytest.approx(0.05 * np.cos(turn * 0.7), abs=1e-6)


def test_heave_rests_where_the_file_says():
    plant = floating(1.9, heave=30.0, rest_heave=1.9)
    plant.bar_state[2] = 2.0
    turn = np.sqrt(30.0 / MASS)
    assert after(plant, 0.5)[2] == pytest.approx(1.9 + 0.1 * np.cos(turn * 0.5), abs=1e-6)


@pytest.mark.parametrize(("dof", "axis"), [("roll", 3), ("pitch", 4), ("yaw", 5)])
def test_a_turned_bar_swings_back(dof, axis):
    plant = floating(**{dof: 0.8})
    plant.bar_state[axis] = 0.03
    turn = np.sqrt(0.8 / INERTIA)
    assert after(plant, 0.4)[axis] == pytest.approx(0.03 * np.cos(turn * 0.4), abs=1e-5)


def test_a_bar_that_floats_hangs_lighter_in_its_cables():
    """At rest the cables carry what buoyancy does not."""
    stiffness = dict.fromkeys((*DOFS, "rest_heave"), 0.0) | {"heave": 10.0, "rest_heave": 1.5}
    content = general_content()
    free = Plant(build(content), STILL, 1_000_000, bar_pose=POSE, locked=True)
    content["effects"] = [{"effect": "bar_restoring", "parameters": stiffness}]
    borne = Plant(build(content), STILL, 1_000_000, bar_pose=POSE, locked=True)
    for plant in (free, borne):
        rest = plant.bar_state.copy()
        after(plant, 0.05)
        assert np.abs(plant.bar_state[:3] - rest[:3]).max() < 1e-3
    assert borne.tensions.sum() < free.tensions.sum()


def test_stiffness_and_rest_come_back_from_their_weights():
    effect = catalogue()["bar_restoring"]
    values = dict(zip(DOFS, (3.0, 4.0, 50.0, 0.5, 0.6, 0.7), strict=True)) | {"rest_heave": 1.8}
    assert effect.values(effect.weights(values)) == pytest.approx(values)
    none = effect.values([0.0] * 7)
    assert effect.is_absent(none)
