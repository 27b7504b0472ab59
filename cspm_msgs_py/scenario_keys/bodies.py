"""The keys `winch_frame:` and `target:` of a scenario: bodies with a prescribed motion."""

from __future__ import annotations

from typing import Literal

from pydantic import PositiveFloat

from cspm_msgs_py.motion_spec import MotionSpec, StillMotion
from cspm_msgs_py.yaml_file import StrictModel

Pose = tuple[float, float, float, float, float, float]
ORIGIN: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

PRESCRIBED, MEASURED, EXTERNAL = "prescribed", "measured", "external"


class Body(StrictModel):
    """A body with a prescribed motion about a mean pose in world_ned (x y z φ θ ψ; m, rad)."""

    mean_pose: Pose = ORIGIN
    motion: MotionSpec = StillMotion()


class Target(Body):
    """The body that the bar follows, and how the bar's reference comes from it.

    Attributes:
        source: `prescribed`: from the motion itself, exactly; `measured`: from `/target/pose` of
            the simulated plant; `external`: from `/target/pose` of somebody's driver.
        bandwidth: of the filter that tells velocity and acceleration from measured poses [rad/s].
    """

    source: Literal["prescribed", "measured", "external"] = "prescribed"
    bandwidth: PositiveFloat = 40.0

    @property
    def is_measured(self) -> bool:
        """Whether the bar's reference comes from measured poses."""
        return self.source != PRESCRIBED
