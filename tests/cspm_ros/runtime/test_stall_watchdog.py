"""How long a run may stand still: while it starts, and once it is under way."""

import math
from types import SimpleNamespace

import pytest

from cspm_msgs_py.errors import InputError
from cspm_ros.runtime import stall_watchdog as watch
from cspm_ros.runtime.stall_watchdog import (
    COMPLAIN_S,
    FIRST_STEPS,
    START_FACTOR,
    Patience,
    StartWatch,
    Watch,
    check_patience,
)

PATIENCE = Patience(8.0, 2.0)


class Clock:
    """A clock that a test sets [s]."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(watch, "time", SimpleNamespace(perf_counter=clock, monotonic=clock))
    return clock


class Node:
    """A node that is as far as a test says."""

    def __init__(self, name="plant"):
        self.name, self.progress = name, -1

    def waiting(self):
        return f"{self.name} waits for more"


class Watched:
    """Nodes under a watch; `to` moves one of them, `still` lets time pass."""

    def __init__(self, clock, *nodes, patience=PATIENCE, **options):
        self.clock, self.nodes, self.complaints = clock, nodes, []
        self.watch = Watch(nodes, patience, self.complaints.append, **options)
        self.watch.look()

    def to(self, progress, node=0):
        self.nodes[node].progress = progress
        self.watch.look()

    def still(self, seconds):
        self.clock.now += seconds
        self.watch.look()
        return self.watch.stuck


def under_way(clock, *nodes, **options):
    """Return nodes that have all gone on beyond the first steps."""
    found = Watched(clock, *(nodes or [Node()]), **options)
    for progress in (FIRST_STEPS + 1, FIRST_STEPS + 2):
        for number in range(len(found.nodes)):
            found.to(progress, number)
    return found


@pytest.mark.parametrize("seconds", [0.1, 0.5, 30.0, 1e6])
def test_a_patience_that_can_be_used(seconds):
    assert check_patience(seconds) == seconds


@pytest.mark.parametrize(
    ("seconds", "shown"),
    [(0.0, "0"), (0.09, "0.09"), (-3.0, "-3"), (math.nan, "nan"), (math.inf, "inf")],
)
def test_a_patience_that_cannot_be_used(seconds, shown):
    with pytest.raises(InputError) as error:
        check_patience(seconds)
    assert str(error.value) == f"--patience {shown}: allowed: 0.1 s or more, finite"


@pytest.mark.parametrize(("cost", "wanted"), [(0.0, 80.0), (7.9, 80.0), (9.0, 90.0), (60.0, 600.0)])
def test_a_start_may_take_as_long_as_starting_costs_here(cost, wanted):
    assert Patience(8.0, cost).start == pytest.approx(wanted)
    assert START_FACTOR == 10.0


def test_a_start_that_is_given_up_is_one_line():
    assert Patience(8.0, 2.04).late(False, "plant waits for recorder") == (
        "not all nodes joined within 80 s: plant waits for recorder; allowed: 10 times the longer"
        " of patience (8 s) and what this start cost (2.0 s); for more use --patience SECONDS, for"
        " a node the parameter patience"
    )
    steps = Patience(8.0, 12.34).late(True, "plant waits for a torque")
    assert steps.startswith("the first steps stood still for 123.4 s: plant waits for a torque; a")


def test_patience_counts_once_a_run_is_under_way(clock):
    run = under_way(clock)
    assert run.still(8.0) is None
    assert run.still(0.1) == "nothing moved for 8 s: plant waits for more"


def test_what_moves_is_not_given_up(clock):
    run = under_way(clock)
    for step in range(10):
        assert run.still(7.9) is None
        run.to(FIRST_STEPS + 10 + step)


@pytest.mark.parametrize(
    ("steps", "begin"),
    [
        ([], "not all nodes joined within 80 s: "),
        ([0], "the first steps stood still for 80 s: "),
        ([0, 1], "the first steps stood still for 80 s: "),
        # The first step of a slow controller.
        ([FIRST_STEPS + 1], "the first steps stood still for 80 s: "),
        ([0, FIRST_STEPS, FIRST_STEPS + 1], "the first steps stood still for 80 s: "),
        ([0, FIRST_STEPS + 1, FIRST_STEPS + 2], "nothing moved for 8 s: "),
    ],
)
def test_a_start_may_stand_still_for_longer(clock, steps, begin):
    run = Watched(clock, Node())
    for step in steps:
        run.to(step)
    limit = 8.0 if begin.startswith("nothing") else 80.0
    assert run.still(limit) is None
    assert run.still(0.1).startswith(f"{begin}plant waits for more")


def test_a_run_is_under_way_once_its_slowest_node_is(clock):
    run = Watched(clock, Node(), Node("recorder"))
    for step in (0, FIRST_STEPS + 1, FIRST_STEPS + 2, FIRST_STEPS + 3):
        run.to(step)
    assert run.still(8.1) is None
    run.to(FIRST_STEPS + 1, 1)
    run.to(FIRST_STEPS + 2, 1)
    assert run.still(8.1) == "nothing moved for 8 s: plant waits for more; recorder waits for more"


def test_time_in_which_nobody_had_to_move_does_not_count(clock):
    run = under_way(clock)
    for _ in range(10):
        clock.now += 5.0
        run.watch.rest()
        run.watch.look()
    assert run.watch.stuck is None
    assert run.complaints == []
    assert run.still(8.1) is not None


def test_a_standstill_is_reported_before_it_is_given_up(clock):
    run = Watched(clock, Node())
    assert run.still(COMPLAIN_S - 0.1) is None
    assert run.complaints == []
    run.still(0.1)
    assert run.complaints == ["since 5 s plant waits for more"]


def test_before_the_first_step_a_guarded_node_leaves_it_to_its_guard(clock):
    run = Watched(clock, Node(), guarded=True)
    assert run.still(1e4) is None
    assert run.complaints == []
    run.to(0)
    assert run.still(80.0) is None
    assert run.complaints == ["since 80 s plant waits for more"]
    assert run.still(0.1).startswith("the first steps stood still for 80 s: plant waits for more")


def test_time_before_the_first_step_is_not_time_that_the_run_took(clock):
    run = Watched(clock, Node())
    assert run.watch.elapsed == 0.0
    run.still(20.0)
    run.to(1)
    clock.now += 3.0
    run.to(2)
    assert run.watch.elapsed == pytest.approx(3.0)


# The start, from outside


@pytest.fixture
def reported(monkeypatch):
    monkeypatch.setattr(watch, "GRACE_S", 3.0)
    return []


def test_a_start_that_takes_long_is_reported_when_it_changes(clock, reported):
    start = StartWatch(reported.append, PATIENCE)
    for waiting in ("waits for a, b", "waits for a, b", "waits for b", ""):
        start.look(waiting)
        clock.now += 2.0
    assert reported == ["waits for b", ""]
    assert start.stuck is None


def test_a_start_is_given_up_in_the_end(clock, reported):
    start = StartWatch(reported.append, Patience(8.0))
    clock.now += 80.0
    start.look("waits for b")
    assert start.stuck is None
    clock.now += 0.1
    start.look("")
    assert start.stuck is None
    start.look("waits for b")
    assert start.stuck.startswith("not all nodes joined within 80 s: waits for b; allowed: ")


def test_a_start_may_take_longer_where_its_leader_took_long(clock, reported):
    start = StartWatch(reported.append, Patience(8.0))
    clock.now += 20.0
    start.note_cost()
    clock.now += 180.0
    # Its first report counts.
    start.note_cost()
    start.look("waits for b")
    assert start.stuck is None
    clock.now += 0.1
    start.look("waits for b")
    assert start.stuck.startswith("not all nodes joined within 200 s: waits for b; allowed: ")
    assert "what this start cost (20.0 s)" in start.stuck


def test_somebodys_drivers_are_waited_for_without_end(clock, reported):
    start = StartWatch(reported.append, Patience(math.inf, 5.0))
    clock.now += 1e9
    start.look("waits for /bar/pose")
    assert (reported, start.stuck) == (["waits for /bar/pose"], None)
