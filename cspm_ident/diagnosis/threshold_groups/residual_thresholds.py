"""Thresholds of residuals: which rows, columns and spectral lines there are."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import count, quantity, share


@dataclass(frozen=True)
class ResidualThresholds:
    """Which rows of a recording enter the residuals, and what they can show."""

    searched_share: float = share(
        0.7,
        "Share of a recording that is searched where no other recording is held out.",
        "Set by hand: about two thirds for the fit, one third for the test.",
        low=0.1,
        high=0.9,
    )
    gap_share: float = share(
        0.02,
        "Share of a recording between the searched part and the held-out part.",
        "Set by hand: 0.4 s of a recording of 20 s.",
        high=0.09,
    )
    block_count: int = count(
        48,
        "Number of blocks of time into which the searched data are cut.",
        "Set by hand: a block has to outlast the residuals' memory, and a test needs many blocks.",
        low=6,
    )
    shortest_block_s: float = quantity(
        0.5,
        "s",
        "Shortest block; a shorter recording has fewer blocks.",
        "Set by hand.",
        low=0.05,
    )
    reversal_speed_share: float = share(
        0.05,
        "Share of a shaft's RMS speed below which it may stick and its direction is noise.",
        "Set by hand: below it, dry friction may take any value up to its breakaway.",
    )
    common_acceleration_share: float = share(
        0.7,
        "Share of a regressor's square that accelerations by tensions and by poses must have in"
        " common.",
        "Set by hand; what two sensors have in common is no noise of either.",
    )
    healthy_clock_drift: float = quantity(
        2.5e-5,
        "s/s",
        "Largest drift of the load cells' clock that a healthy rig has; faster is a fault.",
        "Clocks that nothing disciplines: 25 ppm.",
    )
    line_false_alarm_rate: float = share(
        1e-3,
        "Probability that noise makes any line as high, over all frequencies and residuals.",
        "Bins of a periodogram of noise are exponential; Bonferroni over those looked at.",
    )
    line_coherence: float = share(
        0.8,
        "Coherence of a line's complex amplitude over eight pieces of the series.",
        "Set by hand: a force from outside keeps phase and size, what rings down does not.",
    )
