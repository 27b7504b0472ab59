"""How significant and how large an effect is beside others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_sim.effects import Effect

Index = NDArray[np.intp]


class Significance:
    """Significance and effect size of one of many candidates."""

    def __init__(self, fits: Fits, candidates: Sequence[Candidate]) -> None:
        """Take the fits and all candidates that are tested."""
        self._fits, self._evidence, self._sums = fits, fits.gram, fits.sums
        self._tried = Counter(candidate.effect_id for candidate in candidates)

    def below(self, effect: Effect) -> float:
        """Return the p-value below which a candidate is significant.

        Each effect has an equal part of the false alarm rate, which its candidates share. So
        effects with many shapes do not mask the others (weighted Bonferroni).
        """
        rate = self._fits.thresholds.false_alarm_rate
        return rate / (self._tried[effect.id] * len(self._tried))

    def share(self, base: Index, columns: Index) -> float:
        """Return the largest share of a residual's squares that regressors take beyond a base."""
        both = np.concatenate([base, columns])
        before = self._evidence.left(base, self._sums.weights(base))
        after = self._evidence.left(both, self._sums.weights(both))
        return max(1.0 - after[place] / before[place] for place in before if before[place] > 0.0)
