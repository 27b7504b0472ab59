"""Two faults of one winch that hide each other at its shaft."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.joint_pairs import best_pairs
from cspm_ident.diagnosis.selection.search import Search
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 0.5
CELL, DRIVE, COM, MASS = (
    catalogue()[name] for name in ("tension_bias", "winch_torque_offset", "bar_com", "bar_mass")
)
WINCH, OTHER = "hoist_1", "hoist_2"


def machine(cell, drive, other=0.0, seed=5):
    """A shaft on which both zeros act and a bar that feels the cell's alone, as it would others.

    On the other shaft acts the zero of its drive.
    """
    rng, times = np.random.default_rng(seed), STEP * np.arange(ROWS)
    ones, moved = np.ones(ROWS), np.sin(1.7 * times) + 0.5 * np.sin(0.61 * times + 1.0)
    com = np.stack([0.9 * ones + 0.4 * moved, 0.2 * moved, moved**2], 1)
    bar = {
        Candidate(CELL, WINCH): ones[:, None],
        Candidate(CELL, OTHER): 0.8 * (ones + 0.6 * moved)[:, None],
        Candidate(COM, "bar"): com,
        Candidate(MASS, "bar"): (ones + 0.3 * moved)[:, None],
    }
    places = {Place(Channel.WRENCH, "bar"): (bar, cell * ones)}
    for name, torque in ((WINCH, drive - cell), (OTHER, other)):
        shaft = {Candidate(CELL, name): -ones[:, None], Candidate(DRIVE, name): ones[:, None]}
        places[Place(Channel.SHAFT, name)] = shaft, torque * ones
    equations = []
    for place, (columns, target) in places.items():
        target = (target + 0.1 * rng.standard_normal(ROWS))[:, None]
        shaped = {term: values[:, None, :] for term, values in columns.items()}
        equations.append(Equation(place, times, target, shaped, target))
    return gather([equations], BLOCK_S)


def test_the_pair_that_explains_most_is_the_first_and_of_one_element():
    search = Search(machine(0.1, 0.1))
    pairs = best_pairs(search.gram, search.sums, search.fits.columns([]), search.heard)
    assert {h.effect.id for h in pairs[0]} == {CELL.id, DRIVE.id}
    assert {h.elements for h in pairs[0]} == {(WINCH,)}
    assert all(one.elements == other.elements for one, other in pairs)


@pytest.mark.parametrize("drive", [0.1, 0.09])
def test_zeros_that_hide_each_other_are_found_together(drive):
    named = Search(machine(0.1, drive)).run().findings
    found = {(n.hypothesis.effect.id, n.hypothesis.elements) for n in named}
    assert found == {(CELL.id, (WINCH,)), (DRIVE.id, (WINCH,))}


def test_one_fault_is_not_taken_for_two():
    (named,) = Search(machine(0.0, 0.1)).run().findings
    assert (named.hypothesis.effect, named.hypothesis.elements) == (DRIVE, (WINCH,))


def test_a_pair_that_is_a_wider_form_of_a_finding_does_not_replace_it():
    """Torque less load is what accelerates: gain and radius together do what inertia does."""
    rng, times = np.random.default_rng(2), STEP * np.arange(ROWS)
    load = 1.0 + 0.3 * np.sin(0.9 * times)
    accelerated = 0.2 * np.sin(2.3 * times) + 0.1 * np.sin(3.7 * times)
    inertia, gain, radius = (
        Candidate(catalogue()[name], WINCH)
        for name in ("winch_inertia", "winch_torque_gain", "winch_drum_radius")
    )
    # What the pair has more than the inertia is real, though little.
    target = (0.5 * accelerated + 0.01 * load + 0.02 * rng.standard_normal(ROWS))[:, None]
    columns = {inertia: accelerated, gain: load + accelerated, radius: load}
    shaped = {term: values[:, None, None] for term, values in columns.items()}
    place = Place(Channel.SHAFT, WINCH)
    search = Search(gather([[Equation(place, times, target, shaped, target)]], BLOCK_S))
    chosen = [Hypothesis(inertia.effect, (inertia,))]
    better = search.sums.gain(search.fits.columns(chosen), search.gram.columns_of([radius]))
    assert better.total > 2.0 * better.error
    assert search._exchanged(chosen) == chosen


def test_what_was_chosen_stays_where_no_pair_is_better():
    search = Search(machine(0.0, 0.1))
    chosen = [
        Hypothesis(DRIVE, (Candidate(DRIVE, WINCH),)),
        Hypothesis(MASS, (Candidate(MASS, "bar"),)),
    ]
    assert search._exchanged(chosen) == chosen


def chosen_of(*pairs):
    return [Hypothesis(effect, (Candidate(effect, element),)) for effect, element in pairs]


def test_a_pair_replaces_what_it_explains_and_lets_the_rest_stay():
    weight, zero = chosen = chosen_of((MASS, "bar"), (DRIVE, OTHER))
    exchanged = Search(machine(0.1, 0.1, other=0.1))._exchanged(chosen)
    assert weight not in exchanged
    assert zero in exchanged
    assert {h.effect.id for h in exchanged if h is not zero} == {CELL.id, DRIVE.id}


def test_a_pair_replaces_nothing_that_says_something_else():
    chosen = chosen_of((DRIVE, OTHER))
    assert Search(machine(0.1, 0.1, other=0.1))._exchanged(chosen) == chosen


RATE = 400.0
LATE, DRY = (
    Candidate(catalogue()[name], element)
    for name, element in (("tension_delay", "load_cells"), ("winch_coulomb_friction", WINCH))
)


def rig(friction, delay, noise=0.02):
    """A shaft whose tension follows its angle, so that dry friction looks like late load cells."""
    rng, times = np.random.default_rng(4), STEP * np.arange(ROWS)
    speed = (0.1 + 2.0 * (times / times[-1]) ** 3) * np.sin(3.1 * times)
    place = Place(Channel.SHAFT, WINCH)
    columns = {LATE: RATE * speed[:, None], DRY: -np.sign(speed)[:, None]}
    columns |= {d: c for d, c in Knots().columns(place, {"speed [rad/s]": speed}).items()}
    target = delay * RATE * speed - friction * np.sign(speed) + noise * rng.standard_normal(ROWS)
    shaped = {term: c.reshape(ROWS, 1, -1) for term, c in columns.items()}
    return Search(gather([[Equation(place, times, target[:, None], shaped, target[:, None])]], 2.0))


@pytest.mark.parametrize("friction", [0.0, 0.015, 0.15])
def test_friction_is_looked_for_beside_late_load_cells_where_anything_is_left(friction):
    """Ten times as late is no healthy clock, and a fault of its own."""
    pair = rig(friction, friction / RATE)._pair([])
    assert {h.candidates for h in pair} == ({(LATE,), (DRY,)} if friction else set())


def hidden(size, seed=3):
    """A shaft with an inertia and dry friction that cancel in every other block."""
    rng, times = np.random.default_rng(seed), STEP * np.arange(ROWS)
    turning = np.sin(2.0 * np.pi * times)
    turned = np.where((times // 2.0) % 2, 1.0, -1.0) * turning
    place = Place(Channel.SHAFT, WINCH)
    inertia, dry = (
        Candidate(catalogue()[name], WINCH) for name in ("winch_inertia", "winch_coulomb_friction")
    )
    columns = {inertia: turning, dry: turned}
    columns |= Knots().columns(place, {"angle [rad]": turning})
    target = size * (turning + turned) + 0.02 * rng.standard_normal(ROWS)
    shaped = {term: np.reshape(c, (ROWS, 1, -1)) for term, c in columns.items()}
    made = Equation(place, times, target[:, None], shaped, target[:, None])
    return Search(gather([[made]], 2.0)), {inertia, dry}


@pytest.mark.parametrize(("size", "both"), [(0.5, True), (0.0, False)])
def test_two_large_errors_that_hide_each_other_are_found_together(size, both):
    search, own = hidden(size)
    assert search._best([]) is None
    found = {h.candidates[0] for h in search._pair([])}
    assert found == (own if both else set())
    named = {each.hypothesis.candidates[0] for each in search.run().findings}
    assert named == found
