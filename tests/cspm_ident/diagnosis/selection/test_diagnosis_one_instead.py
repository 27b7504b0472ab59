"""One effect instead of several faults: only where it explains all of them."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, freedom
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.merge import one_instead
from cspm_ident.diagnosis.selection.search import Search
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
PLACE = Place(Channel.SHAFT, "only")
COULOMB, VISCOUS, LOAD, COM = (
    Candidate(catalogue()[name], "only")
    for name in (
        *("winch_coulomb_friction", "winch_viscous_friction"),
        *("winch_load_friction", "bar_com"),
    )
)


def search(share, third=LOAD, further=0.0):
    """A shaft with dry and viscous friction, and a third effect that has a share of the latter.

    Further columns of the third are waves, of which the shaft has so much.
    """
    rng, times = np.random.default_rng(3), STEP * np.arange(ROWS)
    speed = np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times)
    dry, viscous = 0.3 * np.sign(speed), 0.1 * speed
    waves = [np.cos(times), np.cos(3.3 * times)] if third is COM else []
    noise = 0.05 * rng.standard_normal(ROWS)
    target = (dry + viscous + sum(further * wave for wave in waves) + noise)[:, None]
    columns = {COULOMB: np.sign(speed), VISCOUS: speed, third: 5.0 * (dry + share * viscous)}
    shaped = {term: values[:, None, None] for term, values in columns.items()}
    own = [shaped[third], *(wave[:, None, None] for wave in waves)]
    shaped[third] = np.concatenate(own, axis=2)
    return Search(gather([[Equation(PLACE, times, target, shaped, target)]], BLOCK_S))


def of(*candidates):
    return [Hypothesis(candidate.effect, (candidate,)) for candidate in candidates]


def instead(looked, chosen, *free):
    return one_instead(looked.fits, looked.significance, chosen, free)


def test_what_explains_both_replaces_them():
    looked, chosen = search(1.0), of(COULOMB, VISCOUS)
    one, *two = instead(looked, chosen, LOAD)
    assert (one.effect.id, two) == ("winch_load_friction", chosen)
    assert looked._merged(chosen) == of(LOAD)


@pytest.mark.parametrize("share", [0.0, 0.5, 2.0])
def test_what_explains_less_does_not(share):
    looked, chosen = search(share), of(COULOMB, VISCOUS)
    assert instead(looked, chosen, LOAD) is None
    assert looked._merged(chosen) == chosen


def test_what_has_no_fewer_numbers_has_to_explain_no_less():
    """One fault more counts for a number; as much as the model-form error is too much."""
    chosen = of(COULOMB, VISCOUS)
    assert freedom(*of(COM)) == 3
    one, *two = instead(search(1.0, COM, further=0.01), chosen, COM)
    assert (one, two) == (*of(COM), chosen)
    assert instead(search(1.03, COM), chosen, COM) is None
    assert instead(search(1.03), chosen, LOAD) is not None


@pytest.mark.parametrize(("weight", "replaced"), [(1.0, True), (1.1, False)])
def test_what_explains_a_finding_on_two_elements_replaces_it(weight, replaced):
    """A bar's own, which has three numbers, shows in two cables at once."""
    times = STEP * np.arange(ROWS)
    speeds = {"a": np.sin(2.1 * times), "b": np.sin(0.83 * times)}
    rubs = {name: Candidate(VISCOUS.effect, name) for name in speeds}
    equations = []
    for k, (name, speed) in enumerate(speeds.items()):
        noise = 0.3 * np.random.default_rng(7 + k).standard_normal(ROWS)
        own = speed if name == "a" else weight * speed
        cable = np.stack([2.0 * own, 1e-6 * np.cos(times), 1e-6 * np.sin(times)], axis=1)
        columns = {COM: cable[:, None, :], rubs[name]: speed[:, None, None]}
        target = (speed + noise)[:, None]
        place = Place(Channel.SHAFT, name)
        equations.append(Equation(place, times, target, columns, target))
    looked = Search(gather([equations], BLOCK_S))
    both = Hypothesis(VISCOUS.effect, tuple(rubs.values()))
    assert freedom(both) == freedom(*of(COM)) == 3
    found = instead(looked, [both], COM)
    assert found == ((*of(COM), both) if replaced else None)


def test_nor_does_anything_for_what_begins_late_or_is_alone():
    looked = search(1.0)
    late = [replace(each, onset=20) for each in of(COULOMB, VISCOUS)]
    assert instead(looked, late, LOAD) is None
    assert instead(looked, of(COULOMB), LOAD) is None
