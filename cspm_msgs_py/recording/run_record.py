"""What a recording states about the run that made it, in its metadata."""

from __future__ import annotations

from cspm_msgs_py.recording.reader import Recording

RECORD_NAME = "cspm"
# In the plant's place: somebody's drivers, not a simulation.
SIM, MUJOCO, EXTERNAL = "sim", "mujoco", "external"
# The key under which controllers of somebody's own are named: objects, which no recording carries,
# or files, which one carries and nobody runs unasked.
OWN_CONTROLLERS = "own_controllers"
# What is said there of a controller that was a ROS program of the user's.
OWN_NODE = "a ROS node"


def own_controllers(recording: Recording) -> str | None:
    """Return which controllers were somebody's own, by stage; None: those of the scenario ran."""
    return recording.metadata.get(RECORD_NAME, {}).get(OWN_CONTROLLERS)


def simulated_plant(recording: Recording) -> str | None:
    """Return which of this project's plants was recorded; None of hardware and imported data."""
    plant = recording.metadata.get(RECORD_NAME, {}).get("plant")
    return None if plant == EXTERNAL else plant
