"""Whether an effect is significant and large enough to be reported."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.collinearity import chance
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_sim.effects import Effect

Index = NDArray[np.intp]


class Significance:
    """Criteria for one of many candidates to be reported: significance and effect size."""

    def __init__(self, fits: Fits, candidates: Sequence[Candidate]) -> None:
        """Take the fits and all candidates that are tested."""
        self._fits, self._evidence, self._sums = fits, fits.gram, fits.sums
        self._tried = Counter(candidate.effect_id for candidate in candidates)

    def below(self, effect: Effect, known: int = 0) -> float:
        """Return the p-value below which a candidate is significant.

        Each effect has an equal part of the false alarm rate, which its candidates share. So
        effects with many shapes do not mask the others (weighted Bonferroni). The rate increases
        with the number of findings, of which a share may be false (Benjamini and Hochberg, J. R.
        Stat. Soc. B 57(1), 1995).

        Args:
            effect: of the candidate.
            known: number of other findings.
        """
        rate = self._fits.thresholds.false_alarm_rate
        return (1 + known) * rate / (self._tried[effect.id] * len(self._tried))

    def share(self, base: Index, columns: Index) -> float:
        """Return the largest share of a residual's squares that regressors take beyond a base."""
        both = np.concatenate([base, columns])
        before = self._evidence.left(base, self._sums.weights(base))
        after = self._evidence.left(both, self._sums.weights(both))
        return max(1.0 - after[place] / before[place] for place in before if before[place] > 0.0)

    def counts(self, base: Index, hypothesis: Hypothesis, gain: Gain, known: int = 0) -> bool:
        """Return whether a hypothesis is significant beside a base and large enough to report.

        Args:
            base: indices of the regressors beside it.
            hypothesis: tested.
            gain: of the hypothesis beyond the base.
            known: number of other findings.
        """
        own, least = self._fits.own_columns(hypothesis), self._fits.thresholds.material_share
        return (
            gain.total > 0.0
            and self.share(base, own) >= least
            and self._is_sure(base, hypothesis, known)
        )

    def _is_sure(self, base: Index, hypothesis: Hypothesis, known: int) -> bool:
        parts = [self._evidence.columns_of([c]) for c in hypothesis.candidates]
        # The onset was selected among all blocks: Bonferroni correction by their number.
        tried = self._sums.blocks if hypothesis.onset else 1
        sums = self._sums
        if hypothesis.common:
            sums, base, own = self._fits.shared(base, hypothesis)
            parts = [own]
        return chance(sums, base, parts) < self.below(hypothesis.effect, known) / tried
