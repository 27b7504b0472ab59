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
        "Multiple of the noise from row to row up to which an error is at the noise floor.",
        "Windows overlap: a healthy machine leaves 1.4 times that noise.",
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
