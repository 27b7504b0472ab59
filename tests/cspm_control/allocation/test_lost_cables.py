"""Cables that are reported to be lost by their load cells, and left out of the distribution."""

import numpy as np
import pytest
from run_samples import bundle_of
from structure_samples import HOLD, HOME, row, structure

from cspm_control.allocation.lost_cables import LostCables
from cspm_control.stages.make import distribution_stage, force_stage
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import (
    BAR_POSE,
    FRAME_POSE,
    TENSION,
    TENSION_COMMAND,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
    WINCH_STATE,
    WRENCH,
    schedule_of,
)

MS = 1_000_000
WHOLE = np.full(8, 5.0)
LOST = "control.tension_distribution.lost_cable={below: 0.5, duration: 0.003}"


def without(*cables):
    tensions = WHOLE.copy()
    tensions[list(cables)] = 0.0
    return tensions


def test_a_cable_is_lost_after_so_many_steps_in_a_row():
    found = LostCables(8, 0.5, 3, 5)
    reported = [found.step(row) for row in [without(2)] * 2 + [WHOLE] + [without(2)] * 4]
    assert reported == [False] * 5 + [True, False]
    assert found.lost.tolist() == [i == 2 for i in range(8)]


def test_a_lost_cable_stays_lost():
    found = LostCables(8, 0.5, 1, 5)
    assert found.step(without(2))
    assert not found.step(WHOLE)
    assert found.lost[2]


def test_what_is_not_measured_is_not_lost():
    found = LostCables(8, 0.5, 1, 5)
    assert not found.step(np.where(without(2) == 0.0, np.nan, WHOLE))


def test_five_cables_are_never_given_up():
    found = LostCables(8, 0.5, 1, 5)
    assert found.step(np.zeros(8))
    assert not found.step(np.zeros(8))
    assert found.lost.sum() == 3


@pytest.fixture
def bundle():
    return bundle_of("rest", LOST, "rates.tension_distribution=1000")


def inputs(measured):
    return {
        WRENCH: HOLD,
        BAR_POSE: row(HOME),
        FRAME_POSE: row(np.zeros(6)),
        TENSION: measured,
    }


def steps_of(stage, *measured):
    sent = []
    for k, tensions in enumerate(measured):
        stage.step(k * MS, inputs(tensions), lambda topic, row: sent.append(row))
    return sent


def test_the_others_meet_the_wrench_without_it(bundle):
    testbed = bundle.testbed.testbed
    stage = distribution_stage(bundle.scenario.control, bundle.scenario, testbed)
    *before, after = steps_of(stage, *[without(0)] * 3)
    assert all((tensions >= 2.0).all() for tensions in before)
    assert after[0] == 0.0
    assert (after[1:] >= 2.0).all()
    axes = list(CONTROLLED_AXES)
    rows = structure(testbed, HOME, np.zeros(6))[axes]
    np.testing.assert_allclose(rows @ after, HOLD[axes], atol=1e-6)
    assert stage.status().values["lost"] == "hoist_1"


def test_what_it_computes_on_the_way_is_of_all_cables():
    bundle = bundle_of(
        "rest", LOST, "rates.tension_distribution=1000", "control.record_internals=true"
    )
    stage = distribution_stage(bundle.scenario.control, bundle.scenario, bundle.testbed.testbed)
    sent = steps_of(stage, *[without(0)] * 3)
    assert [len(row) for row in sent] == [8, 16] * 3
    unlimited, active = np.split(sent[-1], 2)
    np.testing.assert_allclose(unlimited, sent[-2])
    assert not active.any()


def test_the_distribution_waits_for_load_cells_only_where_it_reads_them(bundle):
    def held(found):
        return schedule_of(found.scenario, found.testbed.testbed).nodes[TENSION_DISTRIBUTION].held

    assert TENSION in held(bundle)
    assert TENSION not in held(bundle_of("rest"))


def test_the_winch_of_a_lost_cable_comes_to_rest(bundle):
    testbed = bundle.testbed.testbed
    stage = force_stage(bundle.scenario.control, bundle.scenario, testbed)
    sent, speeds = [], np.zeros(8)
    for k, wanted in enumerate((WHOLE, without(0), WHOLE)):
        speeds[0] = 1000.0 if k else 0.0
        rows = {
            TENSION_COMMAND: wanted,
            TENSION: without(0),
            WINCH_STATE: np.concatenate([np.zeros(8), speeds, np.zeros(8)]),
        }
        stage.step(k * MS, rows, lambda topic, row: sent.append((topic, row.copy())))
    assert {topic for topic, _ in sent} == {TORQUE_COMMAND}
    # J·10/s at 1000 rad/s, and nothing that is wanted later brings the cable back.
    assert sent[1][1][0] == pytest.approx(-6.5e-6 * 10.0 * 1000.0)
    assert sent[2][1][0] == pytest.approx(-6.5e-6 * 10.0 * 1000.0)
    assert stage.status().message == "ok"


def test_a_bound_that_whole_cables_pass_is_refused():
    bundle = bundle_of("rest", "control.tension_distribution.lost_cable={below: 2.0}")
    with pytest.raises(InputError) as caught:
        distribution_stage(bundle.scenario.control, bundle.scenario, bundle.testbed.testbed)
    assert str(caught.value) == (
        "control.tension_distribution.lost_cable.below: 2 N, allowed: less than the lower tension"
        " limit of hoist_1, 2 N"
    )
