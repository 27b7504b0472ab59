"""A cable with memory of its load."""

import numpy as np
from machines import LINEAR, build, cable

from cspm_model.motion import Motion

STILL = Motion.still(np.zeros(6))
MS = 1_000_000
LENGTH_M = 2.1


def line(effects=(), end=(0.0, 0.0, LENGTH_M), stiffness=LINEAR, damping=0.0, **winch):
    """One linear cable without damping to a fixed point."""
    only = cable("only", (0, 0, 0), end, stiffness, **winch)
    only["damping"] = {"constant": damping}
    return build({"name": "line", "cables": [only], "effects": list(effects)})


def stiffness_of(machine, unstretched):
    found = machine.cables[0]
    return found.stiffness.axial_rigidity / (unstretched + found.offset_length)
