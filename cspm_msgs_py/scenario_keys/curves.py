"""References of laboratories: curves, sums of sines and waypoints, keys of a scenario's `motion:`.

Each is a displacement from the body's mean pose, as in `motion_spec`. Curves lie in the plane of
surge and sway and are turned by `turn`, roll, pitch and yaw [rad]; with `ramp` [s] they grow from
rest.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator
from typing_extensions import Self

from cspm_msgs_py.dofs import Dof
from cspm_msgs_py.yaml_file import StrictModel

Six = tuple[float, float, float, float, float, float]
Three = tuple[float, float, float]


class Sine(StrictModel):
    """amplitude·sin(2π·frequency·t + phase) [as the signal, Hz, rad]."""

    amplitude: float
    frequency: PositiveFloat
    phase: float = 0.0


class Grown(StrictModel):
    """What grows from rest within `ramp` seconds; 0: at once."""

    ramp: NonNegativeFloat = 2.0


class Curve(Grown):
    """A closed curve, gone through once per `period` [s], turned about the mean pose."""

    period: PositiveFloat
    turn: Three = (0.0, 0.0, 0.0)


class LineMotion(Curve):
    """There and back along a straight line: `to` is the far end's displacement [m, rad]."""

    type: Literal["line"] = "line"
    to: Six


class CircleMotion(Curve):
    """A circle of `radius` [m] about the mean pose, from surge towards sway."""

    type: Literal["circle"] = "circle"
    radius: PositiveFloat


class LemniscateMotion(Curve):
    """Gerono's lemniscate: `size` is how far it reaches in surge and in sway [m]."""

    type: Literal["lemniscate"] = "lemniscate"
    size: tuple[PositiveFloat, PositiveFloat]


class HelixMotion(Curve):
    """Turns of a circle of `radius` [m] per `period`, `rise` [m] up within `turns` and back."""

    type: Literal["helix"] = "helix"
    radius: PositiveFloat
    rise: float
    turns: PositiveInt = 3


class SinesMotion(Grown):
    """A sum of sines per DOF [m, rad]."""

    type: Literal["sines"] = "sines"
    sines: Annotated[dict[Dof, tuple[Sine, ...]], Field(min_length=1)]


class Waypoint(StrictModel):
    """Where to go next: `to` is a displacement from the mean pose [m, rad], then rest for `pause`.

    The way takes `duration` [s], or goes at `speed` at most: in m/s, or rad/s where only the
    attitude changes.
    """

    to: Six
    speed: PositiveFloat | None = None
    duration: PositiveFloat | None = None
    pause: NonNegativeFloat = 0.0

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.speed is None) == (self.duration is None):
            raise ValueError("speed, duration: both or neither, allowed: one of them")
        return self


class WaypointsMotion(StrictModel):
    """From point to point in straight lines, at rest in each.

    The profile `quintic` has least jerk (Flash, Hogan, J. Neuroscience 5, 1985); `jerk_limited`
    keeps `acceleration` [m/s² or rad/s²] and `jerk` at most and needs a speed (Biagiotti,
    Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4).
    """

    type: Literal["waypoints"] = "waypoints"
    points: tuple[Waypoint, ...] = Field(min_length=1)
    profile: Literal["quintic", "jerk_limited"] = "quintic"
    acceleration: PositiveFloat = 1.0
    jerk: PositiveFloat = 10.0

    @model_validator(mode="after")
    def _has_speeds(self) -> Self:
        for i, point in enumerate(self.points):
            if self.profile == "jerk_limited" and point.speed is None:
                raise ValueError(
                    f"points[{i}].duration: with profile jerk_limited, allowed: a speed"
                )
        return self


CurveSpec = LineMotion | CircleMotion | LemniscateMotion | HelixMotion
