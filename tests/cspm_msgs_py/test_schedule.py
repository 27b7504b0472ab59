"""The schedule, against a step-by-step account of what has arrived."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import Listener
from machines import build, point_content, rig_content
from run_samples import bundle_of
from schedules import delayed

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.schedule import CLOCK, HELD, RATE_OF_SENSOR, Timing, schedule_of, status_divider

PLAIN = "name: plain\ntestbed: none.yaml\nduration: 1.0\n"
RATES = st.sampled_from([10, 20, 50, 100, 125, 200, 250, 500, 1000])
WANTED = {
    "motion_capture": RATES,
    "load_cells": RATES,
    "winches": RATES,
    "wave_trajectory": RATES,
    "motion_controller": RATES,
    "tension_distribution": RATES,
    "force_controller": RATES,
}
DELAYS = st.dictionaries(
    st.sampled_from(["/bar/pose", "/winch_frame/pose", "/winches/state", "/cables/tension"]),
    st.integers(0, 40),
)
THESIS = bundle_of("rest").testbed.testbed


def scenario(text="", **rates):
    reported = "".join(f"  {name}: {rate}\n" for name, rate in rates.items())
    return parse_scenario(f"{PLAIN}rates:\n{reported}{text}" if rates else PLAIN + text, "my.yaml")


class Account:
    """What arrives and who computes at each plant step, by the rules alone."""

    def __init__(self, rates, delays, nodes, steps):
        self.computed = {node: {} for node, _, _, _ in nodes}
        self.arrived = {}
        for step in range(steps):
            for topic, rate in RATE_OF_SENSOR.items():
                sampled = step - delays.get(topic, 0)
                if (
                    topic in THESIS.sensors
                    and sampled >= 0
                    and sampled % (1000 // rates[rate]) == 0
                ):
                    self.arrived.setdefault(topic, {})[step] = sampled
            self.arrived.setdefault("/clock", {})[step] = step
            for node, rate, inputs, outputs in nodes:
                if step % (1000 // rates[rate]) == 0 and all(map(self.latest, inputs)):
                    held = [name for name in HELD.get(node, ()) if self.latest(name)]
                    self.computed[node][step] = {
                        name: self.latest(name)[-1] * 1_000_000 for name in (*inputs, *held)
                    }
                    for topic in outputs:
                        self.arrived.setdefault(topic, {})[step] = step

    def latest(self, topic):
        return list(self.arrived.get(topic, {}).values())[-1:]


CASCADE = (
    (
        "wave_trajectory",
        "wave_trajectory",
        ["/clock"],
        ["/bar/reference", "/winch_frame/reference"],
    ),
    (
        "motion_controller",
        "motion_controller",
        ["/bar/pose", "/bar/reference"],
        ["/wrench_command"],
    ),
    (
        "tension_distribution",
        "tension_distribution",
        ["/wrench_command", "/bar/pose"],
        ["/tension_command"],
    ),
    (
        "force_controller",
        "force_controller",
        ["/tension_command", "/cables/tension"],
        ["/winches/torque_command"],
    ),
)


@given(rates=st.fixed_dictionaries(WANTED), delays=DELAYS)
def test_who_computes_when_and_from_what(rates, delays):
    account = Account(rates, delays, CASCADE, 250)
    schedule = schedule_of(scenario(**rates), delayed(THESIS, delays))
    assert list(schedule.nodes) == list(account.computed)
    for node, plan in schedule.nodes.items():
        steps = range(plan.first, 250, plan.divider)
        needs = {step: schedule.needs(node, step) for step in steps}
        if CLOCK in plan.held:
            assert [found.pop(CLOCK) for found in needs.values()] == [k * 1_000_000 for k in steps]
        assert needs == account.computed[node]
    for topic, arrived in account.arrived.items():
        timing = schedule.topics[topic]
        assert timing.count(250) == len(arrived)
        for step in range(250):
            before = [stamp for at, stamp in arrived.items() if at <= step]
            assert timing.latest(step) == (before[-1] if before else None)


@given(rates=st.fixed_dictionaries(WANTED), delays=DELAYS)
def test_who_computes_often_reads_something_that_comes_as_often(rates, delays):
    schedule = schedule_of(scenario(**rates), delayed(THESIS, delays))
    for plan in schedule.nodes.values():
        read = [schedule.topics[name].divider for name in (*plan.inputs, *plan.held)]
        assert min(read) <= plan.divider
        # What comes only after the first computation does not pace it.
        others = [schedule.topics[n] for n in (*plan.inputs, *plan.held) if n != CLOCK]
        paced = [timing.divider for timing in others if timing.first <= plan.first]
        # The clock alone paces the wave trajectory.
        assert (CLOCK in plan.held) == (bool(paced) and plan.divider < min(paced))


@given(rates=st.fixed_dictionaries(WANTED), delays=DELAYS)
def test_statuses_come_with_computations_about_ten_times_a_second(rates, delays):
    schedule = schedule_of(scenario(**rates), delayed(THESIS, delays))
    for plan in schedule.nodes.values():
        assert plan.status_divider % plan.divider == 0
        assert plan.status_divider >= 100 > plan.status_divider - plan.divider
    assert schedule.plant_status_divider == 100


@pytest.mark.parametrize(
    ("rate", "divider", "expected"), [(1000, 1, 100), (1000, 8, 104), (1000, 200, 200), (5, 1, 1)]
)
def test_status_dividers(rate, divider, expected):
    assert status_divider(rate, divider) == expected


def test_the_loop_keeps_the_schedule():
    """Log times and stamps of a run in process are those that the schedule gives."""
    late = {"/bar/pose": 23, "/cables/tension": 3}
    bundle = bundle_of("rest", "rates.tension_distribution=50", "rates.wave_trajectory=250")
    machine = delayed(THESIS, late)
    found = Listener(bundle, machine.sensors).run(200)
    schedule = schedule_of(bundle.scenario, machine)
    assert {name for name, heard in found.messages.items() if heard} == set(schedule.topics)
    for name, timing in schedule.topics.items():
        logs = np.arange(timing.first, 200, timing.divider) * 1_000_000
        np.testing.assert_array_equal(found.log(name), logs)
        np.testing.assert_array_equal(found.stamp(name), logs - timing.delay * 1_000_000)


def test_nothing_is_there_before_the_first():
    timing = Timing(first=23, divider=10, delay=3)
    assert timing.latest(22) is None
    assert [timing.latest(step) for step in (23, 32, 33, 42)] == [20, 20, 30, 30]
    assert [timing.count(steps) for steps in (0, 23, 24, 33, 34)] == [0, 0, 1, 1, 2]


def test_ideal_sensors_are_not_late():
    machine = delayed(THESIS, {"/bar/pose": 20})
    assert schedule_of(scenario(), machine).topics["/bar/pose"] == Timing(20, 10, 20)
    assert schedule_of(scenario("sensors: ideal\n"), machine).topics["/bar/pose"] == Timing(0, 10)


@pytest.mark.parametrize("rate", [1000, 2000])
def test_the_period_is_the_plants(rate):
    schedule = schedule_of(scenario(plant=rate), THESIS)
    assert schedule.period_ns == 1_000_000_000 // rate
    assert schedule.topics["/bar/pose"].divider == rate // 100
    assert schedule.needs("force_controller", rate)["/cables/tension"] == 1_000_000_000


@pytest.mark.parametrize(
    ("mode", "nodes", "commands"),
    [
        ("locked_winches", ["wave_trajectory"], set()),
        ("torque", ["wave_trajectory", "force_controller"], {"/winches/torque_command"}),
    ],
)
def test_without_a_closed_loop_only_what_is_used_computes(mode, nodes, commands):
    schedule = schedule_of(scenario(f"control: {{mode: {mode}}}\n"), THESIS)
    assert list(schedule.nodes) == nodes
    assert {name for name in schedule.topics if name.endswith("command")} == commands
    if commands:
        assert schedule.nodes["force_controller"].inputs == ("/clock",)


def test_a_machine_without_bodies_has_no_references():
    schedule = schedule_of(scenario("control: {mode: torque}\n"), build(rig_content()))
    assert list(schedule.nodes) == ["force_controller"]
    assert not [name for name in schedule.topics if "pose" in name or "reference" in name]


def test_a_closed_loop_needs_a_bar_and_its_sensors():
    with pytest.raises(InputError) as caught:
        schedule_of(scenario(), build(rig_content()))
    assert str(caught.value) == (
        "control.mode: closed_loop without a bar, allowed: torque, angle, locked_winches"
    )
    with pytest.raises(InputError) as caught:
        schedule_of(scenario(), build(point_content()))
    assert str(caught.value) == (
        "sensors: /bar/pose, /cables/tension missing, allowed in closed loop: /bar/pose,"
        " /cables/tension"
    )
    kept = {"/bar/pose": THESIS.sensors["/bar/pose"]}
    with pytest.raises(InputError) as caught:
        schedule_of(scenario(), THESIS.model_copy(update={"sensors": kept}))
    assert str(caught.value) == (
        "sensors: /cables/tension, /winch_frame/pose missing, allowed in closed loop: /bar/pose,"
        " /cables/tension, /winch_frame/pose"
    )
    schedule_of(scenario(), THESIS)
