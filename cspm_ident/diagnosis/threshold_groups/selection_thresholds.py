"""Thresholds of the selection: how many effects, on which elements, since when, where."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_ident.diagnosis.threshold_groups.threshold_field import count, ratio, share, sigmas


@dataclass(frozen=True)
class SelectionThresholds:
    """How effects are chosen among the candidates, and what stays unknown."""

    most_effects: int = count(
        3,
        "Number of effects, beside those of a healthy machine, after which the search ends.",
        "Set by hand.",
    )
    screened_effects: int = count(
        12,
        "Number of effects that are examined in each search pass, by their gain alone.",
        "Set by hand, for computing time.",
    )
    screened_pairs: int = count(
        8,
        "Number of pairs of effects on one element that are examined.",
        "Set by hand, for computing time.",
    )
    wider_scope_sigma: float = sigmas(
        3.0,
        "Standard errors by which more elements have to explain more than fewer.",
        "Set by hand, as for an onset: the extent is chosen among many.",
    )
    blocks_before_onset: int = count(
        5,
        "Blocks before an onset, in which the effect is absent.",
        "Set by hand.",
    )
    blocks_after_onset: int = count(
        10,
        "Blocks after an onset, in which the effect acts.",
        "Set by hand.",
    )
    onset_interval_sigma: float = sigmas(
        3.0,
        "Scatter of blocks of 0.1 s by which a time outside the onset's interval is worse.",
        "Set by hand: three standard deviations.",
    )
    agreement_half_widths: float = ratio(
        1.5,
        "Half widths of 95 % intervals within which elements have one common value.",
        "Set by hand: about three standard errors.",
    )
    masked_gain_share: float = share(
        0.99,
        "Share of a finding's gain that an effect masked by a parameter has to explain with it.",
        "Model-form error, more loosely: 10 % of the amplitude.",
    )
    masked_collinear_share: float = share(
        0.99,
        "Share of a finding's squares that a parameter spans in the residual it shows most in.",
        "Set by hand: variance inflation of 100.",
    )
    masked_significance: float = share(
        0.01,
        "p value above which either of a masked effect and its parameter may be absent.",
        "Usual level of a single test.",
    )
    unknown_share: float = share(
        0.15,
        "Share of a residual's squares that a free function takes to be reported as unknown.",
        "Set by hand: three times the effect size of a named effect.",
    )
    unknown_sigma: float = sigmas(
        1.5,
        "Standard errors by which a free function has to gain to be reported as unknown.",
        "Blind recordings: 1.6 and more in 20 with unknown physics, 1.4 and less in a healthy one.",
    )
    unknown_fewest_blocks: int = count(
        8,
        "Blocks from which on one of them may show something unknown by itself.",
        "One of fewer may hold half of the residual by chance.",
    )
    region_gain_share: float = share(
        0.9,
        "Share of a finding's gain that a region of a signal has to hold.",
        "Set by hand, for the statement only.",
    )
    region_widest_share: float = share(
        0.5,
        "Share of the data above which a region counts as everywhere.",
        "Majority, for the statement only.",
    )
    region_loss_share: float = share(
        0.1,
        "Share of the gain that bins of a signal may lose in all before no region is reported.",
        "Set by hand: with more, chance decides which bins gain.",
    )
