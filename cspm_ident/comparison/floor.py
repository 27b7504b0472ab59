"""What noise alone would leave of the error, so that nobody fits below it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import BlockSimulation, Input, Simulated, Window
from cspm_ident.signals.measurement import BAR, FRAME, SPEED, TENSION, TORQUE, WINCHES
from cspm_ident.signals.noise import with_more_noise
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

_LONGEST_S = 30.0
# More of the signals than is simulated, so that smoothing has both sides.
_MARGIN_S = 3.0
_SEED = 20260101
# One draw of the swing that a noisy start leaves behind is known to a factor of two at best.
_STARTS = 4
_POSES = {FRAME: "frame_pose", BAR: "bar_pose"}
_MOTION = {WINCHES: "angle", SPEED: "speed"}
# What noise goes to, by drive and topic: attributes of the measurement.
_INPUTS = {
    Input.WINCH: {**_POSES, **_MOTION},
    Input.CABLE: {**_POSES, **_MOTION},
    Input.TORQUE: {**_POSES, **_MOTION, TORQUE: "torque"},
    Input.TENSION: {**_POSES, TENSION: "tension"},
    Input.SHAFT: {**_MOTION, TORQUE: "torque", TENSION: "tension"},
}


def propagated(
    timeline: Timeline,
    machine: Testbed,
    drive: Input,
    windows: list[Window],
    noise: Mapping[str, Array],
) -> Simulated:
    """Return how a simulation scatters when its inputs get as much noise as they have.

    The difference of two simulations, of which one has the noise once more, over half a minute: at
    each step the RMS of several such draws where few windows begin.
    """
    some = _first(windows, timeline.period)
    if not some:
        return _nothing(len(machine.cables))
    first, last = some[0][0], max(end for _, end in some)
    clean = timeline.within(first, last)
    some = [(start - first, end - first) for start, end in some]
    before = BlockSimulation(clean, machine).run(drive, some)
    draws = [
        BlockSimulation(_noisier(clean, drive, noise, _SEED + i), machine).run(drive, some)
        for i in range(_draws(drive, some))
    ]

    def scatter(signal: str) -> Array:
        apart = [getattr(after, signal) - getattr(before, signal) for after in draws]
        return np.asarray(np.sqrt(np.mean(np.square(apart), axis=0)))

    failed = [window for after in draws for window in after.failed]
    bars, tensions, angles, speeds = (scatter(name) for name in Simulated._fields[:-1])
    return Simulated(bars, tensions, angles, speeds, failed)


def _draws(drive: Input, windows: list[Window]) -> int:
    """Return how many draws show what starts leave behind: each window has one in each draw."""
    # Cables between given ends swing nowhere.
    return 1 if drive is Input.CABLE else max(1, _STARTS // len(windows))


def lasting_rms(scatter: Array, steps: int) -> float:
    """Return the RMS that a scatter (k,) has over so many steps, of which it shows the first.

    What it does in its last third it goes on doing: a start from a noisy state has died out.
    """
    squares = scatter[np.isfinite(scatter)] ** 2
    if not len(squares):
        return 0.0
    more = max(0, steps - len(squares))
    total = squares.sum() + more * squares[-max(1, len(squares) // 3) :].mean()
    return float(np.sqrt(total / (len(squares) + more)))


def _noisier(timeline: Timeline, drive: Input, noise: Mapping[str, Array], seed: int) -> Timeline:
    """Return the timeline with the noise of what a drive takes once more."""
    start, end = timeline.times[0] - _MARGIN_S, timeline.times[-1] + _MARGIN_S
    measurement = timeline.measurement.within(start, end)
    more = {
        name: noise[topic]
        for topic, name in _INPUTS[drive].items()
        if getattr(measurement, name) is not None and topic in noise
    }
    noisy = Timeline(
        with_more_noise(measurement, more, seed),
        timeline.period_ns,
        timeline.delays,
        timeline.pose_band,
    )
    noisy.times = timeline.times
    return noisy


def _nothing(cables: int) -> Simulated:
    bars, joints = np.zeros((0, 6)), np.zeros((0, cables))
    return Simulated(bars, joints, joints, joints, [])


def _first(windows: list[Window], period: float) -> list[Window]:
    """Return the first windows that make up half a minute, the last of them cut."""
    left, found = round(_LONGEST_S / period), []
    for start, end in windows:
        if left < 2:
            break
        found.append((start, min(end, start + left)))
        left -= end - start
    return found
