"""Machines drawn at random, and the judgement of their runs."""

import json

import numpy as np
import pytest

from bench.accuracy.drawn_machine import drawn_machine
from bench.accuracy.judged_run import is_wild, moving
from bench.accuracy.quiet_twin import instabilities
from bench.accuracy.random_machines import VERDICTS, WELL, Outcome, page_of, table_of
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.testbed import parse_testbed
from cspm_run.assembly import resolve
from cspm_run.stability.loop_growth import loop_growth

FEW_LARGE, REEVED_SMALL, COUPLED = 11, 12, 3


def test_a_seed_is_a_machine_and_others_are_others():
    drawn = [drawn_machine(seed) for seed in (1, 1, 2, 3)]
    assert drawn[0] == drawn[1]
    assert len({json.dumps(each.testbed) for each in drawn}) == 3
    counts = {len(each.testbed["cables"]) for each in drawn}
    assert counts <= set(range(3, 10))


@pytest.mark.parametrize("seed", [FEW_LARGE, REEVED_SMALL, COUPLED])
def test_gains_that_nobody_gave_are_stable_together(seed):
    """A stiff hoist, a light robot, and nine cables whose fast force loops are not."""
    drawn = drawn_machine(seed)
    testbed = parse_testbed(json.dumps(drawn.testbed), "drawn").testbed
    scenario = resolve(parse_scenario(json.dumps(drawn.scenario), "drawn", []), testbed)
    growth = loop_growth(scenario, testbed)
    assert growth is not None
    assert not growth.unstable
    ahead = {each.feedforward for each in scenario.control.force.gains.values()}
    assert ahead == ({0.0} if seed == REEVED_SMALL else {1.0})


def test_wild_is_what_errs_by_more_than_a_share_of_the_machine():
    errors = {"surge": {"max": 0.05}, "yaw": {"max": 0.09}, "roll": {"max": 9.0}}
    summary = {"controlled": ["surge", "yaw"], "errors": errors}
    assert not is_wild(summary, 2.0)
    assert is_wild(summary, 1.0)
    assert is_wild({"controlled": ["roll"], "errors": errors}, 2.0)


def test_what_moves_is_faster_than_a_reference_or_grows():
    time = np.arange(4000) * 1e-3
    turn = 10.0 + 3.0 * np.sin(2.0 * np.pi * time / 6.0)[:, None]
    fast = np.sin(2.0 * np.pi * 12.0 * time)[:, None]
    assert list(moving(time, turn)) == []
    assert list(moving(time, turn + fast)) == []
    assert [each[:14] for each in moving(time, turn + 3.0 * fast)] == ["tensions shake"]
    growing = turn + 0.05 * np.exp(time)[:, None] * fast
    assert "a motion grows" in " ".join(moving(time, growing))


@pytest.mark.slow
@pytest.mark.compiled
def test_without_noise_a_stable_machine_neither_shakes_nor_grows(tmp_path):
    assert instabilities(drawn_machine(REEVED_SMALL), tmp_path / "stable") == ()


def test_the_page_counts_each_verdict_and_lists_what_is_not_well():
    found = [Outcome(seed, kind, ("so",), {}) for seed, kind in enumerate((*VERDICTS, WELL))]
    assert f"| {WELL} | 2 |" in table_of(found)
    page = page_of(found, [], range(len(found)))
    assert all(f"| {kind} | 1 |" in page for kind in VERDICTS[1:])
    assert f"| 1 | {VERDICTS[1]} | so |" in page
    assert f"| 0 | {WELL}" not in page
