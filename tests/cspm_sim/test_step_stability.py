"""The plant's steps: modes by a second road, both sides of stability, and their accuracy."""

from pathlib import Path

import numpy as np
import pytest
from machines import LINEAR, build, point_content, rig_content

from cspm_model.kernels.cable import RADIUS
from cspm_model.linearisation import linear_model, operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import assemble, resolve
from cspm_sim.step_stability import axial_modes, is_stable, steps_along, steps_needed

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


def test_a_fast_mode_takes_as_many_steps_as_are_accurate():
    assert steps_needed(np.array([2800.0j, -2800.0j]), 1000) == 1
    assert steps_needed(np.array([3834.0j, -3834.0j]), 1000) == 8
    assert steps_needed(np.array([3834.0j, -3834.0j]), 2000) == 1
    assert steps_needed(np.zeros(0), 1000) == 1
    with pytest.raises(InputError) as caught:
        steps_needed(np.array([200_000.0j]), 1000)
    assert str(caught.value) == (
        "rates.plant: 1000 Hz, with cables whose axial mode has 2e+05 rad/s, allowed: at most"
        " 1e+05 rad/s; a softer cable, a heavier bar or winch, or a higher rate: `--set"
        " rates.plant=…`"
    )


def test_the_shortest_cables_of_a_reference_count():
    content = stiff(point_content())
    testbed, pose = build(content), np.array([0.1, 0.05, 1.0, 0.0, 0.0, 0.0])
    parameters = nominal_parameters(testbed)
    point = operating_point(testbed, parameters, pose)
    lengths = point.unstretched_lengths, point.lengths
    poses, still = np.array([pose, pose - [0, 0, 0.9, 0, 0, 0]]), np.zeros((2, 6))
    far, near = (
        steps_along(parameters, (bars, still[:1]), lengths, point.tensions, 200, locked=False)
        for bars in (poses[:1], poses[1:])
    )
    assert far == steps_needed(modes_of(testbed, pose), 200) == 1
    assert near == 7
    both = steps_along(parameters, (poses, still), lengths, point.tensions, 200, locked=False)
    assert both == near


def steel(testbed):
    thick = testbed.cables[0].stiffness.model_copy(
        update={"youngs_modulus": 2.0e11, "diameter": 5.0e-3}
    )
    cables = [cable.model_copy(update={"stiffness": thick}) for cable in testbed.cables]
    return testbed.model_copy(update={"cables": tuple(cables)})


@pytest.fixture(scope="module")
def suspended():
    """The scenario of four cables, and the machine with steel ropes of 5 mm in their place."""
    scenario = load_scenario(SCENARIOS / "robots" / "suspended_four.yaml")
    testbed = load_testbed(SCENARIOS / "testbeds" / "suspended_four.yaml").testbed
    return scenario, testbed, steel(testbed)


def assembled(scenario, testbed):
    return assemble(resolve(scenario, testbed), testbed, SCENARIOS).plant


@pytest.mark.compiled
def test_steel_ropes_at_1_khz_are_as_right_as_with_steps_far_shorter(suspended):
    scenario, soft, testbed = suspended
    assert assembled(scenario, soft).substeps == 1
    plants = [assembled(scenario, testbed) for _ in range(2)]
    needed = plants[0].substeps
    assert needed > 1
    plants[1].substeps = 16 * needed
    balance = plants[0].parameters.cables[:, RADIUS] * plants[0].tensions
    for k in range(300):
        torque = balance * (1.0 + 0.1 * np.sin(0.04 * k + np.arange(4)))
        for plant in plants:
            plant.step(torque)
    moved = np.abs(plants[1].bar_state[:3] - assembled(scenario, testbed).bar_state[:3]).max()
    assert moved > 1e-3
    np.testing.assert_allclose(plants[0].bar_state, plants[1].bar_state, atol=2e-5)
    np.testing.assert_allclose(plants[0].tensions, plants[1].tensions, rtol=2e-3)
