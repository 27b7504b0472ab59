"""Corrected measurements: sensor faults and parameter errors removed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from cspm_ident.diagnosis.residuals.file_effects import joined_entries, of_all_cells
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.sensor_readings import (
    mean_of_others,
    pose_rows,
    reading_rows,
)
from cspm_ident.signals.measurement import BAR, FRAME, TENSION, WINCHES, Measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.errors import InputError
from cspm_sim.effect_entries import Action, altered_testbed, read_actions
from cspm_sim.effects.winch_load import without_loads

Array = NDArray[np.float64]

# Number of iterations; each reduces the error by the relative size of the fault.
_FIXED_POINTS = 4


def with_found(measurement: Measurement, weights: Mapping[Candidate, Array]) -> Measurement:
    """Return the measurement of a machine whose description has further effects.

    Args:
        measurement: what was recorded.
        weights: of the effects' regressors, by candidate.
    """
    entries = [
        candidate.effect.entry(
            (candidate.element,), candidate.effect.values(own.tolist(), **candidate.nonlinear)
        )
        for candidate, own in weights.items()
    ]
    machine = measurement.machine
    entries = of_all_cells(entries, machine)
    machine = machine.model_copy(update={"effects": joined_entries(machine, entries)})
    return measurement.with_machine(machine)


def settled(measurement: Measurement) -> Measurement:
    """Return the corrected measurement, by the effects in the machine's description.

    Sensor faults are removed from the readings, and parameter errors are corrected in the
    description. Missing physics stays among the machine's effects.

    Raises:
        InputError: an effect cannot be used, or the corrected parameters are impossible.
    """
    machine, actions = measurement.machine, read_actions(measurement.machine)
    if not any(action.effect.physics.alter or action.effect.physics.sense for action in actions):
        return measurement
    for action in actions:
        if action.effect.physics.sense is not None:
            measurement = _true_readings(measurement, action)
    numbers = altered_testbed(machine, actions)
    kept = tuple(
        a.effect.entry((a.name,), a.values)
        for a in actions
        if a.effect.physics.alter is None and a.effect.physics.sense is None
    )
    left = without_loads(numbers).model_copy(update={"effects": kept})
    return measurement.with_machine(left)


def as_found(measurement: Measurement, weights: Mapping[Candidate, Array]) -> Measurement:
    """Return the corrected measurement of a machine that has the findings.

    If the corrected parameters are impossible, the findings are ignored.
    """
    try:
        return settled(with_found(measurement, weights))
    except InputError:
        return settled(measurement)


def is_possible(measurement: Measurement, weights: Mapping[Candidate, Array]) -> bool:
    """Return whether the measured machine can have further effects with such weights."""
    try:
        settled(with_found(measurement, weights))
    except InputError:
        return False
    return True


def nearest_possible(
    measurement: Measurement, candidate: Candidate, weights: Array, half: Array
) -> Array:
    """Return the nearest weights that the machine can have, if within the intervals.

    Otherwise the weights are returned unchanged.

    Args:
        measurement: of the machine.
        candidate: that the weights belong to.
        weights: as fitted.
        half: half the widths of their 95 % intervals.
    """
    effect = candidate.effect
    if effect.physics.nearest is None or not np.all(np.isfinite(half)):
        return weights
    names = [parameter.name for parameter in effect.linear]
    errors = dict(zip(names, half.tolist(), strict=True))
    values = effect.values(weights.tolist(), **candidate.nonlinear)
    nearest = effect.weights(effect.physics.nearest(measurement.machine, values, errors))
    return nearest if np.all(np.abs(nearest - weights) <= half) else weights


def _true_readings(measurement: Measurement, action: Action) -> Measurement:
    """Return a sensor's readings without its fault, by fixed-point iteration."""
    effect = action.effect
    assert effect.physics.sense is not None
    topic = effect.physics.sense.topics[0]
    joints = {TENSION: "tension", WINCHES: effect.physics.sense.quantity or "angle"}
    if topic in joints and effect.physics.sense.lateness is None:
        return _true_joint(measurement, action, joints[topic])
    poses = {BAR: "bar_pose", FRAME: "frame_pose"}
    kind = joints[topic] if topic in joints else poses[topic.format(action.name)]
    samples: Samples | None = getattr(measurement, kind)
    if samples is None:
        return measurement
    if effect.physics.sense.lateness is not None:
        parameters = np.array(list(action.values.values()))
        late = np.array(
            [effect.physics.sense.lateness(float(t), parameters) for t in samples.times]
        )
        alone = action.name in measurement.machine.cable_names and samples.values.shape[1] > 1
        there = _earlier(samples, late, action.element) if alone else _stamped(samples, late)
        return measurement.with_samples(kind, there)
    values, weights = samples.values, effect.weights(action.values)
    for _ in range(_FIXED_POINTS):
        rows = pose_rows(samples.times, values, np.zeros_like(values))
        values = samples.values - effect.regressors(rows) @ weights
    return measurement.with_samples(kind, Samples(samples.times, values))


def _stamped(samples: Samples, late: Array) -> Samples:
    """Return all readings with the stamps of what they show; `late` is of each, (k,) [s]."""
    return Samples(samples.times - late, samples.values)


def _earlier(samples: Samples, late: Array, i: int) -> Samples:
    """Return column i as it was at the stamps, where readings are late; `late` is of each, (k,)."""
    values = samples.values.copy()
    reading = CubicSpline(samples.times, values[:, i], extrapolate=False)
    values[:, i] = reading(np.clip(samples.times + late, samples.times[0], samples.times[-1]))
    return Samples(samples.times, values)


def _true_joint(measurement: Measurement, action: Action, kind: str) -> Measurement:
    samples: Samples | None = getattr(measurement, kind)
    if samples is None:
        return measurement
    effect, i, weights = action.effect, action.element, action.effect.weights(action.values)
    assert effect.physics.sense is not None
    if effect.physics.sense.time_constant is not None:
        # By the rate of the reading itself, which is exact.
        own = slice(i, i + 1) if action.name in measurement.machine.cable_names else slice(None)
        values = samples.values.copy()
        values[:, own] += weights[0] * np.gradient(values[:, own], samples.times, axis=0)
        return measurement.with_samples(kind, Samples(samples.times, values))
    values, others = samples.values.copy(), mean_of_others(samples.values, i)
    for _ in range(_FIXED_POINTS):
        rows = reading_rows(samples.times, values[:, i], others)
        values[:, i] = samples.values[:, i] - effect.regressors(rows)[:, 0] @ weights
    return measurement.with_samples(kind, Samples(samples.times, values))
