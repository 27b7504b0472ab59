"""Windows of a recording simulated from free initial states: multiple shooting (Bock 1981)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import BlockSimulation, Input, Window
from cspm_ident.signals.measurement import BAR, FRAME, SPEED, TENSION, WINCHES, Measurement
from cspm_ident.signals.noise import with_more_noise
from cspm_ident.signals.noise_source import noise_of
from cspm_ident.signals.timeline import Timeline
from cspm_ident.system.lateness import delays_to_remove
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.plant_blocks import PlantBlocks

Array = NDArray[np.float64]

# Steps over which tensions are averaged: 10 ms, the usual interval of a motion capture.
_BLOCK = 10
# Of the initial states: position, angles, velocity, ω, unstretched lengths.
_STEPS = np.array([1e-6] * 6 + [1e-5] * 6)
_LENGTH_STEP = 1e-8
# Below it a band that is not found may be noise that passes for motion, which dampers see.
_LONG_ENOUGH = 12.0  # s
# A residual where the simulation diverged, in standard deviations of the sensor.
_DIVERGED = 1e4
# Directions of the initial state that the window sees less than this share of the best.
_UNSEEN = 1e-8


@dataclass(eq=False)
class Shooting:
    """One recording cut into windows.

    Attributes:
        timeline: its signals.
        windows: first and last step of each.
        starts: what is added to the state measured at each window's start: bar (12) and unstretched
            lengths, shape (windows, 12 + n).
        spans: per window, an orthonormal basis of what changes of its start do to all residuals.
        answers: per window, the change of its start from coordinates in that basis.
        weights: by kind, one over the standard deviation of each channel.
        noise: by attribute of the measurement, the standard deviation of each of its columns.
    """

    timeline: Timeline
    windows: list[Window]
    starts: Array
    weights: dict[str, Array]
    noise: dict[str, Array]
    spans: list[Array] = field(default_factory=list)
    answers: list[Array] = field(default_factory=list)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The groups of channels, in the order of the residuals of a window."""
        return tuple(self.weights)

    def residuals(self, machine: Testbed) -> list[dict[str, Array]]:
        """Return measured less simulated over the sensor's noise, per window and kind.

        Each is (samples, channels), and free of what other initial states would explain.
        """
        raw = self.raw_residuals(machine)
        if not self.spans:
            return raw
        return [self._freed(i, part) for i, part in enumerate(raw)]

    def raw_residuals(self, machine: Testbed) -> list[dict[str, Array]]:
        """Return the same with the initial states as they are."""
        simulation = BlockSimulation(self.timeline, machine)
        plant = PlantBlocks(simulation.parameters, self.timeline.motion, self.timeline.period_ns)
        return [
            self._window(plant, window, _started(simulation, window[0], start))
            for window, start in zip(self.windows, self.starts, strict=True)
        ]

    def redrawn(self, seed: Sequence[int], sign: float = 1.0) -> Shooting:
        """Return the same windows with one more draw of noise on all measured signals.

        With `sign` −1 it is the opposite of that draw.
        """
        line = self.timeline
        number = int(np.random.SeedSequence(seed).generate_state(1)[0])
        noise = {name: sign * own for name, own in self.noise.items()}
        noisy = with_more_noise(line.measurement, noise, number)
        # The same smoothing, so that the difference is that of the noise alone.
        timeline = Timeline(noisy, line.period_ns, line.delays, line.pose_band)
        timeline.times = line.times
        return replace(self, timeline=timeline)

    def relinearise(self, machine: Testbed) -> None:
        """Move the initial states to their best for a machine, and free the residuals of them."""
        base = self.raw_residuals(machine)
        kept, columns = self.starts, []
        width = kept.shape[1]
        steps = np.concatenate([_STEPS, np.full(width - len(_STEPS), _LENGTH_STEP)])
        for step, unit in zip(steps, np.eye(width), strict=True):
            self.starts = kept + step * unit
            columns.append(self.raw_residuals(machine))
        self.starts, self.spans, self.answers = kept.copy(), [], []
        for i, part in enumerate(base):
            target = self._row(part)
            slopes = [(self._row(c[i]) - target) / s for c, s in zip(columns, steps, strict=True)]
            span, answer = _solution(np.stack(slopes, axis=1))
            self.spans.append(span)
            self.answers.append(answer)
        self._move_starts(base)

    def follow(self, machine: Testbed) -> None:
        """Move the initial states to their best for another machine, by the slopes known."""
        self._move_starts(self.raw_residuals(machine))

    def _move_starts(self, residuals: list[dict[str, Array]]) -> None:
        for i, part in enumerate(residuals):
            self.starts[i] -= self.answers[i] @ (self.spans[i].T @ self._row(part))

    def _row(self, part: dict[str, Array]) -> Array:
        return np.concatenate([part[kind].ravel() for kind in self.kinds])

    def _freed(self, i: int, part: dict[str, Array]) -> dict[str, Array]:
        """Return a window's residuals without the part that other starts explain."""
        row, span = self._row(part), self.spans[i]
        row -= span @ (span.T @ row)
        ends = np.cumsum([part[kind].size for kind in self.kinds])[:-1]
        rows = np.split(row, ends)
        return {k: r.reshape(part[k].shape) for k, r in zip(self.kinds, rows, strict=True)}

    def _window(self, plant: PlantBlocks, window: Window, state: Array) -> dict[str, Array]:
        start, end = window
        rows, line = slice(start, end + 1), self.timeline
        angles, speeds = np.asarray(line.angles)[rows], np.asarray(line.speeds)[rows]
        driven = plant.by_winches(start, state, angles, speeds)
        found = {}
        for kind, weight in self.weights.items():
            if kind == BAR:
                error = _pose_error(line, window, driven.states[:, :6])
            else:
                error = _averaged(np.asarray(line.tensions)[rows] - driven.tensions)
            found[kind] = np.nan_to_num(error * weight, nan=_DIVERGED)
        return found


def make_shooting(
    measurement: Measurement,
    horizon: float,
    most_windows: int,
    delays: Mapping[str, float] | None = None,
) -> Shooting:
    """Return a recording cut into windows, before any sensitivity.

    Args:
        measurement: what was recorded, with the machine as described.
        horizon: length of the windows [s].
        most_windows: so many, spread evenly, where there are more.
        delays: of the sensors, by topic [s]; None: those found, see `delays_to_remove`.

    Raises:
        InputError: a sensor is missing, motion cannot be distinguished from noise, or no window is
            long enough.
    """
    line = Timeline(measurement)
    BlockSimulation(line, measurement.machine).check(Input.WINCH)
    noise, _ = noise_of(measurement, None)
    duration = float(line.times[-1] - line.times[0])
    _check_band(line, noise, duration)
    if delays is None:
        delays = delays_to_remove(line, measurement.machine)
    line = line.delayed(delays)
    least = 0.5 * horizon / line.period
    windows = BlockSimulation(line, measurement.machine).windows(Input.WINCH, horizon)
    windows = [w for w in windows if w[1] - w[0] >= least]
    if not windows:
        raise InputError(
            f"{measurement.path}: of {duration:.1f} s no stretch of {0.5 * horizon:g} s is without"
            " a hole, allowed: a longer recording or a shorter --horizon"
        )
    if len(windows) > most_windows:
        kept = np.linspace(0, len(windows) - 1, most_windows).round().astype(int)
        windows = [windows[i] for i in kept]
    kinds = [BAR] + [TENSION] * (line.tensions is not None)
    weights = {kind: 1.0 / _positive(noise[kind]) for kind in kinds}
    width = len(_STEPS) + len(measurement.machine.cables)
    by_signal = _noise_of_signals(measurement, noise)
    return Shooting(line, windows, np.zeros((len(windows), width)), weights, by_signal)


def _noise_of_signals(measurement: Measurement, noise: Mapping[str, Array]) -> dict[str, Array]:
    """Return the noise by attribute of the measurement; `noise` has it by topic."""
    names = {FRAME: "frame_pose", BAR: "bar_pose", TENSION: "tension"}
    names |= {WINCHES: "angle", SPEED: "speed"}
    return {
        name: noise[topic]
        for topic, name in names.items()
        if topic in noise and getattr(measurement, name) is not None
    }


def _check_band(line: Timeline, noise: Mapping[str, Array], duration: float) -> None:
    """Refuse poses of which the motion cannot be distinguished from the noise."""
    if duration < _LONG_ENOUGH and not np.isfinite(line.pose_band) and noise[BAR].any():
        raise InputError(
            f"{line.measurement.path}: {duration:.1f} s, the motion of its poses does not stand out"
            f" of their noise; allowed: a recording of at least {_LONG_ENOUGH:g} s, or motion"
            " capture at a higher rate"
        )


def _started(simulation: BlockSimulation, step: int, change: Array) -> Array:
    state = simulation.state_at(step)
    state[: len(change)] += change
    return state


def _pose_error(line: Timeline, window: Window, simulated: Array) -> Array:
    """Return the error of the pose at the sensor's own samples, at most one per 10 ms."""
    samples = line.measurement.bar_pose
    times = line.times[window[0] : window[1] + 1]
    if samples is None:
        return np.zeros((0, 6))
    # On the clock of the simulation.
    chosen = samples.shifted(-line.delays.get(BAR, 0.0)).within(times[0], times[-1])
    skip = max(1, round(_BLOCK * line.period / max(samples.interval, 1e-9)))
    at, values = chosen.times[::skip], chosen.values[::skip]
    model = [np.interp(at, times, column) for column in simulated.T]
    return np.asarray(values - np.stack(model, axis=1))


def _averaged(error: Array) -> Array:
    count = len(error) // _BLOCK
    return np.asarray(error[: count * _BLOCK].reshape(count, _BLOCK, -1).mean(axis=1))


def _solution(slopes: Array) -> tuple[Array, Array]:
    """Return an orthonormal basis of the columns that show, and what solves them from there.

    With Q and A, A·Qᵀ·y is the least squares solution of slopes·x = y.
    """
    size = np.linalg.norm(slopes, axis=0) + 1e-300
    left, values, right = np.linalg.svd(slopes / size, full_matrices=False)
    seen = values > _UNSEEN * values[0]
    return left[:, seen], right[seen].T / values[seen] / size[:, None]


def _positive(noise: Array) -> Array:
    """Keep a sensor without noise from weighing infinitely."""
    least = noise[noise > 0.0].min() if (noise > 0.0).any() else 1.0
    return np.maximum(noise, least)
