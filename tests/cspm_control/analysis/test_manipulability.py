"""Manipulability by its definitions, and accelerations by linear programs and by falling."""

import numpy as np
import pytest
from altered_machines import CENTRE, TESTBEDS, THESIS, with_bar, with_cables
from machines import build, general_content
from scipy.optimize import linprog

from cspm_control.analysis.cable_structure import cable_structure, structures
from cspm_control.analysis.manipulability import (
    conditions,
    gyration_radius,
    manipulability,
    mass_columns,
    measures,
)
from cspm_control.analysis.pose_grid import Grid
from cspm_model.equilibrium import gravity_wrench
from cspm_model.kinematics import RANK_TOLERANCE, geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import load_testbed

ASIDE = (0.05, -0.08, 1.6, 0.0, 0.2, 0.1)


def parts(testbed, pose=ASIDE):
    machine = cable_structure(testbed, pose)
    grid = Grid(*(np.array([pose[axis]]) for axis in (0, 1, 2, 4, 5)))
    return machine, nominal_parameters(testbed), grid


def test_measure_is_the_product_of_the_scaled_singular_values():
    machine, parameters, grid = parts(THESIS)
    radius = gyration_radius(parameters)
    scaled = structures(machine, grid)[0] / np.array([1, 1, 1, radius, radius])[:, None]
    found = manipulability(machine, parameters, ASIDE)
    values = np.linalg.svd(scaled, compute_uv=False)
    assert found.measure == pytest.approx(values.prod())
    assert found.scaled_condition == pytest.approx(values[0] / values[-1])


def test_rank_is_that_of_the_whole_structure_matrix():
    for name, rank in (("thesis", 5), ("thesis_six_dof", 6)):
        testbed = load_testbed(TESTBEDS / f"{name}.yaml").testbed
        machine, parameters, _ = parts(testbed)
        jacobian = geometry(parameters.cables, ASIDE, np.zeros(6)).bar
        assert np.linalg.matrix_rank(jacobian, rtol=RANK_TOLERANCE) == rank
        assert manipulability(machine, parameters, ASIDE).rank == rank


def test_radius_of_gyration_of_a_slender_bar_is_its_length_over_the_root_of_twelve():
    assert gyration_radius(nominal_parameters(THESIS)) == pytest.approx(12**-0.5, rel=2e-3)


def test_measure_falls_to_zero_and_condition_grows_where_cables_become_parallel():
    machine, parameters, grid = parts(THESIS, CENTRE)
    radius = gyration_radius(parameters)
    depths = [structures(machine, grid._replace(z=np.array([z]))) for z in (1.0, 10.0, 1000.0)]
    found = [measures(machine, each, radius)[0] for each in depths]
    assert found[0] > 100 * found[1] > 1e4 * found[2]
    assert conditions(depths[2])[0] > 50 * conditions(depths[1])[0]


def test_ellipsoids_bound_what_unit_tensions_give():
    machine, parameters, grid = parts(THESIS)
    found = manipulability(machine, parameters, ASIDE)
    structure, rng = structures(machine, grid)[0], np.random.default_rng(0)
    mass = mass_columns(machine, parameters, grid)[0]
    accelerations = np.linalg.solve(mass, structure)
    for ellipsoids, gains in ((found.force, structure), (found.acceleration, accelerations)):
        for ellipsoid, rows in zip(ellipsoids, (gains[:3], gains[3:]), strict=True):
            reached = []
            for _ in range(300):
                tension = rng.normal(size=8)
                given = rows @ (tension / np.linalg.norm(tension))
                reached.append(np.linalg.norm((ellipsoid.axes.T @ given) / ellipsoid.lengths))
            assert 0.8 < max(reached) <= 1.0 + 1e-9
    assert found.force[1].dofs == ("pitch", "yaw")


def test_available_accelerations_are_what_linear_programs_find():
    testbed = with_cables(build(general_content()), tension_limits=(0.2, 40.0))
    for machine_file in (THESIS, testbed):
        machine, parameters, grid = parts(machine_file)
        found = manipulability(machine, parameters, ASIDE)
        structure = structures(machine, grid)[0]
        gravity = gravity_wrench(parameters, ASIDE)[list(machine.axes)]
        mass = mass_columns(machine, parameters, grid)[0]
        for i, axis in enumerate(machine.axes):
            for sign, ours in zip((-1.0, 1.0), found.available[DOFS[axis]], strict=True):
                # S·t + gravity = s·M·e.
                program = linprog(
                    np.r_[np.zeros(len(machine.limits)), -1.0],
                    A_eq=np.column_stack([structure, -sign * mass[:, i]]),
                    b_eq=-gravity,
                    bounds=[*machine.limits, (0, None)],
                )
                if program.status == 0:
                    assert ours == pytest.approx(-program.fun, rel=1e-6)
                else:
                    assert np.isnan(ours)


def test_a_hanging_bar_is_not_pulled_down_faster_than_it_falls():
    slack = with_cables(THESIS, tension_limits=(0.0, 60.0))
    machine, parameters, _ = parts(slack)
    down = manipulability(machine, parameters, CENTRE).available["heave"][1]
    assert down == pytest.approx(THESIS.gravity)
    machine, parameters, _ = parts(THESIS)
    assert manipulability(machine, parameters, CENTRE).available["heave"][1] < 0.7 * THESIS.gravity


def test_mass_is_about_the_frame_and_not_the_centre_of_mass():
    machine, parameters, grid = parts(with_bar(THESIS, com=(0.02, 0.0, 0.01)))
    mass = mass_columns(machine, parameters, grid)[0]
    np.testing.assert_allclose(mass, mass.T, atol=1e-15)
    assert abs(mass[0, 3]) > 0.01
    np.testing.assert_allclose(np.diag(mass)[:3], THESIS.bar.mass)
