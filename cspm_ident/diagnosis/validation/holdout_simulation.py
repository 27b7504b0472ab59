"""Validation of findings by simulation of held-out data."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import BlockSimulation, Input, Simulated
from cspm_ident.comparison.floor import lasting_rms, propagated
from cspm_ident.diagnosis.finding import Improvement
from cspm_ident.diagnosis.residuals.corrected_measurement import as_found
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.side_by_side import side_by_side
from cspm_ident.signals.measurement import BAR, TENSION, WINCHES, Measurement
from cspm_ident.signals.noise_source import noise_of
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Channel

Array = NDArray[np.float64]
Weights = Mapping[Candidate, Array]

# Length of simulation windows where an input is integrated twice or more [s]; None: unlimited.
HORIZONS: dict[Input, float | None] = {Input.SHAFT: 0.5, Input.WINCH: None, Input.TENSION: 0.5}
# Longest simulated part of each recording [s].
LONGEST_S = 30.0
# Lead time before that part, in which a cable's initial internal states decay [s].
LEAD_S = 10.0


class Output(NamedTuple):
    """A simulated quantity that was measured.

    Attributes:
        drive: which measured signals drove the simulation.
        name: topic and column, such as `cables/tension/surge_2`.
        unit: of the values.
        element: name of cable or body.
        kind: channel of the same block's residual.
    """

    drive: Input
    name: str
    unit: str
    element: str
    kind: Channel


Errors = dict[Output, tuple[float, float]]


class SimulatedFit(NamedTuple):
    """One measured quantity of held-out data against its simulation, in the quantity's unit.

    Attributes:
        output: which quantity.
        measured: its standard deviation.
        before: RMS error of the simulation with the file's model.
        retuned: with the file's parameters fitted to the searched data, nothing added.
        after: with the findings.
        floor: RMS error due to noise of sensors and inputs.
        tabled: with the findings and tables of what is unexplained; None without tables.
    """

    output: Output
    measured: float
    before: float
    retuned: float
    after: float
    floor: float
    tabled: float | None = None

    @property
    def final(self) -> float:
        """The error with all that the improved test-bed file has."""
        return self.after if self.tabled is None else self.tabled


class Baselines(NamedTuple):
    """Simulations without findings, as the reference of others.

    Attributes:
        parts: simulated parts, of each recording half a minute and its lead time.
        since: time from which each part counts [s].
        described: standard deviation and RMS error by output with the file's model.
        retuned: with the file's parameters fitted to the searched data.
    """

    parts: Sequence[Measurement]
    since: Sequence[float]
    described: Errors
    retuned: Errors


def baselines_of(
    measurements: Sequence[Measurement], starts: Sequence[float], retuned: Weights
) -> Baselines:
    """Simulate the held-out data with the file's model, as it is and re-tuned.

    Args:
        measurements: the recordings, of which half a minute counts; rows before it settle
            internal states such as creep.
        starts: times from which each recording is held out [s].
        retuned: weights of the file's own parameters.
    """
    parts = [
        m.within(at - LEAD_S, at + LONGEST_S) for m, at in zip(measurements, starts, strict=True)
    ]
    described = _errors(parts, starts, {})
    tuned = _errors(parts, starts, retuned) if retuned else described
    return Baselines(parts, starts, described, tuned)


def simulate_held_out(baselines: Baselines, found: Weights) -> tuple[SimulatedFit, ...]:
    """Simulate winches, cables and bar from measured signals with the findings.

    In windows of half a second, torques and tensions drive the winches, and tensions drive the bar.
    Motor angles drive cables and bar throughout. A simulation is left out if a sensor is missing.

    Args:
        baselines: those of the recordings.
        found: weights of the findings.
    """
    parts, since, described, tuned = baselines
    after = _errors(parts, since, found) if found else described
    floors = _floors(parts, found)
    return tuple(
        SimulatedFit(output, spread, before, tuned[output][1], after[output][1], floors[output])
        for output, (spread, before) in described.items()
        if output in tuned and output in after and output in floors
    )


def with_tables_simulated(
    fits: Sequence[SimulatedFit], baselines: Baselines, found: Weights
) -> tuple[SimulatedFit, ...]:
    """Return the fits with those of a model that has tables of what is unexplained as well.

    Args:
        fits: without tables.
        baselines: those of the recordings.
        found: weights of the findings and values of the tables.
    """
    errors = _errors(baselines.parts, baselines.since, found)
    return tuple(
        fit._replace(tabled=errors[fit.output][1]) if fit.output in errors else fit for fit in fits
    )


def improvement_by(
    baselines: Baselines,
    fits: Sequence[SimulatedFit],
    found: Weights,
    own: Collection[Candidate],
) -> Improvement | None:
    """Return the improvement of simulations by an effect; None where none depends on it.

    It is that of the quantity that improves most, in the blocks that the effect acts on. It is
    measured against the simulation without this effect or that without any, whichever is better:
    of two effects that compensate each other neither improves anything.

    Args:
        baselines: those of the simulated recordings.
        fits: their simulation with all findings.
        found: weights of all findings.
        own: the effect's candidates.
    """
    kinds = {
        r.channel
        for c in own
        for r in (c.effect.signature.regression, *c.effect.signature.partners)
    }
    sensed = any(c.effect.physics.sense is not None for c in own)
    fewer = {c: weights for c, weights in found.items() if c not in own}
    before = {f.output: f.before for f in fits}
    if fewer:
        errors = _errors(baselines.parts, baselines.since, fewer)
        before = {
            output: float(np.fmin(errors[output][1], nominal))
            for output, nominal in before.items()
            if output in errors
        }
    shown = [
        Improvement(fit.output.name, fit.output.unit, before[fit.output], fit.after)
        for fit in fits
        if fit.output in before and (sensed or _is_affected(fit.output, kinds))
    ]
    shown = [each for each in shown if each.without > 0.0 and np.isfinite(each.with_it)]
    return min(shown, key=lambda each: each.with_it / each.without, default=None)


def _is_affected(output: Output, kinds: Collection[Channel]) -> bool:
    """Return whether a simulated quantity depends on effects in residuals of the given channels.

    Motor angles drive cables and bar together, so that an effect in either changes both.
    """
    together = {Channel.TENSION, Channel.WRENCH}
    both = output.drive is Input.WINCH and not together.isdisjoint(kinds)
    return both or output.kind in kinds


def _errors(parts: Sequence[Measurement], since: Sequence[float], weights: Weights) -> Errors:
    """Return standard deviation and RMS error by output, over all recordings."""
    found: dict[Output, list[tuple[Array, Array]]] = {}
    for part, start in zip(parts, since, strict=True):
        measurement = as_found(part, weights)
        timeline = Timeline(measurement)
        simulation = BlockSimulation(timeline, measurement.machine)
        drives = _drives(simulation)
        runs = side_by_side(partial(_run, simulation), drives)
        for drive, simulated in zip(drives, runs, strict=True):
            for output, samples, column, i in _outputs(measurement, drive, simulated):
                inside = (start <= samples.times) & (samples.times <= timeline.times[-1])
                at = np.interp(samples.times[inside], timeline.times, column)
                whole = np.isfinite(at)
                measured = samples.values[inside, i][whole]
                found.setdefault(output, []).append((measured, measured - at[whole]))
    return {
        output: (
            float(np.sqrt(np.mean([np.var(m) for m, _ in pairs]))),
            float(np.sqrt(np.mean(np.concatenate([e for _, e in pairs]) ** 2))),
        )
        for output, pairs in found.items()
        if all(len(m) > 1 for m, _ in pairs)
    }


def _run(simulation: BlockSimulation, drive: Input) -> Simulated:
    return simulation.run(drive, simulation.windows(drive, HORIZONS[drive]))


def _drives(simulation: BlockSimulation) -> list[Input]:
    bar = simulation.testbed.bar is not None
    return [
        drive
        for drive in HORIZONS
        if (bar or drive is Input.SHAFT) and not simulation.missing(drive)
    ]


def _floors(parts: Sequence[Measurement], weights: Weights) -> dict[Output, float]:
    """Return the RMS error due to noise by output, from the first recording."""
    measurement = as_found(parts[0], weights)
    noise, _ = noise_of(measurement, None)
    timeline = Timeline(measurement)
    simulation = BlockSimulation(timeline, measurement.machine)
    found = {}
    topics = {"angle": WINCHES, "tension": TENSION, "pose": BAR}

    def scattered(drive: Input) -> tuple[Input, Simulated, int]:
        windows = simulation.windows(drive, HORIZONS[drive])
        scatter = propagated(timeline, simulation.testbed, drive, windows, noise)
        return drive, scatter, sum(end - start for start, end in windows)

    for drive, scatter, steps in side_by_side(scattered, _drives(simulation)):
        for output, _, column, i in _outputs(measurement, drive, scatter):
            topic = topics[output.name.split("/")[1]]
            found[output] = float(np.hypot(noise[topic][i], lasting_rms(column, steps)))
    return found


def _outputs(
    measurement: Measurement, drive: Input, simulated: Simulated
) -> list[tuple[Output, Samples, Array, int]]:
    """Return the outputs of an input's simulation that were measured, with sensor and column."""
    cables, kinds = measurement.machine.cable_names, Channel
    tables = [
        ("winches/angle", measurement.angle, simulated.angles, cables, kinds.SHAFT),
        ("cables/tension", measurement.tension, simulated.tensions, cables, kinds.TENSION),
        ("bar/pose", measurement.bar_pose, simulated.bars, DOFS, kinds.WRENCH),
    ]
    found = []
    for stem, samples, values, names, kind in tables:
        if samples is None or not values.size:
            continue
        for i, name in enumerate(names):
            if not np.ptp(samples.values[:, i]) > 0.0:
                continue
            element = "bar" if kind is Channel.WRENCH else name
            output = Output(drive, f"{stem}/{name}", _unit(stem, i), element, kind)
            found.append((output, samples, values[:, i], i))
    return found


def _unit(stem: str, i: int) -> str:
    if stem == "bar/pose":
        return "m" if i < 3 else "rad"
    return "N" if stem == "cables/tension" else "rad"
