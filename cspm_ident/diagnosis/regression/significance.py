"""Whether an effect is surely there, and worth a word."""

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
    """What it takes for one of many candidates to be told."""

    def __init__(self, fits: Fits, candidates: Sequence[Candidate]) -> None:
        """Take all candidates that are looked at."""
        self._fits, self._evidence, self._sums = fits, fits.gram, fits.sums
        self._tried = Counter(candidate.effect_id for candidate in candidates)

    def below(self, effect: Effect, known: int = 0) -> float:
        """Return how small the chance of a candidate's weights has to be for it to be sure.

        Each effect has an equal part of the false alarms, whose candidates share it, so that those
        of many shapes do not hide the others (Bonferroni, weighted). What is told beside others may
        be false as often as a part of all that is told (Benjamini and Hochberg, J. R. Stat. Soc. B
        57(1), 1995).

        Args:
            effect: of the candidate.
            known: how many others are told.
        """
        rate = self._fits.thresholds.false_alarm_rate
        return (1 + known) * rate / (self._tried[effect.id] * len(self._tried))

    def share(self, base: Index, columns: Index) -> float:
        """Return the largest share of a place's squares that columns take beyond a base."""
        both = np.concatenate([base, columns])
        before = self._evidence.left(base, self._sums.weights(base))
        after = self._evidence.left(both, self._sums.weights(both))
        return max(1.0 - after[place] / before[place] for place in before if before[place] > 0.0)

    def counts(self, base: Index, hypothesis: Hypothesis, gain: Gain, known: int = 0) -> bool:
        """Return whether a hypothesis is surely there beside a base and worth a word."""
        own, least = self._fits.own_columns(hypothesis), self._fits.thresholds.material_share
        return (
            gain.total > 0.0
            and self.share(base, own) >= least
            and self._is_sure(base, hypothesis, known)
        )

    def _is_sure(self, base: Index, hypothesis: Hypothesis, known: int) -> bool:
        parts = [self._evidence.columns_of([c]) for c in hypothesis.candidates]
        # An onset was chosen among the blocks.
        tried = self._sums.blocks if hypothesis.onset else 1
        sums = self._sums
        if hypothesis.common:
            sums, base, own = self._fits.shared(base, hypothesis)
            parts = [own]
        return chance(sums, base, parts) < self.below(hypothesis.effect, known) / tried
