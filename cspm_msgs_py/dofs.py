"""The six degrees of freedom of a body, in the order of every pose and wrench."""

from typing import Literal

Dof = Literal["surge", "sway", "heave", "roll", "pitch", "yaw"]
DOFS: tuple[Dof, ...] = ("surge", "sway", "heave", "roll", "pitch", "yaw")
# The world axes in which the thesis's machine meets a wrench: all but the roll moment.
CONTROLLED_AXES = (0, 1, 2, 4, 5)
