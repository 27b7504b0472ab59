"""What the sensors of a simulated machine gave, and the same with faults put in."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

import cspm
from cspm_checks.columns import recorded_columns
from cspm_checks.look import look_at
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.attached_testbed import attached_testbed

BESIDE = ("smoothed", "power", "velocity", "unrelated", "resolution")
STATE, CELLS, BAR = "/winches/state", "/cables/tension", "/bar/pose"


@cache
def healthy(scenario="suspended_four", duration=14.0):
    """Return the sensors' messages of a run, by topic, and the machine."""
    with TemporaryDirectory() as folder:
        place = Path(folder) / "run"
        cspm.simulate(scenario, seed=5, duration=duration).save(place)
        with Recording(place) as opened:
            machine = attached_testbed(opened.attachments, place).testbed
            return recorded_columns(opened), machine


def changed(log, topic, change):
    """Return a log of which the rows of a topic, by field, are changed in place."""
    table = log[topic].table.copy()
    change({name: table[:, i] for i, name in enumerate(log[topic].topic.fields)})
    return log | {topic: replace(log[topic], table=table)}


def later(log, topic, seconds):
    """Return a log of which a topic is stamped later."""
    stamps = log[topic].stamp_ns + round(seconds * 1e9)
    return log | {topic: replace(log[topic], stamp_ns=stamps)}


def read_as(log, places, turns):
    """Return a log of which the bar's places (k, 3) and rotations are functions of the true."""

    def change(fields):
        where = np.stack([fields[name] for name in "xyz"], axis=1)
        quaternion = ("qx", "qy", "qz", "qw")
        found = Rotation.from_quat(np.stack([fields[name] for name in quaternion], axis=1))
        for name, column in zip("xyz", places(where).T, strict=True):
            fields[name][:] = column
        for name, column in zip(quaternion, turns(found).as_quat().T, strict=True):
            fields[name][:] = column

    return changed(log, BAR, change)


def told(log, machine):
    """Return what looks wrong, less what else contradicts an encoder or grid that was changed."""
    origin = min(int(one.stamp_ns[0]) for one in log.values())
    found = look_at(log, machine, origin, {}).suspicions
    return [one for one in found if one.kind not in BESIDE]
