"""The physical limit: when does any tension set give the bar the motion that is wanted?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from bench.results.tracking import motions_of_bundle
from cspm_control.controllers.bar_dynamics import bar_parameters, wanted_motion, wrench_for
from cspm_control.controllers.governor import plan_deviation
from cspm_control.stages.make import controlled_axes, governed, known_wrench
from cspm_control.waves.wave_trajectory import WaveTrajectory
from cspm_model.kinematics import geometry
from cspm_model.motion import Motion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.testbed import Testbed
from cspm_run.bundle import Bundle

Array = NDArray[np.float64]

FORESEEN = 2.0
# Beside half the square of each deviation; three times as much gains 0.1 to 0.3 % of the time.
GATHERING = 30.0
REFERENCES = ("/bar/reference", "/winch_frame/reference")


def least_tensions(bundle: Bundle, times: Array) -> Array:
    """Return the highest lower tension limit that allows the reference at each of these times [N].

    −inf where even pushing cables would not; below 0 no set of pulling cables gives the bar its
    reference's acceleration with the bar on the reference (2-12); a linear programme each. The
    upper limits are the test-bed's, cables are rigid, winches as strong as it takes.

    Args:
        bundle: a closed loop.
        times: any (n,) [s].
    """
    assert isinstance(bundle.scenario.control, ClosedLoop)
    testbed = bundle.testbed.testbed
    axes = list(controlled_axes(bundle.scenario.control))
    motions = motions_of_bundle(bundle)
    bar, frame = (WaveTrajectory(motions[name]) for name in REFERENCES)
    upper = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)[:, 1]
    cables = nominal_parameters(testbed).cables
    known = known_wrench(bundle.scenario.control)
    found = []
    for time in times:
        stamp = round(time * 1e9)
        wrench, pose = _wanted(bar.step(stamp), testbed)
        frame.step(stamp)
        structure = -geometry(cables, pose, frame.values[:6].copy()).bar.T[axes]
        found.append(_least(structure, (wrench - known)[axes], upper))
    return np.array(found)


def least_errors(bundle: Bundle, lower: float = 0.0) -> Array:
    """Return the least RMS error [m, rad] (6,) with tensions ≥ `lower` [N] at any instant.

    Of the nominal bar in the controlled coordinates, by any controller that knows the reference
    `FORESEEN` [s] ahead; least in the sum of squared shares of the requirement, but for the
    governor's preference for smooth accelerations.
    """
    return np.sqrt((_plan(bundle, lower, 0.0).knots[:, :6] ** 2).mean(axis=0))


def gathered_deviations(bundle: Bundle, lower: float, times: Array) -> Array:
    """Return deviations (k, 6) [m, rad] at times (k,) [s] that exceed the requirement seldom.

    As for `least_errors`, but least in what exceeds the requirement, where tensions ≥ 0 exist.
    """
    plan = _plan(bundle, lower, GATHERING)
    return np.array([plan.at(time)[:6] for time in times])


def _plan(bundle: Bundle, lower: float, excess_weight: float) -> Motion:
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    limits = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)
    limits[:, 0] = lower
    motions = motions_of_bundle(bundle)
    bar, frame = (motions[name] for name in REFERENCES)
    machine = governed(scenario, testbed, limits)
    return plan_deviation(machine, bar, frame, scenario.duration, FORESEEN, excess_weight)


def _wanted(row: Array, testbed: Testbed) -> tuple[Array, Array]:
    """Return the wrench on the bar that follows a reference row, and the pose x y z φ θ ψ."""
    assert testbed.bar is not None
    motion, wrench = np.empty((3, 6)), np.empty(6)
    wanted_motion(row, motion)
    wrench_for(*motion, bar_parameters(testbed.bar, testbed.gravity), wrench)
    return wrench, motion[0]


def _least(structure: Array, wrench: Array, upper: Array) -> float:
    """Return the largest s for which t ≥ s, t ≤ upper and A·t = w hold for some t."""
    m, n = structure.shape
    solution = linprog(
        np.append(np.zeros(n), -1.0),
        A_eq=np.column_stack([structure, np.zeros(m)]),
        b_eq=wrench,
        A_ub=np.column_stack([-np.eye(n), np.ones(n)]),
        b_ub=np.zeros(n),
        bounds=[(None, limit) for limit in upper] + [(None, None)],
    )
    return float(-solution.fun) if solution.status == 0 else -np.inf
