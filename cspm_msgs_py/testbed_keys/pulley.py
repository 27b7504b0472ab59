"""The pulley at a cable's exit, which swivels so that it always faces the attachment."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from cspm_msgs_py.testbed_keys.plausible import DrumRadius
from cspm_msgs_py.yaml_file import StrictModel

# The most parts of a cable between two blocks: more than any crane has.
MOST_PARTS = 16
Parts = Annotated[int, Field(ge=1, le=MOST_PARTS)]


def _has_direction(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    length = float(np.linalg.norm(axis))
    if not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"{list(axis)}, allowed: three finite numbers, not all 0")
    return axis


Axis = Annotated[tuple[float, float, float], AfterValidator(_has_direction)]


class Pulley(StrictModel):
    """A pulley of `radius` [m] that swivels about `axis`, in winch_frame_ned.

    The cable enters it at the exit, in the direction of the axis.
    """

    radius: DrumRadius
    axis: Axis

    @property
    def direction(self) -> NDArray[np.float64]:
        """The axis as a unit vector, (3,)."""
        axis = np.array(self.axis, dtype=np.float64)
        return np.asarray(axis / np.linalg.norm(axis), dtype=np.float64)
