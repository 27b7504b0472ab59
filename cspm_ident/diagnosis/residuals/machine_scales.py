"""Ranges and grids of the effects' parameters for a machine of another size or other units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import SingularityError
from cspm_sim.effects import Block, Effect, EffectParameter

Array = NDArray[np.float64]

# Share of the readings that lie within a scale.
_SHARE = 0.95
# Interval over which a speed is averaged, so that noise of the encoder adds little [s].
_AVERAGED_S = 0.05


class Scales(NamedTuple):
    """Sizes of a machine's signals; the others follow, with the second as unit of time.

    Attributes:
        torque: at the motor shafts [N·m].
        speed: of the motor shafts [rad/s].
        force: in the cables [N].
        length: of the cables [m].
    """

    torque: float
    speed: float
    force: float
    length: float


# Sizes for which the catalogue's ranges and grids are declared: in the middle of the thesis's
# recordings, of torques from 0.13 to 0.9 N·m, speeds from 90 to 270 rad/s, tensions from 6 to 37 N.
CATALOGUE_SCALES = Scales(torque=0.35, speed=100.0, force=15.0, length=2.0)

# By unit the powers of torque and speed at a winch, and of force and length elsewhere.
_WINCH = {
    "N·m": (1, 0),
    "N·m·s/rad": (1, -1),
    "N·m·s²/rad²": (1, -2),
    "kg·m²": (1, -1),
    "rad/s": (0, 1),
}
_ELSEWHERE = {
    "N": (1, 0),
    "m": (0, 1),
    "m/N": (-1, 1),
    "N/m": (1, -1),
    "N·s/m": (1, -1),
    "N·s²/m²": (1, -2),
    "kg": (1, -1),
    "kg/m": (1, -2),
    "kg·m²": (1, 1),
    "N·m": (1, 1),
    "N·m/rad": (1, 1),
    "N·m·s/rad": (1, 1),
    "N·m·s²/rad²": (1, 1),
}


def scales_of(measurements: Sequence[Measurement]) -> Scales:
    """Return the sizes of a machine's signals in its recordings; the catalogue's where unknown."""
    torques = [_size(m.torque) for m in measurements]
    speeds = [_speed(m.angle) for m in measurements]
    forces = [_size(m.tension) or _pulled(m) for m in measurements]
    lengths = [_length(m) for m in measurements]
    found = (max(own, default=0.0) for own in (torques, speeds, forces, lengths))
    return Scales(*(own or usual for own, usual in zip(found, CATALOGUE_SCALES, strict=True)))


def of_size(effects: Iterable[Effect], measurements: Sequence[Measurement]) -> list[Effect]:
    """Return effects `scaled` to the machine of these recordings."""
    scales = scales_of(measurements)
    return [scaled(each, scales) for each in effects]


def scaled(effect: Effect, scales: Scales) -> Effect:
    """Return an effect whose ranges and grids are those of a machine of this size.

    They are multiplied by powers of ten, so that machines of one order of magnitude share them, and
    the same data in other units give the same verdict.
    """
    by_unit = {p.unit: _factor(effect.block, p.unit, scales) for p in effect.parameters}
    if all(factor == 1.0 for factor in by_unit.values()):
        return effect
    factors = {p.name: by_unit[p.unit] for p in effect.parameters}
    parameters = tuple(_times(p, factors[p.name]) for p in effect.parameters)
    grids = effect.signature.nonlinear
    nonlinear = {name: tuple(factors[name] * v for v in grid) for name, grid in grids.items()}
    return replace(effect.with_grid(nonlinear), parameters=parameters)


def _times(parameter: EffectParameter, factor: float) -> EffectParameter:
    usual = None if parameter.usual is None else parameter.usual * factor
    low, high = parameter.minimum * factor, parameter.maximum * factor
    return replace(parameter, minimum=low, maximum=high, usual=usual)


def _factor(block: Block, unit: str, scales: Scales) -> float:
    decades = [
        round(float(np.log10(own / usual)))
        for own, usual in zip(scales, CATALOGUE_SCALES, strict=True)
    ]
    of_winch = block is Block.WINCH and unit in _WINCH
    powers = (_WINCH if of_winch else _ELSEWHERE).get(unit, (0, 0))
    first = 0 if of_winch else 2
    return float(10.0 ** (powers[0] * decades[first] + powers[1] * decades[first + 1]))


def _size(samples: Samples | None) -> float:
    if samples is None or not samples.values.size:
        return 0.0
    return float(np.nanmax(np.nanquantile(np.abs(samples.values), _SHARE, axis=0)))


def _speed(angle: Samples | None) -> float:
    if angle is None or len(angle.times) < 2:
        return 0.0
    apart = max(1, min(len(angle.times) - 1, round(_AVERAGED_S / angle.interval)))
    turned = angle.values[apart:] - angle.values[:-apart]
    speeds = np.abs(turned) / (angle.times[apart:] - angle.times[:-apart])[:, None]
    return float(np.nanmax(np.nanquantile(speeds, _SHARE, axis=0)))


def _pulled(measurement: Measurement) -> float:
    """Return the force of the torques at the drums, where there are no load cells."""
    radii = [cable.wound_radius for cable in measurement.machine.cables]
    return _size(measurement.torque) / max(radii)


def _length(measurement: Measurement) -> float:
    machine = measurement.machine
    if not any(cable.has_cable for cable in machine.cables):
        return 0.0
    bar, frame = (
        np.zeros(6) if samples is None else np.nanmean(samples.values, axis=0)
        for samples in (measurement.bar_pose, measurement.frame_pose)
    )
    try:
        lengths = geometry(nominal_parameters(machine).cables, bar, frame).lengths
    except SingularityError:
        return 0.0
    return float(np.nanmedian(lengths))
