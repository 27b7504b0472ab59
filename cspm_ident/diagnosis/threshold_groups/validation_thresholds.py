"""Thresholds of the validation: what held-out data and instruments have to confirm."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import ratio, share


@dataclass(frozen=True)
class ValidationThresholds:
    """Which findings are accepted, and which are rejected."""

    driven_noise_ratio: float = ratio(
        10.0,
        "Multiple of its noise by which undemanded bar motion has a cause other than feedback,"
        " and a simulated cable or pose shows that something is missing.",
        "Set by hand.",
    )
    breakaway_excess_share: float = share(
        0.2,
        "Share of sliding friction by which the breakaway has to exceed it to be an alternative.",
        "Set by hand.",
    )
