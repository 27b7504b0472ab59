"""When a finding shows most along held-out data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.validation.residual_curves import Curve

# Length of the stretch that is looked for [s]: a reader takes in about a second at once.
STRETCH_S = 1.0


def shown_place(diagnosis: Diagnosis, finding: Finding) -> dict[str, Any] | None:
    """Return recording and middle [s] of the stretch where a finding lowers a residual most.

    None where it lowers none.
    """
    own = finding.hypothesis
    touched = (
        curve
        for curve in diagnosis.curves
        if any(c.effect_id == own.effect.id and c.element in own.elements for c in curve.touched)
    )
    curve, time = most_lowered(touched)
    if curve is None:
        return None
    judged = diagnosis.held_out or diagnosis.searched
    return {"recording": str(judged[curve.recording].path), "time_s": time}


def most_lowered(curves: Iterable[Curve]) -> tuple[Curve | None, float]:
    """Return the curve, and the middle [s] of its stretch, with the greatest explained share.

    The share is of the curve's own squared residual, so that units do not matter.
    """
    best: tuple[float, Curve | None, float] = (0.0, None, 0.0)
    for curve in curves:
        whole = float(np.sum(curve.before**2))
        if whole <= 0.0 or curve.gained <= 0.0:
            continue
        sums = np.concatenate([[0.0], np.cumsum(curve.before**2 - curve.after**2)])
        first = np.searchsorted(curve.times, curve.times - STRETCH_S)
        gained = (sums[1:] - sums[first]) / whole
        last = int(np.argmax(gained))
        # A curve that is explained as a whole shows more than a lucky stretch of another.
        value = float(gained[last]) * curve.gained
        if value > best[0]:
            middle = 0.5 * (curve.times[first[last]] + curve.times[last])
            best = value, curve, float(middle)
    return best[1], best[2]
