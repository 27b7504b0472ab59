"""The six degrees of freedom of a body, in the order of every pose and wrench."""

from typing import Literal

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
ControlledDof = Literal["surge", "sway", "heave", "pitch", "yaw"]
