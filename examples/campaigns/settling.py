"""A measure of one's own: the largest surge error once the first seconds are over."""

import numpy as np

SETTLED_S = 5.0


def largest_after(run):
    """Return the largest deviation in surge from 5 s on [m]."""
    pose, wanted = run.bar_pose, run.signal("bar_reference")
    at_pose = np.interp(pose.time, wanted.time, wanted["surge"])
    error = np.abs(pose["surge"] - at_pose)
    return error[pose.time >= SETTLED_S].max(initial=0.0)
