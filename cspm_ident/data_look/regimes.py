"""Stretches of a recording in which a winch obeys another equation than in the rest."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import Measurement
from cspm_ident.winch.recording import WinchSignals, signal_rows, winch_signals
from cspm_model.robust_statistics import difference_noise
from cspm_msgs_py.errors import InputError
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]
Stretch = tuple[float, float]

# Time that one value of the residual covers: longer than starts and stops of a winch take.
_BIN_S = 0.5
# Of the shaft's RMS speed: slower than that it may stick.
_STANDING = 0.05
# Subsets from which the law starts, and steps of concentration: with four parameters, and 40 % of
# the rows off, a subset is free of them with probability 0.13, so that all of 300 fail never.
_SUBSETS, _STEPS = 300, 10
# The smaller half of a normal distribution, |z| < 0.6745, has a root mean square of 0.378.
_HALF_TO_SIGMA = 1.0 / 0.378
# Standard deviations from bin to bin, and of the half of the bins that agrees best. One of 10⁴
# normal bins lies beyond 4; steps of friction or ripple are no normal noise, hence the double. The
# agreeing half may be of several kinds, which a gap of 3 still separates.
_APART, _BEYOND = 8.0, 3.0
# Of the torque's RMS: what is smaller moves no estimate by more than that share.
_MATERIAL = 0.25
# A shaft at rest holds any torque up to its breakaway. That is at most about twice Coulomb
# friction (Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994, table 1).
_BREAKAWAY = 2.0
# Bins in a row that make a stretch, and the gap up to which two are one.
_FEWEST_BINS, _GAP_BINS = 4, 6


class Regime(NamedTuple):
    """A stretch that does not belong to the rest.

    Attributes:
        winch: name of its cable.
        start, end: [s] after the recording's start.
        torque: median of what the winch's equation leaves in it [N·m].
        usual: standard deviation of that from bin to bin [N·m].
    """

    winch: str
    start: float
    end: float
    torque: float
    usual: float


def regimes_of(measurement: Measurement) -> list[Regime]:
    """Return the stretches in which winches obey another equation than most of the time.

    Inertia, viscous and Coulomb friction and an offset are fitted to the half of the rows that
    agrees best. Bins of half a second are then held against their own scatter;
    while the shaft is at rest, friction up to its breakaway is allowed for.

    Args:
        measurement: winches without angle and torque, or whose cable has no tension, are passed
            over.
    """
    found = []
    for name in measurement.machine.cable_names:
        try:
            signals = winch_signals(measurement, name, measurement.torque_age)
        except InputError:
            continue
        found += _regimes(name, signals)
    return found


def _regimes(name: str, signals: WinchSignals) -> list[Regime]:
    times, rows = _binned(signals)
    if len(times) < 4 * _FEWEST_BINS:
        return []
    speed = rows[:, WinchSignal.SPEED]
    moving = np.abs(speed) > _STANDING * np.sqrt(np.mean(speed**2))
    target = rows[:, WinchSignal.TORQUE] - signals.radius * rows[:, WinchSignal.TENSION]
    target = target - signals.load_torque(rows)
    columns = np.column_stack(
        [rows[:, WinchSignal.ACCELERATION], speed, np.sign(speed), np.ones(len(speed))]
    )
    if moving.sum() < 2 * columns.shape[1]:
        return []
    law = _majority_law(columns[moving], target[moving])
    left = target - columns @ law
    held = np.abs(target - law[-1]) - _BREAKAWAY * abs(law[2])
    left[~moving] = (np.sign(target - law[-1]) * np.maximum(held, 0.0))[~moving]
    usual = float(difference_noise(left[moving], 1))
    whole = float(np.sqrt(np.mean(target[moving] ** 2)))
    least = max(_APART * usual, _BEYOND * _trimmed_scale(left[moving]), _MATERIAL * whole)
    apart = np.abs(left) > least
    return [
        Regime(name, float(times[a]), float(times[b - 1]), float(np.median(left[a:b])), usual)
        for a, b in _stretches(apart)
    ]


def _majority_law(columns: Array, target: Array) -> Array:
    """Return coefficients by least trimmed squares of half of the rows.

    Source: Rousseeuw and Van Driessen, Data Min. Knowl. Disc. 12, 2006 (FAST-LTS).
    """
    rng = np.random.default_rng(0)
    half = (len(target) + columns.shape[1] + 1) // 2
    best, least = np.zeros(columns.shape[1]), np.inf
    for _ in range(_SUBSETS):
        chosen = rng.choice(len(target), columns.shape[1] + 1, replace=False)
        for _ in range(_STEPS):
            law = np.linalg.lstsq(columns[chosen], target[chosen], rcond=None)[0]
            squares = (target - columns @ law) ** 2
            before, chosen = chosen, np.argpartition(squares, half - 1)[:half]
            if len(before) == half and np.array_equal(np.sort(before), np.sort(chosen)):
                break
        if (total := float(np.sum(squares[chosen]))) < least:
            best, least = law, total
    return np.asarray(best)


def _trimmed_scale(left: Array) -> float:
    """Return the standard deviation of normal noise whose smaller half is that of `left`."""
    half = np.sort(left**2)[: (len(left) + 1) // 2]
    return float(_HALF_TO_SIGMA * np.sqrt(np.mean(half)))


def _binned(signals: WinchSignals) -> tuple[Array, Array]:
    """Return medians of times and rows over bins."""
    tables = signal_rows(signals)
    if not tables:
        return np.zeros(0), np.zeros((0, len(WinchSignal)))
    times = np.concatenate([each for each, _ in tables])
    rows = np.concatenate([each for _, each in tables])
    numbers = np.floor((times - times[0]) / _BIN_S).astype(int)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(numbers)) + 1, [len(times)]])
    pairs = list(pairwise(edges))
    return (
        np.array([np.median(times[a:b]) for a, b in pairs]),
        np.array([np.median(rows[a:b], axis=0) for a, b in pairs]),
    )


def _stretches(apart: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last-plus-one bin of each stretch, short gaps closed."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], apart, [False]]).astype(int)))
    found: list[tuple[int, int]] = []
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if found and a - found[-1][1] <= _GAP_BINS:
            found[-1] = found[-1][0], b
        else:
            found.append((a, b))
    return [(a, b) for a, b in found if apart[a:b].sum() >= _FEWEST_BINS]
