"""The payload that swings below the bar: what mechanics says of it without its equations."""

import numpy as np
import pytest
from machines import build, changed, entry, general_content

from cspm_model.kinematics import rotation
from cspm_model.motion import Motion
from cspm_sim.effects import catalogue
from cspm_sim.effects.signals import BarSignal
from cspm_sim.plant import Plant
from cspm_sim.plant_blocks import PlantBlocks

STILL = Motion.still(np.zeros(6))
MS = 1_000_000


def floating(effects, gravity, **bar):
    """The bar in the air, its cables slack."""
    content = {**general_content(), "gravity": gravity, "effects": list(effects)}
    for key, value in bar.items():
        content = changed(content, f"bar.{key}", value)
    plant = Plant(build(content), STILL, MS, bar_pose=[0, 0, 2, 0, 0, 0], locked=True)
    plant.unstretched_lengths += 3.0
    return plant


def momenta(plant, mass, length):
    """Momentum, angular momentum about the world's origin, and energy, payload included."""
    bar, state = plant.testbed.bar, plant.state
    turn = rotation(state[:6])
    omega, com = turn @ state[9:12], turn @ np.array(bar.com)
    inertia = turn @ bar.inertia.matrix @ turn.T
    centre, moved = state[:3] + com, state[6:9] + np.cross(omega, com)
    a, b, da, db = state[-4:]
    rod = np.array([np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)])
    by_a = np.array([0.0, -np.cos(a) * np.cos(b), -np.sin(a) * np.cos(b)])
    by_b = np.array([np.cos(b), np.sin(a) * np.sin(b), -np.cos(a) * np.sin(b)])
    place, speed = state[:3] + length * rod, state[6:9] + length * (da * by_a + db * by_b)
    momentum = bar.mass * moved + mass * speed
    turning = np.cross(centre, bar.mass * moved) + inertia @ omega + np.cross(place, mass * speed)
    height = bar.mass * centre[2] + mass * place[2]
    energy = 0.5 * (bar.mass * moved @ moved + omega @ inertia @ omega + mass * speed @ speed)
    return momentum, turning, energy - plant.testbed.gravity * height


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_payload_and_a_free_bar_keep_momentum_and_energy(gravity):
    """Exact coupling, whatever the motion: all but gravity's own impulse is kept."""
    mass, length = 2.0, 0.4
    payload = entry("payload_swing", mass=mass, length=length, damping=0.0)
    plant = floating([payload], gravity)
    plant.bar_state[6:] = [0.2, -0.1, 0.3, 0.5, -0.4, 0.8]
    plant.state[-4:] = [0.5, -0.4, 1.5, -2.0]
    before = momenta(plant, mass, length)
    for _ in range(500):
        plant.step(np.zeros(8))
    after = momenta(plant, mass, length)
    fall = (plant.testbed.bar.mass + mass) * gravity * 0.5
    assert after[0] - before[0] == pytest.approx([0, 0, fall], abs=1e-8)
    if gravity == 0.0:
        assert after[1] == pytest.approx(before[1], abs=1e-8)
    assert after[2] == pytest.approx(before[2], abs=1e-7)


def test_drag_takes_a_payloads_energy():
    payload = entry("payload_swing", mass=2.0, length=0.4, damping=1.5)
    plant = floating([payload], 9.81)
    plant.state[-4:] = [0.5, -0.4, 1.5, -2.0]
    energies = [momenta(plant, 2.0, 0.4)[2]]
    for _ in range(200):
        plant.step(np.zeros(8))
        energies.append(momenta(plant, 2.0, 0.4)[2])
    assert (np.diff(energies) < 0.0).all()


@pytest.mark.parametrize("mass", [0.5, 5.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_payload_under_a_held_up_bar_swings_with_the_pendulum_s_frequency(mass, axis):
    """ω² = g/length·(1 + mass/bar's mass): a small swing below a body free to yield."""
    length, heavy = 0.3, 15.0
    lift = entry(
        "bar_constant_wrench",
        **dict.fromkeys(("surge", "sway", "roll", "pitch", "yaw"), 0.0),
        # Not all of it: with no weight at all there is nothing for the start to balance.
        heave=-(heavy + mass) * 9.81 * (1.0 - 1e-6),
    )
    payload = entry("payload_swing", mass=mass, length=length, damping=0.0)
    plant = floating([payload, lift], 9.81, mass=heavy, com=[0.0, 0.0, 0.0])
    plant.state[-4 + axis] = 1e-3
    omega = np.sqrt(9.81 / length * (1.0 + mass / heavy))
    for _ in range(600):
        plant.step(np.zeros(8))
        assert plant.state[-4 + axis] == pytest.approx(1e-3 * np.cos(omega * plant.time), abs=2e-7)
    assert abs(plant.state[-3 - axis]) < 1e-12


def test_a_payload_hangs_on_a_bar_at_rest():
    """Its weight is in the cables from the start, and nothing moves."""
    content = general_content()
    content["effects"] = [entry("payload_swing", mass=1.0, length=0.5, damping=0.1)]
    plants = [
        Plant(build({**content, "effects": e}), STILL, MS, bar_pose=[0, 0, 2, 0, 0, 0], locked=True)
        for e in (content["effects"], [])
    ]
    assert plants[0].tensions.sum() > plants[1].tensions.sum()
    for _ in range(300):
        plants[0].step(np.zeros(8))
    assert plants[0].state[-4:] == pytest.approx(0.0, abs=1e-6)
    assert plants[0].bar_state[:3] == pytest.approx([0, 0, 2], abs=1e-6)


def test_columns_are_the_forces_of_a_small_swing():
    """The pivot moved on a given path: its force from a direct integration of the pendulum."""
    from scipy.integrate import solve_ivp

    mass, length, damping, gravity = 1.7, 0.4, 0.5, 9.81
    time = np.linspace(0.0, 4.0, 4001)

    def pivot(t):
        s, c = np.sin(5.0 * t), np.cos(5.0 * t)
        # From rest: x = 1e-3·(1 − cos)², y the same with the other sign.
        x, v = 1e-3 * (1 - c) ** 2, 1e-2 * (1 - c) * s
        return x, v, 5e-2 * (s * s + c * (1 - c))

    def rate(t, state):
        _, v, a = pivot(t)
        return [state[1], -a - gravity / length * state[0] - damping / mass * (state[1] + v)]

    found = solve_ivp(rate, (0.0, 4.0), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-12)
    signals = np.zeros((len(time), BarSignal.TIME + 1))
    signals[:, BarSignal.TIME], signals[:, BarSignal.GRAVITY] = time, gravity
    _, velocity, acceleration = pivot(time)
    for axis, side in ((0, 1.0), (1, -1.0)):
        signals[:, BarSignal.VELOCITY + axis] = side * velocity
        signals[:, BarSignal.ACCELERATION + axis] = side * acceleration
    effect = catalogue()["payload_swing"]
    columns = effect.regressors(signals, length=length, damping=damping / mass)
    wrench = columns @ effect.weights({"mass": mass, "length": length, "damping": damping})
    expected = mass * gravity / length * found.y[0]
    assert np.abs(expected).max() > 1e-2
    assert wrench[:, 0] == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    assert wrench[:, 1] == pytest.approx(-expected, abs=1e-4 * np.abs(expected).max())
    assert wrench[:, 2] == pytest.approx(mass * gravity, rel=1e-12)
    assert not wrench[:, 3:].any()


@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_a_payload_swings_along_under_a_bar_that_recorded_tensions_drive(mass):
    """As far off with a payload as without: the tensions' straight lines between samples."""
    effects = [entry("payload_swing", mass=mass, length=0.5, damping=0.1)]
    motion = Motion(np.zeros((400, 18)), 1e-3, False)
    machine = build({**general_content(), "effects": effects})
    plant = Plant(machine, motion, MS, bar_pose=[0, 0, 2, 0, 0, 0], locked=True)
    plant.bar_state[6] = 0.2
    start = plant.state.copy()
    states, tensions = [plant.bar_state.copy()], [plant.tensions.copy()]
    for _ in range(300):
        plant.step(np.zeros(8))
        states.append(plant.bar_state.copy())
        tensions.append(plant.tensions.copy())
    driven = PlantBlocks(plant.parameters, motion, MS)
    found = driven.by_tensions(0, start, np.array(tensions)).states
    moved = np.abs(np.array(states) - states[0]).max()
    assert np.abs(found - np.array(states)).max() < 0.02 * moved
