"""Effects in the MuJoCo plant against the same effects in the plant."""

import numpy as np
import pytest
from mujoco_pairs import MS, POSE, drive, pair, radii, still, swinging_torques, waving

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry
from cspm_sim.mujoco.plant import MujocoPlant


def with_effect(testbed, effect, elements=(), **parameters):
    entry = EffectEntry(effect=effect, elements=elements, parameters=parameters)
    return testbed.model_copy(update={"effects": (*testbed.effects, entry)})


DRAG = {"surge": 3.0, "sway": 5.0, "heave": 2.0, "roll": 0.3, "pitch": 0.2, "yaw": 0.4}


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("effect", "parameters"),
    [
        ("bar_linear_damping", DRAG),
        ("cable_transverse_damping", {"coefficient": 0.5}),
        ("cable_transverse_damping", {"coefficient": 0.5, "exit_share": -0.5}),
        ("winch_viscous_friction", {"coefficient": 0.01}),
    ],
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


@pytest.mark.parametrize("share", [{}, {"exit_share": -0.5}])
def test_damping_across_a_cable_resists_motion_across_it_alone(general, share):
    """The wrench from the definition, cable by cable, with vector products."""
    coefficients = np.linspace(0.0, 2.1, 8)
    machine = general
    for name, value in zip(general.cable_names, coefficients, strict=True):
        machine = with_effect(
            machine, "cable_transverse_damping", (name,), coefficient=value, **share
        )
    damped, free = (MujocoPlant(m, waving(1.0).at, MS, bar_pose=POSE) for m in (machine, general))
    rng = np.random.default_rng(4)
    twist = rng.uniform(-0.3, 0.3, 6)
    for plant in (damped, free):
        plant._bar_velocity[:] = twist
        plant._observe()
    wrench = damped._wrench - free._wrench
    turn, origin = free._rotation, free._origin
    spin = turn @ twist[3:]
    expected = np.zeros(6)
    for i, value in enumerate(coefficients):
        end, start = free._ends[8 + i], free._ends[i]
        line = (end - start) / np.linalg.norm(end - start)
        frame = free._frame_body
        apart = twist[:3] + np.cross(spin, end - origin)
        exit_velocity = frame[3:6] + np.cross(frame[6:], start - frame[:3])
        apart -= share.get("exit_share", 1.0) * exit_velocity
        force = -value * np.cross(line, np.cross(apart, line))
        expected[:3] += force
        expected[3:] += np.cross(end - free._centre, force)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(wrench, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(damped.tensions, free.tensions)


@pytest.mark.compiled
def test_a_dry_winch_slides_equally_and_stays_where_it_is(general):
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
        r" cable_transverse_damping, winch_viscous_friction, winch_coulomb_friction$",
    ):
        MujocoPlant(machine, still().at, MS, bar_pose=POSE)


@pytest.mark.parametrize(
    ("effect", "elements", "parameters", "text"),
    [
        ("winch_coulomb_friction", ("c9",), {"torque": 0.1}, "no element 'c9', allowed: c0, c1"),
        ("winch_coulomb_friction", (), {"force": 0.1}, r"\['force'\], allowed: exactly \['torque'"),
        ("winch_viscous_friction", (), {"coefficient": -1.0}, "coefficient below 0, allowed: 0"),
        ("cable_transverse_damping", ("bar",), {"coefficient": 1.0}, "no element 'bar', allowed"),
        ("bar_linear_damping", ("c1",), DRAG, r"\['c1'\], allowed: \[bar\]"),
    ],
)
def test_wrong_effects_are_refused(general, effect, elements, parameters, text):
    machine = with_effect(general, effect, elements, **parameters)
    with pytest.raises(InputError, match=text):
        MujocoPlant(machine, still().at, MS, bar_pose=POSE)
