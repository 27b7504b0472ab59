"""The check of the plant's step: modes by a second road, and both sides of stability."""

from pathlib import Path

import numpy as np
import pytest
from machines import LINEAR, build, point_content, rig_content

from cspm_model.linearisation import linear_model, operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import assemble, resolve
from cspm_sim.step_stability import axial_modes, check_step, is_stable

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"


def modes_of(testbed, pose, *, locked=False):
    parameters = nominal_parameters(testbed)
    point = operating_point(testbed, parameters, pose)
    lengths, tensions = (point.unstretched_lengths, point.lengths), point.tensions
    return axial_modes(parameters, point.bar_pose, np.zeros(6), lengths, tensions, locked=locked)


def stiff(content):
    for cable in content["cables"]:
        cable["stiffness"] = dict(LINEAR, youngs_modulus=2.0e11)
    return content


@pytest.mark.parametrize("content", [point_content(), stiff(point_content())])
def test_the_fast_modes_are_those_of_the_linear_model(content):
    """The model of chapter 6 has the same modes, beside those of the bar as a pendulum."""
    testbed, pose = build(content), (0.1, 0.05, 1.0, 0.0, 0.0, 0.0)
    parameters = nominal_parameters(testbed)
    point = operating_point(testbed, parameters, pose)
    whole = np.linalg.eigvals(linear_model(testbed, parameters, point).A)
    fast = whole[np.abs(whole) > 10.0]
    found = modes_of(testbed, pose)
    assert len(found) == 6
    for mode in found:
        assert np.abs(fast - mode).min() < 1e-3 * abs(mode)


def test_locked_winches_move_no_cable():
    pose = (0.1, 0.05, 1.0, 0.0, 0.0, 0.0)
    testbed = build(point_content())
    assert (
        np.abs(modes_of(testbed, pose)).max() > np.abs(modes_of(testbed, pose, locked=True)).max()
    )


def test_a_rig_without_a_bar_is_a_winch_on_a_spring():
    testbed = build(rig_content() | {"cables": stiff(rig_content())["cables"]})
    cable = testbed.cables[0]
    parameters = nominal_parameters(testbed)
    found = axial_modes(
        parameters, None, np.zeros(6), (np.array([2.0]),) * 2, np.array([10.0]), locked=False
    )
    stiffness = cable.stiffness.axial_rigidity / (2.0 + cable.offset_length)
    frequency = np.sqrt(stiffness * cable.drum_radius**2 / cable.rotor_inertia)
    np.testing.assert_allclose(np.abs(found), frequency, rtol=1e-9)


@pytest.mark.parametrize(("z", "stable"), [(-2.78, 1), (-2.79, 0), (2.82j, 1), (2.84j, 0), (0, 1)])
def test_both_sides_of_the_border_of_the_classical_runge_kutta_step(z, stable):
    assert is_stable(np.array([1000.0 * z]), 1000) == bool(stable)


def test_the_line_names_the_rate_that_is_enough():
    with pytest.raises(InputError) as caught:
        check_step(np.array([3834.0j, -3834.0j]), 1000)
    assert str(caught.value) == (
        "rates.plant: 1000 Hz, a step of 1 ms, with cables whose axial mode has 3834 rad/s,"
        " allowed: 2000 Hz or more; `--set rates.plant=…`"
    )
    check_step(np.array([3834.0j, -3834.0j]), 2000)


def test_a_run_of_steel_cables_is_refused_before_it_begins():
    scenario = load_scenario(SCENARIOS / "robots" / "suspended_four.yaml")
    testbed = load_testbed(SCENARIOS / "testbeds" / "suspended_four.yaml").testbed
    thick = testbed.cables[0].stiffness.model_copy(
        update={"youngs_modulus": 2.0e11, "diameter": 5.0e-3}
    )
    steel = [cable.model_copy(update={"stiffness": thick}) for cable in testbed.cables]
    resolved = resolve(scenario, testbed)
    with pytest.raises(InputError, match=r"rates\.plant: 1000 Hz, a step of 1 ms"):
        assemble(resolved, testbed.model_copy(update={"cables": tuple(steel)}), SCENARIOS)
    assemble(resolved, testbed, SCENARIOS)
