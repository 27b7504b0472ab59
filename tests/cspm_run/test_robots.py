"""The gallery of published robots: each is controlled in what its cables give, rests and tracks."""

from pathlib import Path

import numpy as np
import pytest

import cspm
from cspm_control.analysis.cable_structure import cable_structure
from cspm_control.analysis.pose_grid import Grid
from cspm_control.analysis.workspace import static_workspace
from cspm_model.equilibrium import find_equilibrium, gravity_wrench
from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed
from cspm_run.before_run import free_of

TESTBEDS = Path(__file__).resolve().parents[2] / "scenarios" / "testbeds"
REST = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
ALL = ("surge", "sway", "heave", "roll", "pitch", "yaw")
CONTROLLED = {
    "planar_kntu": ("surge", "heave", "pitch"),
    "stadium_camera": ("surge", "sway", "heave"),
    "suspended_four": ("surge", "sway", "heave"),
    "robocrane": ALL,
    "ipanema": ALL,
    "cogiro": ALL,
}


@pytest.fixture(scope="module", params=CONTROLLED)
def robot(request):
    return request.param, cspm.simulate(request.param, duration=3.0)


def test_what_the_cables_give_is_controlled_and_followed(robot):
    name, run = robot
    assert run.failure is None
    assert tuple(run.summary["controlled"]) == CONTROLLED[name]
    assert run.summary["slack_share"] == 0.0
    for dof in CONTROLLED[name]:
        assert run.errors[dof]["rms"] < 0.02, dof


def test_each_is_analysed(robot):
    name, _ = robot
    found = cspm.analyze_manipulability(name).data()
    assert found["rank"] == len(CONTROLLED[name])
    assert tuple(found["available_acceleration"]) == CONTROLLED[name]
    assert all(low > 0.0 < high for low, high in found["available_acceleration"].values())
    linear = cspm.analyze_linear(name)
    assert all(mode.frequency > 0.0 for mode in linear.modes)


def aside(name):
    """Return a machine, a pose beside its middle, and the state of rest that was found."""
    testbed = load_testbed(TESTBEDS / f"{name}.yaml").testbed
    middle = np.array(cspm.load_scenario(name).description.bar_mean_pose)
    pose = middle + np.array([0.1, 0, 0.1, 0, 0, 0])
    limits = np.array([cable.tension_limits for cable in testbed.cables])
    parameters = nominal_parameters(testbed)
    return testbed, pose, find_equilibrium(parameters, pose, np.zeros(6), limits), limits


@pytest.mark.parametrize("name", CONTROLLED)
def test_at_rest_all_forces_and_moments_balance(name):
    testbed, pose, rest, limits = aside(name)
    parameters = nominal_parameters(testbed)
    pulls = -geometry(parameters.cables, rest.bar_pose, np.zeros(6)).bar.T @ rest.tensions
    weight = testbed.bar.mass * testbed.gravity
    missing = pulls + gravity_wrench(parameters, rest.bar_pose)
    np.testing.assert_allclose(missing / weight, 0.0, atol=1e-6)
    assert (rest.tensions >= limits[:, 0] - 1e-9).all()
    axes = cable_structure(testbed, pose).axes
    np.testing.assert_allclose(rest.bar_pose[list(axes)], pose[list(axes)])


def test_a_point_mass_is_held_below_the_polygon_of_its_exits_and_nowhere_else():
    """The known static workspace of a point mass on cables (Riechel, Ebert-Uphoff, ICRA 2004)."""
    testbed = load_testbed(TESTBEDS / "stadium_camera.yaml").testbed
    machine = cable_structure(testbed, (0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    # As strong as need be: near a side of the polygon two cables carry all.
    machine = machine._replace(limits=np.tile([0.0, 1e6], (4, 1)))
    aside = np.linspace(-4.9, 4.9, 15)
    grid = Grid(aside, aside, np.array([-1.0, 0.5, 3.0]), np.zeros(1), np.zeros(1))
    held = static_workspace(machine, grid, "general")[..., 0, 0]
    x, y, z = np.meshgrid(aside, aside, grid.z, indexing="ij")
    assert (held == ((np.abs(x) <= 4.0) & (np.abs(y) <= 3.0) & (z > 0.0))).all()
    assert 0.2 < held.mean() < 0.5


def test_a_robot_with_pulleys_and_a_block_follows_its_reference():
    straight = cspm.load_testbed("ipanema")
    bent = straight
    for i in range(4):
        pulley = {"radius": 0.05, "axis": [0, 0, -1]}
        bent = bent.with_parameter(f"cables[{i}].pulley", pulley)
    bent = bent.with_parameter("cables[4].parts", 2)
    run = cspm.simulate("ipanema", testbed=bent, duration=3.0)
    assert run.failure is None
    for dof in ("surge", "sway", "heave"):
        assert run.errors[dof]["rms"] < 0.02, dof
    lengths = [
        geometry(nominal_parameters(each.file.testbed).cables, REST, np.zeros(6)).lengths
        for each in (straight, bent)
    ]
    assert (lengths[1][:4] - lengths[0][:4] > 0.02).all()
    assert lengths[1][4] == pytest.approx(2.0 * lengths[0][4])


def test_a_robot_with_a_block_on_its_bar_follows_its_reference():
    straight = cspm.load_testbed("ipanema")
    cable = straight.file.testbed.cables[4]
    beside = [place + 0.1 for place in cable.exit]
    route = [
        {"on": "frame", "at": list(cable.exit)},
        {"on": "bar", "at": list(cable.attachment), "radius": 0.03},
        {"on": "frame", "at": beside},
    ]
    reeved = straight.with_parameter("cables[4].route", route)
    run = cspm.simulate("ipanema", testbed=reeved, duration=1.0)
    assert run.failure is None
    for dof in ("surge", "sway", "heave"):
        assert run.errors[dof]["rms"] < 0.02, dof
    pulls = geometry(nominal_parameters(reeved.file.testbed).cables, REST, np.zeros(6)).bar
    assert np.linalg.norm(pulls[4, :3]) == pytest.approx(2.0, abs=0.01)


def test_a_suspended_plate_hangs_tilted_beside_its_middle():
    _, pose, rest, _ = aside("suspended_four")
    assert abs(rest.bar_pose[4] - pose[4]) > 0.05


def bundle_of(name, **control):
    from cspm.simulation import bundle_of as bundle
    from cspm_msgs_py.recording.run_record import SIM

    scenario = cspm.load_scenario(name)
    for key, value in control.items():
        scenario = scenario.with_parameter(key.replace("__", "."), value)
    return bundle(scenario, None, SIM)


def test_what_is_left_free_is_reported_with_the_reason():
    (line,) = free_of(bundle_of("planar_kntu"))
    assert line == (
        "not controllable: sway, roll, yaw: somewhere along the reference no cable gives a force or"
        " moment there"
    )
    assert free_of(bundle_of("ipanema")) == []
    (left,) = free_of(bundle_of("ipanema", control__motion__dofs=["surge", "sway", "heave"]))
    assert left == "left free: roll, pitch, yaw: controllable, but not in control.motion.dofs"
    assert any("the cables span 3 of 6" in line for line in free_of(bundle_of("suspended_four")))


def test_a_dof_that_the_cables_do_not_give_is_refused():
    with pytest.raises(InputError) as caught:
        bundle_of("planar_kntu", control__motion__dofs=["surge", "sway"])
    assert str(caught.value) == (
        "control.motion.dofs: sway, somewhere along the reference no cable gives a force or moment"
        " there, allowed on planar_kntu along this reference: surge, heave, pitch"
    )
