"""Let the bar follow a motion of one's own: a circle that begins from rest."""

import numpy as np

import cspm


def circle(time):
    """Return x y z [m] and roll, pitch, yaw [rad] in world_ned at a time [s]."""
    angle = 0.5 * time**2 / (2.0 + time)  # up to 0.5 rad/s
    return [0.05 * np.sin(angle), 0.05 * (1.0 - np.cos(angle)), 1.8, 0.0, 0.0, 0.0]


run = cspm.simulate("rest", duration=8, reference=circle)
x, y = run.bar_pose["surge"], run.bar_pose["sway"]
print(f"radius in the end: {np.hypot(x[-1], y[-1] - 0.05):.4f} m, wanted 0.0500 m")
print(f"largest error of sway: {run.errors['sway']['max']:.2e} m")
