"""Poses, angles and tensions of machines whose cables begin and end beside where the file says."""

from pathlib import Path

import numpy as np
import yaml
from machines import general_content
from scipy.spatial.transform import Rotation

from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_model.elastic_law import elongation_at
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import parse_testbed

RATE = 100.0
FILE = parse_testbed(yaml.safe_dump(general_content()), "general.yaml")
# Amplitudes [m, rad] and frequencies [Hz] of the bar's motion, which no two axes share.
BAR = np.array([0.3, 0.25, 0.25, 0.35, 0.3, 0.4])
FRAME = np.array([0.05, 0.05, 0.05, 0.1, 0.1, 0.1])
PACES = np.array([0.11, 0.17, 0.23, 0.29, 0.37, 0.43])


def survey(seed, size=2e-3, n=8):
    """Errors of exits and attachments, (n, 6) [m]."""
    return np.random.default_rng(seed).normal(0.0, size, (n, 6))


def turned(poses, point):
    return poses[:, :3] + Rotation.from_euler("ZYX", poses[:, :2:-1]).apply(point)


def swing(times, amplitudes, phase, centre=(0.0,) * 6):
    return np.array(centre) + amplitudes * np.sin(2 * np.pi * PACES * times[:, None] + phase)


def measured(
    errors,
    duration=20.0,
    *,
    file=FILE,
    bar=BAR,
    frame=FRAME,
    noise=0.0,
    scales=1.0,
    late=0.0,
    tension=True,
    seed=3,
):
    """Return what sensors say of a machine with such errors of its ends and encoders' scales.

    Lengths are distances of points that scipy turns; the drums take l0/l of the cable's motion.
    """
    machine, times = file.testbed, np.arange(round(duration * RATE)) / RATE
    phases = np.arange(6.0)
    bars, frames = swing(times, bar, phases, (0, 0, 2, 0, 0, 0)), swing(times, frame, -phases)
    pulls = 20.0 + 6.0 * np.sin(2 * np.pi * 0.31 * times[:, None] + np.arange(len(errors)))
    ends = [
        (np.add(c.exit, e[:3]), np.add(c.attachment, e[3:]))
        for c, e in zip(machine.cables, errors, strict=True)
    ]
    apart = [turned(bars, there) - turned(frames, here) for here, there in ends]
    lengths = np.linalg.norm(apart, axis=2).T
    parameters = nominal_parameters(machine)
    elastic = lengths + np.array([c.offset_length for c in machine.cables])
    stretch = elongation_at(parameters, pulls, elastic)
    stretch = elongation_at(parameters, pulls, elastic - stretch)
    rest = lengths - stretch
    taken = (
        -np.diff(rest, axis=0) * 2.0 / (2.0 - (stretch / lengths)[1:] - (stretch / lengths)[:-1])
    )
    radii = scales * np.array([c.drum_radius / c.gear_ratio for c in machine.cables])
    angles = np.vstack([np.zeros(len(errors)), np.cumsum(taken, axis=0)]) / radii
    rng = np.random.default_rng(seed)
    rates = np.gradient(lengths, times, axis=0) + np.gradient(angles, times, axis=0) * radii
    damping = [
        c.damping.constant - c.damping.slope * elastic[:, i] for i, c in enumerate(machine.cables)
    ]
    pulls = pulls + np.transpose(damping) * rates

    def posed(poses):
        return Samples(times + late, poses + noise * rng.normal(size=poses.shape))

    return Measurement(
        Path(f"synthetic_{seed}"),
        f"{seed:064d}",
        file,
        frame_pose=posed(frames),
        bar_pose=posed(bars),
        angle=Samples(times, angles),
        tension=Samples(times, pulls) if tension else None,
    )
