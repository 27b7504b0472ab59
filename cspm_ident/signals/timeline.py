"""Measured signals on the steps of a simulation, as its inputs and initial states."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples, digest
from cspm_ident.signals.smoothing import Smooth, band_of, smooth, smoothed
from cspm_ident.signals.winch_motion import WinchMotion, winch_motion
from cspm_model.kernels.trajectory import body_rates_along, twists_along
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

PERIOD_NS = 1_000_000
_KNOT_S = 0.005
# How far from a lost reading speeds are known as well as elsewhere.
_NEAR_S = 0.01
# More than is looked at, so that smoothing has both sides.
_MARGIN_S = 3.0


class Smoothed(NamedTuple):
    """The smoothed signals of a timeline; None where a sensor is absent.

    Attributes:
        pose_band: to which poses are smoothed [Hz].
        frame, bar: poses.
        winches: angles and speeds at the steps.
        tension: of the cables.
    """

    pose_band: float
    frame: Smooth | None
    bar: Smooth | None
    winches: WinchMotion | None
    tension: Smooth | None


class Timeline:
    """All that a simulation can take from a measurement, at steps of one period.

    Poses and angles are smoothed in the band in which they rise above their noise; torques and
    tensions are as measured.

    Attributes:
        measurement: where it comes from.
        period_ns: the step [ns].
        times: of the steps, on the measurement's clock [s], shape (k,).
        delays: by topic, by how much its stamps are late [s].
        drifts: by topic, by how much later they become per second.
    """

    def __init__(
        self,
        measurement: Measurement,
        period_ns: int = PERIOD_NS,
        delays: Mapping[str, float] = MappingProxyType({}),
        pose_band: float | None = None,
        smoothed: Smoothed | None = None,
    ) -> None:
        """Lay the steps over the time in which all sensors deliver.

        Args:
            measurement: what was recorded.
            period_ns: the step [ns].
            delays: by topic, by how much its stamps are late [s].
            pose_band: to which poses are smoothed [Hz]; None: while they rise above their noise.
            smoothed: its signals where they are known; None: they are smoothed where needed.

        Raises:
            InputError: the sensors never deliver together.
        """
        self.measurement = measurement
        self.period_ns = period_ns
        self.delays = dict(delays)
        self.drifts: dict[str, float] = {}
        self._smoothed, self._given_band = smoothed, pose_band
        sensors = measurement.sensors.values()
        start = max(float(s.times[0]) for s in sensors)
        end = min(float(s.times[-1]) for s in sensors)
        steps = int((end - start) / (period_ns * 1e-9) + 1e-6)
        if steps < 2:
            raise InputError(
                f"{measurement.path}: its sensors share {max(0.0, end - start):.3f} s, allowed:"
                " sensors that measure at the same time"
            )
        self.times: Array = np.asarray(start + np.arange(steps + 1) * (period_ns * 1e-9))

    @property
    def period(self) -> float:
        """The step [s]."""
        return self.period_ns * 1e-9

    def delayed(
        self, delays: Mapping[str, float], drifts: Mapping[str, float] = MappingProxyType({})
    ) -> Timeline:
        """Return the same signals with other delays and drifts, without smoothing them again."""
        return self._with(self.times, self._winches, delays, drifts)

    def _with(
        self,
        times: Array,
        winches: WinchMotion | None,
        delays: Mapping[str, float],
        drifts: Mapping[str, float],
    ) -> Timeline:
        smoothed = Smoothed(self.pose_band, self._frame, self._bar, winches, self._tension)
        other = Timeline(self.measurement, self.period_ns, delays, smoothed=smoothed)
        other.drifts, other.times = dict(drifts), times
        return other

    def slowly(self, period_ns: int, band: float) -> Timeline:
        """Return the same signals at longer steps, tensions and angles smoothed to `band` [Hz]."""
        start, end = self.times[0] - _MARGIN_S, self.times[-1] + _MARGIN_S
        measured = self.measurement.within(start, end)
        # Its steps, at which angles are read.
        times = Timeline(measured, period_ns, self.delays).times
        tension, angle, winches = measured.tension, measured.angle, None
        if angle is not None:
            # Of what is smoothed so only the steps are kept: a long recording's is much memory.
            key = Timeline.slowly, band, digest(times)
            winches = angle.kept(key, lambda: _slow_motion(angle, band, times))
        pull = None if tension is None else smoothed(tension, band)
        known = Smoothed(self.pose_band, self._frame, self._bar, winches, pull)
        other = Timeline(measured, period_ns, self.delays, smoothed=known)
        other.drifts = self.drifts
        return other

    def within(self, first: int, last: int) -> Timeline:
        """Return the stretch from step `first` to `last`, without smoothing it again."""
        cut, moved = slice(first, last + 1), self._winches
        if moved is not None:
            moved = moved._replace(angles=moved.angles[cut], speeds=moved.speeds[cut])
        return self._with(self.times[cut], moved, self.delays, self.drifts)

    @cached_property
    def bands(self) -> dict[str, float]:
        """What was kept of each smoothed sensor [Hz], by topic."""
        found = {"/winch_frame/pose": self._frame, "/bar/pose": self._bar}
        found["/cables/tension"] = self._tension
        bands = {name: each.band for name, each in found.items() if each is not None}
        if self._winches is not None:
            bands["/winches/state"] = self._winches.band
        return bands

    @cached_property
    def pose_band(self) -> float:
        """The band of both poses [Hz]: cables see their difference, so one band serves both."""
        if self._smoothed is not None:
            return self._smoothed.pose_band
        if self._given_band is not None:
            return self._given_band
        poses = (self.measurement.frame_pose, self.measurement.bar_pose)
        return max((band_of(s) for s in poses if s is not None), default=float("inf"))

    @cached_property
    def motion(self) -> Motion:
        """The winch frame's motion from the first step on; it stands still where not measured."""
        if self._frame is None:
            return Motion.still(np.zeros(6))
        times = np.arange(self.times[0], self.times[-1] + 2 * _KNOT_S, _KNOT_S)
        stamps = self._stamps("/winch_frame/pose", times)
        inside = np.clip(stamps, self._frame.spans[0, 0], self._frame.spans[-1, 1])
        knots = np.hstack([self._frame.at(inside, d) for d in range(3)])
        return Motion(_bridged(knots), _KNOT_S)

    @cached_property
    def frame_poses(self) -> Array:
        """The winch frame's pose x y z φ θ ψ, shape (k, 6); NaN in holes."""
        if self._frame is None:
            return np.zeros((len(self.times), 6))
        return self._frame.at(self._stamps("/winch_frame/pose"))

    @cached_property
    def bars(self) -> Array | None:
        """The bar's states: position, Euler angles, velocity (world), ω (bar axes), (k, 12)."""
        if self._bar is None:
            return None
        out = np.hstack([self._bar.at(self._stamps("/bar/pose")), self.bar_twists])
        body_rates_along(out[:, :6], self.bar_twists[:, 3:], out[:, 9:])
        return out

    @cached_property
    def bar_poses(self) -> Array:
        """The bar's pose, shape (k, 6); the world's where there is no bar, NaN in holes."""
        return np.zeros((len(self.times), 6)) if self.bars is None else self.bars[:, :6]

    @cached_property
    def bar_twists(self) -> Array:
        """Velocity and ω of the bar in world axes, shape (k, 6)."""
        if self._bar is None:
            return np.zeros((len(self.times), 6))
        times = self._stamps("/bar/pose")
        return _twists(self._bar.at(times), self._bar.at(times, 1))

    @cached_property
    def frame_twists(self) -> Array:
        """Velocity and ω of the winch frame in world axes, shape (k, 6)."""
        if self._frame is None:
            return np.zeros((len(self.times), 6))
        times = self._stamps("/winch_frame/pose")
        return _twists(self._frame.at(times), self._frame.at(times, 1))

    def body_motion(self, body: str) -> tuple[Array, Array, Array]:
        """Return pose x y z φ θ ψ, its rates and accelerations, each (k, 6); NaN in holes.

        Args:
            body: `bar` or `frame`; one that is not measured stands still at the world's origin.
        """
        topic, found = {
            "bar": ("/bar/pose", self._bar),
            "frame": ("/winch_frame/pose", self._frame),
        }[body]
        if found is None:
            still = np.zeros((len(self.times), 6))
            return still, still, still
        times = self._stamps(topic)
        return found.at(times), found.at(times, 1), found.at(times, 2)

    @property
    def angles(self) -> Array | None:
        """Motor angles, shape (k, n) [rad]."""
        return None if self._winches is None else self._winches.angles

    @property
    def speeds(self) -> Array | None:
        """Motor speeds, the derivative of `angles`, (k, n) [rad/s]."""
        return None if self._winches is None else self._winches.speeds

    @cached_property
    def smooth_tensions(self) -> Array | None:
        """Tensions in the band above their noise, shape (k, n) [N]."""
        stamps = self._stamps("/cables/tension")
        return None if self._tension is None else self._tension.at(stamps)

    @cached_property
    def tensions(self) -> Array | None:
        """Tensions as measured, joined by straight lines, shape (k, n) [N]; NaN in holes."""
        samples = self.measurement.tension
        return None if samples is None else joined(samples, self._stamps("/cables/tension"))

    @cached_property
    def torques(self) -> Array | None:
        """Torque held from each step to the next, shape (k, n) [N·m]; NaN in holes.

        A drive reports the torque that it applied up to the stamp. A single lost reading is a hole
        as well: a rough torque does not follow from its neighbours, and a light shaft takes another
        speed, which its angles show only some time later.
        """
        samples = self.measurement.torque
        if samples is None:
            return None
        later = np.searchsorted(samples.times, self.times + 0.5 * self.period)
        out: Array = samples.values[np.minimum(later, len(samples.times) - 1)].copy()
        lost = _lost(samples, later)
        near = 2 * round(_NEAR_S / self.period) + 1
        lost = binary_dilation(lost, np.ones(near, dtype=bool))
        out[_far(samples, self.times) | lost] = np.nan
        return out

    def _stamps(self, topic: str, times: Array | None = None) -> Array:
        """Return what a sensor stamped at the steps, or at some times, [s]."""
        times = self.times if times is None else times
        return times + self.delays.get(topic, 0.0) + self.drifts.get(topic, 0.0) * times

    @cached_property
    def _frame(self) -> Smooth | None:
        if self._smoothed is not None:
            return self._smoothed.frame
        samples = self.measurement.frame_pose
        return None if samples is None else smooth(samples, self.pose_band)

    @cached_property
    def _bar(self) -> Smooth | None:
        if self._smoothed is not None:
            return self._smoothed.bar
        samples = self.measurement.bar_pose
        return None if samples is None else smooth(samples, self.pose_band)

    @cached_property
    def _winches(self) -> WinchMotion | None:
        if self._smoothed is not None:
            return self._smoothed.winches
        angle, speed = self.measurement.angle, self.measurement.speed
        return None if angle is None else winch_motion(angle, speed, self.times)

    @cached_property
    def _tension(self) -> Smooth | None:
        if self._smoothed is not None:
            return self._smoothed.tension
        samples = self.measurement.tension
        return None if samples is None else smooth(samples)


def _slow_motion(angle: Samples, band: float, times: Array) -> WinchMotion:
    slow = smoothed(angle, band)
    return WinchMotion(slow.at(times), slow.at(times, 1), band)


def joined(samples: Samples, times: Array) -> Array:
    """Return samples joined by straight lines at `times`; NaN in holes and outside."""
    columns = [np.interp(times, samples.times, column) for column in samples.values.T]
    out = np.stack(columns, axis=1)
    out[_far(samples, times)] = np.nan
    return out


def whole_stretches(columns: list[Array], shortest: int) -> list[tuple[int, int]]:
    """Return first and last step of each stretch of at least `shortest` steps without NaN."""
    whole = np.ones(len(columns[0]), dtype=bool)
    for column in columns:
        whole &= np.isfinite(column).reshape(len(column), -1).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(int)))
    pairs = [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(a, b) for a, b in pairs if b - a >= shortest]


def _twists(poses: Array, rates: Array) -> Array:
    """Return v and ω in world axes, (k, 6), of poses x y z φ θ ψ and their rates."""
    out: Array = np.empty_like(rates)
    twists_along(poses, rates, out)
    return out


def _far(samples: Samples, times: Array) -> NDArray[np.bool_]:
    inside = np.zeros(len(times), dtype=np.bool_)
    slack = samples.interval
    for span in samples.spans:
        t = samples.times[span]
        inside |= (times >= t[0] - slack) & (times <= t[-1] + slack)
    return ~inside


def _lost(samples: Samples, later: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return for which steps, whose next readings are `later`, the reading itself was lost."""
    held = np.minimum(later, len(samples.times) - 1)
    gap = np.append(False, samples.gaps)[held]
    return np.asarray(gap & np.append(held[:-1] == held[1:], False))


def _bridged(knots: Array) -> Array:
    """Put straight lines where the frame was not seen; no window lies there."""
    whole = np.isfinite(knots).all(axis=1)
    index = np.arange(len(knots))
    return np.stack([np.interp(index, index[whole], c[whole]) for c in knots.T], axis=1)
