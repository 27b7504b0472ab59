"""Compiled code is loaded before a run in real time begins, not by its first step.

Loading takes a tenth of a second, which is longer than inputs may be old.
"""

from __future__ import annotations

from pathlib import Path

from cspm_control.safety import GuardedStage
from cspm_msgs_py.schedule import PLANT, schedule_of
from cspm_run.assembly import assemble_simulator, assemble_stage
from cspm_run.bundle import Bundle
from cspm_run.plant_guard import make_watchdog
from cspm_run.stage_warm_up import rest_rows
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
        plant, sensors, target = assemble_simulator(scenario, testbed, folder, bundle.plant)
        simulator = Simulator(
            plant, sensors, {}, period_ns=schedule.period_ns, controlled=False, target=target
        )
        simulator.observe()
        simulator.advance()
        make_watchdog(scenario, plant)
        return
    stage, rows = assemble_stage(node, scenario, testbed, folder), rest_rows(node, bundle)
    stage.step(0, rows, lambda _topic, _row: None)
    if isinstance(stage, GuardedStage):
        stage.trip(0, "warming up")
        stage.watch(1, {}, lambda _topic, _row: None)
    stage.status()
