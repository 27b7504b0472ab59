"""Effects in the MuJoCo plant against the same effects in the plant."""

import numpy as np
import pytest
from mujoco_pairs import MS, POSE, drive, pair, radii, still, swinging_torques, waving

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry
from cspm_mujoco.plant import MujocoPlant


def with_effect(testbed, effect, elements=(), **parameters):
    entry = EffectEntry(effect=effect, elements=elements, parameters=parameters)
    return testbed.model_copy(update={"effects": (*testbed.effects, entry)})


DRAG = {"surge": 3.0, "sway": 5.0, "heave": 2.0, "roll": 0.3, "pitch": 0.2, "yaw": 0.4}


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("effect", "parameters"),
    [("bar_linear_damping", DRAG), ("winch_viscous_friction", {"coefficient": 0.01})],
)
def test_smooth_effects_agree(general, effect, parameters):
    machine = with_effect(general, effect, **parameters)
    ours, theirs = pair(machine, waving(1.0))
    _, without = pair(general, waving(1.0))
    torques = swinging_torques(ours, 5)
    worst = drive(ours, theirs, torques)
    for torque in torques:
        for _ in range(100):
            without.step(torque)
    shown = np.abs(without.bar_state - ours.bar_state).max()
    assert shown > 1e-3
    assert worst["bar_state"] < 1e-3 * shown


@pytest.mark.compiled
def test_friction_of_one_winch_is_on_that_winch(general):
    machine = with_effect(general, "winch_viscous_friction", ("c2",), coefficient=0.02)
    ours, theirs = pair(machine)
    assert drive(ours, theirs, swinging_torques(ours, 3))["speeds"] < 1e-5


@pytest.mark.compiled
def test_a_dry_winch_slides_alike_and_stays_where_it_is(general):
    machine = with_effect(general, "winch_coulomb_friction", torque=0.01)
    ours, theirs = pair(machine)
    balance = radii(machine) * ours.tensions
    for _ in range(300):
        theirs.step(balance + 0.009)  # within the friction: nothing turns
    assert np.abs(theirs.speeds).max() < 1e-4
    ours, theirs = pair(machine)
    worst = drive(ours, theirs, balance + 0.05 * np.array([[1.0], [-1.0], [1.0]]) * np.ones(8))
    # Each resolves the instant of sticking in its own way, to a few steps.
    assert np.abs(ours.speeds).max() > 0.1
    assert worst["bar_state"] < 2e-3


def test_effects_that_it_does_not_have_are_refused(general):
    machine = with_effect(general, "bar_quadratic_drag", surge=1.0)
    with pytest.raises(
        InputError,
        match=r"^effects: bar_quadratic_drag: not in the MuJoCo plant, allowed: bar_linear_damping,"
        r" winch_viscous_friction, winch_coulomb_friction$",
    ):
        MujocoPlant(machine, still().at, MS, bar_pose=POSE)


@pytest.mark.parametrize(
    ("effect", "elements", "parameters", "text"),
    [
        ("winch_coulomb_friction", ("c9",), {"torque": 0.1}, "no element 'c9', allowed: c0, c1"),
        ("winch_coulomb_friction", (), {"force": 0.1}, r"\['force'\], allowed: exactly \['torque'"),
        ("winch_viscous_friction", (), {"coefficient": -1.0}, "coefficient below 0, allowed: 0"),
        ("bar_linear_damping", ("c1",), DRAG, r"\['c1'\], allowed: \[bar\]"),
    ],
)
def test_wrong_effects_are_refused(general, effect, elements, parameters, text):
    machine = with_effect(general, effect, elements, **parameters)
    with pytest.raises(InputError, match=text):
        MujocoPlant(machine, still().at, MS, bar_pose=POSE)
