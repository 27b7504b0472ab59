"""Force loops that the drive limits: margins, the motion plant they leave, and runs with them."""

import json

import numpy as np
import pytest
import yaml
from steel_hoist import DRUM, GEAR, MASS, MIDDLE, ROTOR, hoist, hoist_content, hoist_scenario

import cspm
from cspm_control.design.drive_limited import DriveLimit, fast_gains, slow_gains
from cspm_control.design.force_gains import SLOW_FORCE_BANDWIDTH, design_force_gains
from cspm_control.design.gains import force_loop, motion_plant, tension_plant
from cspm_control.design.margins import loop_frequencies, margins
from cspm_model.linearisation import operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.testbed import parse_testbed
from cspm_run.assembly import resolve
from cspm_run.stability.loop_growth import loop_growth

THIN, THICK = 0.0015, 0.005
HELD = 0.5e-3


def designed(diameter):
    testbed = hoist(diameter)
    parameters = nominal_parameters(testbed)
    return testbed, parameters, design_force_gains(testbed, parameters, MIDDLE, 800.0, HELD)


def margins_of(testbed, parameters, gains):
    """Return the margins of the first cable's loop with the delay of a held torque."""
    plant = tension_plant(testbed, parameters, MIDDLE)
    grid = loop_frequencies(plant, 800.0)
    loop = force_loop(plant, 0, gains)
    return margins(lambda w: loop(w) * np.exp(-1j * w * HELD), grid)


def test_above_the_resonance_where_the_drive_allows_it():
    testbed, parameters, gains = designed(THIN)
    found = margins_of(testbed, parameters, gains["h1"])
    assert gains["h1"].feedforward == 0.0
    assert 300.0 < found.bandwidth <= 800.0
    assert found.phase_margin >= np.radians(30.0)
    assert found.gain_margin >= 6.0


def test_below_the_resonance_where_it_does_not():
    testbed, parameters, gains = designed(THICK)
    found = margins_of(testbed, parameters, gains["h1"])
    assert gains["h1"].feedforward == 1.0
    assert found.gain_margin >= 6.0
    assert found.phase_margin >= np.radians(30.0) or np.isinf(found.phase_margin)
    plant = tension_plant(testbed, parameters, MIDDLE)
    at = force_loop(plant, 0, gains["h1"])(np.array([2.0 * SLOW_FORCE_BANDWIDTH]))
    assert abs(at[0]) == pytest.approx(0.5, rel=0.02)


def test_a_bandwidth_that_is_asked_for_is_kept_or_refused():
    testbed, parameters, _ = designed(THICK)
    with pytest.raises(InputError, match=r"without control\.force\.bandwidth its loop has what"):
        design_force_gains(testbed, parameters, MIDDLE, 700.0)


def test_a_resonance_that_is_hardly_damped_leaves_a_slower_loop_below_it_and_none_above():
    frequencies = np.geomspace(0.1, 1000.0, 4000)
    limit = DriveLimit(np.pi / 6, 6.0, 800.0, 0.73, 10.0)
    gains = {}
    for damping in (0.3, 0.003):
        s = 1j * frequencies / 100.0
        response = (1.0 + 0.2 * damping * s) / (1.0 + 2.0 * damping * s + s**2)
        gains[damping] = slow_gains(frequencies, response, limit)
    assert fast_gains(frequencies, response, 1.0, 100.0, limit) is None
    assert gains[0.3].kp * gains[0.3].integral_frequency == pytest.approx(0.73, rel=0.01)
    # The resonance is 1/(2·0.003) high.
    slower = 0.1 * 0.5 * 100.0 * 0.006
    assert gains[0.003].kp * gains[0.003].integral_frequency == pytest.approx(slower, rel=0.02)


def test_one_slow_loop_slows_those_that_nobody_asked_to_be_fast():
    content = hoist_content(THIN)
    content["cables"][0]["stiffness"]["diameter"] = THICK
    content["cables"][0]["damping"]["constant"] = 20.0
    testbed = parse_testbed(json.dumps(content), "mixed").testbed
    gains = design_force_gains(testbed, nominal_parameters(testbed), MIDDLE, 800.0, HELD)
    assert [each.feedforward for each in gains.values()] == [1.0, 1.0, 1.0]


def test_the_motion_loops_see_the_inertia_of_the_winches():
    """Between force loop and resonance the load weighs M + Σ I/r²·u·uᵀ."""
    testbed, parameters, gains = designed(THICK)
    point = operating_point(testbed, parameters, MIDDLE)
    plant = motion_plant(testbed, parameters, MIDDLE, (0, 1, 2), gains)
    frequency = 15.0
    heavy = MASS * np.eye(3) + ROTOR * (GEAR / DRUM) ** 2 * (
        point.jacobian[:, :3].T @ point.jacobian[:, :3]
    )
    expected = -np.linalg.inv(heavy) / frequency**2
    np.testing.assert_allclose(
        plant.response(frequency)[0, :3].real, expected, atol=0.02 * np.abs(expected).max()
    )


@pytest.mark.parametrize("diameter", [THIN, THICK])
def test_the_loops_are_stable_together(diameter):
    testbed = hoist(diameter)
    scenario = resolve(parse_scenario(json.dumps(hoist_scenario()), "test", []), testbed)
    assert not loop_growth(scenario, testbed).unstable


@pytest.mark.compiled
def test_a_hoist_with_steel_rope_runs_on_its_file_alone(tmp_path):
    (tmp_path / "steel_hoist.yaml").write_text(yaml.safe_dump(hoist_content(THICK)))
    (tmp_path / "run.yaml").write_text(yaml.safe_dump(hoist_scenario()))
    run = cspm.simulate(tmp_path / "run.yaml")
    assert run.failure is None
    assert not run.summary["warnings"]
    assert run.summary["slack_share"] == run.summary["infeasible_share"] == 0.0
    assert all(run.errors[dof]["max"] < 0.02 for dof in ("surge", "sway", "heave"))
