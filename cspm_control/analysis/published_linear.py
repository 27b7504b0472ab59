"""What chapter 6 of the thesis says of its linear model, beside both of ours."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np

from cspm_control.analysis.cable_groups import cable_groups
from cspm_control.analysis.claim import Claim, rounded
from cspm_control.analysis.gain import condition
from cspm_control.analysis.linear import (
    FREQUENCIES,
    LinearAnalyses,
    LinearAnalysis,
    SubsystemAnalysis,
)
from cspm_msgs_py.dofs import DOFS

FROZEN, EXACT = "frozen", "exact"
DECOUPLED = ("surge", "heave", "pitch", "yaw")
CONTROLLED = 5
SLOPE_ERROR = 0.05

Measure = Callable[[LinearAnalysis], float]
Row = tuple[str, str, tuple[float, float], Measure]


def linear_claims(found: LinearAnalyses, cables: tuple[str, ...]) -> list[Claim]:
    """Return the figures of sections 6-1-1 and 6-1-2.

    Where the thesis has words only, `published` says when they count as true.

    Args:
        found: of the thesis's machine, at its operating point.
        cables: its cables' names.
    """
    rows: list[Row] = [
        ("rank of Jᵀ", "5", (5.0, 5.0), lambda _: float(found.rank)),
        *_motion_rows(),
        *_tension_rows(cables),
    ]
    return [
        Claim(what, published, *ends, {FROZEN: value(found.frozen), EXACT: value(found.exact)})
        for what, published, ends, value in rows
    ]


def _motion_rows() -> list[Row]:
    return [
        ("motion, largest σ", "1719", rounded("1719"), _motion_gain(0)),
        ("motion, second lowest σ", "11", rounded("11"), _motion_gain(4)),
        ("motion, their ratio", "156", rounded("156"), lambda a: condition(a.motion.low.gains)),
        ("motion, lowest σ", "0", (0.0, 1e-6), _motion_gain(5)),
        *(
            (f"motion, relative gain of {dof}", "1.00", rounded("1.00"), _relative(dof, dof))
            for dof in DECOUPLED
        ),
        (
            "motion, relative gain of roll on sway force",
            "strong: ≥ 0.5",
            (0.5, inf),
            _relative("roll", "sway"),
        ),
        ("motion, slope at 0.1 rad/s", "−2", _slope_ends(-2), lambda a: _slope(a.motion, 0)),
        ("motion, slope at 10⁴ rad/s", "−3", _slope_ends(-3), lambda a: _slope(a.motion, -2)),
        ("slowest oscillation, rad/s", "≥ 20", (20.0, inf), lambda a: min(_oscillations(a))),
        ("fastest oscillation, rad/s", "≤ 100", (0.0, 100.0), lambda a: max(_oscillations(a))),
        ("least damping ratio", "high: ≥ 0.2", (0.2, 1.0), _least_damping),
    ]


def _tension_rows(
    cables: tuple[str, ...],
) -> list[Row]:
    return [
        ("tension, condition", "17", rounded("17"), lambda a: condition(a.tension.low.gains)),
        ("tension, slope at 0.1 rad/s", "0", _slope_ends(0), lambda a: _slope(a.tension, 0)),
        ("tension, slope at 10⁴ rad/s", "−1", _slope_ends(-1), lambda a: _slope(a.tension, -2)),
        (
            "tension, slowest oscillation, rad/s",
            "≥ 40",
            (40.0, inf),
            lambda a: min(_oscillations(a)),
        ),
        (
            "tension, fastest oscillation, rad/s",
            "≤ 90",
            (0.0, 90.0),
            lambda a: max(_oscillations(a)),
        ),
        (
            "tension, relative gain of hoists above that of others",
            "above: > 0",
            (1e-6, inf),
            lambda a: _hoist_excess(a, cables),
        ),
    ]


def _slope_ends(slope: float) -> tuple[float, float]:
    return slope - SLOPE_ERROR, slope + SLOPE_ERROR


def _motion_gain(i: int) -> Measure:
    return lambda analysis: float(analysis.motion.low.gains[i])


def _relative(output: str, wrench: str) -> Measure:
    place = DOFS.index(output), DOFS.index(wrench)
    return lambda analysis: float(analysis.motion.relative[0].real[place])


def _slope(found: SubsystemAnalysis, start: int) -> float:
    """Return decades per decade of the gains that are not zero, between two neighbours."""
    pair = [start, start + 1]
    count = min(CONTROLLED, found.gains.shape[1])
    rise = np.diff(np.log10(found.gains[pair, :count]), axis=0).mean()
    return float(rise / np.diff(np.log10(FREQUENCIES[pair]))[0])


def _oscillations(analysis: LinearAnalysis) -> list[float]:
    return [mode.frequency for mode in analysis.modes if mode.pole.imag > 0.0]


def _least_damping(analysis: LinearAnalysis) -> float:
    return min(mode.damping for mode in analysis.modes if mode.pole.imag > 0.0)


def _hoist_excess(analysis: LinearAnalysis, cables: tuple[str, ...]) -> float:
    own = np.diag(analysis.tension.relative[0]).real
    groups = {name: own[members].max() for name, members in cable_groups(cables).items()}
    return float(groups.pop("hoist") - max(groups.values()))
