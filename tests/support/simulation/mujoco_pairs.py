"""Both plants of one machine, side by side."""

import numpy as np
import pytest

from cspm_model.motion import Motion
from cspm_sim.plant import Plant

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from cspm_sim.mujoco.plant import MujocoPlant

MS = 1_000_000
POSE = [0.02, -0.03, 1.9, 0.0, 0.05, -0.04]


def still():
    return Motion.still(np.zeros(6))


def waving(seconds, seed=0):
    """A winch frame that moves in all six coordinates."""
    rng = np.random.default_rng(seed)
    rates = 2 * np.pi * rng.uniform(0.3, 1.5, 6)
    sizes, phases = rng.uniform(0.01, 0.04, 6), rng.uniform(0, 6, 6)
    turns = np.arange(0, seconds + 0.1, 0.01)[:, None] * rates + phases
    parts = (np.sin(turns), rates * np.cos(turns), -(rates**2) * np.sin(turns))
    return Motion(np.hstack([sizes * part for part in parts]), 0.01)


def pair(testbed, motion=None, pose=POSE, period_ns=MS, substeps=1, **arguments):
    """Both plants of one machine."""
    motion = motion or still()
    if testbed.bar:
        arguments["bar_pose"] = pose
    return (
        Plant(testbed, motion, period_ns, **arguments),
        MujocoPlant(testbed, motion.at, period_ns, substeps=substeps, **arguments),
    )


def radii(testbed):
    return np.array([c.drum_radius / c.gear_ratio for c in testbed.cables])


def run_free(plant, steps):
    for _ in range(steps):
        plant.step(np.zeros(len(plant.tensions)))


def gaps(ours, theirs):
    """Largest difference of each view of the two plants' states."""
    names = ("bar_state", "angles", "speeds", "tensions", "unstretched_lengths", "frame")
    return {n: np.abs(getattr(ours, n) - getattr(theirs, n)).max(initial=0.0) for n in names}


def drive(ours, theirs, torques, hold=100):
    """Hold each row of torques for some steps; return the largest gaps seen on the way."""
    worst = gaps(ours, theirs)
    for torque in torques:
        for _ in range(hold):
            ours.step(torque)
            theirs.step(torque)
        worst = {name: max(worst[name], gap) for name, gap in gaps(ours, theirs).items()}
    assert ours.steps == theirs.steps
    assert ours.time == theirs.time
    return worst


def swinging_torques(plant, count, share=0.1, seed=3):
    rng = np.random.default_rng(seed)
    balance = radii(plant.testbed) * plant.tensions
    return balance * (1.0 + share * rng.standard_normal((count, len(balance))))
