"""The elastic catenary: how a cable with weight hangs between two points.

Source: Irvine, Cable Structures, MIT Press, 1981, section 1.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from cspm_msgs_py.errors import ConvergenceError

Array = NDArray[np.float64]

# Of the end point's position against the distance: what a solution may miss.
_TOLERANCE = 1e-9


class HangingCable(NamedTuple):
    """A cable that hangs from its upper or lower exit to its attachment.

    Attributes:
        horizontal: horizontal force, the same all along [N].
        exit_pull: vertical force at the exit, positive upwards on the cable [N].
        end_pull: vertical force that the cable exerts on its attachment, positive upwards [N].
        unstretched: its length without tension [m].
        sag: largest distance from the straight line [m].
    """

    horizontal: float
    exit_pull: float
    end_pull: float
    unstretched: float
    sag: float


def catenary_end(
    horizontal: float, exit_pull: float, length: float, weight: float, rigidity: float
) -> tuple[float, float]:
    """Return how far a point of the cable is from its exit, across and down [m].

    Args:
        horizontal: horizontal force [N].
        exit_pull: vertical force at the exit, positive upwards on the cable [N].
        length: of unstretched cable from the exit to the point [m].
        weight: per unstretched length [N/m].
        rigidity: E·A [N].
    """
    left, scale = exit_pull - weight * length, horizontal / weight
    across = np.arcsinh(exit_pull / horizontal) - np.arcsinh(left / horizontal)
    down = np.hypot(horizontal, exit_pull) - np.hypot(horizontal, left)
    stretched = length / rigidity
    return (
        float(horizontal * stretched + scale * across),
        float(stretched * (exit_pull - 0.5 * weight * length) + down / weight),
    )


def hang(
    across: float, down: float, tension: float, weight: float, rigidity: float
) -> HangingCable:
    """Return the cable that hangs between two points with a tension at its exit.

    Args:
        across: horizontal distance of the attachment from the exit [m].
        down: of the attachment below the exit [m].
        tension: at the exit [N].
        weight: per unstretched length, above 0 [N/m].
        rigidity: E·A [N].

    Raises:
        ConvergenceError: the tension does not hold the cable.
    """
    distance = float(np.hypot(across, down))

    def forces(angle: float) -> tuple[float, float]:
        # A vertical cable has a horizontal force of round-off, which the formulas need above 0.
        return max(tension * np.cos(angle), 1e-15 * tension), tension * np.sin(angle)

    def missed(unknown: Array) -> Array:
        end = catenary_end(*forces(unknown[0]), unknown[1] * distance, weight, rigidity)
        return np.array([end[0] - across, end[1] - down]) / distance

    # A straight cable, whose weight is half a turn of its direction at the exit.
    lean = 0.5 * weight * across / tension
    start = np.array([np.arctan2(down, across) + lean, 1.0 / (1.0 + tension / rigidity)])
    found = root(missed, start, tol=1e-12)
    angle, share = float(found.x[0]), float(found.x[1])
    if np.abs(missed(found.x)).max() > _TOLERANCE or share <= 0.0:
        raise ConvergenceError(
            f"{tension:.4g} N do not hold a cable of {weight * distance:.4g} N over"
            f" {distance:.4g} m, allowed: a higher tension or a lighter cable"
        )
    horizontal, pull = forces(angle)
    length = share * distance
    return HangingCable(
        float(horizontal),
        float(pull),
        float(pull - weight * length),
        length,
        _sag(horizontal, pull, length, weight, rigidity, (across, down)),
    )


def _sag(
    horizontal: float,
    pull: float,
    length: float,
    weight: float,
    rigidity: float,
    end: tuple[float, float],
) -> float:
    """Return the largest distance from the straight line, where the cable is parallel to it."""
    across, down = end
    if across <= 0.0:
        return 0.0
    place = float(np.clip((pull - horizontal * down / across) / weight, 0.0, length))
    if place == 0.0:
        return 0.0
    x, z = catenary_end(horizontal, pull, place, weight, rigidity)
    return abs(z * across - x * down) / float(np.hypot(across, down))


def ernst_share(across: float, tension: float, weight: float, rigidity: float) -> float:
    """Return which share of its stiffness sag leaves a cable: Ernst's equivalent modulus.

    Source: Ernst, Der Bauingenieur 40(2), 1965.

    Args:
        across: horizontal distance of its ends [m].
        tension: mean [N].
        weight: per length [N/m].
        rigidity: E·A [N].
    """
    return float(1.0 / (1.0 + (weight * across) ** 2 * rigidity / (12.0 * tension**3)))
