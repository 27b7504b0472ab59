"""Thresholds of the selection: how many effects, on which elements, since when, where."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import count, share, sigmas


@dataclass(frozen=True)
class SelectionThresholds:
    """How effects are chosen among the candidates, and what stays unknown."""

    most_effects: int = count(
        3,
        "Number of effects, beside those of a healthy machine, after which the search ends.",
        "Set by hand.",
    )
    screened_candidates: int = count(
        12,
        "Number of effects, and of pairs on one element, that are examined in each search pass.",
        "Set by hand, for computing time: those that take most alone.",
    )
    onset_blocks: int = count(
        5,
        "Blocks before an onset, in which the effect is absent; twice as many after it.",
        "Set by hand: the size is estimated after it, the absence is tested before it.",
    )
    unknown_share: float = share(
        0.15,
        "Share of a residual's squares that a free function takes to be reported as unknown.",
        "Set by hand: three times the effect size of a named effect.",
    )
    unknown_sigma: float = sigmas(
        1.5,
        "Standard errors by which a free function has to gain to be reported as unknown.",
        "Blind recordings: 1.6 and more in 20 with unknown physics, 1.4 and less in a healthy one.",
    )
    unknown_fewest_blocks: int = count(
        8,
        "Blocks from which on one of them may show something unknown by itself.",
        "One of fewer may hold half of the residual by chance.",
    )
