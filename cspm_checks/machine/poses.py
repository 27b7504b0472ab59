"""Poses of bodies as columns, and the lengths of cables between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from typing_extensions import Self

from cspm_checks.series import Log, TopicColumns
from cspm_model.elastic_law import elongation_at, tabulated_elongation
from cspm_model.kernels.cable import OFFSET_LENGTH
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.trajectory import eulers_along, lengths_along
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE

Array = NDArray[np.float64]
ANGLES = ("roll", "pitch", "yaw")
BAR, FRAME = "/bar/pose", "/winch_frame/pose"


class Poses(NamedTuple):
    """A body's poses in order of time, without NaN.

    Attributes:
        time: shape (k,) [s].
        places: shape (k, 3) [m].
        turns: quaternions x y z w, shape (k, 4), of one sign from each to the next.
        angles: φ θ ψ as they were read, shape (k, 3), where no quaternion was.
    """

    time: Array
    places: Array
    turns: Array
    angles: Array | None = None

    def some(self, chosen: NDArray[np.intp] | NDArray[np.bool_]) -> Self:
        """Return some of them."""
        angles = None if self.angles is None else self.angles[chosen]
        return self._replace(
            time=self.time[chosen],
            places=self.places[chosen],
            turns=self.turns[chosen],
            angles=angles,
        )

    def at(self, time: Array) -> Self:
        """Return the poses at other instants, by straight lines."""
        places, turns = (
            np.stack([np.interp(time, self.time, column) for column in table.T], axis=1)
            for table in (self.places, self.turns)
        )
        return self._replace(time=time, places=places, turns=_unit(turns), angles=None)

    def with_angles(self) -> Array:
        """Return x y z φ θ ψ, shape (k, 6)."""
        angles = np.empty((len(self.time), 3))
        eulers_along(np.ascontiguousarray(self.turns), angles)
        angles = np.unwrap(angles, axis=0)
        return np.ascontiguousarray(np.concatenate([self.places, angles], axis=1))

    def rotation(self) -> Rotation:
        """Return what turns the body's axes to those of the world."""
        return Rotation.from_quat(self.turns)


def poses(time: Array, places: Array, turns: Array) -> Poses:
    """Return poses whose quaternions, shape (k, 4), are of unit length and one sign."""
    turns = _unit(turns)
    flips = np.concatenate([[1.0], np.sign(np.sum(turns[1:] * turns[:-1], axis=1) + 1e-300)])
    return Poses(time, places, turns * np.cumprod(flips)[:, None])


def _unit(turns: Array) -> Array:
    sizes = np.linalg.norm(turns, axis=1, keepdims=True)
    return np.asarray(turns / np.where(sizes > 0.0, sizes, 1.0))


def poses_of(topic: TopicColumns, origin_ns: int) -> Poses:
    """Return the poses of a topic; times from the origin [ns]."""
    rows, stamps = topic.rows(slice(None)), topic.stamp_ns
    order = np.argsort(stamps, kind="stable")
    first = POSE.index("qx")
    turns = rows[:, first : first + 4]
    order = order[~np.isnan(rows[order]).any(axis=1) & turns[order].any(axis=1)]
    time = np.asarray((stamps[order] - origin_ns) * 1e-9, dtype=np.float64)
    found = poses(time, rows[order, :3], turns[order])
    if "roll" not in topic.measured:
        return found
    angles = np.stack([topic.values(name) for name in ANGLES], axis=1)
    return found._replace(angles=angles[order])


def bodies(log: Log, testbed: Testbed, origin_ns: int) -> tuple[Poses, Poses | None] | None:
    """Return the poses of bar and winch frame; None where one that moves was not recorded."""
    if BAR not in log or (testbed.winch_frame is not None and FRAME not in log):
        return None
    bar = poses_of(log[BAR], origin_ns)
    frame = poses_of(log[FRAME], origin_ns) if FRAME in log else None
    if len(bar.time) < 2 or (frame is not None and len(frame.time) < 2):
        return None
    return bar, frame


def cable_lengths(testbed: Testbed, bar: Poses, frame: Poses | None) -> Array:
    """Return the lengths of all cables at the bar's instants, shape (k, n) [m]."""
    cables = nominal_parameters(testbed).cables
    of_bar = bar.with_angles()
    of_frame = np.zeros_like(of_bar) if frame is None else frame.at(bar.time).with_angles()
    lengths, bar_rates, frame_rates = np.empty((3, len(bar.time), len(cables)))
    still = np.zeros_like(of_bar)
    lengths_along(cables, of_bar, of_frame, still, still, lengths, bar_rates, frame_rates)
    return np.asarray(lengths)


def cable_lifts(testbed: Testbed, bar: Poses, frame: Poses | None) -> Array:
    """Return the share of each cable's pull that lifts the bar, (k, n), at the bar's instants."""
    cables = nominal_parameters(testbed).cables
    of_bar = bar.with_angles()
    of_frame = np.zeros_like(of_bar) if frame is None else frame.at(bar.time).with_angles()
    found = []
    for one, base in zip(of_bar, of_frame, strict=True):
        # A cable gets shorter as the bar moves along its pull, up where z points down.
        lengths, rows = np.empty(len(cables)), np.empty((len(cables), 6))
        cable_geometry(cables, one, base, lengths, rows, rows.copy())
        found.append(rows[:, 2])
    return np.array(found)


def cable_stretch(testbed: Testbed, tensions: Array, lengths: Array) -> Array:
    """Return by how much cables are stretched by tensions [N] at lengths [m], all (k, n) [m]."""
    return tabulated_elongation(nominal_parameters(testbed), tensions, lengths)


def elastic_range(testbed: Testbed, lengths: Array) -> Array:
    """Return by how much cables may stretch between their tension limits, (n,) [m].

    Args:
        testbed: the machine.
        lengths: mean lengths, (n,) [m].
    """
    parameters = nominal_parameters(testbed)
    limits = np.array([cable.tension_limits or (0.0, 0.0) for cable in testbed.cables])
    elastic = np.tile(lengths + parameters.cables[:, OFFSET_LENGTH], (2, 1))
    low, high = elongation_at(parameters, np.ascontiguousarray(limits.T), elastic)
    return np.asarray(high - low)
