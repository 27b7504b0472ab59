"""A ROS program of the user's in a controller's place, in lockstep, recorder included."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ros_graph import load_ros, new_domain
from run_samples import bundle_of

from cspm_msgs_py.diagnostics import decode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording, overview
from cspm_msgs_py.schedule import MOTION_CONTROLLER, WAVE_TRAJECTORY
from cspm_run.resim import resimulate

load_ros()

from cspm_ros.runtime.process_run import run_processes  # noqa: E402 - after ROS is known to be there

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
STEPS, PERIOD_NS = 200, 10_000_000


@pytest.fixture
def own_node(request):
    """A domain in which an example runs."""
    domain = new_domain()
    environment = os.environ | {
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    with subprocess.Popen([sys.executable, EXAMPLES / request.param], env=environment) as process:
        yield domain
        process.kill()


@pytest.mark.parametrize("own_node", ["own_stage.py"], indirect=True)
def test_its_commands_are_obeyed_and_recorded(own_node, tmp_path):
    own = {"domain_id": own_node, "own_nodes": (MOTION_CONTROLLER,)}
    result = run_processes(bundle_of("rest"), tmp_path / "bag", steps=STEPS, **own)
    assert result.failure is None
    assert overview(tmp_path / "bag").complete
    with Recording(tmp_path / "bag") as recording:
        wrenches = recording.rows("/wrench_command")
        poses = recording.rows("/bar/pose")
        reports = [decode_diagnostics(each) for each in recording.payloads("/diagnostics").payloads]
    assert wrenches.stamp_ns.tolist() == [PERIOD_NS * k for k in range(STEPS // 10)]
    assert wrenches.rows[:, 2] == pytest.approx(100.0 * (2.0 - poses.rows[:, 2]) - 4.0 * 9.81)
    assert not np.any(wrenches.rows[:, [0, 1, 3, 4, 5]])
    names = {status.name for _, statuses in reports for status in statuses}
    assert MOTION_CONTROLLER not in names
    assert "plant" in names
    with pytest.raises(
        InputError, match=r"motion_controller: a ROS node\), allowed: one made with"
    ):
        resimulate(tmp_path / "bag", lambda now, total: None)


@pytest.mark.parametrize("own_node", ["ros_reference.py"], indirect=True)
def test_a_bar_follows_the_references_of_a_ros_node(own_node, tmp_path):
    own = {"domain_id": own_node, "own_nodes": (WAVE_TRAJECTORY,)}
    result = run_processes(bundle_of("rest"), tmp_path / "bag", steps=3000, **own)
    assert result.failure is None
    with Recording(tmp_path / "bag") as recording:
        references = recording.rows("/bar/reference")
        poses = recording.rows("/truth/bar/pose")
    assert references.stamp_ns.tolist() == [1_000_000 * k for k in range(3000)]
    turn = 1e-9 * references.stamp_ns
    assert references.rows[:, 0] == pytest.approx(0.02 * (1.0 - np.cos(turn)), abs=1e-12)
    wanted = np.interp(poses.stamp_ns, references.stamp_ns, references.rows[:, 0])
    assert np.abs(poses.rows[:, 0] - wanted).max() < 2e-3
    assert poses.rows[-1, 0] > 0.035
