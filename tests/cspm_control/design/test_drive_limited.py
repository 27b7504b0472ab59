"""Force loops that the drive limits: margins, the motion plant they leave, and runs with them."""

import json

import numpy as np
import pytest
import yaml
from steel_hoist import DRUM, GEAR, MASS, MIDDLE, ROTOR, hoist, hoist_content, hoist_scenario

import cspm
from cspm_control.design.drive_limited import DriveLimit, drive_limited_gains
from cspm_control.design.force_gains import SLOW_FORCE_BANDWIDTH, design_force_gains
from cspm_control.design.gains import force_loop, motion_plant, tension_plant
from cspm_control.design.margins import loop_frequencies, margins
from cspm_model.linearisation import operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import parse_scenario
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


def test_a_resonance_without_damping_has_no_loop():
    frequencies = np.geomspace(1.0, 1000.0, 2000)
    free = 1.0 / (1.0 - (frequencies / 100.0) ** 2 + 1e-12j)
    with pytest.raises(InputError, match=r"no PI of h1 keeps 30° and 6 dB of margins"):
        drive_limited_gains("h1", frequencies, free, 1.0, DriveLimit(np.pi / 6, 6.0, 800.0, 1e4))


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
