import numpy as np
import pytest
from estimation_samples import first_order

from cspm_ident.estimation import Interval, Parameter, Prior, Problem, Record, fit, fit_linear
from cspm_ident.estimation.identifiability import find_excitation

NAMES = ("bar mass", "hoist stiffness", "damping", "offset")


def parameters(**priors):
    return [
        Parameter(name, "1", scale=1.0, prior=priors.get(name.replace(" ", "_"))) for name in NAMES
    ]


def experiment(rng, join, deviation=0.05):
    """Regressors of which the second is `join` times the first, plus as much as is passed."""
    time = np.arange(1500.0)
    first = np.sin(0.07 * time)
    columns = [first, join(first, time), np.cos(0.031 * time), np.ones_like(time)]
    regressors = np.stack(columns, axis=1)
    noise = first_order(rng, 1500, 0.8, deviation)
    return Record(regressors @ np.array([1.0, 0.5, -0.7, 0.2]) + noise, regressors)


@pytest.mark.parametrize("interval", list(Interval))
def test_only_a_combination_is_seen(interval):
    """m and k act as −0.98·m + k: along m + 0.98 k nothing changes. The rest is as without k."""
    record = experiment(np.random.default_rng(1), lambda first, _: -first / 0.98)
    found = fit_linear([record], parameters(), interval=interval).estimate
    assert [direction.name for direction in found.unexcited] == ["bar mass + 0.98 hoist stiffness"]
    assert found.unexcited[0].sd == np.inf
    for name in NAMES[:2]:
        assert found.interval(name) == (-np.inf, np.inf)
    reduced = Record(record.target, record.regressors[:, :, [0, 2, 3]])
    known = [parameters()[i] for i in (0, 2, 3)]
    alone = fit_linear([reduced], known, interval=interval).estimate
    for name in NAMES[2:]:
        assert found.value(name) == pytest.approx(alone.value(name), abs=0.02 * alone.sd[1])
        # The bootstrap draws other directions of the same space: 1000 replicates give 5 %.
        np.testing.assert_allclose(found.interval(name), alone.interval(name), rtol=0.02)
    assert np.isnan(found.correlation[0]).all()
    assert np.isfinite(found.correlation[2:, 2:]).all()


def test_sign_of_the_combination_is_reported():
    record = experiment(np.random.default_rng(2), lambda first, _: 2.0 * first)
    found = fit_linear([record], parameters()).estimate
    assert found.unexcited[0].name == "bar mass − 0.5 hoist stiffness"
    assert dict(found.unexcited[0].weights) == pytest.approx(
        {"bar mass": 1.0, "hoist stiffness": -0.5}
    )


def test_what_is_not_excited_does_not_move():
    """The start is kept along it, so that other parameters are not driven to compensate."""
    record = experiment(np.random.default_rng(3), lambda first, _: first)
    start = np.array([3.0, 1.0, 0.0, 0.0])
    found = fit_linear([record], parameters(), start).estimate
    assert found.values[0] - found.values[1] == pytest.approx(2.0, abs=1e-9)
    assert found.values[:2].sum() == pytest.approx(1.5, abs=5 * found.sd[2])


def test_excited_means_known_better_than_a_scale():
    """The same data, once with a difference that the noise hides and once with one it does not."""
    for share, seen in ((1e-4, False), (1.0, True)):
        record = experiment(
            np.random.default_rng(4), lambda first, time, s=share: first + s * np.sin(0.3 * time)
        )
        found = fit_linear([record], parameters()).estimate
        assert (found.unexcited == ()) is seen
        assert np.isfinite(found.sd).all() is np.bool_(seen)
        if not seen:
            assert found.unexcited[0].name == "bar mass − hoist stiffness"
            assert 1.0 < found.unexcited[0].sd < np.inf


def test_a_prior_excites_nothing():
    """It holds the value; the interval still says that the data is silent."""
    record = experiment(np.random.default_rng(5), lambda first, _: first)
    found = fit_linear([record], parameters(bar_mass=Prior(1.0, 0.01))).estimate
    assert found.interval("bar mass") == (-np.inf, np.inf)
    assert len(found.unexcited) == 1


def test_two_unseen_directions_get_a_name_each():
    rng = np.random.default_rng(6)
    seen = rng.standard_normal((200, 3))
    jacobian = np.column_stack([seen[:, 0], np.zeros(200), seen[:, 1], seen[:, 1]])
    found = find_excitation(100.0 * jacobian, parameters(), 1e-12)
    assert sorted(direction.name for direction in found.directions) == [
        "damping − offset",
        "hoist stiffness",
    ]
    assert found.unknown.tolist() == [False, True, True, True]
    assert found.basis.shape == (4, 2)


def test_scales_decide_what_matters_not_units():
    """In grams the column is a thousand times smaller, and the scale as much larger."""
    rng = np.random.default_rng(7)
    jacobian = rng.standard_normal((300, 2)) * [20.0, 0.02]
    units = [Parameter("length", "m", scale=0.1), Parameter("mass", "g", scale=100.0)]
    assert find_excitation(jacobian, units, 1e-12).directions == ()
    coarse = [units[0], Parameter("mass", "g", scale=0.1)]
    assert [d.name for d in find_excitation(jacobian, coarse, 1e-12).directions] == ["mass"]


def test_a_product_in_a_simulated_model():
    """y = a·b·x + c: a and b are not seen one by one, c is."""
    x = np.sin(np.arange(800.0) * 0.05)
    noise = first_order(np.random.default_rng(8), 800, 0.7, 0.02)
    measured = 6.0 * x + 1.0 + noise
    chosen = [Parameter(name, "1", 0.1, 20.0, 1.0) for name in ("a", "b", "c")]
    problem = Problem(lambda t: [measured - t[0] * t[1] * x - t[2]], chosen)
    found = fit(problem, [1.0, 2.0, 0.5]).estimate
    assert len(found.unexcited) == 1
    assert {name for name, _ in found.unexcited[0].weights} == {"a", "b"}
    assert np.isinf(found.sd[:2]).all()
    assert abs(found.value("c") - 1.0) < 3.5 * found.sd[2] < 0.1
    assert found.values[0] * found.values[1] == pytest.approx(6.0, abs=0.05)
