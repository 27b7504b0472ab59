"""A winch's equation without the effects that its recordings do not show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from cspm_ident.estimation import Estimate
from cspm_ident.winch.identification import WinchFit
from cspm_ident.winch.identified_winch import absent_value

Refit = Callable[[Sequence[str]], WinchFit]


def without_unseen(
    fit: WinchFit, effects: Sequence[str], described: Mapping[str, float], refit: Refit
) -> WinchFit:
    """Return values of the equation without effects that are none seen, with intervals of both.

    A number that is fitted beside an effect belongs to a machine that has it. Where the file does
    not get the effect, the others are fitted without it. The least certain one goes first, until
    all that are left are seen. Intervals also reach to where they are with all effects, since what
    was left out is not known to be 0.

    Args:
        fit: with all effects.
        effects: their ids.
        described: the parameters as the file has them, by the estimate's names; what it describes
            as acting is not left out.
        refit: fits inertia and some effects.
    """
    kept, found = list(effects), fit
    while gone := _least_certain(found.estimate, kept, described):
        kept.remove(gone)
        found = refit(kept)
    if len(kept) == len(effects):
        return fit
    return found._replace(estimate=_joined(fit.estimate, found.estimate))


def _least_certain(
    estimate: Estimate, effects: Sequence[str], described: Mapping[str, float]
) -> str | None:
    """Return the effect that is none seen and nearest to doing nothing; None where all are seen."""
    ratios = {}
    for effect in effects:
        own = [name for name in estimate.names if name.partition(" ")[0] == effect]
        if all(_is_unseen(estimate, name, described) for name in own):
            ratios[effect] = max(_deviations(estimate, name) for name in own)
    return min(ratios, key=lambda effect: ratios[effect], default=None)


def _is_unseen(estimate: Estimate, name: str, described: Mapping[str, float]) -> bool:
    low, high = estimate.interval(name)
    absent = absent_value(name)
    acts = described.get(name, absent) != absent
    return isfinite(low) and isfinite(high) and low <= absent <= high and not acts


def _deviations(estimate: Estimate, name: str) -> float:
    index = estimate.names.index(name)
    return float(abs(estimate.values[index] - absent_value(name)) / estimate.sd[index])


def _joined(whole: Estimate, part: Estimate) -> Estimate:
    """Return the values of `part`, else those of doing nothing, with intervals that hold both."""
    values, ends, sd = whole.values.copy(), whole.ci95.copy(), whole.sd.copy()
    correlation = np.full_like(whole.correlation, np.nan)
    places = [whole.names.index(name) for name in part.names]
    for i, name in enumerate(whole.names):
        if name not in part.names:
            values[i] = absent_value(name)
    for i, name in zip(places, part.names, strict=True):
        values[i], (low, high) = part.value(name), part.interval(name)
        sd[i] = part.sd[part.names.index(name)]
        ends[i] = min(ends[i, 0], low), max(ends[i, 1], high)
    correlation[np.ix_(places, places)] = part.correlation
    return replace(
        whole,
        values=values,
        ci95=ends,
        sd=sd,
        correlation=correlation,
        unexcited=part.unexcited,
    )
