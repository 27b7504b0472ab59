"""The six degrees of freedom of a body, in the order of every pose and wrench."""

from typing import Literal

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
Dof = Literal["surge", "sway", "heave", "roll", "pitch", "yaw"]
# Those that the thesis controls.
ControlledDof = Literal["surge", "sway", "heave", "pitch", "yaw"]
# The world axes in which the thesis's machine meets a wrench: all but the roll moment.
CONTROLLED_AXES = (0, 1, 2, 4, 5)
