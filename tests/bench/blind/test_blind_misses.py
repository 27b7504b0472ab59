"""What speaks for what a blind diagnosis missed, and what of it could be reached."""

import numpy as np
import pytest

from bench.blind.misses import (
    GIVEN_UP,
    HIDDEN,
    MORE,
    NO_COLUMN,
    NO_MORE,
    REASONS,
    SIMPLER,
    Miss,
    compared,
    miss_table,
    nearest_truth,
    reach_table,
    reason_of,
)
from bench.blind.scoring.outcome import judge
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
TIMES = STEP * np.arange(ROWS)
SPEED = np.sin(2.1 * TIMES)
SIDE = np.sign(SPEED)
DRY, GREASE, GAIN = (
    Candidate(catalogue()[name], "only", ())
    for name in ("winch_coulomb_friction", "winch_viscous_friction", "winch_torque_gain")
)


def search_of(target, columns, noise=0.05):
    noise = noise * np.random.default_rng(1).standard_normal(ROWS)
    measured = (target + noise)[:, None]
    shaped = {term: own[:, None, None] for term, own in columns.items()}
    place = Place(Channel.SHAFT, "only")
    return Search(gather([[Equation(place, TIMES, measured, shaped, measured)]], BLOCK_S))


def hypothesis(*candidates):
    return Hypothesis(candidates[0].effect, candidates)


def item(*effects, onset=0.0, absorbed_by=None):
    concealed = [
        {"effect": e, "phenomenon": e, "elements": ["only"], "block": "winch", "multiple": 4.0}
        | {"kind": "effect", "parameter": None, "values": {}, "base": 0.0, "driver": None}
        for e in effects
    ]
    reported = {"name": "a", "stratum": "noise", "scenario": "calm", "concealed": concealed}
    return reported | {"absorbed_by": absorbed_by, "onset_s": onset}


def outcome_of(reported):
    return judge(reported, {"diagnosis": None, "times": {"cpu_s": 0.0}}, {})


def reason(search, reported, *found):
    return compared(outcome_of(reported), reported, search, [hypothesis(c) for c in found]).reason


def test_what_the_residuals_show_and_was_not_found_could_have_been_reported():
    search = search_of(SIDE, {DRY: SIDE, GREASE: SPEED})
    assert reason(search, item("winch_coulomb_friction"), GREASE) == MORE


def test_of_two_columns_that_are_the_same_nothing_speaks_for_the_true_one():
    search = search_of(SPEED, {GREASE: SPEED, GAIN: -SPEED})
    assert reason(search, item("winch_viscous_friction"), GAIN) == NO_MORE


def test_a_companion_that_adds_nothing_is_hidden_and_one_that_does_is_not():
    both = item("winch_coulomb_friction", "winch_viscous_friction")
    columns = {DRY: SIDE, GREASE: SPEED}
    assert reason(search_of(SIDE, columns), both, DRY) == NO_MORE
    assert reason(search_of(SIDE + SPEED, columns), both, DRY) == MORE


def test_a_confounded_effect_that_takes_two_faults_is_not_as_simple():
    search = search_of(SIDE, {DRY: SIDE, GREASE: SIDE, GAIN: SPEED})
    assert reason(search, item("winch_coulomb_friction"), GREASE, GAIN) == SIMPLER


def test_what_a_wrong_number_hides_is_held_against_with_that_number():
    radius = Candidate(catalogue()["winch_drum_radius"], "only", ())
    search = search_of(SIDE - SPEED, {GAIN: SIDE, radius: SPEED, DRY: SIDE - SPEED})
    hidden = item("winch_torque_gain", absorbed_by="radius")
    true = nearest_truth(search, hidden, [])
    assert [h.effect.id for h in true] == ["winch_torque_gain", "winch_drum_radius"]
    assert reason(search, hidden, DRY) == NO_MORE
    assert reason(search, item("winch_torque_gain"), DRY) == NO_MORE
    alone, both = (
        compared(outcome_of(reported), reported, search, [hypothesis(DRY)]).gain.total
        for reported in (item("winch_torque_gain"), hidden)
    )
    assert both > alone + 100.0


def test_what_healthy_clocks_do_is_no_number_of_what_was_found():
    late = Candidate(catalogue()["tension_delay"], "only", ())
    search = search_of(SIDE, {DRY: SIDE, GREASE: SIDE, late: 1e6 * SPEED})
    assert reason(search, item("winch_coulomb_friction"), GREASE, late) == NO_MORE


def test_what_was_found_and_not_reported_first_is_said_so():
    search = search_of(SIDE, {DRY: SIDE, GREASE: SPEED})
    assert reason(search, item("winch_coulomb_friction"), DRY) == GIVEN_UP


def test_what_has_no_column_leaves_no_trace():
    found = compared(
        outcome_of(item("bar_mass")), item("bar_mass"), search_of(SIDE, {DRY: SIDE}), []
    )
    assert (found.reason, found.gain) == (NO_COLUMN, None)


@pytest.mark.parametrize(
    ("gain", "true", "reported", "expected"),
    [
        (Gain(2.1, 1.0), 3, 1, MORE),
        (Gain(1.9, 1.0), 3, 1, NO_MORE),
        (Gain(1.9, 1.0), 1, 2, SIMPLER),
        (Gain(1.9, 1.0), 2, 2, NO_MORE),
        (Gain(-1.9, 1.0), 1, 2, SIMPLER),
        (Gain(-2.1, 1.0), 1, 2, NO_MORE),
    ],
)
def test_what_speaks_for_the_truth(gain, true, reported, expected):
    assert reason_of(gain, true, reported) == expected


def test_the_truth_acts_from_its_beginning_on():
    target = np.where(TIMES >= 24.0, SIDE, 0.0)
    search = search_of(target, {DRY: SIDE, GREASE: SPEED})
    late = item("winch_coulomb_friction", onset=24.0)
    assert [h.onset for h in nearest_truth(search, late, [])] == [24]
    always = compared(outcome_of(item("winch_coulomb_friction")), late, search, [])
    whole = compared(always.outcome, item("winch_coulomb_friction"), search, [])
    assert always.gain.total > 1.5 * whole.gain.total


def test_of_several_shapes_the_one_that_explains_most_is_held_against():
    effect = catalogue()["pulley_friction"]
    half, whole = (Candidate(effect, "only", (("wrap", share * np.pi),)) for share in (0.5, 1.0))
    search = search_of(SIDE, {half: SPEED, whole: SIDE})
    (true,) = nearest_truth(search, item("pulley_friction"), [])
    assert true.candidates == (whole,)


def misses_of(reasons):
    reported = outcome_of(item("winch_coulomb_friction"))
    return [Miss(reported, None if r == NO_COLUMN else Gain(1.0, 2.0), 9.0, r) for r in reasons]


def test_what_is_hidden_is_what_there_is_not_to_reach():
    misses = misses_of(REASONS)
    assert set(HIDDEN) == {NO_COLUMN, NO_MORE}
    rows = reach_table([m.outcome for m in misses], misses).splitlines()[2:]
    assert len(rows) == 3
    for row in rows:
        _, found, *counts, most = (cell.strip() for cell in row.strip("|").split("|"))
        assert found.startswith("0 % (0 of 5;")
        assert counts == ["1"] * 5
        assert most.startswith("60 % (3 of 5;")


def test_every_miss_is_listed_with_what_speaks_for_it():
    lines = miss_table(misses_of(REASONS)).splitlines()[2:]
    assert [line.strip("|").split("|")[-1].strip() for line in lines] == list(REASONS)
    assert "—" in lines[0]
    assert "1 ± 2 of 9" in lines[1]
