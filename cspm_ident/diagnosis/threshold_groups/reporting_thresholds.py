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
    noise_floor_ratio: float = ratio(
        1.5,
        "Multiple of its noise up to which a residual is at the noise.",
        "White noise of 200 rows exceeds it with probability 0.001.",
    )
    immaterial_share: float = share(
        0.05,
        "Share of the measured quantity up to which a difference below the sensor's accuracy is"
        " immaterial.",
        "A usual tolerance of models for control; both limits have to hold.",
    )
