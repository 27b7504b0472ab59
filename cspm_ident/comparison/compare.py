"""Simulate a recording from its own measured inputs and hold both together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import (
    BlockSimulation,
    Input,
    Simulated,
    Window,
)
from cspm_ident.comparison.channel_fit import ChannelFit
from cspm_ident.comparison.floor import lasting_rms, propagated
from cspm_ident.comparison.metrics import error_bins
from cspm_ident.side_by_side import side_by_side
from cspm_ident.signals.clock_drift import ClockDrift, on_one_clock
from cspm_ident.signals.delays import Delay, find_delays
from cspm_ident.signals.measurement import BAR, SPEED, TENSION, WINCHES, Measurement
from cspm_ident.signals.noise_source import NoiseSource, noise_of
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]
Progress = Callable[[str], None]

# How long a drive's errors may grow [s].
HORIZONS = {
    Input.WINCH: None,
    Input.CABLE: None,
    Input.TORQUE: 0.5,
    Input.TENSION: 0.5,
    Input.SHAFT: 0.5,
}
BLOCKS = {"winch": Input.SHAFT, "cable": Input.CABLE, "bar": Input.TENSION}


@dataclass(frozen=True, eq=False)
class Comparison:
    """A recording beside its simulation.

    Attributes:
        measurement: what was recorded.
        drive: what drove the whole.
        horizon: longest window of it [s], None for as long as nothing is missing.
        channels: the whole's, then those of the blocks, each from measured signals alone.
        delays: of the sensors, as found.
        applied: delays that were taken out, by topic [s].
        drifts: of the sensors' clocks, taken out as well; the delays are those at the beginning.
        noise: where each sensor's noise comes from, by topic.
        windows: how many there were, and how many of them diverged.
        bands: what was kept of the smoothed inputs [Hz], by topic.
        left_out: why a block, or the whole, is not among the channels.
    """

    measurement: Measurement
    drive: Input
    horizon: float | None
    channels: list[ChannelFit]
    delays: list[Delay]
    applied: dict[str, float]
    drifts: list[ClockDrift]
    noise: dict[str, NoiseSource]
    windows: tuple[int, int]
    bands: dict[str, float]
    left_out: dict[str, str]

    def use_of(self, delay: Delay) -> str:
        """Return what was done about a delay, to be put behind its text."""
        if delay.topic in self.applied:
            return "; taken out"
        return "; too small to matter, left in" if delay.known else ""

    @property
    def clocks(self) -> list[str]:
        """What was found of the sensors' clocks, in a line for each."""
        drifts = [f"{each.topic}: {each.text}; taken out" for each in self.drifts]
        return drifts + [f"{d.topic}: {d.text}{self.use_of(d)}" for d in self.delays]

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "recording": str(self.measurement.path),
            "sha256": self.measurement.sha256,
            "drive": self.drive.value,
            "horizon_s": self.horizon,
            "windows": self.windows[0],
            "diverged": self.windows[1],
            "delays": [delay.data() for delay in self.delays],
            "applied_delays_s": self.applied,
            "clock_drifts": [drift.data() for drift in self.drifts],
            "noise_from": {name: source.value for name, source in self.noise.items()},
            "bands_hz": {k: v if np.isfinite(v) else None for k, v in self.bands.items()},
            "left_out": self.left_out,
            "channels": [channel.data() for channel in self.channels],
        }


_STEMS = {
    BAR: "bar/pose",
    TENSION: "cables/tension",
    WINCHES: "winches/angle",
    SPEED: "winches/speed",
}


_NOTHING = {
    **dict.fromkeys(("whole", "cable", "bar"), "nothing that it simulates was measured"),
    "winch": "all winches stand still: a brake or friction takes any torque",
}


class _Run(NamedTuple):
    """One drive's outcome: what came out, and the scatter that noisy inputs give it."""

    simulated: Simulated
    scatter: Simulated
    windows: list[Window]


def compare(
    measurement: Measurement,
    drive: Input = Input.WINCH,
    *,
    horizon: float | None = None,
    delays: Mapping[str, float] | None = None,
    repeat: Measurement | None = None,
    progress: Progress = lambda _: None,
) -> Comparison:
    """Simulate a recording and compare, the whole and block by block.

    Args:
        measurement: what was recorded, with the machine to simulate.
        drive: which measured signals drive the whole.
        horizon: longest window [s]; absent: 0.5 s where the drive is integrated twice or more,
            otherwise as long as nothing is missing.
        delays: of sensors, by topic [s]; absent: those found, where they matter.
        repeat: the same experiment once more, from which the noise is taken.
        progress: called with what is being done.

    Raises:
        InputError: a sensor that the drive needs is missing.
    """
    machine = measurement.machine
    timeline = Timeline(measurement)
    blocks, left_out = _blocks(BlockSimulation(timeline, machine), drive)
    progress("delays of the sensors")
    drifts: list[ClockDrift] = []
    if delays is None:
        timeline, drifts = on_one_clock(timeline, machine)
        measurement = timeline.measurement
    found = find_delays(timeline, machine) if delays is None else []
    applied = {d.topic: d.seconds for d in found if d.matters} if delays is None else dict(delays)
    timeline = timeline.delayed(applied)
    progress("noise of the sensors")
    noise, sources = noise_of(measurement, repeat)
    horizon = HORIZONS[drive] if horizon is None else horizon
    progress("simulation")
    simulation = BlockSimulation(timeline, machine)
    runs = _runs(simulation, blocks, {**HORIZONS, drive: horizon}, noise)
    progress("errors")
    channels = {block: _channels(timeline, run, block, noise) for block, run in runs.items()}
    channels["winch"] = _turning(channels.get("winch", []), measurement, noise)
    left_out |= {block: _NOTHING[block] for block in blocks if not channels[block]}
    if not any(channels.values()):
        raise InputError(
            f"{measurement.path}: --drive {drive.value} gives nothing that was measured, allowed:"
            " a recording with the drive's outputs"
        )
    return Comparison(
        measurement,
        drive,
        horizon,
        [channel for block in blocks for channel in channels[block]],
        found,
        applied,
        drifts,
        sources,
        (len(runs["whole"].windows), len(runs["whole"].simulated.failed)),
        timeline.bands,
        left_out,
    )


def _blocks(simulation: BlockSimulation, drive: Input) -> tuple[dict[str, Input], dict[str, str]]:
    """Return the whole and each block whose sensors are there; and why others are left out.

    Raises:
        InputError: a sensor that the whole's drive needs is missing.
    """
    simulation.check(drive)
    found, left_out = {"whole": drive}, {}
    for block, each in BLOCKS.items():
        if each is drive or (simulation.testbed.bar is None and block != "winch"):
            continue
        if each is Input.SHAFT and drive is Input.TORQUE and not simulation.has_cables:
            continue
        missing = simulation.missing(each)
        if missing:
            left_out[block] = f"{', '.join(missing)} not recorded"
        else:
            found[block] = each
    return found, left_out


def _runs(
    simulation: BlockSimulation,
    blocks: Mapping[str, Input],
    horizons: Mapping[Input, float | None],
    noise: Mapping[str, Array],
) -> dict[str, _Run]:
    """Return each block's run; the kernels let Python go on, so that they share processors."""
    runs = side_by_side(
        lambda drive: _run(simulation, drive, horizons[drive], noise), blocks.values()
    )
    return dict(zip(blocks, runs, strict=True))


def _run(
    simulation: BlockSimulation, drive: Input, horizon: float | None, noise: Mapping[str, Array]
) -> _Run:
    windows = simulation.windows(drive, horizon)
    simulated = simulation.run(drive, windows)
    scatter = propagated(simulation.timeline, simulation.testbed, drive, windows, noise)
    return _Run(simulated, scatter, windows)


def _turning(
    channels: list[ChannelFit], measurement: Measurement, noise: Mapping[str, Array]
) -> list[ChannelFit]:
    """Return the channels of winches that turn: at rest a brake may hold against any torque."""
    if measurement.angle is None:
        return channels
    spread = measurement.angle.values.std(axis=0)
    names = measurement.machine.cable_names
    turns = [n for n, s, own in zip(names, spread, noise[WINCHES], strict=True) if s > 3.0 * own]
    return [channel for channel in channels if channel.name.rsplit("/", 1)[-1] in turns]


def _channels(
    timeline: Timeline, run: _Run, block: str, noise: Mapping[str, Array]
) -> list[ChannelFit]:
    measurement = timeline.measurement
    cables = measurement.machine.cable_names
    steps = sum(end - start for start, end in run.windows)
    outputs: list[tuple[str, Samples | None, Array, Array, tuple[str, ...], str]] = [
        (BAR, measurement.bar_pose, run.simulated.bars, run.scatter.bars, DOFS, "m"),
        (TENSION, measurement.tension, run.simulated.tensions, run.scatter.tensions, cables, "N"),
        (WINCHES, measurement.angle, run.simulated.angles, run.scatter.angles, cables, "rad"),
        (SPEED, measurement.speed, run.simulated.speeds, run.scatter.speeds, cables, "rad/s"),
    ]
    found = []
    for topic, samples, simulated, scatter, names, unit in outputs:
        if samples is None or not simulated.size:
            continue
        for i, name in enumerate(names):
            shown = "rad" if topic == BAR and i >= 3 else unit
            own = lasting_rms(scatter[:, i], steps)
            floor = float(np.hypot(noise[topic][i], own))
            channel = _channel(
                timeline,
                f"{_STEMS[topic]}/{name}",
                shown,
                block,
                topic,
                samples,
                simulated,
                i,
                floor,
            )
            if channel is not None:
                found.append(channel)
    return found


def _channel(
    timeline: Timeline,
    name: str,
    unit: str,
    block: str,
    topic: str,
    samples: Samples,
    simulated: Array,
    i: int,
    floor: float,
) -> ChannelFit | None:
    times = samples.times - timeline.delays.get(topic, 0.0)
    inside = (times >= timeline.times[0]) & (times <= timeline.times[-1])
    at = np.interp(times[inside], timeline.times, simulated[:, i])
    whole = np.isfinite(at)
    if whole.sum() < 4:
        return None
    channel = ChannelFit(
        name,
        unit,
        block,
        samples.times[inside][whole],
        samples.values[inside, i][whole],
        at[whole],
        floor,
    )
    return replace(channel, bins=_bins(timeline, channel, topic, i))


def _bins(timeline: Timeline, channel: ChannelFit, topic: str, i: int) -> dict[str, list[Any]]:
    """Return the error against time and what is likely to drive it."""

    def at(signal: Array | None, column: int) -> Array | None:
        if signal is None:
            return None
        return np.asarray(np.interp(channel.times, timeline.times, signal[:, column]))

    rates = timeline.bar_twists if topic == BAR else timeline.speeds
    quantities: dict[str, Array | None] = {"time_s": channel.times}
    if channel.moves:
        # Not the measured value, whose noise is in the error as well and would look like a slope.
        quantities["value"] = channel.simulated
    quantities["speed"] = at(rates, i)
    if topic != BAR:
        quantities["angle_rad"] = at(timeline.angles, i)
        quantities["tension_n"] = at(timeline.smooth_tensions, i)
    bins = {n: error_bins(channel.error, q) for n, q in quantities.items() if q is not None}
    return {name: found for name, found in bins.items() if found}
