"""Steps each node of a scenario in a fork of its own, and says what code that loaded."""

import gc
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from numba.core.dispatcher import Dispatcher
from run_samples import bundle_of

from cspm_control.safety import GuardedStage
from cspm_msgs_py.schedule import PLANT, schedule_of
from cspm_ros.runtime.warm_up import warm_up
from cspm_run.assembly import assemble_simulator, assemble_stage
from cspm_run.plant_guard import make_watchdog
from cspm_sim.simulator import Simulator

MS = 1_000_000


def loaded():
    """Return how many compiled forms each function has."""
    found = [each for each in gc.get_objects() if issubclass(type(each), Dispatcher)]
    return {f"{f.py_func.__module__}.{f.py_func.__qualname__}": len(f.overloads) for f in found}


def step_plant(bundle, place):
    """Make the plant's first steps, and those of its watchdog in the safe state."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    plant, sensors, _ = assemble_simulator(scenario, testbed, place, "sim")
    dog = make_watchdog(scenario, plant)
    simulator = Simulator(plant, sensors, {}, period_ns=MS, controlled=False)
    for k in range(5):
        simulator.observe()
        dog.command(k, simulator.torque)
        simulator.advance()
    dog.torque(1000 * MS)


def step_stage(name, bundle, place):
    """Make a controller's first steps, and those in the safe state."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    plan = schedule_of(scenario, testbed).nodes[name]
    stage = assemble_stage(name, scenario, testbed, place)
    rows = {}
    for topic in (*plan.inputs, *plan.held):
        fields = testbed.topics[topic].fields
        rows[topic] = np.full(len(fields), 0.5)
        if "qw" in fields:
            height = 0.0 if topic.startswith("/winch_frame") else 1.8
            rows[topic][:7] = [0.01, 0.0, height, 0.0, 0.0, 0.0, 1.0]
    for k in range(5):
        # What is held comes later than what is needed.
        inputs = rows if k > 2 else {topic: rows[topic] for topic in plan.inputs}
        stage.step(k * MS, inputs, lambda *_: None)
    stage.status()
    if isinstance(stage, GuardedStage):
        stage.trip(10 * MS, "test")
        for k in range(5):
            stage.watch((20 + k) * MS, {}, lambda *_: None, rows)


def loads_more(name, state, bundle, place):
    """Return whether a node's first steps load code, after its warm-up if it is to be warm."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] != 0
    if state == "warm":
        warm_up(name, bundle, place)
    before = loaded()
    if name == PLANT:
        step_plant(bundle, place)
    else:
        step_stage(name, bundle, place)
    more = [key for key, count in loaded().items() if count != before.get(key, 0)]
    sys.stderr.write(f"{name}: {more}\n")
    os._exit(bool(more))


def nodes_of(bundle):
    return (PLANT, *schedule_of(bundle.scenario, bundle.testbed.testbed).nodes)


def main(scenario, state):
    """Return whether a warm node loaded anything, or, cold, whether none did."""
    bundle = bundle_of(scenario)
    with tempfile.TemporaryDirectory() as place:
        loads = [loads_more(name, state, bundle, Path(place)) for name in nodes_of(bundle)]
    return any(loads) if state == "warm" else not all(loads)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
