"""Thresholds of the validation: what held-out data and instruments have to confirm."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import ratio, share


@dataclass(frozen=True)
class ValidationThresholds:
    """Which findings are accepted, and which are rejected."""

    confirmed_share: float = share(
        0.03,
        "Share of a held-out residual's squares that a finding has to take.",
        "Set by hand, below the effect size of the search.",
    )
    driven_noise_ratio: float = ratio(
        10.0,
        "Multiple of its noise by which undemanded bar motion has a cause other than feedback, and"
        " by which a simulated cable or bar shows that something is missing.",
        "Set by hand; ten healthy simulated recordings stay below 2.3.",
    )
    breakaway_excess_share: float = share(
        0.2,
        "Share of sliding friction by which the breakaway has to exceed it to be an alternative.",
        "Set by hand.",
    )
