"""The residuals that a finding concerns."""

from __future__ import annotations

from collections.abc import Sequence

from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut


def concerned(fit: Sequence[HeldOut], finding: Finding) -> Sequence[HeldOut]:
    """Return the residuals of a finding's own elements that improve, else all it may affect."""
    signature, elements = finding.hypothesis.effect.signature, finding.elements
    places = {r.channel for r in (signature.regression, *signature.partners)}
    fits = [f for f in fit if f.place.element in (*elements, "bar")]
    fits = [f for f in fits if f.place.channel in places] or fits or list(fit)
    own = [f for f in fits if f.place.element in elements and f.after < f.before]
    return own or fits
