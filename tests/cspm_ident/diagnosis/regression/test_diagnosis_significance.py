"""How sure an effect has to be, and when several elements have it from one cause."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, Gain
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    boldness,
    is_seen_to_begin,
    is_spread,
    may_be_none,
    unusual,
)
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.free_shapes import Driver, Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 0.5
DRY, WET = (catalogue()[f"winch_{name}_friction"] for name in ("coulomb", "viscous"))
LATE = catalogue()["pose_delay"]
NAMES = ("one", "two")
RATE = DEFAULT_THRESHOLDS.false_alarm_rate


def winches(second, hum=2.0, effect=DRY, noise=0.05, seed=3):
    """Two elements, the first with 0.3 of an effect, the other with `second` and a hum."""
    rng = np.random.default_rng(seed)
    times, found = STEP * np.arange(ROWS), []
    for name, weight, loud in zip(NAMES, (0.3, second), (0.0, hum), strict=True):
        speed = np.sin(2.1 * times + len(name)) + 0.6 * np.sin(0.83 * times)
        target = weight * np.sign(speed) + noise * rng.standard_normal(ROWS)
        target = target + loud * np.sin(37.0 * times)
        columns = {Candidate(effect, name): np.sign(speed), Candidate(WET, name): speed}
        shaped = {term: values[:, None, None] for term, values in columns.items()}
        place = Place(Channel.SHAFT, name)
        found.append(Equation(place, times, target[:, None], shaped, target[:, None]))
    return found


def test_every_effect_has_an_equal_part_of_the_false_alarms():
    candidates = [Candidate(DRY, "one"), *(Candidate(WET, name) for name in NAMES)]
    gram = gather([winches(0.0)], BLOCK_S)
    significance = Significance(Fits(gram, BlockRegression(gram)), candidates)
    assert significance.below(DRY) == pytest.approx(RATE / 2)
    assert significance.below(WET) == pytest.approx(RATE / 4)
    assert significance.below(WET, known=2) == pytest.approx(3.0 * RATE / 4)
    spent = sum(significance.below(candidate.effect) for candidate in candidates)
    assert spent == pytest.approx(RATE)


def test_an_onset_is_as_much_surer_as_there_are_instants_to_begin_at():
    """Of friction in more and more of the hum: none is reported, then all but onsets, then all."""
    own, found = Candidate(DRY, "two"), []
    both = Hypothesis(DRY, (own,)), Hypothesis(DRY, (own,), onset=3)
    thresholds = replace(DEFAULT_THRESHOLDS, material_share=1e-3)
    for second in (0.03, 0.08, 0.2):
        search = Search(gather([winches(second)], BLOCK_S), thresholds=thresholds)
        base, columns = search.fits.columns([]), search.fits.gram.columns_of([own])
        gain, most = search.sums.gain(base, columns), search.significance.below(DRY)
        chance = search.sums.p_value(base, columns)
        found.append([search.significance.counts(base, each, gain) for each in both])
        assert found[-1] == [chance < most, chance < most / search.sums.blocks]
    assert found == [[False, False], [True, False], [True, True]]


@pytest.mark.parametrize(("second", "elements"), [(0.3, NAMES), (0.0, NAMES[:1])])
def test_what_is_little_on_one_element_is_reported_of_all_if_one_number_is_better(second, elements):
    """In the hum of the other winch the same friction is a tenth of the squares and less."""
    gram = gather([winches(second)], BLOCK_S)
    search = Search(gram)
    one, two = (Candidate(DRY, name) for name in NAMES)
    beside = np.append(search.fits.columns([]), gram.columns_of([one]))
    gain = search.sums.gain(beside, gram.columns_of([two]))
    assert not search.significance.counts(beside, Hypothesis(DRY, (two,)), gain)
    (named,) = search.run().findings
    assert named.hypothesis.elements == elements
    assert named.hypothesis.common is (elements == NAMES)


@pytest.mark.parametrize(("second", "hum", "common"), [(0.3, 8.0, True), (0.0, 2.0, False)])
def test_what_one_system_reads_has_one_number_unless_data_say_otherwise(second, hum, common):
    """Under a great hum nothing shows; under a lesser one the other body does not have it."""
    late, dry = (
        Search(gather([winches(second, hum, effect)], BLOCK_S)).run().findings[0].hypothesis
        for effect in (LATE, DRY)
    )
    assert late.common is common
    assert late.elements == (NAMES if common else NAMES[:1])
    assert dry.elements == NAMES[:1]


@pytest.mark.parametrize(("second", "hum", "same"), [(0.3, 1.0, True), (0.2, 0.0, False)])
def test_all_elements_may_share_a_number_only_if_their_own_agree(second, hum, same):
    search = Search(gather([winches(second, hum)], BLOCK_S))
    both = Hypothesis(DRY, tuple(Candidate(DRY, name) for name in NAMES), common=True)
    assert search.scopes.agree(both, search.fits.columns([])) is same


def test_one_element_alone_says_nothing_of_all():
    """The other's number is known too badly to contradict, and not known to be one."""
    search = Search(gather([winches(0.0, 40.0)], BLOCK_S))
    both = Hypothesis(DRY, tuple(Candidate(DRY, name) for name in NAMES), common=True)
    assert not search.scopes.agree(both, search.fits.columns([]))


def test_a_common_number_is_that_of_the_sum_of_columns():
    """Fitted by hand to both winches' rows."""
    equations = winches(0.1)
    search = Search(gather([equations], BLOCK_S))
    both = Hypothesis(DRY, tuple(Candidate(DRY, name) for name in NAMES), common=True)
    rows = [e.columns[c][:, 0] for e, c in zip(equations, both.candidates, strict=True)]
    target = np.concatenate([e.target for e in equations])
    expected = np.linalg.lstsq(np.concatenate(rows), target, rcond=None)[0]
    found = [weights for weights, _ in search.fits.weights([both]).values()]
    assert found == [pytest.approx(expected[0], rel=1e-9)] * 2
    apart = [w for w, _ in search.fits.weights([replace(both, common=False)]).values()]
    assert apart[0][0] - apart[1][0] == pytest.approx(0.2, abs=0.1)


MANY = ("a", "b", "c", "d")


def several(frictions, hums):
    """Winches of which some are too loud to show their dry friction."""
    found = []
    for k, (name, friction, hum) in enumerate(zip(MANY, frictions, hums, strict=True)):
        rng = np.random.default_rng(k)
        times = STEP * np.arange(ROWS)
        speed = np.sin(2.1 * times + k) + 0.6 * np.sin(0.83 * times)
        column = np.sign(speed)[:, None]
        target = friction * column[:, 0] + (0.05 + hum) * rng.standard_normal(ROWS)
        shaped = {Candidate(DRY, name): column[:, :, None]}
        found.append(Equation(Place(Channel.SHAFT, name), times, target[:, None], shaped, column))
    return found


@pytest.mark.parametrize(
    ("frictions", "hums", "elements"),
    [
        ((0.3, 0.3, 0.3, 0.3), (0.0, 0.0, 40.0, 40.0), MANY),
        ((0.3, 0.3, 0.0, 0.0), (0.0, 0.0, 40.0, 0.0), ("a", "b", "c")),
        ((0.3, 0.0, 0.0, 0.0), (0.0, 40.0, 40.0, 40.0), ("a",)),
    ],
)
def test_what_is_on_half_of_all_elements_is_on_those_that_may_as_well_have_it(
    frictions, hums, elements
):
    search = Search(gather([several(frictions, hums)], BLOCK_S))
    whole = Hypothesis(DRY, tuple(Candidate(DRY, name) for name in MANY))
    assert search.scopes.pruned(whole, search.fits.columns([])).elements == elements


@pytest.mark.parametrize(
    ("elements", "of", "spread"),
    [(("a", "b"), MANY, True), (("a",), MANY, False), (("a",), MANY[:2], False)],
)
def test_half_of_several_elements_is_as_good_as_all(elements, of, spread):
    one, all_of = (Hypothesis(DRY, tuple(Candidate(DRY, n) for n in e)) for e in (elements, of))
    assert is_spread(one, all_of) is spread
    other = Hypothesis(WET, tuple(Candidate(WET, name) for name in of))
    assert not is_spread(one, other)


def curved(amount, dry=0.3):
    """A winch with dry friction, and a wave along its turn that nothing in the catalogue is."""
    (equation, _) = winches(0.0, noise=0.003)
    angle = np.cumsum(equation.columns[Candidate(WET, "one")][:, 0, 0]) * STEP
    wave = amount * np.cos(9.0 * angle)[:, None]
    target = equation.target + wave + (dry - 0.3) * equation.columns[Candidate(DRY, "one")][:, 0]
    signals = {"motor angle [rad]": angle}
    columns = equation.columns | Knots().columns(equation.place, signals)
    return Equation(equation.place, equation.times, target, columns, target)


@pytest.mark.parametrize(("amount", "reported"), [(0.06, True), (0.015, False)])
def test_what_is_left_of_a_great_finding_is_no_unknown(amount, reported):
    """Findings are no truer than 7 % of their amplitude."""
    found = Search(gather([[curved(amount)]], BLOCK_S)).run()
    assert [named.hypothesis.effect for named in found.findings] == [DRY]
    assert bool(found.unexplained) is reported
    alone = Search(gather([[curved(amount, dry=0.0)]], BLOCK_S)).run()
    assert alone.unexplained


@pytest.mark.parametrize(("errors", "reported"), [(1.6, True), (1.4, False)])
def test_what_scatters_as_much_as_it_gains_is_no_unknown(monkeypatch, errors, reported):
    search = Search(gather([[curved(0.06, dry=0.0)]], BLOCK_S))
    gained = search.unexplained([])[0][1].total
    monkeypatch.setattr(BlockRegression, "gain", lambda *_: Gain(gained, gained / errors))
    assert bool(search.unexplained([])) is reported


def warming(amount):
    """A winch whose dry friction grows from nothing by `amount` of its mean, and time's hats."""
    (equation, _) = winches(0.0)
    ramp = 1.0 + amount * np.linspace(-1.0, 1.0, ROWS)
    dry = equation.columns[Candidate(DRY, "one")][:, 0, 0]
    noise = equation.target[:, 0] - 0.3 * dry
    target = (0.3 * ramp * dry + noise)[:, None]
    columns = equation.columns | Knots().columns(equation.place, {"time [s]": equation.times})
    return Equation(equation.place, equation.times, target, columns, target)


@pytest.mark.parametrize(("amount", "reported"), [(1.0, True), (0.2, False)])
def test_a_finding_whose_amount_drifts_is_doubtful(amount, reported):
    found = Search(gather([[warming(amount)]], BLOCK_S)).run()
    assert any(named.hypothesis.effect is DRY for named in found.findings)
    time = Driver(Place(Channel.SHAFT, "one"), "time [s]")
    assert (time in [driver for driver, *_ in found.unexplained]) is reported


def jerked(height):
    """A healthy winch with a jerk of 40 ms in its third block, against 0.05 N·m of noise."""
    (equation, _) = winches(0.0)
    dry = 0.3 * equation.columns[Candidate(DRY, "one")][:, 0]
    jerk = height * (np.arange(ROWS) // 4 == 30)[:, None]
    target = equation.target - dry + jerk
    columns = equation.columns | Knots().columns(equation.place, {"time [s]": equation.times})
    return Search(gather([[replace(equation, target=target, columns=columns)]], BLOCK_S))


@pytest.mark.parametrize(("height", "reported"), [(0.0, False), (0.5, False), (3.0, True)])
def test_what_shows_once_is_unknown_and_not_consistent(height, reported):
    """Unknown where it leaves more than all other blocks."""
    found = jerked(height).run()
    assert not found.findings
    assert [driver.signal for driver, *_ in found.unexplained] == ["time [s]"] * reported


@pytest.mark.parametrize(("onset", "reported"), [(1, True), (2, False), (3, False), (4, True)])
def test_a_block_within_which_something_begins_shows_nothing_unknown(onset, reported):
    search = jerked(3.0)
    (candidate,) = (c for c in search.heard if c.effect is DRY)
    begun = Hypothesis(DRY, (candidate,), onset=onset)
    assert bool(search.delayed(begun).unexplained([begun])) is reported


@pytest.mark.parametrize(("amount", "elements"), [(0.3, MANY), (0.0, ("a",))])
def test_elements_do_not_go_all_at_once_if_together_they_surely_act(amount, elements):
    """Three columns are equal, so that none of them is distinguished from another."""
    rng = np.random.default_rng(6)
    first, second = (np.sign(rng.standard_normal((ROWS, 1))) for _ in range(2))
    columns = {Candidate(DRY, "a"): first[:, :, None]}
    for name in MANY[1:]:
        own = second + 1e-4 * rng.standard_normal((ROWS, 1))
        columns[Candidate(DRY, name)] = own[:, :, None]
    target = 0.3 * first + amount * second + 0.05 * rng.standard_normal((ROWS, 1))
    place = Place(Channel.WRENCH, "bar")
    search = Search(
        gather([[Equation(place, STEP * np.arange(ROWS), target, columns, target)]], 0.5)
    )
    whole = Hypothesis(DRY, tuple(columns))
    assert search.scopes.pruned(whole, search.fits.columns([])).elements == elements


STIFFNESS, LENGTH = catalogue()["cable_stiffness"], catalogue()["cable_length_offset"]


def explained_by(columns, weights, noise=0.05):
    """One residual of the columns of some candidates, by weight."""
    rng = np.random.default_rng(8)
    target = sum(w * columns[c] for c, w in weights.items())
    target = target + noise * rng.standard_normal((ROWS, 1))
    shaped = {c: own[:, :, None] for c, own in columns.items()}
    place = Place(Channel.TENSION, "a")
    return gather([[Equation(place, STEP * np.arange(ROWS), target, shaped, target)]], BLOCK_S)


@pytest.mark.parametrize(("metres", "effect"), [(1.0, STIFFNESS), (0.01, LENGTH)])
def test_of_two_wrong_numbers_that_do_the_same_the_usual_one_is_reported(metres, effect):
    """A stiffness 10 % off, or a length that far; a length is usually a centimetre off."""
    waves = np.random.default_rng(9).standard_normal((ROWS, 1))
    stiff, long = Candidate(STIFFNESS, "a"), Candidate(LENGTH, "a")
    columns = {stiff: 10.0 * waves, long: waves / metres}
    found = Search(explained_by(columns, {stiff: -0.1})).run()
    assert [named.hypothesis.effect for named in found.findings] == [effect]
    assert found.findings[0].alternatives


def test_how_unusual_a_wrong_number_is():
    stiff, long, dry = (Candidate(e, "a") for e in (STIFFNESS, LENGTH, DRY))
    weights = {c: np.array([-0.1]) for c in (stiff, long, dry)}
    sizes = [unusual(weights, Hypothesis(c.effect, (c,))) for c in (stiff, long, dry)]
    assert sizes == pytest.approx([2.0, 10.0, 1.0])


def test_an_effect_has_one_shape_on_all_elements():
    """Each element alone would have the other shape than the one that is reported first."""
    effect, rng = catalogue()["cable_transverse_damping"], np.random.default_rng(10)
    own = {name: rng.standard_normal((ROWS, 1)) for name in ("a", "b")}
    tilt = {name: 0.3 * rng.standard_normal((ROWS, 1)) for name in own}
    shapes = {share: (("exit_share", share),) for share in (-0.5, 1.0)}
    columns = {
        Candidate(effect, name, shape): wave + share * tilt[name]
        for name, wave in own.items()
        for share, shape in shapes.items()
    }
    truth = {Candidate(effect, "a", shapes[1.0]): 2.0, Candidate(effect, "b", shapes[-0.5]): 1.0}
    (named,) = Search(explained_by(columns, truth)).run().findings
    assert sorted(named.hypothesis.elements) == ["a", "b"]
    assert {c.shape for c in named.hypothesis.candidates} == {shapes[1.0]}


@pytest.mark.parametrize(("delay", "effect"), [(1e-4, LATE), (1e-3, WET)])
def test_clocks_as_of_a_healthy_machine_come_before_what_explains_a_little_more(delay, effect):
    """What friction explains beyond the delay is a hundredth of what is left, worth no word."""
    wave, more = np.random.default_rng(11).standard_normal((2, ROWS, 1))
    late = {Candidate(LATE, body): 3e3 * wave for body in ("bar", "winch_frame")}
    wet = Candidate(WET, "a")
    columns = {**late, wet: 1e2 * (6e3 * delay * wave + 0.005 * more)}
    found = Search(explained_by(columns, {wet: 0.01})).run().findings
    assert [named.hypothesis.effect for named in found] == [effect]


def test_a_beginning_has_to_be_worth_more_than_nothing_too():
    dry = Candidate(DRY, "one")
    always, late = Hypothesis(DRY, (dry,)), Hypothesis(DRY, (dry,), onset=4)
    assert boldness(late) == boldness(late, always) > boldness(always) == 0.0
    assert boldness(late, late) == 0.0


@pytest.mark.parametrize(
    ("weights", "half", "none", "begins"),
    [
        ([0.13, -1.0], [0.33, 2.0], True, False),
        ([0.13, -1.0], [0.33, 0.9], False, True),
        ([0.13, -1.0], [0.12, 2.0], False, True),
        # Too few data for an interval say nothing against a finding, and nothing for a beginning.
        ([0.13, -1.0], [np.inf, 2.0], False, False),
        ([0.13, -1.0], [np.inf, 0.9], False, True),
        # Half an interval that is wider than all masses are.
        ([0.13, -1.0], [1e6, 2.0], False, False),
    ],
)
def test_what_may_be_none_has_only_intervals_that_hold_zero(weights, half, none, begins):
    load = Candidate(catalogue()["bar_mass"], "bar")
    wind = Candidate(catalogue()["tension_bias"], "surge_2")
    found = {
        load: (np.array(weights[:1]), np.array(half[:1])),
        wind: (np.array(weights[1:]), np.array(half[1:])),
    }
    assert may_be_none(found) is none
    assert not may_be_none({})
    # What is there all the time is reported in any case.
    always, late = (Hypothesis(load.effect, (load,), onset=block) for block in (0, 20))
    assert is_seen_to_begin(late, found) is begins
    assert is_seen_to_begin(always, found)
