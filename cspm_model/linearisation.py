"""The linear model of bar, cables and winches about a state of rest, thesis (2-31) and chapter 6.

The thesis holds the cable directions fixed and the stiffness matrix constant (`exact=False`): where
the winches are free the bar then meets no static stiffness and drifts like a double integrator. In
truth the cables turn, and their tension pulls the bar back like a pendulum: `exact=True` is the
derivative of the plant itself.

Effects beyond the thesis's model are left out of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from cspm_model.end_slopes import end_slopes
from cspm_model.equilibrium import find_equilibrium, gravity_wrench
from cspm_model.kernels import bar as bar_kernel
from cspm_model.kernels import cable as cable_kernel
from cspm_model.kernels.cable import elastic_tension, law_curve, law_scale
from cspm_model.kernels.machine import BAR_STATES, PlantParameters
from cspm_model.kernels.route import STOP_COUNT
from cspm_model.kinematics import (
    RANK_TOLERANCE,
    euler_rate_map,
    euler_rates,
    geometry,
    rotation,
)
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario_keys.bodies import ORIGIN
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ALL_AXES = (0, 1, 2, 3, 4, 5)
# Of the bar, over twice of which Jacobians of routes are differenced [m, rad].
ROUTE_STEP = 1e-5


@dataclass(frozen=True, eq=False)
class StateSpace:
    """ẋ = A·x + B·u, y = C·x + D·u, with a name for each state, input and output."""

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def response(self, frequencies: ArrayLike) -> ComplexArray:
        """Return G(jω), shape (m, outputs, inputs), for frequencies ω of shape (m,) [rad/s].

        Every ω must differ from an undamped pole; 0 is one where the bar is free to drift.
        """
        s = 1j * np.atleast_1d(np.asarray(frequencies, dtype=float))[:, None, None]
        resolvent = s * np.eye(len(self.A)) - self.A
        forced = np.linalg.solve(resolvent, np.broadcast_to(self.B, (len(s), *self.B.shape)))
        return np.asarray(self.C @ forced + self.D, dtype=np.complex128)


class OperatingPoint(NamedTuple):
    """A state of rest with what the cables do about it; all per cable (n,) where not said.

    Attributes:
        bar_pose: x y z φ θ ψ in world_ned, its roll adapted to where the bar hangs.
        frame_pose: the winch frame's pose.
        tensions: [N].
        lengths: stretched [m].
        unstretched_lengths: [m].
        jacobian: J of (2-6) for the bar's world twist, shape (n, 6).
        stiffness: tangent stiffness ∂t/∂l [N/m].
        length_stiffness: −∂t/∂l0 [N/m], which counts that a longer cable is softer.
        damping: ∂t/∂l̇ [N·s/m].
    """

    bar_pose: Array
    frame_pose: Array
    tensions: Array
    lengths: Array
    unstretched_lengths: Array
    jacobian: Array
    stiffness: Array
    length_stiffness: Array
    damping: Array


def operating_point(
    testbed: Testbed,
    parameters: PlantParameters,
    bar_pose: ArrayLike,
    frame_pose: ArrayLike = ORIGIN,
) -> OperatingPoint:
    """Return the state of rest at `bar_pose` in which the tensions are least.

    Raises:
        InputError: the test-bed has no bar.
        ConvergenceError: no tensions within the cables' limits hold the bar there.
    """
    if testbed.bar is None:
        raise InputError("linear model: this test-bed has no bar, allowed: a test-bed with a bar")
    limits = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)
    rest = find_equilibrium(parameters, bar_pose, frame_pose, limits)
    lengths, jacobian, _ = geometry(parameters.cables, rest.bar_pose, frame_pose)
    slopes = np.array(
        [
            _cable_slopes(parameters, i, length - unstretched, unstretched)
            for i, (length, unstretched) in enumerate(
                zip(lengths, rest.unstretched_lengths, strict=True)
            )
        ]
    )
    return OperatingPoint(
        bar_pose=rest.bar_pose,
        frame_pose=np.array(frame_pose, dtype=float),
        tensions=rest.tensions,
        lengths=lengths,
        unstretched_lengths=rest.unstretched_lengths,
        jacobian=jacobian,
        stiffness=slopes[:, 0],
        length_stiffness=slopes[:, 1],
        damping=slopes[:, 2],
    )


def linear_model(
    testbed: Testbed, parameters: PlantParameters, point: OperatingPoint, *, exact: bool = False
) -> StateSpace:
    """Return the model with motor torques as inputs and pose, pose rate and tensions as outputs.

    States are deviations: the bar's displacement and small rotation in world axes, its velocity and
    angular velocity in world axes, motor angles and motor speeds: 12 + 2n. The unstretched lengths
    are no states of their own, since δl0 = −(l0/l)·r·δq (2-18).

    Args:
        testbed: the machine, for its names.
        parameters: its kernel parameters.
        point: where to linearise.
        exact: count how the cables turn and how a longer cable is softer.
    """
    n = len(point.tensions)
    radii = parameters.cables[:, cable_kernel.RADIUS]
    inverse_inertia = 1.0 / parameters.cables[:, cable_kernel.INERTIA]
    tensions = _tension_rows(point, radii, exact=exact)
    forces = -point.jacobian.T @ tensions
    if exact:
        forces[:, :6] += _geometric_stiffness(parameters, point)
    turns = slice(BAR_STATES, BAR_STATES + n)
    speeds = slice(BAR_STATES + n, BAR_STATES + 2 * n)
    a = np.zeros((BAR_STATES + 2 * n, BAR_STATES + 2 * n))
    a[0:6, 6:12] = np.eye(6)
    a[6:12] = np.linalg.solve(mass_matrix(parameters, point.bar_pose), forces)
    a[turns, speeds] = np.eye(n)
    a[speeds] = -(inverse_inertia * radii)[:, None] * tensions
    b = np.zeros((len(a), n))
    b[speeds] = np.diag(inverse_inertia)
    c = np.vstack([np.eye(BAR_STATES, len(a)), tensions])
    cables = testbed.cable_names
    bar = tuple(f"bar {dof}" for dof in DOFS) + tuple(f"bar {dof} rate" for dof in DOFS)
    return StateSpace(
        A=a,
        B=b,
        C=c,
        D=np.zeros((len(c), n)),
        states=bar
        + tuple(f"motor angle of {name}" for name in cables)
        + tuple(f"motor speed of {name}" for name in cables),
        inputs=tuple(f"torque of {name}" for name in cables),
        outputs=bar + tuple(f"tension of {name}" for name in cables),
    )


def motion_subsystem(
    model: StateSpace,
    parameters: PlantParameters,
    point: OperatingPoint,
    axes: Sequence[int] = ALL_AXES,
) -> StateSpace:
    """Return the model from a wanted wrench to the pose x y z φ θ ψ, thesis (6-2, 6-3).

    A wrench becomes torques by (6-1), τ = −N⁻¹R(Jᵀ)†w, as if cables were rigid.

    Args:
        model: of `linear_model`.
        parameters: the machine's kernel parameters.
        point: the model's operating point.
        axes: world axes of the wrench in which it is to be met, its inputs. With all six the
            pseudo-inverse meets what it can; the controllers leave the roll moment out.
    """
    radii = parameters.cables[:, cable_kernel.RADIUS]
    tensions = wrench_tensions(point, axes)
    pose_rows = model.C[:6].copy()
    to_body = rotation(point.bar_pose).T
    euler = np.array([euler_rates(point.bar_pose, to_body @ axis) for axis in np.eye(3)]).T
    pose_rows[3:] = euler @ pose_rows[3:]
    return StateSpace(
        A=model.A,
        B=model.B @ (radii[:, None] * tensions),
        C=pose_rows,
        D=np.zeros((6, len(axes))),
        states=model.states,
        inputs=tuple(f"wrench {DOFS[axis]}" for axis in axes),
        outputs=model.outputs[:6],
    )


def wrench_tensions(point: OperatingPoint, axes: Sequence[int] = ALL_AXES) -> Array:
    """Return the least tensions per unit of wrench along axes, −(Jᵀ)†, shape (n, axes)."""
    return -np.linalg.pinv(point.jacobian[:, list(axes)].T, rcond=RANK_TOLERANCE)


def tension_subsystem(model: StateSpace) -> StateSpace:
    """Return the model from motor torques to tensions, thesis (6-6, 6-7)."""
    return StateSpace(
        A=model.A,
        B=model.B,
        C=model.C[BAR_STATES:],
        D=model.D[BAR_STATES:],
        states=model.states,
        inputs=model.inputs,
        outputs=model.outputs[BAR_STATES:],
    )


def _cable_slopes(
    parameters: PlantParameters, i: int, elongation: float, unstretched: float
) -> tuple[float, float, float]:
    """Return ∂t/∂l, −∂t/∂l0 and ∂t/∂l̇ of a cable at rest."""
    cables, tables = parameters.cables, parameters.tables
    elastic = unstretched + cables[i, cable_kernel.OFFSET_LENGTH]
    scale = law_scale(elastic, cables, i)
    tension, stiffness = elastic_tension(elongation, elastic, scale, cables, tables, i)
    free = _elongation_below_cap(parameters, i, elongation, elastic)
    # a/l^b of (3-7) falls as −b/l, E·A/l of (3-10) and of the linear law as −1/l.
    softer = cables[i, cable_kernel.LAW_EXPONENT] * free + (elongation - free)
    softening = stiffness * softer / elastic
    constant, slope = cables[i, cable_kernel.DAMPING_CONSTANT : cable_kernel.DAMPING_SLOPE + 1]
    # Below its floor tension the damper of `kernels.cable.cable_tensions` fades.
    share = min(1.0, tension / cables[i, cable_kernel.FLOOR_TENSION])
    return stiffness, stiffness + softening, share * max(0.0, constant - slope * elastic)


def _elongation_below_cap(
    parameters: PlantParameters, i: int, elongation: float, elastic: float
) -> float:
    """Return how much of cable i's elongation follows (3-7) and not the asymptote (3-10) [m]."""
    cables, tables = parameters.cables, parameters.tables
    scale, cap = law_scale(elastic, cables, i), cables[i, cable_kernel.AXIAL_RIGIDITY] / elastic
    if scale == 0.0:
        return 0.0

    def excess(part: float) -> float:
        return float(scale * law_curve(scale * part, cables, tables, i)[1] - cap)

    if excess(elongation) <= 0.0:
        return elongation
    return float(scipy.optimize.brentq(excess, 0.0, elongation, xtol=1e-15))


def _tension_rows(point: OperatingPoint, radii: Array, *, exact: bool) -> Array:
    """Return ∂t/∂state, shape (n, 12 + 2n), of (2-19) with (2-6) and (2-18)."""
    wound = point.unstretched_lengths / point.lengths * radii
    length_stiffness = point.length_stiffness if exact else point.stiffness
    return np.hstack(
        [
            point.stiffness[:, None] * point.jacobian,
            point.damping[:, None] * point.jacobian,
            np.diag(length_stiffness * wound),
            np.diag(point.damping * wound),
        ]
    )


def mass_matrix(parameters: PlantParameters, bar_pose: ArrayLike) -> Array:
    """Return M of (2-12) about the bar frame's origin in world axes, shape (6, 6) [kg, kg·m²]."""
    bar = parameters.bar
    to_world = rotation(bar_pose)
    com = to_world @ bar[bar_kernel.COM : bar_kernel.COM + 3]
    inertia = bar[bar_kernel.INERTIA : bar_kernel.INERTIA + 9].reshape(3, 3)
    coupling = bar[bar_kernel.MASS] * _cross_matrix(com)
    about_origin = to_world @ inertia @ to_world.T - coupling @ _cross_matrix(com)
    return np.block([[bar[bar_kernel.MASS] * np.eye(3), -coupling], [coupling, about_origin]])


def _geometric_stiffness(parameters: PlantParameters, point: OperatingPoint) -> Array:
    """Return the wrench per pose deviation at constant tensions, shape (6, 6).

    That is −∂Jᵀ/∂x·t: a cable's direction turns with its attachment's motion across it, and its arm
    with the bar; likewise the arm of the weight.
    """
    cables, bar = parameters.cables, parameters.bar
    to_world = rotation(point.bar_pose)
    out = np.zeros((6, 6))
    weight = gravity_wrench(parameters, point.bar_pose)[:3]
    com = to_world @ bar[bar_kernel.COM : bar_kernel.COM + 3]
    out[3:, 3:] = _cross_matrix(weight) @ _cross_matrix(com)
    # A force turns with its exit as it does against the attachment's own motion.
    slopes = end_slopes(cables, point.bar_pose[None], point.frame_pose[None])
    turns = slopes.exit_wrenches[0, :, :3] @ rotation(point.frame_pose).T
    routed = cables[:, cable_kernel.ROUTE + STOP_COUNT] > 0.0
    out += _route_stiffness(cables[routed], point.tensions[routed], point)
    for i in np.flatnonzero(~routed):
        tension = point.tensions[i]
        direction = point.jacobian[i, :3]
        arm = _cross_matrix(to_world @ cables[i, cable_kernel.ATTACHMENT :][:3])
        turn = turns[i] @ np.hstack([np.eye(3), -arm])
        out[:3] -= tension * turn
        out[3:] -= tension * arm @ turn
        out[3:, 3:] -= tension * _cross_matrix(direction) @ arm
    return out


def _route_stiffness(cables: Array, tensions: Array, point: OperatingPoint) -> Array:
    """Return what cables with routes have of it, by central differences of their Jacobians."""
    out = np.zeros((6, 6))
    if not len(cables):
        return out
    to_pose = np.eye(6)
    to_pose[3:, 3:] = np.linalg.inv(euler_rate_map(point.bar_pose))
    for axis in range(6):
        step = ROUTE_STEP * to_pose[:, axis]
        before, after = (
            tensions @ geometry(cables, point.bar_pose + sign * step, point.frame_pose).bar
            for sign in (-1.0, 1.0)
        )
        out[:, axis] = (before - after) / (2.0 * ROUTE_STEP)
    return out


def _cross_matrix(v: Array) -> Array:
    """Return the matrix of v × ·, shape (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
