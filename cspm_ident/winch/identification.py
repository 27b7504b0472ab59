"""Inertia and friction of one winch from its own signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation import (
    Estimate,
    Exogeneity,
    Interval,
    Parameter,
    Prior,
    Record,
    fit_instruments,
    fit_linear,
)
from cspm_ident.winch.recording import WinchSignals, signal_rows
from cspm_ident.winch.weak_form import HALF_WIDTH_S, first_of, make_window, weigh
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Effect, catalogue
from cspm_sim.effects.effect import Channel
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

INERTIA = "inertia"
LATENESS = "torque lateness"
_INERTIA_SCALE = 1.0  # kg·m², as far as an inertia may lie off
_LATENESS_SCALE = 1.0  # s
# Of the shaft's RMS speed: a shaft that is slower throughout a window may stick, and its direction
# may be noise. Dry friction then holds whatever the drive gives, which says nothing of its size.
_STANDING = 0.05


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
    lateness: float | None = None,
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
        band: kept of the angle for the speed [Hz]; by default what exceeds its noise.
        reversals: whether windows count in which the shaft reverses. Dry friction holds it there
            for a while, and is then whatever holds, which no regressor of the speed's sign says.
        whiten: see `fit_linear`; not used with instruments.
        interval: see `fit_linear`.
        lateness: if given, `LATENESS` [s] is fitted as well, last: how much longer than
            `torque_age` before its stamp the torque acted, to first order. The standard deviation
            of what is known of it beforehand [s]; infinite: nothing is.
        seed: of the bootstrap.

    Raises:
        InputError: an effect that is not in the catalogue, not linear or the inertia itself, no
            signals or too short ones, or instruments that do not fit.
    """
    chosen = linear_effects(effects)
    parameters = _parameters(chosen)
    if lateness is not None:
        prior = Prior(0.0, lateness) if isfinite(lateness) else None
        parameters.append(Parameter(LATENESS, "s", scale=_LATENESS_SCALE, prior=prior))
    records = winch_records(
        signals,
        chosen,
        half_width,
        band,
        instruments,
        reversals=reversals,
        lateness=lateness is not None,
    )
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
    lateness: bool = False,
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
    found = [_pieces(each, effects, half_width, band) for each in signals]
    slow = _slow(found)
    for i, pieces in enumerate(found):
        others: list[Array | None] = [None] * len(pieces)
        if instruments is not None:
            others = [*_instrument_columns(pieces, instruments[i], effects, half_width, band)]
        for piece, other in zip(pieces, others, strict=True):
            for part in piece.kept(slow, reversals=reversals):
                chosen = None if other is None else other[part]
                columns = piece.columns if lateness else piece.columns[:, :-1]
                records.append(Record(piece.target[part], columns[part], instruments=chosen))
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
    """One stretch in weak form.

    Attributes:
        target: torque less the cable's pull, by window, (n,) [N·m].
        columns: regressors, (n, parameters + 1); the last is minus the torque's rate.
        turns: whether the shaft reverses within a window, (n,).
        fastest: largest speed within a window, (n,) [rad/s].
        speed: mean square over the stretch [rad²/s²], and its samples.
    """

    target: Array
    columns: Array
    turns: NDArray[np.bool_]
    fastest: Array
    speed: tuple[float, int]

    def kept(self, slow: float, *, reversals: bool) -> list[slice]:
        """Return the stretches of windows in which the shaft moves, faster than `slow` [rad/s]."""
        keep = self.fastest > slow
        if not reversals:
            keep &= ~self.turns
        edges = np.flatnonzero(np.diff(np.concatenate([[False], keep, [False]]).astype(int)))
        return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _slow(pieces: Sequence[Sequence[_Weak]]) -> float:
    """Return the speed up to which the shaft counts as standing [rad/s].

    A shaft that never moves counts as moving, so that what it does not excite can be named.
    """
    speeds = [each.speed for own in pieces for each in own]
    count = sum(n for _, n in speeds)
    total = sum(mean * n for mean, n in speeds)
    return _STANDING * float(np.sqrt(total / count)) if total else -1.0


def _pieces(
    signals: WinchSignals, effects: Sequence[Effect], half_width: float, band: float | None
) -> list[_Weak]:
    return [_weak(rows, signals, effects, half_width) for _, rows in signal_rows(signals, band)]


def _weak(
    rows: Array, signals: WinchSignals, effects: Sequence[Effect], half_width: float
) -> _Weak:
    step = signals.angle.interval
    half = max(2, round(half_width / step))
    width = 2 + sum(effect.regressors(rows[:1]).shape[2] for effect in effects)
    if len(rows) < 2 * half + 1:
        none = np.zeros(0)
        return _Weak(none, np.zeros((0, width)), none.astype(np.bool_), none, (0.0, 0))
    window, stride = make_window(half, step), max(1, half // 2)
    load = rows[:, WinchSignal.TORQUE] - signals.radius * rows[:, WinchSignal.TENSION]
    load = load - signals.load_torque(rows)
    speed = rows[:, WinchSignal.SPEED]
    if signals.speed is None:
        inertia = weigh(window.second, rows[:, WinchSignal.ANGLE], stride)
    else:
        inertia = weigh(first_of(half, step), speed, stride)
    none = np.zeros((len(rows), 0))  # where inertia alone is left
    added = np.concatenate([none, *(effect.regressors(rows)[:, 0] for effect in effects)], axis=1)
    target = weigh(window.weights, load, stride) - signals.load_inertia * inertia
    # The mean of the signs is ±1 where the shaft turns one way throughout.
    signs = np.sign(speed)
    one_way = weigh(np.full(len(window.weights), 1.0 / len(window.weights)), signs, stride)
    turns = np.abs(one_way) < 1.0 - 0.5 / len(window.weights)
    added = weigh(window.weights, added, stride)
    rate = weigh(first_of(half, step), rows[:, WinchSignal.TORQUE], stride)
    view = np.lib.stride_tricks.sliding_window_view(np.abs(speed), len(window.weights))
    fastest = view[::stride].max(axis=1)
    moving = (float(np.mean(speed**2)), len(speed))
    columns = np.column_stack([inertia, added, -rate])
    return _Weak(target, columns, turns, fastest, moving)


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
    return [each.columns[:, :-1] for each in found]


def linear_effects(names: Sequence[str]) -> list[Effect]:
    """Return effects of the catalogue that are linear in their parameters and act at the shaft.

    Raises:
        InputError: one that is not among them.
    """
    known = {
        key: effect
        for key, effect in catalogue().items()
        if _is_linear(effect) and not _is_inertia(effect)
    }
    for name in names:
        if name not in known:
            raise InputError(f"effect {name} of a winch; allowed: {', '.join(known)}")
    return [known[name] for name in names]


def _is_linear(effect: Effect) -> bool:
    of_drive = effect.physics.sense is None
    at_shaft = of_drive and effect.signature.regression.channel is Channel.SHAFT
    return at_shaft and not effect.signature.nonlinear and effect.signature.coefficients is None


def _is_inertia(effect: Effect) -> bool:
    """Return whether the effect is what `inertia` already describes."""
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
    shift = np.zeros(len(estimate.values))
    absent = [p.absent or 0.0 for effect in effects for p in effect.parameters]
    shift[1 : 1 + len(absent)] = absent
    ends = estimate.ci95 + shift[:, None]
    return replace(estimate, values=estimate.values + shift, ci95=ends)
