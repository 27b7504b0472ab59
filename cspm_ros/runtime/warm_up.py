"""Compiled code is loaded before a run in real time begins, not by its first step.

Loading takes a tenth of a second, which is longer than inputs may be old.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cspm_control.safety import GuardedStage
from cspm_msgs_py.schedule import PLANT, schedule_of
from cspm_msgs_py.topics import POSE, WRENCH
from cspm_run.assembly import assemble_simulator, assemble_stage
from cspm_run.bundle import Bundle
from cspm_run.plant_guard import make_watchdog
from cspm_sim.simulator import Simulator


def warm_up(node: str, bundle: Bundle, folder: Path) -> None:
    """Step a part of its own kind once, where the bar hangs at rest; nothing of it remains.

    Args:
        node: whose part.
        bundle: what is run, resolved.
        folder: where the files of its motions are.
    """
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    schedule = schedule_of(scenario, testbed)
    if node == PLANT:
        plant, sensors = assemble_simulator(scenario, testbed, folder, bundle.plant)
        simulator = Simulator(plant, sensors, {}, period_ns=schedule.period_ns, controlled=False)
        simulator.observe()
        simulator.advance()
        make_watchdog(scenario, plant)
        return
    stage, plan = assemble_stage(node, scenario, testbed, folder), schedule.nodes[node]
    position = np.array(scenario.bar_mean_pose[:3])
    rows = {}
    for name in (*plan.inputs, *plan.held):
        row = np.zeros(testbed.topics[name].width)
        if testbed.topics[name].fields[: len(POSE)] == POSE:
            row[:3], row[6] = position, 1.0
        elif testbed.topics[name].fields == WRENCH and testbed.bar:
            row[2] = -testbed.bar.mass * testbed.gravity
        rows[name] = row
    if "/winch_frame/pose" in rows:
        rows["/winch_frame/pose"][:3] = scenario.winch_frame.mean_pose[:3]
    stage.step(0, rows, lambda _topic, _row: None)
    if isinstance(stage, GuardedStage):
        stage.trip(0, "warming up")
        stage.watch(1, {}, lambda _topic, _row: None)
    stage.status()
