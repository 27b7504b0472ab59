"""Which effects a set of sensors can distinguish, from what they add to its residuals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_sim.effects import Block, Channel, Effect, Elements
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

# Of a tension, for derivatives by differences.
_STEP_N = 1e-4
_ROUNDING = 1e-9
_CANCELLED = 1e-3


class Sensors(Enum):
    """Where the load cells sit, and whether there is motion capture."""

    BAR_AND_CAPTURE = "cells on the free cables, motion capture"
    DRUM_AND_CAPTURE = "cells at the drums, motion capture"
    BAR = "cells on the free cables, no motion capture"
    DRUM = "cells at the drums, no motion capture"
    CAPTURE = "no cells, motion capture"

    @property
    def at_drum(self) -> bool:
        """Whether the load cells measure between drum and pulley."""
        return self in (Sensors.DRUM_AND_CAPTURE, Sensors.DRUM)

    def of(self, measurement: Measurement) -> Measurement:
        """Return what these sensors measure of it."""
        if self in (Sensors.BAR, Sensors.DRUM):
            return replace(measurement, bar_pose=None, frame_pose=None)
        return replace(measurement, tension=None) if self is Sensors.CAPTURE else measurement


@dataclass(frozen=True, eq=False)
class Signature:
    """All that an effect adds to the residuals.

    Attributes:
        effect_id: whose.
        columns: by residual, what one unit of each weight adds, (k, channels, weights).
    """

    effect_id: str
    columns: Mapping[Place, Array]


def only_shape(effect: Effect) -> Effect:
    """Return the effect, looked at in the middle of its grid alone."""
    shapes = list(shapes_of(effect))
    return effect.with_grid({k: (v,) for k, v in shapes[len(shapes) // 2]})


def signatures(
    measurement: Measurement, effects: Iterable[Effect], cable: str, sensors: Sensors
) -> tuple[list[Signature], list[Equation]]:
    """Return each effect's signature, and the equations in which they stand.

    Args:
        measurement: exact readings of all sensors along a rich motion, with cells at the bar.
        effects: each is looked at in the middle of its grid.
        cable: on which those act that act on cables or load cells; others on the bar or the frame.
        sensors: those that there are.
    """
    seen = sensors.of(measurement)
    looked = [only_shape(effect) for effect in effects]
    equations = equations_of(seen, looked)
    found = []
    for effect in looked:
        own = effect.acts_on in (Elements.CABLES, Elements.CELLS)
        element = cable if own else _body(effect)
        candidate = Candidate(effect, element, next(shapes_of(effect)))
        columns = {e.place: e.columns[candidate] for e in equations if candidate in e.columns}
        if sensors.at_drum and effect.block is Block.CABLE:
            columns = _seen_at_drum(seen, effect, cable, columns, equations)
        found.append(Signature(effect.id, columns))
    return found, equations


def _body(effect: Effect) -> str:
    return Elements.BAR.value if effect.acts_on is Elements.BODIES else effect.acts_on.value


def _seen_at_drum(
    measurement: Measurement,
    effect: Effect,
    cable: str,
    columns: dict[Place, Array],
    equations: Sequence[Equation],
) -> dict[Place, Array]:
    """Return what an effect between drum and free cable adds where the cell is at the drum.

    There the winch equation is right, and the reading differs from the free cable's tension.
    """
    if effect.signature.regression.channel is not Channel.SHAFT or measurement.tension is None:
        return columns
    i = measurement.machine.cable_names.index(cable)
    lost, readings = _tension_lost(measurement, effect, i), measurement.tension
    step = _STEP_N / float(np.abs(lost).max())
    changes: dict[Place, list[Array]] = {e.place: [] for e in equations}
    for each in lost.T:
        moved = readings.values.copy()
        moved[:, i] += step * each
        there = measurement.with_samples("tension", Samples(readings.times, moved))
        added = {e.place: e.target for e in equations_of(there, [])}
        for equation in equations:
            changes[equation.place].append((added[equation.place] - equation.target) / step)
    found = {}
    for place, each in changes.items():
        added_here, own = np.stack(each, axis=2), columns.get(place)
        whole = added_here if own is None else added_here + own
        # What cancels but for the joining of samples is nothing.
        if own is None or np.linalg.norm(whole) > _CANCELLED * np.linalg.norm(own):
            found[place] = whole
    return found


def _tension_lost(measurement: Measurement, effect: Effect, i: int) -> Array:
    """Return by how much the drum's tension exceeds the free cable's, (k, weights) [N]."""
    angle, speed, tension = measurement.angle, measurement.speed, measurement.tension
    assert angle is not None
    assert speed is not None
    assert tension is not None
    winch = measurement.machine.cables[i]
    rows = np.zeros((len(angle.times), len(WinchSignal)))
    rows[:, WinchSignal.TIME] = angle.times
    rows[:, WinchSignal.ANGLE] = angle.values[:, i]
    rows[:, WinchSignal.SPEED] = speed.values[:, i]
    rows[:, WinchSignal.TENSION] = tension.values[:, i]
    rows[:, WinchSignal.RADIUS] = winch.wound_radius
    rows[:, WinchSignal.GEAR] = winch.gear_ratio
    shape = dict(next(shapes_of(effect)))
    torque = effect.regressors(rows, **shape)[:, 0]
    return np.asarray(torque * winch.gear_ratio / winch.drum_radius)


def angles(
    found: Sequence[Signature], equations: Sequence[Equation], noise: Mapping[Place, Array]
) -> dict[tuple[str, str], float | None]:
    """Return the smallest angle [°] between what two effects can add, for each pair of ids.

    0: some amount of the one looks exactly as some amount of the other; 90: they share nothing.
    None where one of the two shows nowhere. Residuals are in units of their noise, and what the
    nuisance explains is taken out. Principal angles: Björck, Golub, Math. Comp. 27(123), 1973.
    """
    spaces = {each.effect_id: _space(each, equations, noise) for each in found}
    return {
        (one.effect_id, other.effect_id): _angle(spaces[one.effect_id], spaces[other.effect_id])
        for one, other in combinations(found, 2)
    }


def _space(
    signature: Signature, equations: Sequence[Equation], noise: Mapping[Place, Array]
) -> Array:
    """Return an orthonormal basis, (rows, rank), of what an effect adds to all residuals."""
    (known,) = in_noise([[replace(e, columns={}) for e in equations]], noise)
    width = max((c.shape[2] for c in signature.columns.values()), default=0)
    parts = []
    for equation in known:
        columns = signature.columns.get(equation.place)
        rows = np.zeros((equation.target.size, width))
        if columns is not None:
            unit = noise[equation.place]
            rows = (columns / unit[:, None]).reshape(-1, width)
        if equation.nuisance.size:
            start = equation.nuisance.reshape(-1, equation.nuisance.shape[2])
            rows = rows - start @ np.linalg.lstsq(start, rows, rcond=None)[0]
        parts.append(rows)
    table = np.concatenate(parts) if parts else np.zeros((0, width))
    sizes = np.linalg.norm(table, axis=0)
    table = table[:, sizes > _ROUNDING * max(1.0, sizes.max(initial=0.0))]
    if not table.shape[1]:
        return table
    left, values, _ = np.linalg.svd(table / np.linalg.norm(table, axis=0), full_matrices=False)
    return np.asarray(left[:, values > _ROUNDING * values[0]])


def _angle(one: Array, other: Array) -> float | None:
    if not one.shape[1] or not other.shape[1]:
        return None
    narrow, wide = sorted((one, other), key=lambda basis: basis.shape[1])
    # The sine is exact where the cosine is all but 1.
    apart = narrow - wide @ (wide.T @ narrow)
    return float(np.degrees(np.arcsin(min(1.0, np.linalg.svd(apart, compute_uv=False)[-1]))))
