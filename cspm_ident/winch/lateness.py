"""How long before its stamp a winch's reported torque acted, from the motion that it makes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.winch.identification import (
    LATENESS,
    WinchFit,
    identify_winch,
    linear_effects,
    winch_records,
)
from cspm_ident.winch.recording import WinchSignals
from cspm_ident.winch.weak_form import HALF_WIDTH_S

Array = NDArray[np.float64]

# How far is searched, in half widths of a window, and in what steps: the residual's minimum over
# the age is as wide as a window.
_WIDEST = 6
_STEP = 0.5
_ROUNDS = 8
_STILL_S = 1e-6
# Of the residual's RMS: friction that the equation lacks is also late or early by some time, but
# then the larger part of the residual stays. 0.7 of the RMS is half of its variance.
_EXPLAINED = 0.7
# Of the time between two torques: a drive holds its torque for an unknown part of it.
_HELD = 0.5


class Lateness(NamedTuple):
    """A torque that the motion follows at another instant than its stamp says.

    Attributes:
        age: how long before its stamp the torque acted [s].
        ci95: of `age` [s].
        stated: the age that the fit was given [s].
        error: residual of the torque equation with the stated age and with this one [%].
    """

    age: float
    ci95: tuple[float, float]
    stated: float
    error: tuple[float, float]


def lateness_of(
    signals: Sequence[WinchSignals],
    effects: Sequence[str],
    *,
    reversals: bool = True,
) -> Lateness | None:
    """Return how late a winch's torque is, or None where its stamps agree with the motion.

    The residual is computed over a grid of ages; about its minimum, Gauss-Newton steps follow with
    the torque's rate as one more regressor. It is reported if each half of the data has its minimum
    there, if its 95 % interval excludes the stated age by more than a drive may hold its torque,
    and if it explains a material share of what the stated age leaves.

    Args:
        signals: readings of one winch, one entry per recording, all of one torque age.
        effects: see `identify_winch`.
        reversals: see `identify_winch`.

    Raises:
        InputError: see `identify_winch`.
    """
    stated = signals[0].torque_age
    step = _STEP * max(HALF_WIDTH_S, 2.0 * signals[0].angle.interval)
    count = round(_WIDEST / _STEP)
    ages = stated + step * np.arange(-count, count + 1)
    left = [_left(at_age(signals, age), effects, reversals=reversals) for age in ages]
    best, *halves = np.argmin(left, axis=0).tolist()
    if best in (0, len(ages) - 1) or any(abs(half - best) > 1 for half in halves):
        return None
    age = float(ages[best])
    for _ in range(_ROUNDS):
        fit = identify_winch(at_age(signals, age), effects, reversals=reversals, lateness=inf)
        change = float(np.clip(fit.estimate.value(LATENESS), -step, step))
        age += change
        if abs(change) < _STILL_S:
            break
    low, high = fit.estimate.interval(LATENESS)
    before = identify_winch(signals, effects, reversals=reversals).error
    found = Lateness(age, (age + low - change, age + high - change), stated, (before, fit.error))
    return found if _is_late(found, signals[0].torque.interval) else None


def fit_beside_lateness(
    signals: Sequence[WinchSignals], effects: Sequence[str], *, reversals: bool
) -> WinchFit:
    """Return the fit whose intervals hold that nobody knows when within a period a torque acts.

    A drive reports it at the beginning, in the middle or at the end of the time in which it acted,
    or a sample later: its lateness is uniform over a period to either side.

    Args:
        signals: see `identify_winch`; about their torque age.
        effects: see `identify_winch`.
        reversals: see `identify_winch`.

    Raises:
        InputError: see `identify_winch`.
    """
    spread = signals[0].torque.interval / sqrt(3.0)
    fit = identify_winch(signals, effects, reversals=reversals, lateness=spread)
    return fit._replace(estimate=fit.estimate.without(LATENESS))


def at_age(signals: Sequence[WinchSignals], age: float) -> list[WinchSignals]:
    """Return the signals with another age of the torque [s]."""
    return [replace(each, torque_age=age) for each in signals]


def _is_late(found: Lateness, interval: float) -> bool:
    (low, high), (before, after) = found.ci95, found.error
    apart = max(low - found.stated, found.stated - high)
    held = abs(found.age - found.stated) <= _HELD * interval
    return apart > 0.0 and not held and after < _EXPLAINED * before


def _left(signals: Sequence[WinchSignals], effects: Sequence[str], *, reversals: bool) -> Array:
    """Return the squared torque that least squares leave at an age: in all, and in each half."""
    records = winch_records(signals, linear_effects(effects), HALF_WIDTH_S, reversals=reversals)
    target = np.concatenate([record.target[:, 0] for record in records])
    columns = np.concatenate([record.regressors[:, 0] for record in records])
    middle = len(target) // 2
    parts = (slice(None), slice(0, middle), slice(middle, None))
    return np.array([_unexplained(target[part], columns[part]) for part in parts])


def _unexplained(target: Array, columns: Array) -> float:
    found = np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sum((target - columns @ found) ** 2) / max(len(target), 1))
