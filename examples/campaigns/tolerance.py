"""A measure of one's own: for how long the bar is where it has to be."""

import numpy as np

TOLERANCE_M = 2e-3


def share_within(run):
    """Return the share of time in which surge, sway and heave are all within ± 2 mm."""
    pose, wanted = run.truth.bar_pose, run.signal("bar_reference")
    within = np.ones(len(pose.time), dtype=bool)
    for dof in ("surge", "sway", "heave"):
        at_pose = np.interp(pose.time, wanted.time, wanted[dof])
        within &= np.abs(pose[dof] - at_pose) < TOLERANCE_M
    return float(within.mean())
