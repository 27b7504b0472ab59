"""What a table of values describes and no effect of the catalogue explains.

Its numbers are a table, so that each table is an effect of its own; all have the id `empirical`.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numba import njit

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed_keys.effect_table import (
    BAR_WRENCH,
    CABLE_TENSION,
    EMPIRICAL,
    WINCH_TORQUE,
    EffectTable,
)
from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Hook,
    Physics,
    Regression,
    Signature,
)
from cspm_sim.effects.signals import BarSignal, CableSignal, WinchSignal
from cspm_sim.kernels import affected_cables as cables
from cspm_sim.kernels import bar_effects as bars
from cspm_sim.kernels import winch as winches
from cspm_sim.kernels.affected_cables import CARRIED_TENSION
from cspm_sim.kernels.table import FIRST_SIGNAL, SECOND_SIGNAL, TARGET, table_value
from cspm_sim.kernels.winch import DRY_LIMIT, SPEED


class _Place(NamedTuple):
    """Where a table acts.

    Attributes:
        block: the part of the machine.
        hook: of the plant.
        channel: of the residual.
        target: signal of the plant that a winch's and a cable's table adds to, of the bar's first.
        drivers: by name the signal of the plant and that of the regressors.
    """

    block: Block
    hook: Hook
    channel: Channel
    target: int
    drivers: dict[str, tuple[int, int]]


_PLACES = {
    WINCH_TORQUE: _Place(
        Block.WINCH,
        Hook.WINCH,
        Channel.SHAFT,
        winches.RESISTANCE,
        {
            "speed": (winches.SPEED, WinchSignal.SPEED),
            "angle": (winches.ANGLE, WinchSignal.ANGLE),
            "tension": (winches.WINCH_TENSION, WinchSignal.TENSION),
        },
    ),
    CABLE_TENSION: _Place(
        Block.CABLE,
        Hook.LOADED_CABLE,
        Channel.TENSION,
        cables.LOADED_FORCE,
        {
            "tension": (cables.CARRIED_TENSION, CableSignal.TENSION),
            "rate of elongation": (cables.ELONGATION_RATE, CableSignal.RATE),
            "motor angle": (cables.MOTOR_ANGLE, CableSignal.ANGLE),
        },
    ),
    BAR_WRENCH: _Place(
        Block.BAR,
        Hook.BAR,
        Channel.WRENCH,
        bars.WRENCH,
        {dof: (bars.POSE + i, BarSignal.POSE + i) for i, dof in enumerate(DOFS)}
        | {
            f"{dof} speed": (bars.VELOCITY + i, BarSignal.VELOCITY + i)
            for i, dof in enumerate(DOFS)
        },
    ),
}


@njit(cache=True, error_model="numpy", _nrt=False)
def _value(table: Array, signals: Array) -> float:
    return table_value(table, signals[int(table[FIRST_SIGNAL])], signals[int(table[SECOND_SIGNAL])])


def _on_winch(table: Array, signals: Array) -> None:
    value = _value(table, signals)
    # What opposes the motion is set-valued at rest, as dry friction is, and cannot drive the winch.
    if int(table[FIRST_SIGNAL]) == SPEED and value * signals[SPEED] > 0.0:
        signals[DRY_LIMIT] += abs(value)
    else:
        signals[int(table[TARGET])] += value


def _on_cable(table: Array, signals: Array) -> None:
    carried = signals[CARRIED_TENSION]
    # The driver is the whole tension, of which the value is a part.
    signals[CARRIED_TENSION] = carried + _value(table, signals)
    value = _value(table, signals)
    signals[CARRIED_TENSION] = carried
    signals[int(table[TARGET])] += value


def _on_bar(table: Array, signals: Array) -> None:
    signals[int(table[TARGET])] += _value(table, signals)


_KERNELS = {WINCH_TORQUE: _on_winch, CABLE_TENSION: _on_cable, BAR_WRENCH: _on_bar}


@lru_cache(maxsize=256)
def table_effect(table: EffectTable) -> Effect:
    """Return the effect that a table describes; its parameters are the values at the knots."""
    place = _PLACES[table.place]
    unit = table.value_unit
    names = [f"value_{k + 1}" for k in range(len(table.values))]
    return Effect(
        id=EMPIRICAL,
        block=place.block,
        parameters=tuple(EffectParameter(n, unit, -np.inf, np.inf) for n in names),
        physics=Physics(
            kernels={place.hook: _KERNELS[table.place]}, constants=_constants(table, place)
        ),
        signature=Signature(regression=Regression(place.channel, partial(_columns, table))),
        description=_description(table),
        table=table,
    )


def _constants(table: EffectTable, place: _Place) -> tuple[float, ...]:
    """Return the kernel's numbers ahead of the values."""
    read = [place.drivers[name][0] for name in table.drivers]
    target = place.target + (DOFS.index(table.axis) if table.axis else 0)
    first, second = (*read, read[0])[:2]
    counts = len(table.knots), len(table.second_knots)
    return (first, counts[0], second, counts[1], target, *table.knots, *table.second_knots)


def _columns(table: EffectTable, signals: Array) -> Array:
    """Return hat functions of the drivers, shape (samples, channels, values)."""
    sources = [_PLACES[table.place].drivers[name][1] for name in table.drivers]
    hats = _hats(signals[:, sources[0]], np.array(table.knots))
    if table.second_knots:
        across = _hats(signals[:, sources[1]], np.array(table.second_knots))
        hats = (hats[:, :, None] * across[:, None, :]).reshape(len(signals), -1)
    if table.axis is None:
        return hats[:, None, :]
    columns = np.zeros((len(signals), len(DOFS), hats.shape[1]))
    columns[:, DOFS.index(table.axis)] = hats
    return columns


def _hats(values: Array, knots: Array) -> Array:
    return np.stack([np.interp(values, knots, unit) for unit in np.eye(len(knots))], axis=1)


def _description(table: EffectTable) -> Description:
    drivers = " and ".join(table.drivers)
    return Description(
        noun=f"a function of {drivers} without a name",
        equation=f"{table.place} += values, linear between knots of {drivers}",
        shows=f"residual is a function of {drivers}",
        confounded_with=(),
        separating_experiment="none: a table describes and does not explain",
        reference="piecewise linear interpolation",
    )
