"""What the drives of a scenario take: torques, or tensions, whose loop they close themselves."""

from __future__ import annotations

from typing import Final, Literal

Drive = Literal["torque", "tension"]
TORQUE_DRIVE: Final = "torque"
TENSION_DRIVE: Final = "tension"


def check_drive(drive: str, mode: str) -> None:
    """Check that there are tensions for drives that take them.

    Raises:
        ValueError: a control mode that commands no tension.
    """
    if drive == TENSION_DRIVE and mode != "closed_loop":
        raise ValueError(
            f"drive: {TENSION_DRIVE} with control.mode {mode}, which wants no tension, allowed:"
            f" {TORQUE_DRIVE}, or closed_loop"
        )
