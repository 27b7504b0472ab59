"""A black box: boosted trees that learn each residual from the signals about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from bench.blind.peers.library import Library
from bench.blind.peers.report import fits, report, unknown_finding
from cspm_ident.diagnosis.reporting.verdict import Verdict
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Block, Channel

Array = NDArray[np.float64]

# Less of the squares that were not fitted is not reported.
MATERIAL_SHARE = 0.1
_FITTED_SHARE = 0.75
_BLOCKS = {
    Channel.DRIVE: Block.WINCH,
    Channel.SHAFT: Block.WINCH,
    Channel.TENSION: Block.CABLE,
    Channel.WRENCH: Block.BAR,
}


def diagnosis_of(library: Library) -> dict[str, Any]:
    """Return where trees learn something that holds later on as well (Friedman 2001)."""
    searched, judge = _by_place(library.searched), _by_place(library.judge)
    reported = {place: _learnt(*rows) for place, rows in searched.items()}
    ranked = sorted(reported, key=lambda place: -reported[place])
    findings = [
        unknown_finding(_BLOCKS[place.channel].value, place.element, "signals")
        for place in ranked
        if reported[place] >= MATERIAL_SHARE
    ]
    after = {
        place: _after(*searched[place], *rows) for place, rows in judge.items() if place in searched
    }
    verdict = Verdict.UNKNOWN if findings else Verdict.CONSISTENT
    return report(verdict, findings, fits(library, after))


def _by_place(equations: Sequence[Equation]) -> dict[Place, tuple[Array, Array]]:
    """Return signals (k, s) and residual (k, channels) of each place, time left out."""
    found: dict[Place, list[tuple[Array, Array]]] = {}
    for equation in equations:
        signals = [v for name, v in equation.signals.items() if not name.startswith("time")]
        if len(equation.times) and signals:
            rows = np.stack(signals, axis=1), equation.left
            found.setdefault(equation.place, []).append(rows)
    return {
        place: (np.vstack([x for x, _ in parts]), np.vstack([y for _, y in parts]))
        for place, parts in found.items()
    }


def _learnt(signals: Array, residual: Array) -> float:
    """Return the share of the squares of the last quarter that the first three predict."""
    cut = round(_FITTED_SHARE * len(signals))
    left = residual[cut:] - _predicted(signals[:cut], residual[:cut], signals[cut:])
    return 1.0 - float(np.sum(left**2) / max(np.sum(residual[cut:] ** 2), 1e-300))


def _after(signals: Array, residual: Array, later: Array, target: Array) -> float:
    left = target - _predicted(signals, residual, later)
    return float(np.sqrt(np.mean(left**2)))


def _predicted(signals: Array, residual: Array, later: Array) -> Array:
    columns = [
        HistGradientBoostingRegressor(random_state=0, early_stopping=False, max_iter=50)
        .fit(signals, column)
        .predict(later)
        for column in residual.T
    ]
    return np.stack(columns, axis=1)
