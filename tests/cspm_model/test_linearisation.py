"""The linear model against the plant's own derivative and against the published figures."""

import control
import numpy as np
import pytest
from altered_machines import CENTRE, THESIS, with_bar, with_cables
from machines import build, general_content, pulley_content, route_content

from cspm_model.kernels.cable import OFFSET_LENGTH, RADIUS, elastic_tension, law_scale
from cspm_model.kernels.machine import frame_placement
from cspm_model.kinematics import euler_rate_map, rotation
from cspm_model.linearisation import (
    linear_model,
    motion_subsystem,
    operating_point,
    tension_subsystem,
)
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import LinearStiffness, Testbed
from cspm_sim.kernels.plant import make_scratch, plant_rate
from cspm_sim.parameters import plant_parameters

LOW = 0.1  # rad/s, where the thesis takes its singular values


def with_floor(testbed: Testbed, floor: float) -> Testbed:
    cables = tuple(
        cable.model_copy(
            update={"stiffness": cable.stiffness.model_copy(update={"floor_tension": floor})}
        )
        for cable in testbed.cables
    )
    return testbed.model_copy(update={"cables": cables})


LINEAR_LAW = LinearStiffness(youngs_modulus=8.721e9, diameter=1e-3, floor_tension=0.05)
MACHINES = {
    "thesis": THESIS,
    "general": with_cables(build(general_content()), tension_limits=(1.0, 60.0)),
    "pulleys": with_cables(build(pulley_content()), tension_limits=(1.0, 60.0)),
    "routes": with_cables(build(route_content()), tension_limits=(1.0, 60.0)),
    "centre_of_mass_off": with_bar(THESIS, com=(0.02, 0.005, 0.01)),
    "linear_law": with_cables(THESIS, stiffness=LINEAR_LAW),
    "below_the_floor": with_floor(THESIS, 8.0),
    "beyond_the_cap": with_cables(
        with_bar(THESIS, mass=60.0), tension_limits=(2.0, 500.0), torque_limit=50.0
    ),
}
POSES = {
    "centre": (CENTRE, (0.0,) * 6),
    "aside": ((0.02, 0.04, 2.1, 0.0, 0.1, -0.05), (0.01, 0.02, 0.03, 0.02, 0.05, -0.03)),
}


def plant_jacobian(parameters, point) -> np.ndarray:
    """∂(plant rate)/∂(plant state) by central differences, at rest with balancing torques."""
    n = len(point.tensions)
    rest = np.concatenate([point.bar_pose, np.zeros(6), point.unstretched_lengths, np.zeros(2 * n)])
    torque = parameters.cables[:, RADIUS] * point.tensions
    frame = frame_placement(np.concatenate([point.frame_pose, np.zeros(12)]))
    scratch = make_scratch(len(rest), n)

    def rate(state):
        out = np.zeros(len(rest))
        plant_rate(
            state, torque, frame, False, 1e-3, *parameters, scratch.spans, scratch.signals, out
        )
        return out

    assert np.abs(rate(rest)).max() < 1e-5
    step = 1e-6
    columns = [
        (rate(rest + step * e) - rate(rest - step * e)) / (2 * step) for e in np.eye(len(rest))
    ]
    return np.array(columns).T


def embedding(parameters, point) -> np.ndarray:
    """∂(plant state)/∂(linear state): Euler angles, body rates, unstretched lengths from angles."""
    n = len(point.tensions)
    out = np.zeros((12 + 3 * n, 12 + 2 * n))
    out[0:3, 0:3] = np.eye(3)
    out[3:6, 3:6] = np.linalg.inv(euler_rate_map(point.bar_pose))
    out[6:9, 6:9] = np.eye(3)
    out[9:12, 9:12] = rotation(point.bar_pose).T
    wound = parameters.cables[:, RADIUS] * point.unstretched_lengths / point.lengths
    out[12 : 12 + n, 12 : 12 + n] = -np.diag(wound)
    out[12 + n :, 12:] = np.eye(2 * n)
    return out


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("machine", MACHINES)
def test_exact_model_is_the_derivative_of_the_plant(machine, pose):
    testbed = MACHINES[machine]
    parameters = plant_parameters(testbed)
    point = operating_point(testbed, parameters, *POSES[pose])
    model = linear_model(testbed, parameters, point, exact=True)
    lift = embedding(parameters, point)
    found = plant_jacobian(parameters, point) @ lift
    wanted = lift @ model.A
    scale = np.abs(wanted).max(axis=1, keepdims=True) + 1.0
    assert np.abs((found - wanted) / scale).max() < 2e-6
    frozen = linear_model(testbed, parameters, point)
    assert np.abs((found - lift @ frozen.A) / scale).max() > 1e-3


def test_machines_reach_the_branches_that_they_are_made_for():
    points = {
        name: operating_point(testbed, plant_parameters(testbed), CENTRE)
        for name, testbed in MACHINES.items()
        if name not in ("general", "pulleys", "routes")
    }
    floor, cap = points["below_the_floor"], points["beyond_the_cap"]
    assert (floor.tensions < 8.0).all()
    np.testing.assert_allclose(
        floor.damping / points["thesis"].damping, floor.tensions / 8.0, rtol=0.02
    )
    laws = [cable.stiffness for cable in THESIS.cables]
    elastic = cap.unstretched_lengths + [cable.offset_length for cable in THESIS.cables]
    np.testing.assert_allclose(cap.stiffness, [law.axial_rigidity for law in laws] / elastic)


@pytest.fixture(scope="module")
def thesis():
    parameters = plant_parameters(THESIS)
    point = operating_point(THESIS, parameters, CENTRE)
    return parameters, point, linear_model(THESIS, parameters, point)


def test_operating_point_of_the_thesis(thesis):
    _, point, _ = thesis
    groups = [0, 2, 4]
    np.testing.assert_allclose(point.tensions[groups], [5.0786, 5.0355, 5.0063], atol=1e-4)
    np.testing.assert_allclose(point.lengths[groups], [2.23302, 2.25214, 2.26529], atol=1e-5)
    # Found with an elongation of constant stiffness, a little less than that of the law.
    np.testing.assert_allclose(point.stiffness[groups], [2169, 1393, 1197], rtol=0.007)
    np.testing.assert_allclose(point.damping[groups], [82.8, 20.1, 14.1], rtol=0.003)


def test_published_singular_values_of_the_motion_subsystem(thesis):
    parameters, point, model = thesis
    response = motion_subsystem(model, parameters, point).response(LOW)[0]
    left, values, right = np.linalg.svd(response)
    assert values[0] == pytest.approx(1719, abs=1)
    assert values[4] == pytest.approx(11, abs=0.05)
    assert values[0] / values[4] == pytest.approx(156, rel=0.01)
    assert values[5] < 1e-9
    np.testing.assert_allclose(np.abs(right[0]), [0, 1, 0, 0.02, 0, 0], atol=5e-4)
    np.testing.assert_allclose(np.abs(right[5]), [0, 0.02, 0, 1, 0, 0], atol=5e-4)
    np.testing.assert_allclose(np.abs(left[:, 0]), [0, 0.014, 0, 1, 0, 0], atol=5e-4)


def test_leaving_the_roll_moment_out_leaves_the_other_singular_values(thesis):
    parameters, point, model = thesis
    reduced = motion_subsystem(model, parameters, point, (0, 1, 2, 4, 5)).response(LOW)[0]
    values = np.linalg.svd(reduced)[1]
    np.testing.assert_allclose(values, [1719.4, 287.2, 85.66, 24.50, 10.96], rtol=1e-3)


def test_published_poles_and_modes(thesis):
    _, _, model = thesis
    poles = np.linalg.eigvals(model.A)
    poles = poles[np.abs(poles) > 1.0]
    oscillating = np.array(sorted(poles[poles.imag > 0], key=abs))
    wanted = [46.5, 46.8, 50.1, 50.6, 60.5, 63.2]
    np.testing.assert_allclose(np.abs(oscillating), wanted, rtol=2e-3)
    ratios = -oscillating.real / np.abs(oscillating)
    np.testing.assert_allclose(ratios, [0.27, 0.28, 0.34, 0.32, 0.44, 0.50], atol=0.006)
    real = np.sort(-poles[poles.imag == 0].real)
    np.testing.assert_allclose(real, [32.9, 42.3, 82.4, 181.2], rtol=0.005)


def test_undamped_modes(thesis):
    parameters, point, _ = thesis
    undamped = point._replace(damping=0.0 * point.damping)
    poles = np.linalg.eigvals(linear_model(THESIS, parameters, undamped).A)
    modes = np.sort(poles.imag[poles.imag > 1.0])
    np.testing.assert_allclose(modes, [45.8, 45.8, 46.5, 46.9, 55.5, 59.8, 74.3, 85.5], rtol=2e-3)


def test_slopes_of_the_motion_subsystem(thesis):
    parameters, point, model = thesis
    motion = motion_subsystem(model, parameters, point)
    for low, high, slope in ((0.1, 1.0, -2), (1e4, 1e5, -3)):
        pair = np.abs(motion.response([low, high]))
        for dof in (0, 1, 2, 4, 5):
            found = np.log10(pair[1, dof, dof] / pair[0, dof, dof])
            assert found == pytest.approx(slope, abs=0.01)


def test_tension_subsystem_has_the_published_condition_slopes_and_gains(thesis):
    _, _, model = thesis
    tension = tension_subsystem(model)
    response = tension.response(LOW)[0]
    values = np.linalg.svd(response)[1]
    assert values[0] / values[-1] == pytest.approx(17, abs=0.25)
    assert values[0] == pytest.approx(318.9, rel=1e-3)
    relative_gains = np.real(np.diag(response * np.linalg.inv(response).T))
    np.testing.assert_allclose(relative_gains[[0, 2, 4]], [1.34, 1.06, 1.18], atol=0.01)
    pair = np.abs(tension.response([0.01, 0.1, 1e4, 1e5]))[:, 0, 0]
    assert pair[1] / pair[0] == pytest.approx(1.0, abs=1e-4)
    assert np.log10(pair[3] / pair[2]) == pytest.approx(-1.0, abs=0.01)


def test_without_frozen_directions_the_published_figures_vanish(thesis):
    parameters, point, _ = thesis
    exact = linear_model(THESIS, parameters, point, exact=True)
    values = np.linalg.svd(motion_subsystem(exact, parameters, point).response(LOW)[0])[1]
    np.testing.assert_allclose(values[:5], [3.5, 1.24, 0.43, 0.057, 0.056], rtol=0.02)
    values = np.linalg.svd(tension_subsystem(exact).response(LOW)[0])[1]
    assert values[0] / values[-1] == pytest.approx(10.8, abs=0.1)
    poles = np.linalg.eigvals(exact.A)
    slow = np.sort(np.abs(poles[(poles.imag > 0.1) & (np.abs(poles) < 30.0)]))
    np.testing.assert_allclose(slow, [0.2, 0.84, 2.05, 2.09, 2.59, 26.4], rtol=0.02)


def test_pose_comes_out_as_euler_angles():
    testbed = MACHINES["centre_of_mass_off"]
    parameters = plant_parameters(testbed)
    point = operating_point(testbed, parameters, *POSES["aside"])
    assert abs(point.bar_pose[3]) > 0.01
    model = linear_model(testbed, parameters, point)
    motion = motion_subsystem(model, parameters, point)
    np.testing.assert_allclose(
        euler_rate_map(point.bar_pose) @ motion.C[3:], model.C[3:6], atol=1e-12
    )


def test_python_control_gives_the_same_response(thesis):
    _, _, model = thesis
    other = control.ss(model.A, model.B, model.C, model.D)
    frequencies = np.array([0.3, 7.0, 50.0, 900.0])
    wanted = np.moveaxis(other(1j * frequencies), -1, 0)
    scale = np.abs(wanted).max()
    np.testing.assert_allclose(model.response(frequencies), wanted, atol=1e-9 * scale)


def test_every_row_and_column_has_its_name(thesis):
    parameters, point, model = thesis
    for system in (model, motion_subsystem(model, parameters, point), tension_subsystem(model)):
        assert system.A.shape == (len(system.states),) * 2
        assert system.B.shape == (len(system.states), len(system.inputs))
        assert system.C.shape == (len(system.outputs), len(system.states))
        assert system.D.shape == (len(system.outputs), len(system.inputs))
    assert model.states[20 + 7] == "motor speed of sway_4"
    assert model.outputs[10] == "bar pitch rate"
    assert model.inputs[2] == "torque of surge_1"


def test_torque_tightens_and_wrench_pushes_its_own_way(thesis):
    parameters, point, model = thesis
    assert (np.diag(tension_subsystem(model).response(LOW)[0].real) > 0).all()
    motion = motion_subsystem(model, parameters, point).response(LOW)[0]
    # Below its resonances a free mass moves against the force in phase.
    assert (np.diag(motion).real[[0, 1, 2, 4, 5]] < 0).all()


def test_a_machine_without_bar_is_refused():
    bare = THESIS.model_copy(update={"bar": None})
    with pytest.raises(InputError, match="linear model: this test-bed has no bar, allowed: a test"):
        operating_point(bare, plant_parameters(bare), CENTRE)


@pytest.mark.parametrize("machine", ["thesis", "linear_law", "beyond_the_cap"])
def test_a_longer_cable_is_softer_by_as_much_as_the_law_says(machine):
    """By central differences of the law in the length, whose error falls with the step squared."""
    testbed = MACHINES[machine]
    parameters = plant_parameters(testbed)
    point = operating_point(testbed, parameters, CENTRE)
    cables, tables = parameters.cables, parameters.tables
    for i in range(8):
        elongation = point.lengths[i] - point.unstretched_lengths[i]
        elastic = point.unstretched_lengths[i] + cables[i, OFFSET_LENGTH]

        def tension(length, i=i, elongation=elongation):
            scale = law_scale(length, cables, i)
            return elastic_tension(elongation, length, scale, cables, tables, i)[0]

        step = 1e-4 * elastic
        wanted = (tension(elastic - step) - tension(elastic + step)) / (2.0 * step)
        assert point.length_stiffness[i] - point.stiffness[i] == pytest.approx(wanted, rel=1e-6)
        assert wanted > 0.0
