"""Intervals of a stiffness law, from cycles that repeat each other."""

import numpy as np
import pytest

from bench.accuracy.rig_cables import SpecimenTruth, ramps
from cspm_ident.rig.branches import DOWN, UP, Branch
from cspm_ident.rig.cycle_scatter import chance_of_misfit, deviations, score_covariance
from cspm_ident.rig.flanks import find_ramps
from cspm_ident.rig.law import Law
from cspm_ident.rig.response import find_response
from cspm_ident.rig.stiffness import identify_stiffness
from cspm_ident.rig.stiffness_fit import NAMES, fit_law

TRUTH = SpecimenTruth()
LAW = Law(TRUTH.a, TRUTH.b, TRUTH.c, TRUTH.d, TRUTH.rigidity, TRUTH.floor)
CYCLES, POINTS = 4, 60


def branches(rng, noise=20.0, law=LAW, lengths=(1.25, 2.1, 3.5)):
    """Return branches of cables that obey a law, with white noise on each cycle's stiffness."""
    found = []
    for length in lengths:
        group = []
        for name in (UP, DOWN):
            tension = np.linspace(0.7, 59.0, POINTS)
            each = rng.normal(0.0, noise, (CYCLES, POINTS))
            mean = law.stiffness(tension, length) + each.mean(axis=0)
            scatter = np.stack([np.zeros_like(each), each - each.mean(axis=0)], axis=1)
            group.append(Branch(name, tension, mean, np.full(POINTS, length), scatter))
        found.append(group)
    return found


def test_scores_of_the_mean_vary_as_those_of_the_cycles_say():
    rng = np.random.default_rng(2)
    rows = rng.normal(0.0, 1.0, (POINTS, 2))
    drawn = rng.normal(0.0, 3.0, (2000, CYCLES, POINTS))
    reported = [score_covariance([each - each.mean(axis=0)], [rows]) for each in drawn]
    means = np.array([each.mean(axis=0) @ rows for each in drawn])
    np.testing.assert_allclose(np.mean(reported, axis=0), 9.0 / CYCLES * rows.T @ rows, atol=12.0)
    np.testing.assert_allclose(np.cov(means.T), 9.0 / CYCLES * rows.T @ rows, atol=20.0)


def test_a_cycle_at_another_tension_deviates_by_what_the_law_changes_there():
    tension, length = np.linspace(5.0, 20.0, 7), np.full(7, 2.1)
    scatter = np.zeros((2, 2, 7))
    scatter[0, 0], scatter[1, 0] = 0.01, -0.01
    one = Branch(UP, tension, LAW.stiffness(tension, length), length, scatter)
    steeper = LAW.stiffness(tension - 0.01, length) - LAW.stiffness(tension + 0.01, length)
    found = deviations(one, LAW)
    np.testing.assert_allclose(found[0] - found[1], steeper)
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-9)
    with pytest.raises(ValueError, match="without cycles"):
        deviations(one._replace(scatter=None), LAW)


def test_a_law_that_fits_is_distinguished_from_one_that_does_not():
    """Chance says 'no misfit' nearly always, evenly, and of a law one per cent off never."""
    rng, sizes = np.random.default_rng(3), [20.0] * 3
    chances = [chance_of_misfit(branches(rng), LAW, sizes, 0) for _ in range(300)]
    assert 0.02 < np.mean(np.array(chances) < 0.05) < 0.09
    assert 0.4 < np.mean(chances) < 0.6
    other = LAW._replace(a=1.02 * LAW.a)
    assert max(chance_of_misfit(branches(rng), other, sizes, 0) for _ in range(20)) < 1e-3


@pytest.fixture(scope="module")
def clean():
    return identify_stiffness([ramps(TRUTH, length, seed=3) for length in (1.25, 2.1, 3.5)])


@pytest.mark.slow
def test_hysteresis_is_misfit_and_noise_is_not(clean):
    truth = TRUTH._replace(dahl_force=0.4)
    loose = identify_stiffness([ramps(truth, length, seed=3) for length in (1.25, 2.1, 3.5)])
    assert clean.both.fits
    assert clean.data()["law"]["scatter_explains_residuals"] is True
    assert not loose.both.fits
    assert loose.data()["law"]["scatter_explains_residuals"] is False
    for name in NAMES:
        ends = [np.ptp(each.both.estimate.interval(name)) for each in (clean, loose)]
        assert ends[0] < ends[1]


@pytest.mark.slow
def test_what_is_taken_out_follows_the_law_that_it_is_taken_out_by(clean):
    """Along a change of the law, branches change as the derivative says."""
    seen = [find_ramps(one.specimen, 2.0) for one in clean.specimens[:1]]
    found = clean.both
    response = find_response(seen, found, 2.0)
    assert [len(each) for each in response.rests] == [2]
    # The filter rounds the bend: an asymptote one per cent lower changes what it takes by some.
    change = np.zeros(5)
    change[4] = 1.0
    own = np.abs(response.law[0][0] @ change)
    level = 1.0 / clean.specimens[0].specimen.length
    assert own.max() < level
    assert own.max() > 1e-3 * level
    alone = response.of(1)
    np.testing.assert_array_equal(alone.law[0][0], response.law[0][1])


def test_a_fit_hands_on_what_intervals_are_made_of():
    rng = np.random.default_rng(4)
    exact = fit_law(branches(rng, noise=1e-6), TRUTH.floor)
    for name, value in zip(NAMES, LAW[:5], strict=True):
        assert exact.estimate.value(name) == pytest.approx(value, rel=1e-5)
    assert len(exact.jacobians) == len(exact.sizes) == 3
    assert exact.jacobians[0][0].shape == (POINTS, 5)
