"""What a viewer shows of a recording or run: poses and signals on one grid of frames."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from cspm.signals import Signal, Signals

Array = NDArray[np.float64]

# Frames per second: motion looks continuous from 25 on.
FRAMES_PER_SECOND = 30
# Most frames: at 8 cables they take 2 MB of a page; longer recordings get fewer per second.
MOST_FRAMES = 5000
# Nothing is drawn inside gaps longer than this [s]: half a second of straight line looks measured.
LONGEST_GAP_S = 0.5
_MILLI = 1e3
_BODIES = {
    "frame": "frame_pose",
    "bar": "bar_pose",
    "wanted": "bar_reference",
    "target": "target_pose",
}
_OF_WINCHES = (
    ("Cable tensions", "tension", "N"),
    ("Motor torques", "winch_torque", "N·m"),
    ("Motor speeds", "winch_speed", "rad/s"),
    ("Motor angles", "winch_angle", "rad"),
)


@dataclass(frozen=True, eq=False)
class Trace:
    """Signals of one kind, as the least and the greatest value around each frame.

    Attributes:
        title: what they are.
        unit: theirs.
        names: of the k signals.
        low: shape (n, k).
        high: shape (n, k).
    """

    title: str
    unit: str
    names: tuple[str, ...]
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Frames:
    """A recording on a grid of n frames.

    Attributes:
        name: of the recording.
        period: from frame to frame [s].
        count: n.
        poses: x y z φ θ ψ of `frame`, `bar`, `wanted` and `target` in world_ned, (n, 6) [m, rad],
            where they are recorded; NaN inside gaps.
        traces: the signals.
    """

    name: str
    period: float
    count: int
    poses: dict[str, Array]
    traces: tuple[Trace, ...]


def frames_of(source: Signals, name: str) -> Frames:
    """Return what a viewer shows of a recording or run.

    Raises:
        InputError: nothing is recorded that could be shown.
    """
    end = float(source.time[-1])
    period = max(1.0 / FRAMES_PER_SECOND, end / (MOST_FRAMES - 1))
    # A share of a frame of rounding makes no frame of its own.
    times = period * np.arange(ceil(end / period - 1e-6) + 1, dtype=np.float64)
    poses = {
        body: _between(times, source.signal(signal))
        for body, signal in _BODIES.items()
        if signal in source.names
    }
    traces = [_trace(times, *each) for each in _signals(source)]
    return Frames(name, period, len(times), poses, tuple(traces))


def _signals(source: Signals) -> Iterable[tuple[str, str, Signal]]:
    """Yield titles, units and signals in the order in which they are shown."""
    if "bar_pose" in source.names:
        yield from _of_bar(source)
    for title, name, unit in _OF_WINCHES:
        if name in source.names:
            yield title, unit, source.signal(name)
    if "frame_pose" in source.names:
        yield from _halves("Ship or frame", source.signal("frame_pose"))


def _of_bar(source: Signals) -> Iterable[tuple[str, str, Signal]]:
    """Yield the bar's errors where its reference is recorded, otherwise its pose."""
    pose = source.bar_pose
    if "bar_reference" not in source.names:
        yield from _halves("Bar", pose)
        return
    wanted = source.bar_reference
    error = np.column_stack(
        [np.interp(pose.time, wanted.time, wanted.values[:, i]) for i in range(6)]
    )
    found = Signal("error", pose.time, error - pose.values, pose.columns, pose.units)
    yield from _halves("Bar error, wanted − measured:", found)


def _halves(what: str, pose: Signal) -> Iterable[tuple[str, str, Signal]]:
    """Yield the positions [mm] and the angles [mrad] of poses."""
    for part, unit, columns in (("position", "mm", slice(0, 3)), ("angles", "mrad", slice(3, 6))):
        values = _MILLI * pose.values[:, columns]
        units = (unit,) * 3
        yield (
            f"{what} {part}",
            unit,
            Signal(part, pose.time, values, pose.columns[columns], units),
        )


def _trace(times: Array, title: str, unit: str, signal: Signal) -> Trace:
    low, high = envelope(times, signal.time, signal.values)
    return Trace(title, unit, signal.columns, low, high)


def _between(times: Array, signal: Signal) -> Array:
    return interpolated(times, signal.time, signal.values)


def interpolated(times: Array, at: Array, values: Array) -> Array:
    """Return values (n, k) at given times, NaN outside of the samples and inside long gaps.

    Args:
        times: where they are wanted, shape (n,) [s].
        at: stamps of the samples in ascending order, shape (m,) [s].
        values: the samples, shape (m, k).
    """
    found = np.column_stack([np.interp(times, at, column) for column in values.T])
    after = np.clip(np.searchsorted(at, times), 1, max(1, len(at) - 1))
    last = min(1, len(at) - 1)
    gap = at[after * last] - at[after - 1]
    # The grid begins up to one sensor's period before its first sample.
    outside = (times < at[0] - LONGEST_GAP_S) | (times > at[-1] + LONGEST_GAP_S)
    found[outside | (gap > LONGEST_GAP_S)] = np.nan
    return found


def envelope(times: Array, at: Array, values: Array) -> tuple[Array, Array]:
    """Return the least and the greatest value around each frame, so that no spike is lost.

    Args:
        times: of the n ≥ 2 frames, equally spaced [s].
        at: stamps of the samples in ascending order, shape (m,) [s].
        values: the samples, shape (m, k).

    Returns:
        Two arrays (n, k); NaN inside gaps.
    """
    low = interpolated(times, at, values)
    high = low.copy()
    half = 0.5 * (times[1] - times[0])
    edges = np.searchsorted(at, np.append(times - half, times[-1] + half))
    filled = np.diff(edges) > 0
    if filled.any():
        starts, inside = edges[:-1][filled], values[: edges[-1]]
        low[filled] = np.minimum.reduceat(inside, starts)
        high[filled] = np.maximum.reduceat(inside, starts)
    return low, high
