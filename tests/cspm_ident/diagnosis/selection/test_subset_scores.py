"""Predictions of subsets, against least squares over rows."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.side_by_side import side_by_side
from cspm_ident.diagnosis.selection.subset_scores import FOLDS, SubsetScores, subsets_of
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 1.0
EFFECTS = [catalogue()[f"winch_{n}"] for n in ("coulomb_friction", "viscous_friction", "inertia")]
NAMES = ("a", "b")


def equations(nuisance=True):
    """Two shafts with three regressors each, of which two act, and an unknown start."""
    rng, found = np.random.default_rng(4), []
    times = STEP * np.arange(ROWS)
    for name in NAMES:
        waves = rng.standard_normal((ROWS, 3))
        target = waves @ (0.5, 0.2, 0.0) + 3.0 * nuisance + 0.3 * rng.standard_normal(ROWS)
        columns = {
            Candidate(effect, name): waves[:, k, None, None] for k, effect in enumerate(EFFECTS)
        }
        start = np.ones((ROWS, 1, 1)) if nuisance else np.zeros((0, 0, 0))
        place = Place(Channel.SHAFT, name)
        given = place, times, target[:, None], columns, target[:, None]
        found.append(Equation(*given, nuisance=start))
    return found


def scores(own, nuisance=True, free=None):
    gram = gather([own], BLOCK_S)
    every = [Hypothesis(e, (Candidate(e, name),)) for name in NAMES for e in EFFECTS]
    return SubsetScores(side_by_side(gram, [], free or every))


def predicted(own, chosen, nuisance):
    """Σ residual² of each place and block, by least squares over the rows of other folds."""
    blocks = (np.arange(ROWS) * STEP // BLOCK_S).astype(int)
    found = np.zeros((len(own), blocks[-1] + 1))
    for fold in np.array_split(np.arange(blocks[-1] + 1), FOLDS):
        inside = (blocks >= fold[0]) & (blocks <= fold[-1])
        others = (blocks < fold[0] - 1) | (blocks > fold[-1] + 1)
        for i, each in enumerate(own):
            columns = [
                v[:, 0] for c, v in each.columns.items() if (c.effect.id, c.element) in chosen
            ]
            table = np.concatenate([np.zeros((ROWS, 0)), *columns], axis=1)
            beside = np.ones((ROWS, int(nuisance)))
            both = np.hstack([table, beside])
            fitted = np.linalg.lstsq(both[others], each.target[others, 0], rcond=None)[0]
            left = each.target[:, 0] - table @ fitted[: table.shape[1]]
            left = left - nuisance * left[inside].mean()
            found[i] += np.bincount(blocks[inside], left[inside] ** 2, len(found[i]))
    return found


@pytest.mark.parametrize("nuisance", [True, False])
@pytest.mark.parametrize("subset", [(), (0,), (0, 1), (0, 4), (1, 2, 3)])
def test_predictions_are_those_of_least_squares_over_rows(subset, nuisance):
    own = equations(nuisance)
    every = [(e.id, name) for name in NAMES for e in EFFECTS]
    expected = predicted(own, [every[k] for k in subset], nuisance)
    found = scores(own)
    np.testing.assert_allclose(found.squares_at([subset])[0], expected, rtol=1e-6)
    assert found.squares([subset])[0] == pytest.approx(expected.sum(), rel=1e-6)


def test_weights_of_elements_that_share_them_are_those_of_their_sum():
    own = equations()
    shared = Hypothesis(EFFECTS[0], tuple(Candidate(EFFECTS[0], n) for n in NAMES), common=True)
    ((weight,),) = scores(own, free=[shared]).weights([(0,)])
    apart = [w[0] for (w,) in scores(own).weights([(0,), (3,)])]
    assert min(apart) < weight[0] < max(apart)
    assert weight[0] == pytest.approx(0.5, abs=0.02)


def test_a_regressor_that_begins_late_is_silent_before():
    own = equations()
    late = Hypothesis(EFFECTS[0], (Candidate(EFFECTS[0], "a"),), onset=12)
    found = scores(own, free=[late])
    ((weight,),) = found.weights([(0,)])
    half = own[0].times >= 12.0 * BLOCK_S
    column = own[0].columns[late.candidates[0]][:, 0, 0] * half
    table = np.column_stack([column, np.ones(ROWS)])
    assert weight[0] == pytest.approx(np.linalg.lstsq(table, own[0].target[:, 0], rcond=None)[0][0])


def test_subsets_are_all_but_those_of_which_one_contains_another():
    spans = np.eye(3)
    assert len(subsets_of(3, 3, spans, 0.999)) == 8
    spans[0, 1] = 0.9995
    assert subsets_of(3, 3, spans, 0.999) == [(), (0,), (1,), (2,), (0, 2), (1, 2)]
    assert subsets_of(3, 1, spans, 0.999) == [(), (0,), (1,), (2,)]
