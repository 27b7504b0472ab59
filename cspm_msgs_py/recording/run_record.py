"""What a recording states about the run that made it, in its metadata."""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256

from cspm_msgs_py.recording.reader import Recording

RECORD_NAME = "cspm"
CONTRACT_VERSION = "1"
# Attachments whose SHA-256 the record has, with its key.
_SEALED = {"testbed.yaml": "testbed_sha256", "mapping.yaml": "mapping_sha256"}
# In the plant's place: a unit of FMI, whose SHA-256 is beside it; somebody's drivers, not a
# simulation.
SIM, MUJOCO, FMU, EXTERNAL = "sim", "mujoco", "fmu", "external"
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


def misfits(attachments: Mapping[str, bytes], record: Mapping[str, str]) -> list[str]:
    """Return what of a recording does not fit its record, one line each.

    Args:
        attachments: content by name.
        record: the metadata of the run or import.
    """
    found = []
    for name, key in _SEALED.items():
        if name in attachments and key in record:
            digest = sha256(attachments[name]).hexdigest()
            if digest != record[key]:
                found.append(
                    f"{name} has SHA-256 {digest}, but {key} is {record[key]}: exchanged or edited"
                )
    version = record.get("contract_version", CONTRACT_VERSION)
    if version != CONTRACT_VERSION:
        found.append(
            f"contract version {version}, this cspm has {CONTRACT_VERSION}: names and units may"
            " mean something else"
        )
    return found
