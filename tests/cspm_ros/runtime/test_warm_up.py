"""After the warm-up a node's first steps load no code, and nothing of the warm-up remains."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_msgs_py.schedule import FORCE_CONTROLLER, PLANT, schedule_of
from cspm_ros.runtime.warm_up import warm_up
from cspm_run.assembly import assemble, assemble_stage

TESTS = Path(__file__).resolve().parents[2] / "support"
SCENARIOS = {
    "rest": (),
    "worst_case": (),
    "one_winch": (),
    "verification_short": (),
}


def nodes_of(bundle):
    return (PLANT, *schedule_of(bundle.scenario, bundle.testbed.testbed).nodes)


@pytest.mark.parametrize("scenario", sorted(SCENARIOS))
@pytest.mark.parametrize("state", ["hold", "brake"])
def test_every_node_of_every_kind_of_scenario_warms_up(tmp_path, scenario, state):
    bundle = bundle_of(scenario, f"safety.state={state}")
    for name in nodes_of(bundle):
        warm_up(name, bundle, tmp_path)


def test_nothing_of_it_remains(tmp_path):
    bundle = bundle_of("worst_case")
    scenario, testbed = bundle.scenario, bundle.testbed.testbed

    def states():
        parts = assemble(scenario, testbed, tmp_path)
        for _ in range(20):
            parts.plant.step(np.full(len(parts.plant.tensions), 0.01))
        return parts.plant.bar_state.copy()

    before = states()
    stage = assemble_stage(FORCE_CONTROLLER, scenario, testbed, tmp_path)
    for name in nodes_of(bundle):
        warm_up(name, bundle, tmp_path)
    np.testing.assert_array_equal(states(), before)
    assert not stage.safe
    assert stage.status().message == "ok"


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("scenario", "state"),
    [
        ("rest", "warm"),
        pytest.param("rest", "cold", marks=pytest.mark.slow),
        pytest.param("one_winch", "warm", marks=pytest.mark.slow),
    ],
)
def test_first_steps_load_nothing_more(scenario, state):
    done = subprocess.run(
        [sys.executable, str(TESTS / "warm_up_child.py"), scenario, state],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
