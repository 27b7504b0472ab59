"""Plants moved by hand, and their trajectories."""

import numpy as np

from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.machine import frame_placement
from cspm_model.motion import Motion
from cspm_sim.kernels.plant import make_scratch, plant_rate
from cspm_sim.plant import Plant

AMPLITUDES = np.array([0.02, 0.015, 0.02, 0.03, 0.04, 0.03])


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
