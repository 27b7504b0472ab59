"""How far cable lengths by the poses are from those that the encoders wound.

A winch turns with its cable: L = c − r/n·q + e, where e is what the cable stretches. Up to the
constant c, the poses give L and the encoder r/n·q.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_checks.machine.poses import (
    Poses,
    bodies,
    cable_lengths,
    cable_lifts,
    cable_stretch,
    elastic_range,
)
from cspm_checks.series import Log, SensorSeries, series_of
from cspm_model.kernels.cable import RADIUS
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
STATE, TENSION = "/winches/state", "/cables/tension"
SURVEY = 0.005
"""Anchors are surveyed to millimetres: a length may be off by so much without any fault [m]."""
APART = 0.1
"""Of the motion: beyond it, and beyond stretch and survey, encoder and poses contradict."""
_MOST, _SIGMA = 0.8, 1.2816
"""Of the deviations, four fifths are below 1.28 sigma of normal noise."""
_FEWEST = 50
_UNSURE = 1.0  # of the stretch: stiffness and load cells are known to a part of it
_UPRIGHT = 50


class Winding(NamedTuple):
    """What poses and encoders of a log say of its cables, at the instants of the bar's poses.

    Attributes:
        testbed: the machine.
        names: of the cables, n.
        columns: their places among the machine's cables.
        bar: poses, k.
        frame: the winch frame's poses; None where it stands still.
        lengths: by the poses, (k, n) [m].
        wound: −r/n·q, and what the cables stretch where tensions are known, (k, n) [m].
        angles: of the encoders, n.
        allowed: how far they may be apart, by stretch and survey, (n,) [m].
    """

    testbed: Testbed
    names: tuple[str, ...]
    columns: tuple[int, ...]
    bar: Poses
    frame: Poses | None
    lengths: Array
    wound: Array
    angles: tuple[SensorSeries, ...]
    allowed: Array

    def lengths_with(self, bar: Poses, frame: Poses | None) -> Array:
        """Return the lengths that other poses would give, (k, n) [m]."""
        return cable_lengths(self.testbed, bar, frame)[:, self.columns]

    def limits(self, lengths: Array | None = None) -> Array:
        """Return how far the two may be apart at most, (n,) [m], with these lengths or others."""
        chosen = self.lengths if lengths is None else lengths
        moving = np.maximum(scatter(chosen), scatter(self.wound))
        return np.maximum(self.allowed, APART * moving)

    def hangs(self, bar: Poses, frame: Poses | None) -> bool:
        """Return whether a cable pulls the bar up, as one must, most of the time."""
        chosen = np.linspace(0, len(bar.time) - 1, _UPRIGHT).astype(int)
        under = None if frame is None else frame.at(bar.time[chosen])
        lifts = cable_lifts(self.testbed, bar.some(chosen), under)[:, self.columns]
        return bool(np.mean((lifts > 0.0).any(axis=1)) > 0.5)

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """Which cables contradict, (n,)."""
        return scatter(self.lengths - self.wound) > self.limits()


def winding(log: Log, testbed: Testbed, origin_ns: int) -> Winding | None:
    """Return what poses and encoders say; None where one of them was not recorded."""
    state = log.get(STATE)
    moving = bodies(log, testbed, origin_ns) if state is not None else None
    if state is None or moving is None or testbed.bar is None:
        return None
    if "position" not in state.topic.parts:
        return None
    chosen = tuple(i for i, cable in enumerate(testbed.cables) if cable.has_cable)
    names = tuple(testbed.cables[i].name for i in chosen)
    angles = [series_of(state, f"position/{name}", origin_ns) for name in names]
    if not names or min(len(one.time) for one in angles) < _FEWEST:
        return None
    first = max(one.time[0] for one in angles)
    last = min(one.time[-1] for one in angles)
    inside = (moving[0].time >= first) & (moving[0].time <= last)
    if inside.sum() < _FEWEST:
        return None
    bar = moving[0].some(inside)
    wound = np.stack([np.interp(bar.time, one.time, one.values) for one in angles], axis=1)
    wound *= -nominal_parameters(testbed).cables[list(chosen), RADIUS]
    lengths = cable_lengths(testbed, bar, moving[1])
    stretch, unsure = _stretch(log, testbed, bar.time, lengths, origin_ns)
    columns = list(chosen)
    return Winding(
        testbed,
        names,
        chosen,
        bar,
        moving[1],
        lengths[:, columns],
        wound + stretch[:, columns],
        tuple(angles),
        unsure[columns] + SURVEY,
    )


def _stretch(
    log: Log, testbed: Testbed, time: Array, lengths: Array, origin_ns: int
) -> tuple[Array, Array]:
    """Return what cables stretch, (k, n), and how far that may be wrong, (n,) [m]."""
    usual = np.nan_to_num(np.nanmedian(lengths, axis=0), nan=1.0)
    # Poses in another unit make no longer cables than the machine has room for.
    exits = [each.exit for each in testbed.cables if each.exit]
    usual = np.minimum(usual, 1.0 + 4.0 * float(np.abs(exits).max()))
    cells, fields = log.get(TENSION), [f"effort/{name}" for name in testbed.cable_names]
    series = []
    if cells is not None and set(fields) <= set(cells.measured):
        series = [series_of(cells, field, origin_ns) for field in fields]
    if not series or min(len(one.time) for one in series) < _FEWEST:
        return np.zeros_like(lengths), elastic_range(testbed, usual)
    pulls = np.stack([np.interp(time, one.time, one.values) for one in series], axis=1)
    stretch = cable_stretch(testbed, pulls, np.broadcast_to(usual, pulls.shape))
    return stretch, _UNSURE * np.nanstd(stretch, axis=0)


def scatter(table: Array) -> Array:
    """Return the standard deviation of columns (k, n) of which a fifth may be wrong."""
    about = np.abs(table - np.nanmedian(table, axis=0))
    return np.asarray(np.nan_to_num(np.nanquantile(about, _MOST, axis=0), nan=np.inf) / _SIGMA)
