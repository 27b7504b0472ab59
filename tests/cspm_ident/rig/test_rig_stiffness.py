"""The stiffness law recovered from cables that the project's plant did not make."""

from dataclasses import replace

import numpy as np
import pytest

from bench.accuracy.rig_cables import SpecimenTruth, described, ramps
from cspm_ident.rig.flanks import DOWN, UP, find_ramps
from cspm_ident.rig.hysteresis import find_hysteresis
from cspm_ident.rig.law import Law, law_of, tension_curve
from cspm_ident.rig.stiffness import MEAN, identify_stiffness
from cspm_ident.vaf import vaf
from cspm_msgs_py.errors import InputError

TRUTH = SpecimenTruth()
LENGTHS = (1.25, 2.1, 3.5)
CUTOFF = 2.0


def specimens(truth, lengths=LENGTHS, **options):
    return [ramps(truth, length, seed=3, **options) for length in lengths]


@pytest.fixture(scope="module")
def clean():
    return identify_stiffness([*specimens(TRUTH), ramps(TRUTH, 1.8, seed=3)], ["l180"])


@pytest.fixture(scope="module")
def loose():
    """With a hysteresis of 0.4 N either way."""
    return identify_stiffness(specimens(TRUTH._replace(dahl_force=0.4)))


@pytest.mark.slow
def test_the_truth_is_within_the_intervals(clean):
    # Five intervals of 95 %; wide enough to hold and narrow enough to say something.
    truth = dict(a=TRUTH.a, b=TRUTH.b, c=TRUTH.c, d=TRUTH.d, rigidity=TRUTH.rigidity)
    for name, value in truth.items():
        low, high = clean.both.estimate.interval(name)
        assert low <= value <= high, name
    low, high = clean.both.estimate.interval("b")
    assert high - low < 0.05
    assert clean.both.estimate.unexcited == ()


def test_the_modulus_comes_from_the_asymptote_of_each_length(clean):
    assert clean.both.asymptote
    for one in clean.specimens:
        value, (low, high) = one.asymptote
        # Load cells of 0.02 N, 30 N on the asymptote: parts in a thousand.
        assert value == pytest.approx(TRUTH.youngs_modulus, rel=2e-3)
        assert low < value < high
    data = clean.data()["law"]["youngs_modulus"]
    assert data["ci95"][0] < TRUTH.youngs_modulus < data["ci95"][1]


def test_a_length_not_fitted_is_predicted(clean):
    assert [one.fitted for one in clean.specimens] == [True, True, True, False]
    for one in clean.specimens:
        assert set(one.vaf) == {UP, DOWN, MEAN}
        assert min(one.vaf.values()) > 99.9
    # A law of another cable is not: the score can fail.
    one = clean.specimens[0]
    other = clean.both.law._replace(a=0.7 * clean.both.law.a)
    branch = one.branches[0]
    assert vaf(branch.stiffness, other.stiffness(branch.tension, branch.length)) < 95.0


def test_the_published_form_is_ranked_first(clean):
    assert len(clean.candidates) == 6
    assert clean.candidates[0].name == "two exponentials (3-5)"
    assert clean.candidates[-1].name == "linear"
    scores = [rank.mean for rank in clean.candidates]
    assert scores == sorted(scores, reverse=True)
    assert scores[-1] < 99.8 < scores[0]


def test_without_hysteresis_none_is_seen(clean):
    for one in clean.specimens:
        found = one.hysteresis
        assert not found.seen
        # The damper's own loop is what remains: ±B·v, known from the generator.
        expected = TRUTH.damping(one.specimen.length) * one.ramps.flanks[0].speed
        assert found.half_width == pytest.approx(expected, abs=found.limit)
        assert found.viscous == pytest.approx(expected, rel=1e-2)


@pytest.mark.slow
def test_hysteresis_is_reported_with_its_size(loose):
    for one in loose.specimens:
        found = one.hysteresis
        assert found.seen
        # Dahl's force is ±F_c but for the reversals: F = F_c·(1 − 2·exp(−x/x_c)), whose mean over
        # the stroke X is F_c·(1 − 2·x_c/X); what the ramps' ends leave out lies between.
        stroke = float(np.ptp(one.specimen.wound))
        least = 0.4 * (1.0 - 2.0 * TRUTH.dahl_scale / stroke)
        assert least - found.limit < found.half_width - found.viscous < 0.4 + found.limit
    assert loose.data()["specimens"][0]["hysteresis"]["seen"] is True


@pytest.mark.slow
def test_the_branches_are_kept_apart(loose, clean):
    """Friction holds the tension up while stretching: at one tension the cable seems softer."""
    up, down = (loose.alone[name].law for name in (UP, DOWN))
    stiffness = [float(law.stiffness(5.0, 2.1)) for law in (up, loose.both.law, down)]
    assert stiffness[0] < stiffness[1] < stiffness[2]
    truth = float(TRUTH.stiffness(5.0, 2.1))
    assert abs(stiffness[1] - truth) < min(abs(stiffness[0] - truth), abs(stiffness[2] - truth))
    # 0.4 N of 5 N where k is nearly proportional to t: several per cent either way.
    assert stiffness[2] - stiffness[0] > 0.05 * truth
    alone = [float(clean.alone[name].law.stiffness(5.0, 2.1)) for name in (UP, DOWN)]
    assert abs(alone[1] - alone[0]) < 0.02 * truth


def test_a_gap_of_the_wrong_sign_is_no_hysteresis():
    """A load cell that comes late by 20 ms lowers the tension while stretching."""
    one = ramps(TRUTH, 2.1, seed=5, cycles=3)
    late = replace(one, tension=np.concatenate([np.full(20, one.tension[0]), one.tension[:-20]]))
    found = find_hysteresis(find_ramps(late, CUTOFF))
    assert found.half_width < -5 * found.alignment
    assert not found.seen


@pytest.mark.slow
def test_an_asymptote_that_is_not_reached_is_not_made_up():
    result = identify_stiffness(specimens(TRUTH, highest=12.0))
    assert not result.both.asymptote
    assert result.data()["law"]["youngs_modulus"] is None
    assert all(one.asymptote is None for one in result.specimens)
    low, high = result.both.estimate.interval("b")
    assert low < TRUTH.b < high


def test_one_length_leaves_the_exponent_to_hooke():
    result = identify_stiffness(specimens(TRUTH, lengths=(2.1,)))
    assert result.both.estimate.frozen == ("b",)
    assert result.both.law.b == 1.0
    assert result.specimens[0].vaf[MEAN] > 99.9


def test_winding_in_must_raise_the_tension():
    """With the winding's sign inverted the ramps lie the other way round, and no law fits."""
    one = ramps(TRUTH, 2.1, seed=5, cycles=3)
    flanks = find_ramps(one, CUTOFF).flanks
    assert [flank.branch for flank in flanks] == [UP, DOWN] * 3
    assert all(flank.stiffness.min() > 0.0 for flank in flanks)
    wrong = find_ramps(replace(one, wound=-one.wound), CUTOFF).flanks
    assert all(flank.stiffness.max() < 0.0 for flank in wrong)


def test_the_filter_has_no_phase():
    """Both branches of a cable without damper and hysteresis are one curve."""
    found = find_hysteresis(
        find_ramps(ramps(TRUTH._replace(constant=0.0, slope=0.0), 2.1, seed=5), CUTOFF)
    )
    assert abs(found.half_width) < found.limit
    assert found.viscous == 0.0


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"cycles": 1}, "l210: 1 slow cycles of stretching and releasing in nowhere, allowed: at"),
    ],
)
def test_what_is_no_trapezoid_is_refused(change, line):
    with pytest.raises(InputError) as caught:
        identify_stiffness([ramps(TRUTH, 2.1, seed=1, **change)])
    assert str(caught.value).startswith(line)


def test_faults_are_one_line():
    good = ramps(TRUTH, 2.1, seed=1, cycles=2)
    with pytest.raises(InputError) as caught:
        identify_stiffness([good], ["l999"])
    assert str(caught.value) == "--verify l999: no such cable, allowed: l210"
    with pytest.raises(InputError) as caught:
        identify_stiffness([good], ["l210"])
    assert str(caught.value) == "--verify l210: leaves no cable to fit, allowed: some"
    with pytest.raises(InputError) as caught:
        identify_stiffness([good], cutoff=400.0)
    assert str(caught.value) == (
        "l210: 1e+03 Hz, allowed with a cut-off at 400 Hz: at least 1600 Hz"
    )
    thick = replace(good, label="thick", cable=described(2.1, TRUTH._replace(diameter=2e-3)))
    with pytest.raises(InputError) as caught:
        identify_stiffness([good, thick])
    assert str(caught.value) == (
        "diameters l210 1.2 mm, thick 2 mm, allowed: cables of one kind; choose with --cables"
    )


def test_vaf_is_the_thesiss():
    rng = np.random.default_rng(1)
    signal, error = rng.normal(0.0, 2.0, 10_000), rng.normal(0.0, 1.0, 10_000)
    assert vaf(signal, signal) == 100.0
    # A constant offset counts nothing, an error of a quarter of the variance 25 %.
    assert vaf(signal, signal + 3.0) == pytest.approx(100.0)
    assert vaf(signal, signal + error) == pytest.approx(
        100.0 * (1.0 - np.var(error) / np.var(signal))
    )
    assert vaf(signal, -signal) < 0.0


@pytest.mark.parametrize("tension", [0.02, 0.4, 5.0, 40.0])
def test_the_curve_is_the_laws_own_integral(tension):
    """dt/dε = k, by differences, and a straight line below the floor."""
    law = Law(TRUTH.a, TRUTH.b, TRUTH.c, TRUTH.d, TRUTH.rigidity, 0.05)
    assert law_of(described(2.1, TRUTH)).floor == 0.05
    curve = tension_curve(law, 2.1, 60.0)
    at = law.elongation(tension, 2.1)
    step = 1e-3 * at
    low, middle, high = (
        float(curve.tension(np.array(at + k * step), np.array(2.1))) for k in (-1, 0, 1)
    )
    assert middle == pytest.approx(tension, rel=1e-6)
    # The table's linear pieces are 1/2800 of a decade long.
    slope = (high - low) / (2.0 * step)
    assert slope == pytest.approx(float(law.stiffness(tension, 2.1)), rel=2e-3)
