"""Machines drawn at random, and the judgement of their runs."""

import json

import pytest

from bench.accuracy.drawn_machine import drawn_machine
from bench.accuracy.random_machines import BROKEN, REFUSED, WARNED, WELL, WILD, Outcome, is_wild
from bench.accuracy.random_machines import table_of as table
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


def test_the_table_counts_each_verdict():
    kinds = (WELL, WELL, WARNED, WILD, REFUSED, BROKEN)
    found = [Outcome(seed, kind, (), {"design": "no"}) for seed, kind in enumerate(kinds)]
    cells = [list(column.cells) for column in table(found).columns]
    assert dict(zip(*cells, strict=True)) == {
        WELL: "2",
        WARNED: "1",
        WILD: "1",
        REFUSED: "1",
        BROKEN: "1",
        "analysis refused: design": "6",
    }
