"""How far a machine's bar is from its reference when all is well, found by simulating it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_control.plausibility.make import FOLLOWING_SHARE, body_points, machine_size
from cspm_msgs_py.errors import CspmError
from cspm_run.bundle import Bundle
from cspm_run.recorded_run import run, steps_of

Array = NDArray[np.float64]
# A minute of the shipped seas has their largest errors within a fifth; it takes a second.
LOOKED_S = 60.0
# So many times the tracking error is no tracking any more.
MARGIN = 3.0


def following_error(bundle: Bundle) -> float:
    """Return how far the bar's points may be from where they are wanted [m] in real time.

    The scenario's own number; else `MARGIN` times the tracking error, at most half the machine's
    size. That is also taken where nothing can be simulated: controllers of the user's own.
    """
    scenario, most = bundle.scenario, FOLLOWING_SHARE * machine_size(bundle.testbed.testbed)
    if scenario.safety.following_error is not None:
        return scenario.safety.following_error
    if scenario.controllers:
        return most
    found = tracking_error(bundle)
    return most if found is None else min(most, MARGIN * found)


def tracking_error(bundle: Bundle) -> float | None:
    """Return how far the bar's points are from their reference at most [m], all being well.

    Simulated without faults, and no less than what the scenario requires: errors below that are
    none of a machine's that is in order. None where the loop loses its bar.
    """
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    well = replace(bundle, scenario=scenario.model_copy(update={"faults": ()}))
    steps = min(steps_of(bundle), round(LOOKED_S * scenario.rates.plant))
    try:
        result = run(well, None, steps=steps)
    except CspmError:
        return None
    if result.failure is not None or result.interrupted:
        return None
    points, required = body_points(testbed)[1], scenario.requirement
    arm = np.linalg.norm(points, axis=1).max(initial=0.0)
    # Lowest and highest errors of each bin of some ten ms, each taken for one pose.
    bounds = result.statistics.envelope[:, :, :6].reshape(-1, 6)
    moved = _displacements(bounds[np.isfinite(bounds).all(axis=1)], points)
    return max(float(moved.max(initial=0.0)), float(required.position + arm * required.angle))


def _displacements(errors: Array, points: Array) -> Array:
    """Return how far small errors x y z φ θ ψ (k, 6) move points (n, 3) of a body, (k, n) [m]."""
    turned = np.cross(errors[:, None, 3:], points[None])
    return np.asarray(np.linalg.norm(errors[:, None, :3] + turned, axis=2))
