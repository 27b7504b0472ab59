"""How far gains that stay fixed are stable together, beside growth looked at pose by pose."""

import json

import numpy as np
from swivel_platform import MIDDLE, platform, platform_scenario

from cspm_control.analysis.pose_grid import Grid
from cspm_msgs_py.scenario import PidGains, parse_scenario
from cspm_run.assembly import resolve
from cspm_run.stability.loop_growth import loop_growth
from cspm_run.stability.stable_region import COARSE, stable_limits

PLATFORM = platform()
PLACES = np.linspace(0.0, 1.5, 5 * COARSE + 1)
HERE = [np.array([float(MIDDLE[axis])]) for axis in (1, 2, 4, 5)]
GRID = Grid(PLACES, *HERE)


def resolved(**changes):
    return resolve(parse_scenario(json.dumps(platform_scenario(**changes)), "test", []), PLATFORM)


def moved(scenario, **changes):
    motion = scenario.control.motion.model_copy(update=changes)
    control = scenario.control.model_copy(update={"motion": motion})
    return scenario.model_copy(update={"control": control})


def test_the_last_stable_value_is_followed_by_one_that_is_not_or_by_the_end():
    scenario = resolved()
    found = stable_limits(scenario, PLATFORM, GRID, MIDDLE)
    assert found.keys() - {"surge"} == {"sway", "pitch", "yaw"}
    assert [found[dof] for dof in ("sway", "pitch", "yaw")] == [None] * 3
    tried = PLACES[::COARSE]
    growths = [
        loop_growth(moved(scenario, design_pose=(x, *MIDDLE[1:])), PLATFORM) for x in tried.tolist()
    ]
    stable = [each is not None and not each.unstable for each in growths]
    assert stable[0]
    assert not all(stable)
    assert found["surge"] == tried[stable.index(False) - 1]


def test_gains_that_are_stable_nowhere_and_laws_without_loops_have_no_region():
    scenario = resolved()
    gains = {dof: PidGains(kp=1e7, ki=0.0, kd=0.0) for dof in scenario.control.motion.gains}
    wild = stable_limits(moved(scenario, gains=gains), PLATFORM, GRID, MIDDLE)
    assert wild["surge"] is None
    other = {"law": "computed_wrench", "design_pose": MIDDLE}
    control = {"mode": "closed_loop", "motion": other}
    assert stable_limits(resolved(control=control), PLATFORM, GRID, MIDDLE)["surge"] is None
