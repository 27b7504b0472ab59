"""Runs with somebody else's hardware, simulated by a plant that leads nobody."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from realtime_graph import (
    OWN_RUN,
    STALE_AFTER,
    WATCHDOG,
    Evidence,
    Graph,
    Witness,
    check_plant,
    slow_bundle,
    warm_processes,
)
from ros_graph import load_ros

from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.recording import overview
from cspm_msgs_py.schedule import (
    BAR_POSE,
    FORCE_CONTROLLER,
    FRAME_POSE,
    PLANT,
    TENSION,
    TENSION_COMMAND,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
    WINCH_STATE,
    schedule_of,
)
from cspm_ros.check_drivers.winch_wiggle import FARTHEST, TRAVEL
from cspm_ros.runtime.exit_watchdog import IN_ORDER
from cspm_ros.runtime.progress_file import read_report

load_ros()
pytestmark = [pytest.mark.slow, pytest.mark.realtime]

MS = 1_000_000
MEASURED = (FRAME_POSE, BAR_POSE, WINCH_STATE, TENSION)
TRUTH = "/truth/bar/pose"
RADII = np.array([0.0025] * 2 + [0.025] * 6)


@pytest.fixture(scope="module")
def warm():
    return warm_processes()


def external(warm, bundle, place, steps=0):
    """Return a run without plant, led by its recorder."""
    nodes = schedule_of(bundle.scenario, bundle.testbed.testbed).nodes
    return Graph(warm, bundle, place, members=(*nodes, RECORDER), steps=steps)


class Hardware(Graph):
    """A machine with its drivers, on the domain of a run."""

    def __init__(self, warm, bundle, place, domain, plant):
        place.mkdir()
        super().__init__(warm, replace(bundle, plant=plant), place, members=(PLANT,), domain=domain)

    def switch_on(self):
        self.start(remaps=OWN_RUN)


def topics_of(bundle, *names):
    return [bundle.testbed.testbed.topics[name] for name in names]


def waits_for(graph):
    return read_report(Path(graph.parameters.report)).waiting


@pytest.mark.parametrize("plant", ["mujoco", "sim"])
def test_a_run_waits_for_the_hardware_and_holds_its_bar(warm, tmp_path, plant):
    check_plant(plant)
    bundle = slow_bundle()
    with (
        external(warm, bundle, tmp_path, steps=400) as graph,
        Hardware(warm, bundle, tmp_path / "lab", graph.domain, plant) as hardware,
        Witness(graph.domain, topics_of(bundle, TENSION, TRUTH)) as witness,
    ):
        graph.start()
        missing = f"waits for {', '.join(MEASURED)}"
        witness.until(lambda: waits_for(graph) == missing, missing)
        # Nothing is commanded before the run has begun.
        reported = witness.until_said(FORCE_CONTROLLER, lambda s: s.level == 3, "what it waits for")
        assert reported.message.startswith("waits for ")
        hardware.switch_on()
        witness.until(lambda: read_report(Path(graph.parameters.report)).simulated > 0.0, "start")
        witness.until_running(FORCE_CONTROLLER, WATCHDOG)
        assert set(graph.join().values()) <= IN_ORDER
        # The end of a run is a silence, on which the drives hold.
        witness.until_state(WATCHDOG, "hold")
        heave = []
        witness.node.subscribe_rows(
            topics_of(bundle, TRUTH)[0], lambda _, row: heave.append(row[2]), pytest.fail
        )
        witness.until(lambda: len(heave) > 100, "poses after the end")
        assert np.ptp(heave) < 0.01
        assert abs(heave[-1] - 2.0) < 0.02
        assert set(hardware.end().values()) <= IN_ORDER
    found = overview(graph.folder)
    assert found.complete
    assert not [topic.name for topic in found.topics if topic.name.startswith("/truth/")]
    evidence = Evidence(graph.folder)
    start = evidence.stamps("/bar/reference")[0]
    for topic in MEASURED:
        stamps = evidence.stamps(topic)
        assert (np.diff(stamps) > 0).all()
        # Heard before the run began, and through all of its two seconds.
        assert stamps[0] < start
        assert stamps[-1] > start + 1800 * MS
    assert np.ptp(evidence.rows[BAR_POSE].rows[:, 2]) < 0.005
    assert not evidence.alarms(FORCE_CONTROLLER)
    # Each winch was wiggled both ways before the first reference, and none went far.
    states = evidence.rows[WINCH_STATE]
    before = states.rows[states.stamp_ns < start, : len(RADII)] * RADII
    wiggled = before - before[0]
    assert (wiggled.max(axis=0) > 0.9 * TRAVEL).all()
    assert (wiggled.min(axis=0) < -0.9 * TRAVEL).all()
    assert np.abs(wiggled).max() < FARTHEST


def test_a_run_waits_until_each_controller_hears_the_hardware(warm, tmp_path):
    """That the recorder hears it, which leads, is not enough: others may be connected later."""
    bundle = slow_bundle()
    deaf, named = TENSION_DISTRIBUTION, f"waits for drivers to reach {TENSION_DISTRIBUTION}"
    with (
        external(warm, bundle, tmp_path) as graph,
        Hardware(warm, bundle, tmp_path / "lab", graph.domain, "sim") as hardware,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start(*(name for name in graph.names if name != deaf))
        graph.start(deaf, remaps={BAR_POSE: "/elsewhere"})
        hardware.switch_on()
        witness.until(lambda: waits_for(graph) == named, named)
        witness.until_more(TENSION, 200)
        assert waits_for(graph) == named
        hardware.end()
        assert set(graph.end(RECORDER).values()) <= IN_ORDER
    assert BAR_POSE in Evidence(graph.folder).rows


def test_hardware_that_nobody_commands_is_waited_for(warm, tmp_path):
    bundle, named = slow_bundle(), f"waits for drivers to reach {FORCE_CONTROLLER}"
    with (
        external(warm, bundle, tmp_path) as graph,
        Hardware(warm, bundle, tmp_path / "lab", graph.domain, "sim") as hardware,
        Witness(graph.domain) as witness,
    ):
        graph.start()
        hardware.start(remaps=OWN_RUN | {TORQUE_COMMAND: "/elsewhere"})
        witness.until(lambda: waits_for(graph) == named, named)
        hardware.end()
        assert set(graph.end(RECORDER).values()) <= IN_ORDER


def test_hardware_that_dies_is_missed_and_may_come_back(warm, tmp_path):
    bundle = slow_bundle()
    with (
        external(warm, bundle, tmp_path) as graph,
        Hardware(warm, bundle, tmp_path / "first", graph.domain, "sim") as first,
        Hardware(warm, bundle, tmp_path / "second", graph.domain, "sim") as second,
        Witness(graph.domain, topics_of(bundle, TENSION, TORQUE_COMMAND)) as witness,
    ):
        graph.start()
        first.switch_on()
        witness.until_running(FORCE_CONTROLLER, WATCHDOG)
        witness.until_more(TENSION, 100)
        first.processes[PLANT].kill()
        reported = witness.until_state(FORCE_CONTROLLER, "hold")
        # Without poses there are no wanted tensions either.
        silent = (TENSION, WINCH_STATE, TENSION_COMMAND)
        assert reported.values["reason"].startswith(tuple(f"{topic} stale: " for topic in silent))
        assert not witness.reset(FORCE_CONTROLLER)[0]
        witness.until_more(TORQUE_COMMAND, 50)
        second.switch_on()
        witness.until_reset(FORCE_CONTROLLER)
        witness.until_running(FORCE_CONTROLLER, WATCHDOG)
        witness.until_more(TENSION, 100)
        assert set(graph.end(RECORDER).values()) <= IN_ORDER
        second.end()
    evidence = Evidence(graph.folder)
    ((since, _),) = evidence.alarms(FORCE_CONTROLLER)
    gap = np.diff(evidence.stamps(TENSION)).max()
    assert gap > STALE_AFTER * 1e9
    assert evidence.stamps(TENSION)[-1] > since + gap - STALE_AFTER * 1e9
    # Whoever reads the winches blind has the brakes set until somebody resets it.
    assert True in evidence.brakes
    assert not evidence.brakes[-1]
