"""Whether one wrong number of the test-bed file explains all that several findings do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, Status
from cspm_ident.diagnosis.judged_search import JudgedSearch
from cspm_ident.diagnosis.regression.block_comparison import behind, paired
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival, is_number
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.validation.acceptance import Acceptance
from cspm_ident.diagnosis.validation.found_model import Data, Model, modelled
from cspm_ident.diagnosis.validation.holdout_degradation import squares_left
from cspm_ident.diagnosis.validation.holdout_residuals import residuals_of
from cspm_ident.diagnosis.validation.holdout_test import holdout_tested
from cspm_ident.diagnosis.validation.materiality import accuracy_of
from cspm_ident.diagnosis.validation.remainder import independent_noise, remainders_of

Array = NDArray[np.float64]

# Numbers that are fitted about the corrected machine, the most promising first.
_TRIED = 2


def with_one_number(own: JudgedSearch, model: Model, data: Data) -> tuple[Acceptance, Model] | None:
    """Return the acceptance and model of a single wrong number instead of all findings, or None.

    Regressors hold to first order, so that a law may follow a large error of a number better than
    the number's own column does. Fitted about the corrected machine, the number has to leave all
    held-out residuals at their noise, and to predict them no worse than the findings do.

    Args:
        own: the judged search.
        model: of its findings.
        data: for fitting and validating models.
    """
    calibrated = _calibrated(own)
    beside = {(each.effect, each.elements) for each in calibrated}
    found = [each for each in model.findings if each.status is not Status.NEGLIGIBLE]
    named = [each for each in found if (each.effect, each.elements) not in beside]
    if len(named) == 1 and is_number(named[0].hypothesis):
        return None
    if _is_at_noise(own, Model((), {}) if named else model):
        return None
    before = _left(own, model, data)
    for hypothesis in _promising(own, found):
        finding = own.search.finding_of(hypothesis, [])
        tested = holdout_tested(own.search.fits, own.judge, [finding, *calibrated])[0]
        if tested.status is Status.REJECTED:
            continue
        alone = modelled(own.search, [tested, *calibrated], data)
        if alone.useless or not _is_at_noise(own, alone):
            continue
        left = _left(own, alone, data)
        worse = np.sum([left[place] - before[place] for place in before if place in left], axis=0)
        if behind(paired(worse)) > own.thresholds.tie_sigma:
            continue
        rest = tuple(each for each in own.acceptance.findings if each.status is Status.REJECTED)
        kept = replace(tested, alternatives=_with_rival(own, tested, found, worse))
        every = (kept, *calibrated)
        return Acceptance((*every, *rest)), modelled(own.search, every, data)
    return None


def _calibrated(own: JudgedSearch) -> list[Finding]:
    """Return the findings of surveyed places within their accuracy."""
    kept, fits = own.acceptance.kept, own.search.fits
    chosen = [each.hypothesis for each in kept]
    return [each for each in kept if fits.is_calibration(each.hypothesis, chosen)]


def _promising(own: JudgedSearch, found: list[Finding]) -> Iterator[Hypothesis]:
    """Yield numbers of the file that alone take most of what the findings take, to first order."""
    search = own.search
    fits, base = search.fits, search.fits.columns([])
    every = fits.columns([each.hypothesis for each in found])
    taken = fits.sums.squares_of(base) - fits.sums.squares_of(every)
    if not found:
        taken = fits.sums.squares_of(base) * own.thresholds.unknown_share
    numbers = [c for c in search.heard if c.effect.physics.alter is not None]
    gains = fits.sums.gains_beyond(base, [fits.gram.columns_of([c]) for c in numbers])
    best: dict[str, tuple[float, Candidate]] = {}
    for candidate, gain in zip(numbers, gains, strict=True):
        if gain > best.get(candidate.effect_id, (-np.inf, candidate))[0]:
            best[candidate.effect_id] = float(gain), candidate
    # The first scope holds the elements on which the effect is significant.
    scopes = [
        search.scopes.pruned(search.scopes.of(c, numbers, base)[0], base) for _, c in best.values()
    ]
    squares = [float(fits.sums.gains_beyond(base, [fits.own_columns(h)])[0]) for h in scopes]
    for k in np.argsort(squares)[::-1][:_TRIED]:
        if squares[k] >= own.thresholds.majority_share * taken and fits.is_plausible([scopes[k]]):
            yield scopes[k]


def _left(own: JudgedSearch, model: Model, data: Data) -> Mapping[Place, Array]:
    """Return the squared held-out residuals with a model, by place and block."""
    given = own.last.noise, own.last.block, own.thresholds
    return squares_left(data.baselines, model.values, *given)


def _is_at_noise(own: JudgedSearch, model: Model) -> bool:
    """Return whether a model leaves noise of all held-out residuals."""
    parts = list(zip(own.judges, own.starts, strict=True))
    noise, machine = own.last.noise, own.judges[0].machine
    for place, rows in residuals_of(parts, model.values, noise, own.thresholds).items():
        calm = [each.steady for each in rows if len(each.steady.times)]
        if not calm:
            continue
        sizes = independent_noise(calm), noise[place], accuracy_of(machine, place)
        found = remainders_of(calm, *sizes)
        if any(each.is_judged and not each.is_at_noise(own.thresholds) for each in found):
            return False
    return True


def _with_rival(
    own: JudgedSearch, number: Finding, found: list[Finding], worse: Array
) -> tuple[Rival, ...]:
    """Return the alternatives of a number, with the single finding that it replaces."""
    apart = behind(paired(-worse))
    names = {rival.hypothesis.effect.id for rival in number.alternatives}
    if len(found) != 1 or apart > own.thresholds.tie_sigma or found[0].effect in names:
        return number.alternatives
    return (*number.alternatives, Rival(found[0].hypothesis, apart))
