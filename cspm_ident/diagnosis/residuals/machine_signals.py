"""Measured signals of a machine at equal steps, and their changes by sensor faults."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from cspm_ident.signals.timeline import Timeline, whole_stretches
from cspm_model.kernels.cable import ARM, COUPLE, DIRECTION, LENGTH, RATE, SPAN_COLUMNS
from cspm_model.kernels.trajectory import Motions, spans_along

Array = NDArray[np.float64]

# Step between the rows of cables and bar.
PERIOD_NS = 5_000_000
# Shorter stretches without gaps contain little more than a filter's transient.
_SHORTEST_S = 2.0


class BodyMotion(NamedTuple):
    """A body's motion; poses x y z φ θ ψ in world_ned, all shape (k, 6).

    Attributes:
        poses: [m, rad].
        rates: of the poses' coordinates.
        accelerations: of the poses' coordinates.
    """

    poses: Array
    rates: Array
    accelerations: Array

    def moved(self, change: Array, times: Array, step: float) -> BodyMotion:
        """Return the motion with `step`·change (k, 6) added to its poses and derivatives."""
        spline = CubicSpline(times, change)
        return BodyMotion(
            self.poses + step * change,
            self.rates + step * spline(times, 1),
            self.accelerations + step * spline(times, 2),
        )


@dataclass(frozen=True, eq=False)
class MachineSignals:
    """Measured signals of a whole machine at equal steps.

    Attributes:
        times: shape (k,) [s].
        frame: the winch frame's motion.
        bar: the bar's motion.
        angles, speeds: of the motors, shape (k, n) [rad, rad/s].
        tensions: shape (k, n) [N].
        wound: whether angles were measured. If not they are 0 here: cables have no equation, the
            bar's does without them.
    """

    times: Array
    frame: BodyMotion
    bar: BodyMotion
    angles: Array
    speeds: Array
    tensions: Array
    wound: bool = True

    @property
    def step(self) -> float:
        """The time between two steps [s]."""
        return float(self.times[1] - self.times[0])

    def of_cable(self, i: int) -> MachineSignals:
        """Return the signals with angles, speeds and tensions of cable i alone, n = 1."""
        names = ("angles", "speeds", "tensions")
        return replace(self, **{name: getattr(self, name)[:, i : i + 1] for name in names})

    def with_pose_change(self, body: str, change: Array, step: float) -> MachineSignals:
        """Return the signals with `step`·change (k, 6) added to the pose of `bar` or `frame`."""
        moved = getattr(self, body).moved(change, self.times, step)
        return replace(self, **{body: moved})


def machine_signals(timeline: Timeline) -> list[MachineSignals]:
    """Return the measured signals at steps of 5 ms, one entry per stretch without gaps."""
    measured = timeline.measurement
    if measured.bar_pose is None or measured.tension is None:
        return []
    slow = timeline.slowly(PERIOD_NS, timeline.pose_band)
    frame, bar = slow.body_motion("frame"), slow.body_motion("bar")
    tensions = np.asarray(slow.smooth_tensions)
    angles, speeds = slow.angles, slow.speeds
    if angles is None or speeds is None:
        angles = speeds = np.zeros_like(tensions)
    columns = [frame[0], bar[0], angles, speeds, tensions]
    whole = [np.asarray(c) for c in columns]
    shortest = round(_SHORTEST_S / slow.period)
    wound = measured.angle is not None
    return [
        MachineSignals(
            slow.times[part],
            BodyMotion(*(each[part] for each in frame)),
            BodyMotion(*(each[part] for each in bar)),
            *(angles[part], speeds[part], tensions[part]),
            wound,
        )
        for part in (slice(a, b + 1) for a, b in whole_stretches(whole, shortest))
    ]


class BodyState(NamedTuple):
    """Kinematics of a body in world axes.

    Attributes:
        rotation: R_world_body, shape (k, 3, 3).
        velocity: of its origin, (k, 3) [m/s].
        omega: (k, 3) [rad/s].
        acceleration: of its origin, (k, 3) [m/s²].
        alpha: (k, 3) [rad/s²].
    """

    rotation: Array
    velocity: Array
    omega: Array
    acceleration: Array
    alpha: Array


def body_state(motion: BodyMotion) -> BodyState:
    """Return a body's kinematics from its Euler angles (2-3), (2-6) and their derivatives."""
    angles, rates = motion.poses[:, 3:], motion.rates[:, 3:]
    (_, cp, cy), (_, sp, sy) = np.cos(angles).T, np.sin(angles).T
    zero, one = np.zeros(len(cp)), np.ones(len(cp))
    carry = np.array([[cp * cy, -sy, zero], [cp * sy, cy, zero], [-sp, zero, one]])
    pitch, yaw = rates[:, 1], rates[:, 2]
    turning = np.array(
        [
            [-sp * pitch * cy - cp * sy * yaw, -cy * yaw, zero],
            [-sp * pitch * sy + cp * cy * yaw, -sy * yaw, zero],
            [-cp * pitch, zero, zero],
        ]
    )
    accelerated = motion.accelerations[:, 3:]
    cr, sr = np.cos(angles[:, 0]), np.sin(angles[:, 0])
    rotation = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return BodyState(
        np.ascontiguousarray(np.moveaxis(rotation, 2, 0)),
        motion.rates[:, :3],
        np.einsum("ijk,kj->ki", carry, rates),
        motion.accelerations[:, :3],
        np.einsum("ijk,kj->ki", carry, accelerated) + np.einsum("ijk,kj->ki", turning, rates),
    )


class CableSpans(NamedTuple):
    """The cables between both bodies, world axes.

    Attributes:
        directions: from exit to attachment, (k, n, 3).
        arms: from the bar's origin to the attachment, (k, n, 3) [m].
        lengths: (k, n) [m].
        rates: (k, n) [m/s].
        couples: of routes, beyond the moment of the direction at the attachment, (k, n, 3) [m].
    """

    directions: Array
    arms: Array
    lengths: Array
    rates: Array
    couples: Array

    def only(self, i: int) -> CableSpans:
        """Return cable i's alone, n = 1."""
        return CableSpans(*(part[:, i : i + 1] for part in self))


def cable_spans(
    signals: MachineSignals, bar: BodyState, frame: BodyState, cables: Array
) -> CableSpans:
    """Return directions, lengths and rates, thesis (2-2), (2-5), (2-6).

    Args:
        signals: poses of both bodies.
        bar: the bar's kinematics.
        frame: the winch frame's.
        cables: parameter rows, see `cspm_model.kernels.cable`.
    """
    out = np.empty((len(signals.times), len(cables), SPAN_COLUMNS))
    spans_along(cables, _motions(signals.frame, frame), _motions(signals.bar, bar), out)
    columns = (slice(DIRECTION, ARM), slice(ARM, LENGTH), LENGTH, RATE, slice(COUPLE, COUPLE + 3))
    return CableSpans(*(np.ascontiguousarray(out[:, :, column]) for column in columns))


def _motions(motion: BodyMotion, state: BodyState) -> Motions:
    poses, rotation = np.ascontiguousarray(motion.poses), np.ascontiguousarray(state.rotation)
    velocity, omega = np.ascontiguousarray(state.velocity), np.ascontiguousarray(state.omega)
    return poses, rotation, velocity, omega


def end_velocities(
    spans: CableSpans, bar: BodyState, frame: BodyState, exits: Array
) -> tuple[Array, Array]:
    """Return velocities of attachments relative to exits, and of exits, (k, n, 3) [m/s].

    Args:
        spans: the cables.
        bar: the bar's kinematics.
        frame: the winch frame's.
        exits: in winch_frame_ned, shape (n, 3) [m].
    """
    roots = np.einsum("kij,nj->kni", frame.rotation, exits)
    near = frame.velocity[:, None] + np.cross(frame.omega[:, None], roots)
    far = bar.velocity[:, None] + np.cross(bar.omega[:, None], spans.arms)
    return far - near, near
