"""Inertia and friction of one winch from its own signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation import (
    Estimate,
    Exogeneity,
    Interval,
    Parameter,
    Record,
    fit_instruments,
    fit_linear,
)
from cspm_ident.winch.recording import WinchSignals, signal_rows
from cspm_ident.winch.weak_form import HALF_WIDTH_S, make_window, weigh
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Effect, catalogue
from cspm_sim.effects.effect import Channel
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

INERTIA = "inertia"
_INERTIA_SCALE = 1.0  # kg·m², as far as an inertia may lie off


class WinchFit(NamedTuple):
    """A winch's equation, identified.

    Attributes:
        estimate: inertia [kg·m²] and the effects' parameters, named "effect parameter".
        error: of the torque, 100·|τ − τ̂|/|τ| over all windows [%]; τ less the cable's pull.
        exogeneity: whether least squares would have been biased; None without instruments.
    """

    estimate: Estimate
    error: float
    exogeneity: Exogeneity | None


def identify_winch(
    signals: Sequence[WinchSignals],
    effects: Sequence[str],
    *,
    instruments: Sequence[WinchSignals] | None = None,
    half_width: float = HALF_WIDTH_S,
    band: float | None = None,
    reversals: bool = True,
    whiten: bool = False,
    interval: Interval = Interval.BOOTSTRAP,
    seed: int = 0,
) -> WinchFit:
    """Estimate J and the effects' parameters in J·q̈ + (r/n)·t + Σ effects = τ, thesis (2-21).

    All is weighted with windows and summed, and acceleration and speed of the inertia's column come
    from the angle by summation by parts. Not whitened by default: what friction models miss is no
    noise, and whitening would give weight to the instants of reversal, where they miss most.

    Args:
        signals: readings of one winch, one entry per recording.
        effects: ids from the catalogue, each linear in its parameters and at the shaft.
        instruments: the same winch simulated from the reference alone, entry by entry, where the
            measured signals carry noise that the controller feeds back.
        half_width: of the windows [s].
        band: kept of the angle for the speed [Hz]; by default what stands out of its noise.
        reversals: whether windows count in which the shaft reverses. Dry friction holds it there
            for a while, and is then whatever holds, which no regressor of the speed's sign says.
        whiten: see `fit_linear`; not used with instruments.
        interval: see `fit_linear`.
        seed: of the bootstrap.

    Raises:
        InputError: an effect that is not in the catalogue, not linear or the inertia itself, no
            signals or too short ones, or instruments that do not fit.
    """
    chosen = [_linear_effect(name) for name in effects]
    parameters = _parameters(chosen)
    records = winch_records(signals, chosen, half_width, band, instruments, reversals=reversals)
    exogeneity = None
    if instruments is None:
        solution = fit_linear(records, parameters, whiten=whiten, interval=interval, seed=seed)
    else:
        found = fit_instruments(records, parameters, interval=interval, seed=seed)
        solution, exogeneity = found.solution, found.exogeneity
    error = relative_error(records, solution.estimate.values)
    return WinchFit(_from_weights(solution.estimate, chosen), error, exogeneity)


def winch_records(
    signals: Sequence[WinchSignals],
    effects: Sequence[Effect],
    half_width: float,
    band: float | None = None,
    instruments: Sequence[WinchSignals] | None = None,
    *,
    reversals: bool = True,
) -> list[Record]:
    """Return the weak form of the winch equation: inertia first, then the effects' parameters.

    See `identify_winch` for the arguments. Without reversals each stretch between two of them is a
    record of its own.

    Raises:
        InputError: no stretch is as long as a window, or instruments are not as many as signals.
    """
    if instruments is not None and len(instruments) != len(signals):
        raise InputError(
            f"{len(instruments)} instruments for {len(signals)} recordings; allowed: one for each"
        )
    records: list[Record] = []
    for i, each in enumerate(signals):
        pieces = _pieces(each, effects, half_width, band)
        others: list[Array | None] = [None] * len(pieces)
        if instruments is not None:
            others = [*_instrument_columns(pieces, instruments[i], effects, half_width, band)]
        for (target, columns, turns), other in zip(pieces, others, strict=True):
            for part in _kept(turns) if not reversals else [slice(0, len(target))]:
                if len(target[part]):
                    chosen = None if other is None else other[part]
                    records.append(Record(target[part], columns[part], instruments=chosen))
    if not records:
        without = "" if reversals else " without a reversal"
        raise InputError(
            f"no stretch of angle and torque is as long as a window, {2.0 * half_width:g} s"
            f"{without}; allowed: longer stretches"
        )
    return records


def relative_error(records: Sequence[Record], values: Array) -> float:
    """Return 100·|y − Φ·θ|/|y| over all records [%]."""
    target = np.concatenate([record.target for record in records])
    left = np.concatenate([record.target - record.regressors @ values for record in records])
    return float(100.0 * np.linalg.norm(left) / np.linalg.norm(target))


class _Weak(NamedTuple):
    """One stretch in weak form: target, columns, and whether the shaft reverses, by window."""

    target: Array
    columns: Array
    turns: NDArray[np.bool_]


def _pieces(
    signals: WinchSignals, effects: Sequence[Effect], half_width: float, band: float | None
) -> list[_Weak]:
    return [_weak(rows, signals, effects, half_width) for _, rows in signal_rows(signals, band)]


def _weak(
    rows: Array, signals: WinchSignals, effects: Sequence[Effect], half_width: float
) -> _Weak:
    step = signals.angle.interval
    half = max(2, round(half_width / step))
    columns = 1 + sum(effect.regressors(rows[:1]).shape[2] for effect in effects)
    if len(rows) < 2 * half + 1:
        return _Weak(np.zeros(0), np.zeros((0, columns)), np.zeros(0, dtype=np.bool_))
    window, stride = make_window(half, step), max(1, half // 2)
    load = rows[:, WinchSignal.TORQUE] - signals.radius * rows[:, WinchSignal.TENSION]
    inertia = weigh(window.second, rows[:, WinchSignal.ANGLE], stride)
    added = np.concatenate([effect.regressors(rows)[:, 0] for effect in effects], axis=1)
    target = weigh(window.weights, load, stride)
    # The mean of the signs is ±1 where the shaft turns one way throughout.
    signs = np.sign(rows[:, WinchSignal.SPEED])
    one_way = weigh(np.full(len(window.weights), 1.0 / len(window.weights)), signs, stride)
    turns = np.abs(one_way) < 1.0 - 0.5 / len(window.weights)
    added = weigh(window.weights, added, stride)
    return _Weak(target, np.column_stack([inertia, added]), turns)


def _kept(turns: NDArray[np.bool_]) -> list[slice]:
    """Return the stretches of windows without reversal."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], turns, [True]]).astype(int)))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _instrument_columns(
    pieces: Sequence[_Weak],
    simulated: WinchSignals,
    effects: Sequence[Effect],
    half_width: float,
    band: float | None,
) -> list[Array]:
    found = _pieces(simulated, effects, half_width, band)
    if [len(each.target) for each in found] != [len(each.target) for each in pieces]:
        raise InputError(
            "instruments have other stretches than the recording; "
            "allowed: signals at the recording's times"
        )
    return [each.columns for each in found]


def _linear_effect(name: str) -> Effect:
    known = {
        key: effect
        for key, effect in catalogue().items()
        if _is_linear(effect) and not _is_inertia(effect)
    }
    if name not in known:
        raise InputError(f"effect {name} of a winch; allowed: {', '.join(known)}")
    return known[name]


def _is_linear(effect: Effect) -> bool:
    at_shaft = effect.signature.regression.channel is Channel.SHAFT
    return at_shaft and not effect.signature.nonlinear and effect.signature.coefficients is None


def _is_inertia(effect: Effect) -> bool:
    """Return whether the effect is what `inertia` already stands for."""
    probe = np.random.default_rng(0).standard_normal((4, len(WinchSignal)))
    columns = effect.regressors(probe)[:, 0]
    return np.array_equal(columns, probe[:, [WinchSignal.ACCELERATION]])


def _parameters(effects: Sequence[Effect]) -> list[Parameter]:
    """Without the catalogue's bounds: a value beyond them says that the model is wrong."""
    return [
        Parameter(INERTIA, "kg·m²", scale=_INERTIA_SCALE),
        *(
            Parameter(f"{effect.id} {p.name}", p.unit, scale=0.5 * (p.maximum - p.minimum))
            for effect in effects
            for p in effect.parameters
        ),
    ]


def _from_weights(estimate: Estimate, effects: Sequence[Effect]) -> Estimate:
    """Return the estimate with values of parameters instead of columns' weights."""
    shift = np.array([0.0, *(p.absent or 0.0 for effect in effects for p in effect.parameters)])
    ends = estimate.ci95 + shift[:, None]
    return replace(estimate, values=estimate.values + shift, ci95=ends)
