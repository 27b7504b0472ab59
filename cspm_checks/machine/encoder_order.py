"""Which encoder is of which cable, and which way it counts, as the poses say."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cspm_checks.machine.misfit import STATE, Winding, scatter
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
Places = NDArray[np.intp]
BETTER = 0.4
"""Of what is left as it is: a reversal has to leave less."""
_SIDE = 0.05
"""Of the motion's square: less than that on either side of an instant tells no direction."""
FACTORS = (1.2, 50.0)
"""Elastic cables bend the factor between encoder and length by less than the first."""


class Encoders(NamedTuple):
    """What is wrong with encoders, if that explains the lengths.

    Attributes:
        suspicions: one per fault.
        changed: how many encoders are concerned.
        left: how far lengths are apart once they are put right, (n,) [m].
    """

    suspicions: list[Suspicion]
    changed: int
    left: Array


def encoder_faults(one: Winding) -> Encoders | None:
    """Return which encoders are exchanged, reversed or off by a factor; None if that is no cause.

    Args:
        one: lengths by poses and by encoders, at least one of them wrong.
    """
    # Each at its own cable first: what changes its sign may follow another one by chance.
    return _faults(one, *_assigned(one, exchange=False)) or _faults(one, *_assigned(one))


def _faults(one: Winding, order: Places, sign: Array) -> Encoders | None:
    """Return what is wrong with encoders of an order, (n,), and signs; None if that is no cause."""
    names, limits = one.names, one.limits()
    as_is = scatter(one.lengths - one.wound)
    left = scatter(one.lengths - sign * one.wound[:, order])
    # A sign that does not fit may be one that changes.
    doubtful = (order == np.arange(len(names))) & (left > limits)
    sign[doubtful], left[doubtful] = 1.0, as_is[doubtful]
    changed = [int(i) for i in np.flatnonzero((order != np.arange(len(names))) | (sign < 0))]
    found = [
        _exchanged(names, order, i, as_is[i], left[i])
        for i in changed
        if order[i] != i and not (order[order[i]] == i and order[i] < i)
    ]
    found += _reversed(names, order, [i for i in changed if sign[i] < 0], as_is, left)
    for k in np.flatnonzero(left > limits):
        i = int(k)
        column = one.lengths[:, i], one.wound[:, i]
        fault = _reversal(one, i) or _factor(names[i], *column, float(limits[i]))
        if fault is None:
            return None
        suspicion, left[i] = fault
        found.append(suspicion)
        changed.append(i)
    return Encoders(found, len(changed), left) if found else None


def _reversed(
    names: tuple[str, ...], order: Places, which: list[int], before: Array, after: Array
) -> list[Suspicion]:
    """Return which encoders count the other way; all of them in one word."""

    def exchanged(where: str, some: list[int]) -> Suspicion:
        text = "counts the other way" if len(some) == 1 else "count the other way, all of them"
        text += f": by the poses, apart by {1e3 * before[some].max():.3g} mm (RMS) as it is, by"
        text += f" {1e3 * after[some].max():.2g} mm reversed"
        mend = {f"{STATE} position/{names[i]}": {"sign": -1.0} for i in some}
        return Suspicion(where, "reversed", text, mend=mend)

    if len(which) == len(names) > 1:
        return [exchanged(f"{STATE} position", which)]
    return [exchanged(f"{STATE} position/{names[order[i]]}", [i]) for i in which]


def _exchanged(
    names: tuple[str, ...], order: Places, i: int, before: float, after: float
) -> Suspicion:
    mine, other = (f"{STATE} position/{names[j]}" for j in (i, order[i]))
    rival = names[order[i]]
    text = f"and position/{rival} are exchanged: by the poses each follows the other's cable"
    if order[order[i]] != i:
        text = f"is of another cable: by the poses {names[i]} follows the encoder called {rival}"
    text += f" (apart by {1e3 * before:.3g} mm RMS as it is, by {1e3 * after:.2g} mm then)"
    mend = {mine: {"of": other}}
    if order[order[i]] == i:
        mend[other] = {"of": mine}
    return Suspicion(mine, "exchanged", text, mend=mend)


def _assigned(one: Winding, *, exchange: bool = True) -> tuple[Places, Array]:
    """Return the encoder that fits each cable best, (n,), and its sign; as it is where it can."""
    count = len(one.names)
    signs = np.array([1.0, -1.0])
    apart = np.stack(
        [[scatter(one.lengths[:, [i]] - s * one.wound) for i in range(count)] for s in signs],
        axis=2,
    )
    cost = apart**2
    # What is no better by more than is allowed anyhow stays as it is.
    allowed = one.limits()[:, None] ** 2
    cost[:, :, 0] += allowed * (1.0 - np.eye(count))
    cost[:, :, 1] += allowed * (1.5 - np.eye(count))
    kind = cost.argmin(axis=2)
    order = linear_sum_assignment(cost.min(axis=2))[1] if exchange else np.arange(count)
    return order, signs[kind[np.arange(count), order]]


def late_reversals(one: Winding) -> list[Suspicion]:
    """Return which encoders of those that fit most of the time count the other way near an end."""
    apart = one.lengths - one.wound
    found = []
    for i in np.flatnonzero((np.nanstd(apart, axis=0) > one.limits()) & ~one.wrong):
        fault = _reversal(one, int(i))
        if fault and fault[0].numbers["rms"] < BETTER * float(np.nanstd(apart[:, i])):
            found.append(fault[0])
    return found


def _reversal(one: Winding, i: int) -> tuple[Suspicion, float] | None:
    """Return from which instant on an encoder counts the other way, and what is then left [m]."""
    lengths, wound = one.lengths[:, i], one.wound[:, i]
    steps = np.stack([np.diff(lengths), np.diff(wound)])
    together = np.nancumsum(steps[0] * steps[1])
    balance = 2.0 * together - together[-1]
    begins = 1.0 if balance.max() >= -balance.min() else -1.0
    at = int(np.argmax(begins * balance))
    signs = begins * np.where(np.arange(len(together)) <= at, 1.0, -1.0)
    mended = np.concatenate([[0.0], np.cumsum(signs * steps[1])])
    left = float(scatter((lengths - mended)[:, None])[0])
    energy = np.cumsum(steps[1] ** 2)
    share = energy[at] / max(energy[-1], 1e-300)
    if left > one.limits()[i] or not _SIDE < share < 1.0 - _SIDE:
        return None
    second, where = float(one.bar.time[at + 1]), f"{STATE} position/{one.names[i]}"
    text = f"counts the other way {'from' if begins > 0 else 'until'} {second:.4g} s"
    text += f"{' on' if begins > 0 else ''}, by the poses, which it fits within"
    text += f" {1e3 * left:.2g} mm if it is reversed there: a line of the encoder lost?"
    remedy = "`drop` the recording from there on, or write the counts anew; check the cable"
    numbers = {"from": second, "left": left, "rms": float(np.nanstd(lengths - mended))}
    return Suspicion(where, "reversed", text, numbers, (second,), remedy), left


def _factor(
    name: str, lengths: Array, wound: Array, limit: float
) -> tuple[Suspicion, float] | None:
    """Return by which factor an encoder counts too much, and what is then left [m]."""
    known = ~np.isnan(lengths)
    about, other = lengths[known] - lengths[known].mean(), wound[known] - wound[known].mean()
    power = float(other @ other)
    factor = float(other @ about) / power if power else 0.0
    if not FACTORS[0] < max(abs(factor), 1.0 / (abs(factor) or 1e-9)) < FACTORS[1]:
        return None
    left = float(scatter((about - factor * other)[:, None])[0])
    if left > 0.5 * limit:
        return None
    text = (
        f"winds {1.0 / factor:.4g} times what the poses say: counts per turn, drum or gear ratio?"
    )
    where = f"{STATE} position/{name}"
    return Suspicion(where, "factor", text, {"factor": 1.0 / factor, "left": left}), left
