"""Motion control by computed wrench: inverse dynamics of the bar about an observed error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp, floor, pi

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from cspm_control.allocation.tension_distribution import TensionDistribution, fill_structure
from cspm_control.controllers.bar_dynamics import (
    GRAVITY,
    MASS,
    acceleration_from,
    bar_parameters,
    wanted_motion,
    wrench_for,
)
from cspm_control.controllers.mass_observer import MassObserver, believed_mass, learn_mass
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.dofs import DOFS, Dof
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

HEAVE = DOFS.index("heave")
# Rows of the observer's memory.
UNEXPLAINED, EXPECTED = 2, 3
# What is counted: steps from one pose to the next, steps since the last new one, and whether any
# wrench was computed.
STEPS_PER_POSE, AGE, STARTED = 0, 1, 2

_VECTOR, _MATRIX = types.float64[::1], types.float64[:, ::1]
# Of `wanted_wrench` and `expect`.
WANTED_WRENCH = types.void(
    *(_VECTOR, types.boolean, _MATRIX, _VECTOR, _MATRIX, _VECTOR, types.float64, types.float64),
    *(types.boolean, _MATRIX, _VECTOR),
)
EXPECT = types.void(
    *(_VECTOR, _VECTOR, _MATRIX, _VECTOR, types.float64[::1, :], _VECTOR, _VECTOR, _MATRIX)
)


class ComputedWrench:
    """From measured poses and the bar's reference to the wanted wrench on the bar, in world_ned.

    The wrench gives the nominal bar (2-12) the reference's acceleration plus ωc²·e + 2ωc·ė + δ in
    each controlled coordinate of x y z φ θ ψ: e is the error, δ the acceleration by which it drifts
    for reasons unknown. A critically damped observer of third order estimates all three from the
    pose alone (extended state observer, Han 2009; as a filter of samples the fading-memory filter
    of degree 2, Brookner 1998), and goes on by the model between poses that come more seldom than
    it computes. δ takes the place of a PID's integral term. The observer is given the acceleration
    that the tension distribution can give, not the one wanted, so that a wrench that cannot be met
    leaves nothing behind in it.

    Attributes:
        gains: ωc² and 2ωc of each DOF, (6, 2).
        bar: the kernels' parameters of the bar, whose mass may be adapted.
        distribution: how the wrench becomes tensions.
        observer: what error, rate and acceleration take of a surprise, (3,).
        period: time between steps [s].
        pose_age: how old a pose is when it is new here [s].
        known_wrench: constant wrench (6,) on the bar from outside [N, N·m].
        mass: the observer of the bar's mass, if there is one.
        memory: of the observer, see `wanted_wrench`, (5, 6).
        wanted: coordinates and their derivatives, (3, 6).
        last_pose: the last new pose row, (7,).
        counts: see `STEPS_PER_POSE`.
    """

    def __init__(
        self,
        bandwidth: Mapping[Dof, float],
        testbed: Testbed,
        distribution: TensionDistribution,
        *,
        observer_bandwidth: float,
        period: float,
        steps_per_pose: int,
        pose_age: float = 0.0,
        known_wrench: Sequence[float] = (0.0,) * 6,
        mass: MassObserver | None = None,
    ) -> None:
        """Make the controller for a test-bed with a bar.

        Args:
            bandwidth: ωc per DOF [rad/s]; a DOF that is absent gets no feedback.
            testbed: the nominal machine.
            distribution: how the wrench becomes tensions.
            observer_bandwidth: of the observer [rad/s].
            period: time between steps [s].
            steps_per_pose: steps from one pose to the next, ≥ 1.
            pose_age: how old a pose is when it is new here [s].
            known_wrench: constant wrench (6,) on the bar from outside [N, N·m], in world_ned.
            mass: the observer of the bar's mass; None: it is the nominal one.
        """
        assert testbed.bar is not None
        self.gains = np.zeros((6, 2))
        for name, frequency in bandwidth.items():
            self.gains[DOFS.index(name)] = frequency**2, 2.0 * frequency
        self.bar = bar_parameters(testbed.bar, testbed.gravity)
        self.distribution = distribution
        self.known_wrench, self.mass = np.array(known_wrench, dtype=float), mass
        self.observer = _observer_gains(observer_bandwidth, period * steps_per_pose, pose_age)
        self.period, self.pose_age = period, pose_age
        self.last_pose = np.full(7, np.nan)
        self.counts = np.array([steps_per_pose, 0, 0], dtype=np.int64)
        self.memory, self.wanted = np.zeros((5, 6)), np.empty((3, 6))

    @property
    def adapted_mass(self) -> float | None:
        """The estimated mass of the bar [kg], None where it is not estimated."""
        return None if self.mass is None else float(self.bar[MASS])

    @property
    def terms(self) -> Array:
        """Observed error [m, rad] and the terms ωc²·e, δ and 2ωc·ė [m/s², rad/s²], shape (4, 6).

        As known after the last wrench; δ only where the error is fed back.
        """
        error, rate, unexplained = self.memory[:3]
        fed_back = self.gains[:, 0] > 0.0
        proportional, derivative = self.gains[:, 0] * error, self.gains[:, 1] * rate
        return np.array([error, proportional, unexplained * fed_back, derivative])

    def restart(self) -> None:
        """Let the next wrench be the one that follows the reference, whatever the error."""
        self.counts[STARTED] = 0
        if self.mass is not None:
            self.mass.restart()

    def step(
        self,
        bar_pose: Array,
        frame_pose: Array,
        reference: Array,
        deviation: Array | None = None,
    ) -> Array:
        """Return the wrench (6,) for measured pose rows (7,) and a reference row (19,).

        `deviation` (18,) is by how much the bar is to be elsewhere: x y z φ θ ψ, first and second
        derivatives.
        """
        wanted_motion(reference, self.wanted)
        if deviation is not None:
            self.wanted += deviation.reshape(3, 6)
        fresh = is_new(bar_pose, self.last_pose, self.counts)
        wrench = np.empty(6)
        wanted_wrench(
            bar_pose,
            fresh,
            self.wanted,
            self.bar,
            self.gains,
            self.observer,
            self.period,
            self.pose_age,
            bool(self.counts[STARTED]),
            self.memory,
            wrench,
        )
        self.counts[STARTED] = 1
        wrench -= self.known_wrench
        tensions = self.distribution.step(wrench, bar_pose, frame_pose).tensions
        expect(
            bar_pose,
            frame_pose,
            self.wanted,
            tensions,
            self.distribution.cables,
            self.bar,
            self.known_wrench,
            self.memory,
        )
        if self.mass is not None:
            adapt_mass(self.wanted, self.bar, self.memory, *self.mass.arrays)
        return wrench


def _observer_gains(bandwidth: float, period: float, age: float) -> Array:
    """Return what error, rate and acceleration take of a surprise: three poles at the bandwidth.

    A surprise that is `age` old describes the state then; its change is carried on until now.
    """
    fade = exp(-bandwidth * period)
    then = [
        1.0 - fade**3,
        1.5 * (1.0 - fade) ** 2 * (1.0 + fade) / period,
        (1.0 - fade) ** 3 / period**2,
    ]
    onward = [[1.0, age, 0.5 * age**2], [0.0, 1.0, age], [0.0, 0.0, 1.0]]
    return np.array(onward) @ then


@njit(cache=True, error_model="numpy", _nrt=False)
def is_new(pose: Array, last: Array, counts: Counts) -> bool:
    """Return whether a pose row (7,) is new, which then is the `last`."""
    counts[AGE] += 1
    # A pose that stays the same for longer than its period is a new one all the same.
    fresh = counts[AGE] >= counts[STEPS_PER_POSE]
    for i in range(7):
        if pose[i] != last[i]:
            fresh = True
    if fresh:
        counts[AGE] = 0
        for i in range(7):
            last[i] = pose[i]
    return fresh


@njit(cache=True, error_model="numpy", _nrt=False)
def adapt_mass(
    wanted: Array,
    bar: Array,
    memory: Array,
    numbers: Array,
    wait: Counts,
    mean: Array,
    spread: Array,
) -> None:
    """Take the mass estimated in the last step, for the next one; see `MassObserver`."""
    given = wanted[2, HEAVE] - memory[EXPECTED, HEAVE]
    lift = bar[GRAVITY] - given
    unexplained = lift + memory[UNEXPLAINED, HEAVE]
    learn_mass(bar[MASS] * lift, unexplained, numbers, wait, mean, spread)
    mass = believed_mass(mean, numbers)
    # What the mass explains from now on is no longer unexplained.
    explained = lift * (bar[MASS] / mass - 1.0)
    memory[EXPECTED, HEAVE] += explained
    memory[UNEXPLAINED, HEAVE] -= explained
    bar[MASS] = mass


@njit(cache=True, error_model="numpy")
def wanted_wrench(
    pose_row: Array,
    fresh: bool,
    wanted: Array,
    bar: Array,
    gains: Array,
    observer: Array,
    period: float,
    age: float,
    started: bool,
    memory: Array,
    out: Array,
) -> None:
    """Write the wrench to `out`.

    `memory` (5, 6) holds the error, its rate, its unexplained and its expected acceleration, and
    what is left of the first error's feedback.
    """
    pose = np.empty(6)
    _pose(pose_row, pose)
    error, rate, unexplained = memory[0], memory[1], memory[2]
    for d in range(6):
        found = _earlier(wanted[0, d], wanted[1, d], wanted[2, d], age) - pose[d]
        if d >= 3:
            found -= 2.0 * pi * floor(found / (2.0 * pi) + 0.5)
        if started:
            acceleration = unexplained[d] + memory[3, d]
            ahead = error[d] + period * (rate[d] + 0.5 * period * acceleration)
            rate[d] += period * acceleration
            surprise = found - _earlier(ahead, rate[d], acceleration, age) if fresh else 0.0
            error[d] = ahead + observer[0] * surprise
            rate[d] += observer[1] * surprise
            unexplained[d] += observer[2] * surprise
            if not fresh or age > 0.0:
                pose[d] = wanted[0, d] - error[d]
        else:
            error[d], rate[d], unexplained[d] = found, 0.0, 0.0
            memory[4, d] = gains[d, 0] * found
    acceleration, turned = np.empty(6), np.empty(6)
    for d in range(6):
        acceleration[d], turned[d] = wanted[2, d], wanted[1, d] - rate[d]
        if gains[d, 0] > 0.0:
            acceleration[d] += gains[d, 0] * error[d] + gains[d, 1] * rate[d] + unexplained[d]
            # The initial error is reduced gently.
            acceleration[d] -= memory[4, d]
            memory[4, d] *= 1.0 - 0.5 * gains[d, 1] * period
    wrench_for(pose, turned, acceleration, bar, out)


@njit(cache=True, error_model="numpy")
def expect(
    bar_row: Array,
    frame_row: Array,
    wanted: Array,
    tensions: Array,
    cables: Array,
    bar: Array,
    known_wrench: Array,
    memory: Array,
) -> None:
    """Write the acceleration of the error that the tensions are to give into `memory`."""
    pose, given = np.empty(6), np.empty(6)
    _pose(bar_row, pose)
    structure, wrench = np.empty((6, len(tensions))), np.empty(6)
    fill_structure(bar_row, frame_row, cables, np.arange(6), structure)
    rate = np.empty(6)
    for d in range(6):
        total = 0.0
        for i in range(len(tensions)):
            total += structure[d, i] * tensions[i]
        wrench[d] = total + known_wrench[d]
        rate[d] = wanted[1, d] - memory[1, d]
    acceleration_from(pose, rate, wrench, bar, given)
    for d in range(6):
        memory[3, d] = wanted[2, d] - given[d]


@njit(cache=True, error_model="numpy", forceinline=True)
def _earlier(place: float, rate: float, acceleration: float, age: float) -> float:
    """Return where something was."""
    return place - age * rate + 0.5 * age**2 * acceleration


@njit(cache=True, error_model="numpy")
def _pose(row: Array, out: Array) -> None:
    """Write x y z φ θ ψ of a pose row (7,)."""
    out[0], out[1], out[2] = row[0], row[1], row[2]
    out[3], out[4], out[5] = euler_from_quaternion(row[3:7])
