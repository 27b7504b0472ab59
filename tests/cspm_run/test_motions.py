"""Motions held against the machine that is to follow them."""

import numpy as np
import pytest
from run_samples import SCENARIOS

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import BAR_REFERENCE
from cspm_msgs_py.testbed import load_testbed
from cspm_run.motions import FARTHEST, motions_of

TESTBED = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml").testbed
SCENARIO = load_scenario(SCENARIOS / "rest.yaml")


def following(folder, metres, control=SCENARIO.control):
    """Return the motions with a target of a file that goes along x and comes back."""
    lines = [f"{t},{metres * np.sin(np.pi * t / 20.0)},0,0,0,0,0" for t in np.arange(21.0)]
    (folder / "target.csv").write_text("\n".join(["t,x,y,z,roll,pitch,yaw", *lines]))
    moving = {"motion": {"type": "file", "path": "target.csv"}, "mean_pose": [0, 0, 2, 0, 0, 0]}
    target = type(SCENARIO.target).model_validate(moving)
    scenario = SCENARIO.model_copy(update={"target": target, "control": control})
    return motions_of(scenario, TESTBED, folder)


def test_a_motion_in_mm_is_refused_with_the_machine_s_size(tmp_path):
    near = following(tmp_path, 0.05)
    assert near[BAR_REFERENCE].at(10.0)[0] == pytest.approx(0.05, rel=1e-3)
    with pytest.raises(InputError) as caught:
        following(tmp_path, 50.0)
    exits = np.array([cable.exit for cable in TESTBED.cables])
    box = np.vstack([exits, SCENARIO.control.motion.design_pose[:3]])
    size = np.linalg.norm(np.ptp(box, axis=0))
    apart = np.linalg.norm([50.0, 0.0, 2.0] - box.mean(axis=0))
    assert str(caught.value) == (
        f"motions of target and winch_frame: the bar is to be {apart:.4g} m from its winches at"
        f" 10 s, allowed: {FARTHEST * size:.4g} m, three times the machine's size; positions are"
        " in m, were they mm?"
    )


def test_a_target_that_no_bar_is_to_follow_may_go_anywhere(tmp_path):
    profile = load_scenario(SCENARIOS / "rig_stiffness_surge.yaml").control
    assert profile.mode == "angle"
    assert BAR_REFERENCE in following(tmp_path, 50.0, profile)
