"""Which models are not worse than the best."""

import numpy as np
import pytest

from cspm_ident.diagnosis.selection.confidence_set import confidence_set

RATE = 0.01


def losses(apart, blocks=48, seed=0, scatter=1.0):
    """Losses of models that share what blocks have in common and differ by so much on average."""
    rng = np.random.default_rng(seed)
    common = 20.0 * rng.gamma(2.0, size=blocks)
    own = scatter * rng.standard_normal((len(apart), blocks))
    return common + own + np.array(apart)[:, None]


def test_the_best_is_always_a_member_and_a_clearly_worse_one_never():
    inside = confidence_set(losses([0.0, 2.0, 0.05]), RATE)
    assert inside.tolist() == [True, False, True]


def test_what_predicts_identically_stays_together():
    """Their difference has no scatter to be compared with."""
    same = losses([0.0])
    both = np.vstack([same, same, same + 5.0 + np.random.default_rng(1).random(48)])
    assert confidence_set(both, RATE).tolist() == [True, True, False]
    assert confidence_set(same, RATE).tolist() == [True]


def test_the_set_does_not_depend_on_the_unit_of_losses_or_the_order_of_models():
    some = losses([0.0, 0.2, 0.6, 3.0])
    inside = confidence_set(some, RATE)
    assert np.array_equal(confidence_set(1e6 * some, RATE), inside)
    assert np.array_equal(confidence_set(some[::-1], RATE)[::-1], inside)


@pytest.mark.parametrize("blocks", [12, 48])
def test_two_equal_models_are_rarely_told_apart(blocks):
    """At a rate of 5 %, in 200 draws; few blocks make the bootstrap's scatter a little small."""
    apart = [not confidence_set(losses([0.0, 0.0], blocks, k), 0.05).all() for k in range(200)]
    assert np.mean(apart) < 0.12


def test_one_loud_block_in_which_a_model_is_better_does_not_make_it_good():
    """Worse in all blocks but one, by logarithmic losses that block counts as one of many."""
    some = losses([0.0, 1.0], scatter=0.1)
    some[1, 7] -= 3.0
    assert confidence_set(some, RATE).tolist() == [True, False]
