"""What findings leave of the residuals that they concern, beside what they explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut


def concerned(fit: Sequence[HeldOut], finding: Finding) -> Sequence[HeldOut]:
    """Return the residuals of a finding's own elements that improve, else all it may affect."""
    signature, elements = finding.hypothesis.effect.signature, finding.elements
    places = {r.channel for r in (signature.regression, *signature.partners)}
    fits = [f for f in fit if f.place.element in (*elements, "bar")]
    fits = [f for f in fits if f.place.channel in places] or fits or list(fit)
    own = [f for f in fits if f.place.element in elements and f.after < f.before]
    return own or fits


def rest_share(fit: Sequence[HeldOut], thresholds: Thresholds = DEFAULT_THRESHOLDS) -> float:
    """Return what is left of residuals beyond their noise, as a share of what the findings take.

    Both are squares on held-out data, in multiples of the noise of each residual. It is 0 where
    all is at the noise.

    Args:
        fit: residuals with and without the findings.
        thresholds: what counts as noise.
    """
    left = sum(_rest(each, thresholds) for each in fit)
    taken = sum(max(0.0, each.before**2 - each.after**2) / _square(each.noise) for each in fit)
    return left / max(taken, 1e-300)


def _rest(fit: HeldOut, thresholds: Thresholds) -> float:
    known = [each for each in fit.remainders if each.is_judged]
    beyond = [
        0.0 if each.is_at_noise(thresholds) else each.excess**2 / _square(each.noise)
        for each in known
    ]
    return float(np.mean(beyond)) if beyond else 0.0


def _square(noise: float) -> float:
    return max(noise**2, 1e-300)
