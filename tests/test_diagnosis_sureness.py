"""How sure an effect has to be, and when it belongs to those found on other elements."""

import numpy as np
import pytest

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.drivers import Driver, Knots
from cspm_ident.diagnosis.equation import Equation
from cspm_ident.diagnosis.evidence import gather
from cspm_ident.diagnosis.hypothesis import Hypothesis
from cspm_ident.diagnosis.search import Search
from cspm_ident.diagnosis.sums import Sums
from cspm_ident.diagnosis.sureness import FALSE_ALARMS, Sureness
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 0.5
DRY, WET = (catalogue()[f"winch_{name}_friction"] for name in ("coulomb", "viscous"))
NAMES = ("one", "two")


def winches(second, noise=0.05, seed=3):
    """Two winches, the first with 0.3 of dry friction, the other with `second` and a big hum."""
    rng = np.random.default_rng(seed)
    times, found = STEP * np.arange(ROWS), []
    for name, weight, hum in zip(NAMES, (0.3, second), (0.0, 2.0), strict=True):
        speed = np.sin(2.1 * times + len(name)) + 0.6 * np.sin(0.83 * times)
        target = weight * np.sign(speed) + noise * rng.standard_normal(ROWS)
        target = target + hum * np.sin(37.0 * times)
        columns = {Candidate(DRY, name): np.sign(speed), Candidate(WET, name): speed}
        shaped = {term: values[:, None, None] for term, values in columns.items()}
        place = Place(Channel.SHAFT, name)
        found.append(Equation(place, times, target[:, None], shaped, target[:, None]))
    return found


def test_every_effect_has_an_equal_part_of_the_false_alarms():
    candidates = [Candidate(DRY, "one"), *(Candidate(WET, name) for name in NAMES)]
    evidence = gather([winches(0.0)], BLOCK_S)
    sureness = Sureness(evidence, Sums(evidence), candidates)
    assert sureness.below(DRY) == pytest.approx(FALSE_ALARMS / 2)
    assert sureness.below(WET) == pytest.approx(FALSE_ALARMS / 4)
    spent = sum(sureness.below(candidate.effect) for candidate in candidates)
    assert spent == pytest.approx(FALSE_ALARMS)


@pytest.mark.parametrize(("second", "told"), [(0.3, True), (0.0, False), (-0.3, False)])
def test_what_agrees_with_a_finding_belongs_to_it_though_it_is_little(second, told):
    """In the hum of the other winch the same friction is a tenth of the squares and less."""
    evidence = gather([winches(second)], BLOCK_S)
    search = Search(evidence)
    one, two = (Candidate(DRY, name) for name in NAMES)
    further = Hypothesis(DRY, (two,))
    base = search.columns([])
    assert search.sureness.agrees(base, [one], further) is told
    beside = np.append(base, evidence.columns_of([one]))
    gain = search.sums.gain(beside, evidence.columns_of([two]))
    assert not search.sureness.counts(beside, further, gain)


@pytest.mark.parametrize(("second", "elements"), [(0.3, NAMES), (0.0, NAMES[:1])])
def test_a_finding_is_told_of_all_elements_that_agree(second, elements):
    (named,) = Search(gather([winches(second)], BLOCK_S)).run().named
    assert named.hypothesis.elements == elements


def warming(amount):
    """A winch whose dry friction grows from nothing by `amount` of its mean, and time's hats."""
    (equation, _) = winches(0.0)
    ramp = 1.0 + amount * np.linspace(-1.0, 1.0, ROWS)
    dry = equation.columns[Candidate(DRY, "one")][:, 0, 0]
    noise = equation.target[:, 0] - 0.3 * dry
    target = (0.3 * ramp * dry + noise)[:, None]
    columns = equation.columns | Knots().columns(equation.place, {"time [s]": equation.times})
    return Equation(equation.place, equation.times, target, columns, target)


@pytest.mark.parametrize(("amount", "told"), [(1.0, True), (0.2, False)])
def test_a_finding_whose_amount_drifts_is_doubtful(amount, told):
    found = Search(gather([[warming(amount)]], BLOCK_S)).run()
    assert any(named.hypothesis.effect is DRY for named in found.named)
    time = Driver(Place(Channel.SHAFT, "one"), "time [s]")
    assert (time in [driver for driver, _, _ in found.unknown]) is told
