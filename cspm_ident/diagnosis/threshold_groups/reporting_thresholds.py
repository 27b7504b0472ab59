"""Thresholds of the report: probabilities and statements."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import ratio, share


@dataclass(frozen=True)
class ReportingThresholds:
    """How probable findings are, and which words state them."""

    trusted_probability: float = share(
        0.9,
        "Probability of a finding without an alternative.",
        "Sealed blind recordings, parts 4 to 8: 268 of 297 were right.",
    )
    doubtful_factor: float = share(
        0.1,
        "Factor on the probability of a doubtful finding.",
        "Sealed blind recordings: 4 of 41 were right.",
    )
    noise_floor_ratio: float = ratio(
        1.5,
        "Multiple of its noise up to which what is left of a residual is at the noise.",
        "White noise of 200 rows exceeds it with probability 0.001.",
    )
    excited_noise_ratio: float = ratio(
        3.0,
        "Multiple of its noise that a measured quantity has to exceed to judge a model by it.",
        "Three standard deviations of normal noise; below, a model of nothing is as good.",
    )
    immaterial_share: float = share(
        0.05,
        "Share of the measured quantity up to which a difference below the sensor's accuracy is"
        " immaterial.",
        "A usual tolerance of models for control; both limits have to hold.",
    )
    steady_error_share: float = share(
        0.8,
        "Share of an error below which that apart from reversals is stated beside it.",
        "Set by hand, for the statement only.",
    )
    formula_share: float = share(
        0.9,
        "Share of a free function's squares that a formula has to account for as a hint.",
        "Set by hand, for the hint only.",
    )
    formula_range_share: float = share(
        0.5,
        "Share of a signal's longer side that its shorter side needs to show a symmetry.",
        "Majority, for the hint only.",
    )
