"""Attitudes that jump: markers of a symmetric body that were swapped, or a body lost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cspm_checks.machine.poses import Poses
from cspm_checks.outlier_suspicions import at_instants
from cspm_checks.outliers import impossible_steps
from cspm_checks.stuck import is_held
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
LEAST = np.radians(5.0)
"""What noise and vibration do not turn a body from one frame to the next."""
SURELY = np.radians(30.0)
"""What no body of such a machine turns in one frame, however many frames jump."""
MOST = 0.2
"""Share of frames: where more jump, it is a motion too fast for the camera."""
_GAP = 1.5
_BACK = np.radians(5.0)
_CLEAR_AXIS = 0.95


class Swap(NamedTuple):
    """A stretch with another attitude than before and after: first and last instant [s]."""

    start: float
    end: float
    turned: Array


def attitude_suspicions(where: str, one: Poses) -> list[Suspicion]:
    """Return at which instants an attitude jumps.

    A jump is a step more than eight times the fifth largest of the fifty around it, as of a
    position, or one that no body makes in a frame.

    Args:
        where: the topic.
        one: its poses.
    """
    if len(one.time) < 20:
        return []
    spans = np.diff(one.time)
    usual = float(np.median(spans))
    turns = np.abs(np.sum(one.turns[1:] * one.turns[:-1], axis=1))
    steps = np.where(spans <= _GAP * usual, 2.0 * np.arccos(np.minimum(turns, 1.0)), 0.0)
    jumps = impossible_steps(steps)[0]
    jumps = np.union1d(jumps[steps[jumps] > LEAST], np.flatnonzero(steps > SURELY))
    # A camera that held its last frames steps on: that is reported as held.
    held = [is_held(one.turns[:, 0], int(row) + 1) for row in jumps]
    jumps = jumps[~np.array(held, dtype=np.bool_)]
    if not len(jumps) or len(jumps) > MOST * len(steps):
        return []
    largest = float(np.degrees(steps[jumps].max()))
    swaps, rows = _swaps(one, jumps)
    text = f"the attitude jumps {len(jumps)} times, by up to {largest:.3g}°"
    if swaps and (axis := _axis(swaps)):
        text += f", about the body's {axis}, and back: markers of a symmetric body swapped?"
    else:
        text += ": markers swapped, or the body lost?"
    remedy, mend = "`drop` the stretches", dict[str, Any]()
    if swaps:
        stretches = ", ".join(f"{each.start:.6g} to {each.end:.6g} s" for each in swaps[:5])
        more = f" and {len(swaps) - 5} more" if len(swaps) > 5 else ""
        remedy = f"`drop` {stretches}{more}: {rows} of {len(one.time)} messages"
        mend = {
            "drop": [[float(one.start - usual / 2), float(one.end + usual / 2)] for one in swaps]
        }
    found = at_instants(where, "attitude", text, one.time[jumps + 1])
    return [replace(found, remedy=remedy, mend={where: mend} if mend else {})]


def _swaps(one: Poses, jumps: NDArray[np.intp]) -> tuple[list[Swap], int]:
    """Return the stretches after which the attitude comes back, and how many frames they have."""
    found, frames, k = [], 0, 0
    turns = Rotation.from_quat(one.turns)
    while k + 1 < len(jumps):
        start, end = int(jumps[k]), int(jumps[k + 1])
        across = turns[start].inv() * turns[end + 1]
        inside = turns[start].inv() * turns[start + 1]
        # What moved meanwhile is small beside the jump.
        if across.magnitude() < max(_BACK, 0.5 * inside.magnitude()):
            found.append(Swap(one.time[start + 1], one.time[end], inside.as_rotvec()))
            frames += end - start
            k += 2
        else:
            k += 1
    if sum(each.end - each.start for each in found) > 0.5 * float(np.ptp(one.time)):
        return [], 0
    return found, frames


def _axis(swaps: list[Swap]) -> str:
    """Return the body's axis about which all swaps turn, empty where it is none."""
    axes = np.array([each.turned / np.linalg.norm(each.turned) for each in swaps])
    usual = np.median(np.abs(axes), axis=0)
    return "xyz"[int(np.argmax(usual))] if usual.max() > _CLEAR_AXIS else ""
