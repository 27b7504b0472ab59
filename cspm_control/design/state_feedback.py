"""Gains of the motion controllers PD+ and LQR, from the bar's own inertia per coordinate."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.controllers.bar_dynamics import bar_parameters, wrench_for
from cspm_msgs_py.dofs import DOFS, Dof
from cspm_msgs_py.scenario import FeedbackControl, LqrControl, PidGains
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


def design_feedback_gains(
    motion: FeedbackControl, testbed: Testbed, period: float
) -> dict[Dof, PidGains]:
    """Return the gains of each DOF with a bandwidth, on the inertia at the design pose.

    Args:
        motion: PD+ or LQR, with its bandwidths.
        testbed: a machine with a bar.
        period: time between steps of the motion controller [s].
    """
    inertia = coordinate_inertia(testbed, motion.design_pose)
    design = pd_gains
    if isinstance(motion, LqrControl):
        design = partial(lqr_gains, integral_time=motion.integral_time, period=period)
    return {
        dof: design(float(inertia[DOFS.index(dof)]), bandwidth)
        for dof, bandwidth in motion.bandwidth.items()
    }


def coordinate_inertia(testbed: Testbed, pose: ArrayLike) -> Array:
    """Return the inertia of the bar along x y z φ θ ψ, (6,) [kg, kg·m²].

    It is the diagonal of the mass matrix (2-12) about the bar's origin, at a pose (6,) at rest.
    """
    assert testbed.bar is not None
    place, still = np.array(pose, dtype=float), np.zeros(6)
    bar = bar_parameters(testbed.bar, 0.0)
    matrix = np.empty((6, 6))
    for row, unit in zip(matrix, np.eye(6), strict=True):
        wrench_for(place, still, unit, bar, row)
    return np.diag(matrix).copy()


def pd_gains(inertia: float, bandwidth: float) -> PidGains:
    """Return m·ω² and 2m·ω: two poles of the error at −ω [rad/s], for m in kg or kg·m²."""
    return PidGains(kp=inertia * bandwidth**2, ki=0.0, kd=2.0 * inertia * bandwidth)


def lqr_gains(inertia: float, bandwidth: float, integral_time: float, period: float) -> PidGains:
    """Return the feedback w = ki·∫e + kp·e + kd·ė of least Σ (e² + (∫e/τ)² + (w/mω²)²).

    Weights by Bryson's rule (Bryson, Ho, Applied Optimal Control, 1975): an error costs as much as
    its integral over τ, and as an acceleration of ω² times it. The solution is by the discrete
    Riccati equation (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998).

    Args:
        inertia: m [kg, kg·m²].
        bandwidth: ω [rad/s].
        integral_time: τ [s].
        period: time between steps [s].
    """
    # The one place that needs it: a node starts without any part of scipy.
    from scipy.linalg import solve_discrete_are

    transition, entry = error_dynamics(inertia, period)
    state_cost = np.diag([integral_time**-2.0, 1.0, 0.0])
    effort_cost = np.array([[(inertia * bandwidth**2) ** -2.0]])
    cost = solve_discrete_are(transition, entry, state_cost, effort_cost)
    gain = np.linalg.solve(effort_cost + entry.T @ cost @ entry, entry.T @ cost @ transition)[0]
    return PidGains(kp=float(gain[1]), ki=float(gain[0]), kd=float(gain[2]))


def error_dynamics(inertia: float, period: float) -> tuple[Array, Array]:
    """Return A (3, 3) and B (3, 1) of ∫e, e and ė, with a held wrench: m·ë = u, u = −w.

    A triple integrator, sampled exactly every `period` [s].
    """
    t = period
    transition = np.array([[1.0, t, 0.5 * t**2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    return transition, np.array([[t**3 / 6.0], [0.5 * t**2], [t]]) / inertia
