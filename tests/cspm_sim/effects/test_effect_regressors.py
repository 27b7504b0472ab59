"""Regressors against machines with the effect: what a recording would leave over."""

import numpy as np
import pytest
from effect_snapshots import Snapshots
from machines import build, general_content

from cspm_msgs_py.testbed import EffectEntry
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.signals import CableSignal

MACHINE = build(general_content())
ALL = list(catalogue().values())
# Values at which the linear weights are exact, however large.
EXACT = {
    "winch_viscous_friction": {"coefficient": 0.02},
    "winch_coulomb_friction": {"torque": 0.05},
    "winch_stribeck_friction": {
        "breakaway_torque": 0.08,
        "coulomb_torque": 0.05,
        "stribeck_speed": 2.0,
    },
    "winch_load_friction": {"coefficient": 0.1},
    "winch_torque_ripple": {"amplitude": 0.03, "order": 6.0, "phase": 0.7},
    "winch_directional_friction": {"coefficient": -0.02},
    "winch_curved_friction": {"torque": 0.05, "speed": 0.7},
    "winch_unbalance": {"cosine": 0.04, "sine": -0.02, "order": 2.0},
    "bar_restoring": {
        "surge": 30.0,
        "sway": 20.0,
        "heave": 40.0,
        "roll": 3.0,
        "pitch": 2.0,
        "yaw": 5.0,
        "rest_heave": 1.8,
    },
    "winch_torque_gain": {"gain": 1.3},
    "winch_torque_offset": {"torque": 0.07},
    "winch_inertia": {"inertia": 1e-4},
    "winch_drum_radius": {"radius": 0.004},
    "winch_drum_eccentricity": {"eccentricity": 0.002, "phase": -0.6},
    "pulley_friction": {"coefficient": 0.15, "wrap": 1.9},
    "cable_axial_damping": {"scale": 1.4},
    "cable_transverse_damping": {"coefficient": 3.0, "exit_share": -0.4},
    "bar_mass": {"mass": 1.5},
    "bar_inertia": {"ixx": 0.03, "iyy": 0.02, "izz": -0.03},
    "bar_linear_damping": dict(
        zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), range(1, 7), strict=True)
    ),
    "bar_quadratic_drag": dict(
        zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), range(1, 7), strict=True)
    ),
    "bar_constant_wrench": dict(
        zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), range(-3, 3), strict=True)
    ),
}
# Values at which the weights are the first order of the effect.
FIRST_ORDER = {
    "cable_stiffness": {"scale": 1.02},
    "cable_length_offset": {"offset": 0.05},
    "cable_exit_offset": {"x": 3e-4, "y": -2e-4, "z": 4e-4},
    "cable_attachment_offset": {"x": -2e-4, "y": 4e-4, "z": 3e-4},
    "pulley_radius": {"radius": 3e-4},
    "cable_sag": {"linear_density": 3e-4},
    "bar_com": {"x": 0.004, "y": -0.003, "z": 0.005},
    "frame_pose_offset": {
        "surge": 2e-4,
        "sway": -3e-4,
        "heave": 1e-4,
        "roll": 2e-4,
        "pitch": -1e-4,
        "yaw": 3e-4,
    },
}
# Residual of the cable's law at the instant: its other effects build up over time.
INSTANT = {"winch_drum_radius", "winch_drum_eccentricity"}


def entry(effect, values):
    return EffectEntry(effect=effect, parameters={k: float(v) for k, v in values.items()})


def shrunk(effect, values, share):
    """The same parameters, nearer to the effect's absence."""
    return {
        p.name: p.absent + share * (values[p.name] - p.absent)
        if p.absent is not None
        else values[p.name]
        for p in effect.parameters
    }


def residual_and_model(snapshots, effect, regression, values, cable):
    """What the nominal machine leaves over of a residual, and what the columns say of it."""
    point = {name: values[name] for name in effect.signature.nonlinear}
    weights = effect.weights(values)
    channel = regression.channel
    if channel is Channel.SHAFT:
        return snapshots.shaft_residual(cable), regression.columns(
            snapshots.winch(cable), **point
        ) @ weights
    if channel is Channel.TENSION:
        signals = snapshots.cable(cable)
        if effect.block.value == "frame":
            signals = snapshots.frame(cable)
        return snapshots.tension_residual(cable), regression.columns(signals, **point) @ weights
    if effect.block.value == "cable":
        model = sum(
            regression.columns(snapshots.ends(i), **point) @ weights for i in range(snapshots.n)
        )
        return snapshots.wrench_residual(), model
    return snapshots.wrench_residual(), regression.columns(snapshots.bar(), **point) @ weights


def regressions(effect):
    partners = () if effect.id in INSTANT else effect.signature.partners
    return (effect.signature.regression, *partners)


def test_the_nominal_machine_leaves_nothing_over():
    """The residuals themselves: without effects they vanish to rounding."""
    snapshots = Snapshots(MACHINE)
    assert np.abs(snapshots.wrench_residual()).max() < 1e-9
    for cable in range(8):
        assert np.abs(snapshots.shaft_residual(cable)).max() < 1e-12
        assert np.abs(snapshots.tension_residual(cable)).max() < 1e-9


def test_every_effect_without_memory_is_tested_here():
    memoryless = {e.id for e in ALL if not e.physics.states and e.block.value != "sensor"}
    assert set(EXACT) | set(FIRST_ORDER) == memoryless


@pytest.mark.parametrize("name", EXACT)
def test_columns_times_weights_are_what_the_nominal_machine_leaves_over(name):
    effect, values = catalogue()[name], EXACT[name]
    snapshots = Snapshots(MACHINE, [entry(name, values)])
    for regression in regressions(effect):
        for cable in (1, 4):
            left, model = residual_and_model(snapshots, effect, regression, values, cable)
            assert np.abs(left).max() > 1e-4
            # The difference quotients of the signals carry about 1e-8 of their size.
            assert model == pytest.approx(left, rel=1e-6, abs=1e-7 * np.abs(left).max())


@pytest.mark.parametrize("name", FIRST_ORDER)
def test_columns_are_the_first_order_of_what_is_left_over(name):
    """Half the effect, a quarter of what the first order misses."""
    effect = catalogue()[name]
    for number in range(len(regressions(effect))):
        misses = []
        for share in (1.0, 0.5):
            values = shrunk(effect, FIRST_ORDER[name], share)
            snapshots = Snapshots(MACHINE, [entry(name, values)])
            regression = regressions(effect)[number]
            left, model = residual_and_model(snapshots, effect, regression, values, 1)
            misses.append(np.abs(left - model).max() / np.abs(left).max())
        assert misses[0] < 0.1
        # Relative misses halve; below 1e-6 they are rounding.
        assert misses[1] < max(0.6 * misses[0], 1e-6)


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.id)
def test_weights_and_parameters_are_two_ways_of_saying_the_same(effect):
    values = {p.name: p.minimum + 0.7 * (p.maximum - p.minimum) for p in effect.parameters}
    point = {name: values[name] for name in effect.signature.nonlinear}
    weights = effect.weights(values)
    found = effect.values(weights, **point)
    if effect.id == "payload_swing":
        # Its grid holds the damping of a mass of 1 kg.
        own = values["damping"] / values["mass"]
        found = effect.values(weights, length=point["length"], damping=own)
    assert found == pytest.approx(values, rel=1e-9)
    assert list(found) == [p.name for p in effect.parameters]
    absent = {p.name: values[p.name] if p.absent is None else p.absent for p in effect.parameters}
    if any(p.absent is not None for p in effect.parameters):
        assert effect.is_absent(absent)
        assert not effect.weights(absent).any()
    assert not effect.is_absent(values)


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.id)
def test_grids_are_of_parameters_and_within_bounds(effect):
    parameters = {p.name: p for p in effect.parameters}
    for name, grid in effect.signature.nonlinear.items():
        assert list(grid) == sorted(set(grid))
        assert parameters[name].minimum <= grid[0] <= grid[-1] <= parameters[name].maximum


@pytest.mark.parametrize("effect", [e for e in ALL if e.signature.saturates], ids=lambda e: e.id)
@pytest.mark.parametrize("stroke", [0.1, 10.0])
def test_what_saturates_has_columns_up_to_one_where_all_of_it_acts(effect, stroke):
    """Swings by a tenth of the grid's displacement, and by ten times as much."""
    ((name, grid),) = effect.signature.nonlinear.items()
    swing = np.sin(np.linspace(0.0, 20.0, 4001))
    for displacement in grid:
        rows = np.zeros((len(swing), len(CableSignal)))
        rows[:, CableSignal.ELONGATION] = stroke * displacement * swing
        most = np.abs(effect.regressors(rows, **{name: displacement})).max()
        assert most == pytest.approx(1.0, abs=1e-3) if stroke > 1.0 else most < 0.2
