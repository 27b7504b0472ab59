"""Thresholds of comparison: significance, and when one number is small beside another."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import share, sigmas


@dataclass(frozen=True)
class RegressionThresholds:
    """When an effect is significant, when two explain the same, and what is much or little."""

    false_alarm_rate: float = share(
        0.01,
        "Probability that a search of a healthy machine reports any effect.",
        "Weighted Bonferroni over effects and elements; Benjamini and Hochberg (1995) beside"
        " others.",
    )
    material_share: float = share(
        0.05,
        "Share of a residual's squares that an effect has to take to be reported, and that others"
        " have to leave of its regressors.",
        "Effect size set by hand: less than 2.5 % of the residual's RMS is not reported.",
        high=0.99,
    )
    model_form_error_share: float = share(
        0.005,
        "Share of a law's gain that its form may be wrong by, so that less decides nothing.",
        "No law of the catalogue is closer than 7 % of its amplitude: 0.07² = 0.005.",
    )
    tie_sigma: float = sigmas(
        2.0,
        "Standard errors up to which two explanations differ by noise alone.",
        "Two-sided level of about 5 % of a normal deviate.",
    )
    certain_sigma: float = sigmas(
        3.0,
        "Standard errors beyond which a difference is certain: an onset, a wider extent, a change"
        " of held-out squares, what instruments confirm, a shaft or pose that moves.",
        "Two-sided level of 0.3 % of a normal deviate; the largest of some 48 by chance, one per"
        " block.",
    )
    majority_share: float = share(
        0.5,
        "Share of a whole from which on it is most of it: of a gain, a residual, the information"
        " of all blocks, the elements, the data, or what held-out data should show.",
        "Majority; halfway between a false alarm, which takes nothing, and a true finding.",
    )
    minor_share: float = share(
        0.1,
        "Share of a gain or of squares below which something is not reported beside the rest, and"
        " that has to be left for regressors not to be collinear.",
        "Variance inflation of 10; weak instruments: Staiger and Stock, Econometrica 65(3), 1997.",
    )
    whole_share: float = share(
        0.99,
        "Share of a whole from which on it counts as all of it.",
        "One per cent of the squares: 10 % of the amplitude, or the rounding of a grid.",
    )
