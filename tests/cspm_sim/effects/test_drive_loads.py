"""Friction by direction, friction that curves, unbalance, and ripple: their signs and limits."""

import numpy as np
import pytest
from machines import WINCH, build, entry

from cspm_model.motion import Motion
from cspm_sim.effects import catalogue
from cspm_sim.plant import Plant

STILL = Motion.still(np.zeros(6))
STEPS, PERIOD, INERTIA, TORQUE = 400, 1e-3, 1e-3, 0.05


def speed_after(effects, torque=TORQUE, steps=STEPS, **winch):
    """Speed of a winch without cable after a constant torque from rest [rad/s]."""
    cables = [{"name": "w", **WINCH, "rotor_inertia": INERTIA, **winch}]
    plant = Plant(build({"name": "bench", "cables": cables, "effects": effects}), STILL, 1_000_000)
    for _ in range(steps):
        plant.step(np.array([torque]))
    return plant.speeds[0], plant.angles[0]


@pytest.mark.parametrize(("torque", "coefficient"), [(TORQUE, 0.002), (-TORQUE, 0.004)])
def test_each_direction_has_its_own_coefficient(torque, coefficient):
    """v = τ/c·(1 − exp(−c·t/J))."""
    mean = entry("winch_viscous_friction", ["w"], coefficient=0.003)
    own = entry("winch_directional_friction", ["w"], coefficient=-0.001)
    speed, _ = speed_after([mean, own], torque)
    settled = torque / coefficient
    lag = np.exp(-coefficient * STEPS * PERIOD / INERTIA)
    assert speed == pytest.approx(settled * (1.0 - lag), rel=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_curved_friction_bulges_most_at_a_quarter_of_its_speed(side):
    """There a quarter of its torque balances a drive: the winch keeps its speed."""
    own = entry("winch_curved_friction", ["w"], torque=4.0 * TORQUE, speed=8.0)
    cables = [{"name": "w", **WINCH, "rotor_inertia": INERTIA}]
    plant = Plant(build({"name": "bench", "cables": cables, "effects": [own]}), STILL, 1_000_000)
    plant.speeds[:] = 2.0 * side
    plant.step(np.array([TORQUE * side]))
    assert plant.speeds[0] == pytest.approx(2.0 * side, rel=1e-6)


def test_beyond_its_speed_curved_friction_gives_back():
    own = entry("winch_curved_friction", ["w"], torque=0.1, speed=1.0)
    cables = [{"name": "w", **WINCH, "rotor_inertia": INERTIA}]
    plant = Plant(build({"name": "bench", "cables": cables, "effects": [own]}), STILL, 1_000_000)
    for start in (4.0, -4.0):
        plant.speeds[:] = start
        plant.step(np.zeros(1))
        assert plant.speeds[0] == pytest.approx(start * (1.0 + 0.1 * 2.0 / 4.0), rel=0.03)


def test_curved_friction_never_drives_a_winch():
    """However steep it is at rest, the speed decays and keeps its sign."""
    cables = [{"name": "w", **WINCH, "rotor_inertia": INERTIA}]
    own = [entry("winch_curved_friction", ["w"], torque=0.5, speed=40.0)]
    plant = Plant(build({"name": "bench", "cables": cables, "effects": own}), STILL, 1_000_000)
    plant.speeds[:] = 3.0
    speeds = []
    for _ in range(STEPS):
        plant.step(np.zeros(1))
        speeds.append(plant.speeds[0])
    assert np.all(np.diff(speeds) <= 1e-12)
    assert speeds[-1] == pytest.approx(0.0, abs=1e-3)
    assert min(speeds) > -1e-9


@pytest.mark.parametrize("gear", [1.0, 5.0])
def test_an_unbalanced_drum_falls_to_its_lowest_point(gear):
    """Energy: ½·J·q̇² = τ·q − ∫ cos(q/n) dq, in turns of the drum, not of the motor."""
    own = entry("winch_unbalance", ["w"], cosine=-0.04, sine=0.0, order=1.0)
    speed, angle = speed_after([own], 0.0, gear_ratio=gear)
    assert angle > 0.1
    assert 0.5 * INERTIA * speed**2 == pytest.approx(0.04 * gear * np.sin(angle / gear), rel=1e-6)


@pytest.mark.parametrize("order", [14, 28])
def test_whole_orders_of_a_drive_are_searched(order):
    signature = catalogue()["winch_torque_ripple"].signature
    assert order in signature.nonlinear["order"]
    assert all(float(each).is_integer() for each in signature.nonlinear["order"])
    assert signature.whole == ("order",)
