"""The Brier score of reported probabilities, by bins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from bench.blind.scoring.share import Share


class Brier(NamedTuple):
    """How well probabilities say what turns out to be right.

    Attributes:
        findings: with a probability.
        score: mean square of probability less 1 where right, less 0 where wrong.
        constant: score of the share of all that are right, said of each.
    """

    findings: int
    score: float
    constant: float


def brier_of(bins: Sequence[tuple[float, Share]]) -> Brier | None:
    """Return the score of bins, each with the mean probability and the share that was right.

    Within a bin each finding counts as if it had the mean (Brier, Monthly Weather Review 78, 1950).
    None without findings.
    """
    cases = sum(own.cases for _, own in bins)
    if not cases:
        return None
    right = sum(own.hits for _, own in bins)
    squares = sum(
        own.hits * (1.0 - said) ** 2 + (own.cases - own.hits) * said**2 for said, own in bins
    )
    return Brier(cases, squares / cases, right / cases * (1.0 - right / cases))
