"""Thresholds of comparison: significance, and when one number is small beside another."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import share, sigmas


@dataclass(frozen=True)
class RegressionThresholds:
    """When something is significant, when two explain the same, and what is much or little."""

    false_alarm_rate: float = share(
        0.01,
        "Share of model confidence sets that lack the best model; probability that anything unknown"
        " is reported of a healthy machine, or that an effect at its detection limit is noise.",
        "Hansen, Lunde, Nason (2011); Bonferroni over signals, effects and elements.",
    )
    material_share: float = share(
        0.05,
        "Share of a residual's squares that an effect has to take to be reported.",
        "Effect size set by hand: 2.5 % of the residual's RMS.",
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
        "Standard errors beyond which a difference is certain: an onset, a change of held-out"
        " squares, what instruments confirm, a shaft or pose that moves.",
        "Two-sided level of 0.3 % of a normal deviate; the largest of some 48 by chance, one per"
        " block.",
    )
    majority_share: float = share(
        0.5,
        "Share of a whole from which on it is most of it: of a gain, a residual, the information"
        " of all blocks, the data, another effect, or what held-out data should show.",
        "Majority; halfway between a false alarm, which takes nothing, and a true finding.",
    )
    minor_share: float = share(
        0.1,
        "Share of a gain or of squares below which something is not reported beside the rest.",
        "Variance inflation of 10; weak instruments: Staiger and Stock, Econometrica 65(3), 1997.",
    )
    whole_share: float = share(
        0.99,
        "Share of a whole from which on it counts as all of it.",
        "One per cent of the squares: 10 % of the amplitude, or the rounding of a grid.",
    )
