"""What a peer found, as the part of `diagnosis.json` that is scored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.blind.peers.library import Library
from cspm_ident.diagnosis.regression.hypothesis import is_negligible
from cspm_ident.diagnosis.reporting.verdict import UNKNOWN, Verdict
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place

Array = NDArray[np.float64]
Weights = Mapping[Candidate, Array]


def report_of(library: Library, support: NDArray[np.intp], intervals: bool) -> dict[str, Any]:
    """Return what a regression found that kept some columns.

    Weights are those of least squares on these columns alone. What a healthy machine has as well is
    taken into account and not reported, as the diagnosis does.

    Args:
        library: residuals and columns.
        support: indices of the columns kept, of the evidence.
        intervals: report the intervals that white residuals would have.
    """
    nuisance = library.gram.nuisance
    columns = np.concatenate([nuisance, support])
    full, half = np.zeros(library.gram.width), np.zeros(library.gram.width)
    full[columns] = library.sums.weights(columns)
    half[support] = library.sums.half_width(nuisance, support)
    kept = [c for c in library.candidates if np.isin(_own(library, c), support).any()]
    weights = {c: full[_own(library, c)] for c in kept}
    widths = {c: half[_own(library, c)] for c in kept} if intervals else {}
    groups: dict[str, list[Candidate]] = {}
    for candidate in kept:
        groups.setdefault(candidate.effect_id, []).append(candidate)
    reported = [g for g in groups.values() if not is_negligible({c: weights[c] for c in g})]
    ranked = sorted(reported, key=lambda group: -_worth(library, columns, group))
    findings = [_finding(group, weights, widths) for group in ranked]
    return report(_verdict(ranked), findings, fits(library, left_with(library, weights)))


def report(
    verdict: Verdict, findings: Sequence[Mapping[str, Any]], reported: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return the parts of `diagnosis.json` that are scored."""
    return {"verdict": verdict.value, "findings": list(findings), "residuals": list(reported)}


def left_with(library: Library, weights: Weights) -> dict[Place, float]:
    """Return the root mean square of each residual that was not searched, over its noise."""
    judge = library.judge_evidence
    rows = {place.place: max(1.0, float(place.rows.sum())) for place in judge.places}
    given: dict[Candidate | Driver, Array] = {}
    given.update(weights.items())
    left = judge.left_with(given)
    return {place: float(np.sqrt(max(0.0, each) / rows[place])) for place, each in left.items()}


def fits(library: Library, after: Mapping[Place, float]) -> list[dict[str, Any]]:
    """Return how residuals that were not searched fall to what is left `after`."""
    described, tuned = left_with(library, {}), left_with(library, retuned_weights(library))
    return [
        {
            "channel": f"{place.channel.name.lower()}/{place.element}",
            "held_out": {
                "nrmse_before": before,
                "nrmse_retuned_nominal": tuned[place],
                "nrmse_after": after.get(place, before),
                "noise_floor": 1.0,
            },
        }
        for place, before in described.items()
    ]


def retuned_weights(library: Library) -> dict[Candidate, Array]:
    """Return the file's own numbers, all fitted to what was searched."""
    own = [c for c in library.candidates if c.effect.physics.alter is not None]
    fitted = library.sums.weights(library.gram.with_nuisance(own))
    return library.gram.parted(own, fitted)


def unknown_finding(block: str, element: str, driver: str) -> dict[str, Any]:
    """Return that something is missing, without a name for it."""
    return {
        "subsystem": block,
        "elements": [element],
        "effect": UNKNOWN,
        "probability": None,
        "onset_s": None,
        "region": {"driver": driver},
        "parameters": [],
        "alternatives": [],
    }


def _own(library: Library, candidate: Candidate) -> NDArray[np.intp]:
    return library.gram.columns_of([candidate])


def _worth(library: Library, columns: NDArray[np.intp], group: Sequence[Candidate]) -> float:
    """Return by how much more is left without an effect."""
    own = library.gram.columns_of(group)
    return library.sums.squares_of(columns[~np.isin(columns, own)])


def _finding(group: Sequence[Candidate], weights: Weights, widths: Weights) -> dict[str, Any]:
    effect = group[0].effect
    return {
        "subsystem": effect.block.value,
        "elements": sorted({c.element for c in group}),
        "effect": effect.id,
        "probability": None,
        "onset_s": None,
        "region": {},
        "parameters": [p for c in group for p in _parameters(c, weights[c], widths.get(c))],
        "alternatives": [],
    }


def _parameters(candidate: Candidate, weights: Array, half: Array | None) -> list[dict[str, Any]]:
    values, low, high = (
        candidate.effect.values((weights + sign * (0.0 if half is None else half)).tolist(),
                                **candidate.nonlinear)
        for sign in (0.0, -1.0, 1.0)
    )  # fmt: skip
    return [
        {
            "element": candidate.element,
            "name": name,
            "value": value,
            "ci95": sorted((low[name], high[name])) if low[name] != high[name] else None,
        }
        for name, value in values.items()
    ]


def _verdict(reported: Sequence[Sequence[Candidate]]) -> Verdict:
    if not reported:
        return Verdict.CONSISTENT
    numbers = all(group[0].effect.physics.alter is not None for group in reported)
    return Verdict.PARAMETER if numbers else Verdict.EFFECT
