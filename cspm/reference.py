"""A motion of one's own for the bar to follow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm.scenario import Scenario, redescribed
from cspm_control.waves.motion_file import COLUMNS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import FileMotion
from cspm_msgs_py.scenario_keys.bodies import ORIGIN, Target

Array = NDArray[np.float64]
Reference: TypeAlias = Callable[[float], ArrayLike] | tuple[ArrayLike, ArrayLike]

# A function is looked at so often [Hz]; between, the motion is a cubic spline.
SAMPLING = 100.0


def with_reference(scenario: Scenario, reference: Reference, folder: Path) -> Scenario:
    """Return the scenario with a motion of one's own of the bar.

    Args:
        scenario: whose target's motion and offset it replaces.
        reference: a function of time [s] that returns a pose x y z φ θ ψ in world_ned [m, rad], or
            times (n,) and poses (n, 6).
        folder: where the motion's file is written.

    Raises:
        InputError: it is no such motion.
    """
    time, pose = _sampled(reference, scenario.description.duration)
    path = folder / "reference.csv"
    table = np.column_stack([time, pose]).tolist()
    lines = [",".join(COLUMNS), *(",".join(map(repr, row)) for row in table)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    body = Target(mean_pose=ORIGIN, motion=FileMotion(path=str(path.absolute())))
    return redescribed(scenario, target=body, bar_offset=ORIGIN)


def _sampled(reference: Reference, duration: float) -> tuple[Array, Array]:
    if callable(reference):
        time = np.arange(round(duration * SAMPLING) + 2) / SAMPLING
        return time, _numbers([reference(float(t)) for t in time], (len(time), 6))
    if not isinstance(reference, tuple) or len(reference) != 2:
        raise InputError("reference: allowed: a function of time, or times (n,) and poses (n, 6)")
    time = _numbers(reference[0], (np.size(reference[0]),))
    return time, _numbers(reference[1], (len(time), 6))


def _numbers(values: object, shape: tuple[int, ...]) -> Array:
    try:
        found = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != shape or not np.isfinite(found).all():
        raise InputError(
            f"reference: shape {found.shape}, allowed: finite numbers of shape {shape}: x y z roll"
            " pitch yaw [m, rad] at each time [s]"
        )
    return found
