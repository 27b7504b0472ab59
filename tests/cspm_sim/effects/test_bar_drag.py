"""Drag in the square of speed: which way it points and how it slows the bar."""

import numpy as np
import pytest
from machines import build, changed, general_content

from cspm_model.motion import Motion
from cspm_sim.plant import Plant

STILL = Motion.still(np.zeros(6))
DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
MASS, INERTIA, STEPS, PERIOD = 5.0, 0.1, 200, 1e-3


def floating(**coefficients: float) -> Plant:
    """A bar on slack cables, without gravity, that only its drag slows."""
    values = dict.fromkeys(DOFS, 0.0) | coefficients
    content = {**general_content(), "gravity": 0.0}
    content = changed(content, "bar.mass", MASS)
    content = changed(content, "bar.com", [0.0, 0.0, 0.0])
    content = changed(content, "bar.inertia", dict.fromkeys(("ixx", "iyy", "izz"), INERTIA))
    content["effects"] = [
        {"effect": "bar_quadratic_drag", "elements": ["bar"], "parameters": values}
    ]
    plant = Plant(build(content), STILL, 1_000_000, bar_pose=[0, 0, 2, 0, 0, 0], locked=True)
    plant.unstretched_lengths += 2.0
    return plant


@pytest.mark.parametrize("velocity", [(2.0, 0.0, 0.0), (1.0, 2.0, -2.0), (0.0, -0.3, 0.4)])
def test_equal_drag_of_all_axes_slows_any_course_and_turns_none(velocity):
    """dv/dt = −c·v²/m along the course: v = v₀/(1 + c·v₀·t/m)."""
    plant = floating(surge=4.0, sway=4.0, heave=4.0)
    plant.bar_state[6:9] = velocity
    for _ in range(STEPS):
        plant.step(np.zeros(8))
    slowed = 1.0 + 4.0 * np.linalg.norm(velocity) * STEPS * PERIOD / MASS
    assert plant.bar_state[6:9] == pytest.approx(np.array(velocity) / slowed, rel=1e-9)
    assert (plant.bar_state[9:] == 0.0).all()


def test_equal_drag_of_all_turns_keeps_the_axis_of_turning():
    plant = floating(roll=0.3, pitch=0.3, yaw=0.3)
    plant.bar_state[9:] = 1.0, 2.0, -2.0
    for _ in range(STEPS):
        plant.step(np.zeros(8))
    slowed = 1.0 + 0.3 * 3.0 * STEPS * PERIOD / INERTIA
    assert plant.bar_state[9:] == pytest.approx(np.array([1.0, 2.0, -2.0]) / slowed, rel=1e-9)
    assert (plant.bar_state[6:9] == 0.0).all()


def test_drag_of_one_axis_grows_with_the_speed_along_another():
    plant = floating(surge=4.0)
    plant.bar_state[6:9] = 0.1, 3.0, 0.0
    plant.step(np.zeros(8))
    expected = 0.1 * np.exp(-4.0 * 3.0 * PERIOD / MASS)
    assert plant.bar_state[6] == pytest.approx(expected, rel=1e-5)
    assert plant.bar_state[7] == 3.0
