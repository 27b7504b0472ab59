"""Thresholds of the regression: significance, collinearity, model-form error."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import count, quantity, share, sigmas


@dataclass(frozen=True)
class RegressionThresholds:
    """When an effect is significant, and when two explain the same."""

    false_alarm_rate: float = share(
        0.01,
        "Probability that a search of a healthy machine reports any effect.",
        "Weighted Bonferroni over effects and elements; Benjamini and Hochberg (1995) beside"
        " others.",
    )
    material_share: float = share(
        0.05,
        "Share of a residual's squares that an effect has to take to be reported.",
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
    rival_gain_share: float = share(
        0.5,
        "Share of a gain that counts as most of it, when explanations are compared.",
        "Majority: what loses more is no alternative, whatever the scatter of blocks.",
    )
    collinear_share: float = share(
        0.95,
        "Share of the squares of regressors from which on others span them.",
        "Variance inflation of 20; a usual limit is 10.",
    )
    timing_collinear_share: float = share(
        0.9,
        "Share of the squares of a delay's regressors from which on other delays span them.",
        "Variance inflation of 10: readings are noisier than laws.",
    )
    nested_share: float = share(
        0.999,
        "Share of the squares of regressors from which on they are a special case of others.",
        "Identity but for rounding and single precision of the columns.",
    )
    parsimony_gain_share: float = share(
        0.1,
        "Share of a gain below which no onset and no further parameter is worth reporting.",
        "Set by hand.",
    )
    schwarz_most_pairs: int = count(
        20,
        "Pairs of blocks that Schwarz's criterion counts at most.",
        "In longer recordings model-form error decides, not noise.",
    )
    dominant_block_share: float = share(
        0.5,
        "Share of the information on an effect above which a single block is left out of its test.",
        "Majority: such a block outweighs all others, and nothing repeats what it shows.",
    )
    block_correlation_limit: float = share(
        0.8,
        "Largest correlation of successive blocks that intervals allow for.",
        "Set by hand: few blocks determine no longer memory.",
        high=0.99,
    )
    interval_least_freedom: float = quantity(
        0.1,
        "degrees of freedom",
        "Degrees of freedom below which a parameter has no interval.",
        "Student's factor exceeds 10¹² there: a single pair of blocks determines the parameter.",
        low=1e-3,
    )
    doubtful_share: float = share(
        0.1,
        "Share of a finding's gain that unexplained residual has to exceed to make it doubtful.",
        "In blind recordings no finding was right (of 7) beside so much.",
    )
    onset_sigma: float = sigmas(
        3.0,
        "Standard errors by which an effect with an onset has to explain more than one without.",
        "Largest of some 48 normal deviates by chance, one per block.",
    )
    extent_sigma: float = sigmas(
        2.0,
        "Standard errors by which an unlikely extent has to explain more than a likely one.",
        "Set by hand: two-sided level of about 5 %.",
    )
    spectrum_end_share: float = share(
        0.99,
        "Share of the longest observable time constant below which a memory is seen to end.",
        "Identity but for rounding of the grid.",
    )
    spread_element_share: float = share(
        0.5,
        "Share of the elements from which on an effect is as likely on all of them.",
        "Majority of three or more elements.",
    )
