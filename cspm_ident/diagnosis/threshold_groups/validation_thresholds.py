"""Thresholds of the validation: what held-out data and instruments have to confirm."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import ratio, share, sigmas


@dataclass(frozen=True)
class ValidationThresholds:
    """Which findings are accepted, and which are rejected."""

    confirmed_share: float = share(
        0.03,
        "Share of a held-out residual's squares that a finding has to take.",
        "Set by hand, below the effect size of the search.",
    )
    confirmed_expected_share: float = share(
        0.6,
        "Share of what a small finding should take of all held-out residuals that it has to take.",
        "Set by hand: a false alarm takes none of it, a true finding all; 0.6 is above the middle.",
    )
    majority_residual_share: float = share(
        0.5,
        "Share of one held-out residual's squares above which a finding is accepted in any case.",
        "Majority of a residual.",
    )
    holdout_sigma: float = sigmas(
        3.0,
        "Standard errors of the held-out blocks by which a change of their squares is certain.",
        "Two-sided level of 0.3 % of a normal deviate.",
    )
    degraded_residual_ratio: float = ratio(
        1.0,
        "Multiple of one held-out residual's squares that a rejected finding adds to it.",
        "More than doubles them.",
    )
    useful_error_share: float = share(
        0.99,
        "Share of the error without a finding to which a held-out simulation has to fall with it.",
        "Set by hand.",
    )
    instrument_sigma: float = sigmas(
        3.0,
        "Standard errors by which instruments have to confirm a finding, or may fall short of it.",
        "Two-sided level of 0.3 % of a normal deviate.",
    )
    instrument_shortfall_share: float = share(
        0.4,
        "Share of a finding that may be missing by instruments though it is well known.",
        "Set by hand: noise that is fed back adds to the least-squares weight.",
    )
    instrument_relevance_share: float = share(
        0.1,
        "Share of a finding's squares that instruments have to explain.",
        "Weak instruments: Staiger and Stock, Econometrica 65(3), 1997.",
    )
    still_noise_ratio: float = ratio(
        5.0,
        "Multiple of its noise by which a winch angle has to spread to be moving on demand.",
        "Set by hand.",
    )
    driven_noise_ratio: float = ratio(
        10.0,
        "Multiple of its noise by which undemanded bar motion has a cause other than feedback.",
        "Set by hand.",
    )
    undemanded_motion_share: float = share(
        0.1,
        "Share of the bar's motion that the demanded motion leaves, with a cause such as a hand.",
        "Set by hand.",
    )
    breakaway_excess_share: float = share(
        0.2,
        "Share of sliding friction by which the breakaway has to exceed it to be an alternative.",
        "Set by hand.",
    )
    breakaway_half_width_share: float = share(
        0.5,
        "Share of sliding friction that half an interval may have to say anything of a breakaway.",
        "Set by hand.",
    )
