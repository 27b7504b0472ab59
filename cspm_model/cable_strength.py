"""Whether cables carry no more than their breaking force allows (thesis, table 3-2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


def allowed_tensions(testbed: Testbed) -> Array:
    """Return breaking force over safety factor, (n,) [N]; inf where no breaking force is known."""
    return np.array(
        [
            (cable.breaking_force or np.inf) / (cable.safety_factor or testbed.safety_factor)
            for cable in testbed.cables
        ]
    )


def limit_warnings(testbed: Testbed) -> tuple[str, ...]:
    """Return a line for each cable whose tension limit is beyond what its strength allows."""
    limits = np.array([(cable.tension_limits or (0.0, 0.0))[1] for cable in testbed.cables])
    return tuple(
        f"cables.{testbed.cables[i].name}.tension_limits: up to {limits[i]:g} N, allowed: at most"
        f" {_allowance(testbed, i)}; lower the limit"
        for i in np.flatnonzero(limits > allowed_tensions(testbed)).tolist()
    )


def strength_warnings(testbed: Testbed, highest: Array) -> tuple[str, ...]:
    """Return what `limit_warnings` and `load_warnings` say."""
    return limit_warnings(testbed) + load_warnings(testbed, highest)


def load_warnings(testbed: Testbed, highest: Array) -> tuple[str, ...]:
    """Return a line for each cable that carried more than its strength allows.

    Args:
        testbed: the machine.
        highest: highest tension of each cable in a run, shape (n,) [N].
    """
    return tuple(
        f"{testbed.cables[i].name} carried {highest[i]:.4g} N, allowed: at most"
        f" {_allowance(testbed, i)}; move less, or take a stronger cable"
        for i in np.flatnonzero(highest > allowed_tensions(testbed)).tolist()
    )


def _allowance(testbed: Testbed, i: int) -> str:
    cable = testbed.cables[i]
    factor = cable.safety_factor or testbed.safety_factor
    return (
        f"{allowed_tensions(testbed)[i]:.4g} N, its breaking force of {cable.breaking_force:g} N"
        f" over the safety factor {factor:g}"
    )
