"""The key `operation:` of a scenario: when the bar is moved by hand, and when it tracks."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, field_validator

from cspm_msgs_py.scenario_keys.bodies import ORIGIN, Pose
from cspm_msgs_py.yaml_file import StrictModel

OPERATION_GRID = 0.01  # s: switches begin and end on it


class _Switch(StrictModel):
    """Attributes common to all modes.

    Attributes:
        at: when the mode is switched to [s].
        blend: how long the reference takes to pass over to it [s]; 0: it jumps.
    """

    at: NonNegativeFloat
    blend: NonNegativeFloat = 5.0

    @field_validator("at", "blend")
    @classmethod
    def _on_grid(cls, time: float) -> float:
        steps = time / OPERATION_GRID
        if abs(steps - round(steps)) > 1e-6:
            raise ValueError(f"{time:g} s, allowed: a multiple of {OPERATION_GRID:g} s")
        return time


class Manual(_Switch):
    """The bar's reference moves from where it is, whatever target and winch frame do.

    Attributes:
        rate: of x, y, z in world_ned [m/s], and of roll, pitch, yaw [rad/s].
    """

    mode: Literal["manual"]
    rate: Pose = ORIGIN


class Track(_Switch):
    """The bar's reference is its target plus its offset."""

    mode: Literal["track"]


Operation = Annotated[Manual | Track, Field(discriminator="mode")]


def check_operation(operation: Sequence[Operation], duration: float, source: str) -> None:
    """Check a timetable of modes in a run of `duration` [s] with this `target.source`.

    Raises:
        ValueError: naming the entry and what is allowed.
    """
    if operation and source != "prescribed":
        raise ValueError(
            f"operation: with target.source {source}, allowed: prescribed, or no operation"
        )
    for i, (first, second) in enumerate(pairwise(operation)):
        if second.at <= first.at:
            raise ValueError(
                f"operation[{i + 1}].at: {second.at:g} s, allowed: later than"
                f" operation[{i}] at {first.at:g} s"
            )
    for i, entry in enumerate(operation):
        if entry.at >= duration:
            raise ValueError(
                f"operation[{i}].at: {entry.at:g} s, allowed: before the run's end at"
                f" {duration:g} s"
            )
