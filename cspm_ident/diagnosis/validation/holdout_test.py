"""Hold-out test: whether held-out data agree with the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, HoldOut, Rejection, Status
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import gain_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.thresholds import Thresholds

Array = NDArray[np.float64]


def holdout_tested(fits: Fits, judge: BlockGram, found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings with their hold-out outcome, rejected where they fail the test.

    A finding passes if it lowers one residual by a material share. Where held-out data excite it
    less, it has to lower all residuals together by the predicted amount. A finding that held-out
    data do not excite is not rejected here.

    Args:
        fits: those of the searched data.
        judge: Gram matrices of the held-out data.
        found: the findings; one that fails is removed from the fit of those after it. One that is
            neither confirmed nor contradicted stays in the fit, and predicts nothing.
    """
    kept = list(found)
    beside: list[Hypothesis] = []
    tested = []
    for each in found:
        own = set(each.hypothesis.candidates)
        whole = fits.values([other.hypothesis for other in kept], beside)
        outcome = _Lowered(judge, whole, own, fits.thresholds).outcome
        if outcome in (None, HoldOut.SILENT, HoldOut.UNDECIDED):
            kept.remove(each)
        if outcome is HoldOut.UNDECIDED:
            beside.append(each.hypothesis)
        tested.append(
            replace(each, status=Status.REJECTED, rejection=Rejection.HOLDOUT_TEST)
            if outcome is None
            else replace(each, holdout=outcome)
        )
    return tuple(tested)


class _Lowered:
    """Reduction of the squared residuals by one finding beside the others, by place."""

    def __init__(
        self,
        judge: BlockGram,
        whole: Mapping[Candidate, Array],
        own: set[Candidate],
        thresholds: Thresholds,
    ) -> None:
        """Take the weights of all findings, and the candidates of this one."""
        self._thresholds = thresholds
        fewer = {c: w for c, w in whole.items() if c not in own}
        opposite = {c: -w if c in own else w for c, w in whole.items()}
        places = [place.place for place in judge.places]
        left, without, against = (
            np.array([squares[place] for place in places]).reshape(len(places), judge.blocks)
            for squares in map(judge.left_by_block_with, (whole, fewer, opposite))
        )
        self._without = without.sum(axis=1)
        by_block = gain_of((without - left).sum(axis=0))
        self._taken, self._error = (without - left).sum(axis=1), by_block.error
        # The squares are quadratic in the weight: the reduction if the finding holds in full.
        self._expected = 0.5 * (left + against).sum(axis=1) - self._without

    @property
    def outcome(self) -> HoldOut | None:
        """Outcome of the hold-out test; None where the data contradict the finding."""
        if self.any_or_none and self.much:
            return HoldOut.DOMINANT if self.most else HoldOut.CONFIRMED
        if self.as_expected:
            return HoldOut.FAINT
        if self.raises:
            return None
        return HoldOut.UNDECIDED if self._should_show else HoldOut.SILENT

    @property
    def any_or_none(self) -> bool:
        """Whether the finding does not raise the squares of all residuals together."""
        return bool(self._taken.sum() >= 0.0)

    @property
    def much(self) -> bool:
        """Whether the finding lowers one residual by the share that confirms it."""
        return bool(np.any(self._taken >= self._thresholds.confirmed_share * self._without))

    @property
    def most(self) -> bool:
        """Whether the finding explains most of one residual."""
        share = self._thresholds.majority_share
        return bool(np.any(self._taken > share * self._without))

    @property
    def as_expected(self) -> bool:
        """Whether a finding without a material share in any residual lowers all as predicted.

        The predicted reduction has to be significant.
        """
        if self._could_take_much or not self._shows:
            return False
        share = self._thresholds.majority_share
        return bool(self._taken.sum() >= share * self._expected.sum())

    @property
    def raises(self) -> bool:
        """Whether the finding raises all residuals together significantly."""
        return bool(self._taken.sum() < -self._thresholds.certain_sigma * self._error)

    @property
    def _could_take_much(self) -> bool:
        return bool(np.any(self._expected > self._thresholds.material_share * self._without))

    @property
    def _should_show(self) -> bool:
        """Whether the finding would change held-out data visibly, beyond the scatter of blocks."""
        visible = self._expected.sum() > self._error
        return self._shows or bool(visible and self._could_take_much)

    @property
    def _shows(self) -> bool:
        """Whether the predicted reduction is significant against the scatter of blocks."""
        return bool(self._expected.sum() > self._thresholds.certain_sigma * self._error)
