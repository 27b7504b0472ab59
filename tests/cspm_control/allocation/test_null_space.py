"""Prescribed tensions of the null space: no wrench, a basis that is one's own choice and steady."""

import numpy as np
import pytest
from machines import build, point_content, random_poses
from run_samples import SCENARIOS, bundle_of, run_to
from scipy.linalg import null_space
from structure_samples import HOLD, HOME, row, structure

from cspm_control.allocation.null_space import carried_basis, null_space_basis
from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_control.stages.make import make_controller
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.distribution import TensionDistribution as HowDistributed
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import InputError, SingularityError
from cspm_msgs_py.schedule import TENSION_COMMAND, TENSION_DISTRIBUTION
from cspm_msgs_py.testbed import load_testbed

AXES = list(CONTROLLED_AXES)
STILL = np.zeros(6)
WIDE = (-1e3, 1e3)
KEY = "control.tension_distribution"
# The λ of the thesis's figure 5-2.
THESIS = (6.0, 0.0, 2.0)


def solver_of(testbed, *coordinates, limits=WIDE, axes=AXES, **settings):
    """Return the distribution with this λ; without any, that of least squares."""
    how = HowDistributed(method="pseudo_inverse")
    if coordinates:
        how = HowDistributed(method="prescribed", null_space=coordinates)
    every = np.tile(np.array(limits), (len(testbed.cables), 1))
    cables = nominal_parameters(testbed).cables
    return TensionDistribution(cables, every, how, tuple(axes), **settings)


@pytest.fixture(scope="module")
def basis(thesis):
    return null_space_basis(structure(thesis, HOME, STILL)[AXES])


def test_no_coordinates_change_the_wrench_anywhere(thesis):
    rng = np.random.default_rng(8)
    for pose in random_poses(20, 9, reach=0.15, angle=0.15):
        wrench = HOLD + rng.normal(size=6)
        solver = solver_of(thesis, *rng.uniform(-20.0, 20.0, 3))
        found = solver.step(wrench, row(pose), row(STILL))
        assert found.feasible
        assert found.saturated == 0
        pulled = structure(thesis, pose, STILL)[AXES] @ found.tensions
        np.testing.assert_allclose(pulled, wrench[AXES], atol=1e-9)


def test_the_coordinates_come_back_from_the_tensions(thesis, basis):
    tensions = solver_of(thesis, *THESIS).step(HOLD, row(HOME), row(STILL)).tensions
    np.testing.assert_allclose(basis.T @ tensions, THESIS, atol=1e-9)


def test_more_of_the_first_pulls_the_first_cable_and_zero_is_least_squares(thesis):
    plain, none, more = (
        solver_of(thesis, *each).step(HOLD, row(HOME), row(STILL)).tensions
        for each in ((), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    )
    np.testing.assert_array_equal(none, plain)
    assert more[0] > plain[0] + 0.5


def test_the_basis_is_the_same_on_every_computer(thesis, basis):
    rows = structure(thesis, HOME, STILL)[AXES]
    np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rows @ basis, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.tril(basis[:3].T, -1), 0.0, atol=1e-12)
    for column in basis.T:
        assert column[np.flatnonzero(np.abs(column) > 1e-9)[0]] > 0.0
    # Which rows describe the same null space does not matter, as it would for a decomposition.
    mixed = np.random.default_rng(2).normal(size=(5, 5)) @ rows
    np.testing.assert_allclose(null_space_basis(mixed), basis, atol=1e-9)
    others = null_space(rows)
    np.testing.assert_allclose(others @ others.T, basis @ basis.T, atol=1e-12)


def test_a_cable_that_is_no_new_direction_is_left_out():
    rows = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 1.0, 0.0]])
    expected = np.array([[0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 0.0, np.sqrt(2.0)]]).T / np.sqrt(2.0)
    np.testing.assert_allclose(null_space_basis(rows), expected, atol=1e-15)


def test_the_basis_moves_with_the_cables_without_jumps_and_forgets_the_way(thesis, basis):
    way = 0.3 * np.array([np.sin(np.linspace(0.0, 2.0 * np.pi, 2001) + k) for k in range(6)]).T
    way[:, 3:] *= 0.5
    found = np.array(
        [carried_basis(structure(thesis, HOME + at, STILL)[AXES], basis) for at in way]
    )
    # The bar moves by at most 1 mm and 0.5 mrad in each axis from one to the next.
    assert np.abs(np.diff(found, axis=0)).max() < 0.01
    np.testing.assert_allclose(found[-1], found[0], atol=1e-9)
    alone = carried_basis(structure(thesis, HOME + way[700], STILL)[AXES], basis)
    np.testing.assert_array_equal(found[700], alone)
    np.testing.assert_allclose(found[0].T @ found[0], np.eye(3), atol=1e-12)


def test_no_other_basis_of_the_null_space_is_nearer(thesis, basis):
    rows = structure(thesis, HOME + np.array([0.1, 0.05, -0.8, 0.0, 0.1, 0.1]), STILL)[AXES]
    found = carried_basis(rows, basis)
    np.testing.assert_allclose(rows @ found, 0.0, atol=1e-12)
    rng = np.random.default_rng(4)
    for size in (1e-3, 0.1, 1.0):
        turned = found @ np.linalg.qr(np.eye(3) + size * rng.normal(size=(3, 3)))[0]
        assert np.linalg.norm(turned - basis) > np.linalg.norm(found - basis)


def test_a_null_space_at_right_angles_is_refused():
    with pytest.raises(SingularityError, match="turned by 90° from that at the design pose"):
        carried_basis(np.array([[1.0, 0.0]]), np.array([[1.0], [0.0]]))


def test_the_basis_is_chosen_at_the_design_pose(thesis):
    high = (0.0, 0.0, 0.6, 0.0, 0.1, 0.0)
    chosen = null_space_basis(structure(thesis, np.array(high), STILL)[AXES])
    solver = solver_of(thesis, *THESIS, design_pose=high)
    found = solver.step(HOLD, row(high), row(STILL)).tensions
    np.testing.assert_allclose(chosen.T @ found, THESIS, atol=1e-9)


def test_tensions_are_limited_each_by_itself(thesis):
    free = solver_of(thesis, *THESIS).step(HOLD, row(HOME), row(STILL)).tensions
    found = solver_of(thesis, *THESIS, limits=(3.0, 8.0)).step(HOLD, row(HOME), row(STILL))
    np.testing.assert_allclose(found.tensions, np.clip(free, 3.0, 8.0), atol=1e-12)
    assert found.saturated == ((free < 3.0) | (free > 8.0)).sum() == 3
    assert not found.feasible


@pytest.mark.parametrize("coordinates", [(1.0,), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0)])
def test_as_many_coordinates_as_dimensions(thesis, coordinates):
    with pytest.raises(InputError) as caught:
        solver_of(thesis, *coordinates)
    assert str(caught.value) == (
        f"{KEY}.null_space: {len(coordinates)} numbers, allowed: 3, the 8 cables less the wrench's"
        " 5 controlled directions"
    )


def test_with_roll_the_null_space_has_one_dimension_less():
    six_dof = load_testbed(SCENARIOS / "testbeds" / "thesis_six_dof.yaml").testbed
    solver = solver_of(six_dof, 1.0, -2.0, axes=range(6))
    found = solver.step(HOLD, row(HOME), row(STILL))
    np.testing.assert_allclose(structure(six_dof, HOME, STILL) @ found.tensions, HOLD, atol=1e-9)
    with pytest.raises(InputError, match="3 numbers, allowed: 2, the 8 cables less"):
        solver_of(six_dof, 1.0, 2.0, 3.0, axes=range(6))


def test_a_geometry_that_cannot_give_a_moment_is_refused_in_one_line():
    meeting = point_content()
    meeting["cables"] += [dict(each, name=f"{each['name']}_b") for each in meeting["cables"]]
    with pytest.raises(InputError) as caught:
        solver_of(build(meeting), 1.0)
    assert str(caught.value) == (
        "control.motion.design_pose: the cables do not span the wrench's controlled directions"
        " there, allowed with method prescribed: a pose at which they span all 5"
    )


def test_where_no_tensions_give_some_wrench_it_is_said_as_by_the_others(thesis):
    """At the height of the exit points all cables are level."""
    flat = row([0.0, 0.0, -0.23, 0.0, 0.0, 0.0])
    level = thesis.model_copy(
        update={
            "cables": tuple(
                each.model_copy(update={"exit": (*each.exit[:2], each.attachment[2] - 0.23)})
                for each in thesis.cables
            )
        }
    )
    solver = solver_of(level, 0.0, 0.0, 0.0)
    with pytest.raises(SingularityError, match="every force and moment along surge, sway"):
        solver.step(HOLD, flat, row(STILL))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("{method: prescribed}", "null_space: missing, allowed with method prescribed: a list of"),
        (
            "{null_space: [1, 2, 3]}",
            "null_space: [1.0, 2.0, 3.0] with method analytic_centre, allowed: with method",
        ),
        ("{method: prescribed, null_space: 3}", "null_space: 3, allowed: a list"),
        ("{method: prescribed, null_space: [1, a, 3]}", "null_space[1]: 'a', allowed: a number"),
    ],
)
def test_each_fault_of_the_file_is_one_line(value, text):
    with pytest.raises(InputError) as caught:
        bundle_of("rest", f"{KEY}={value}")
    assert f"{KEY}.{text}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_scenario_with_too_few_is_refused():
    bundle = bundle_of("rest", f"{KEY}={{method: prescribed, null_space: [1, 2]}}")
    with pytest.raises(InputError, match=r"null_space: 2 numbers, allowed: 3"):
        make_controller(TENSION_DISTRIBUTION, bundle.scenario, bundle.testbed.testbed)


@pytest.mark.compiled
@pytest.mark.parametrize("law", ["pid", "computed_wrench"])
def test_a_run_keeps_the_coordinates_and_the_pose(law, tmp_path, basis):
    overrides = (f"{KEY}={{method: prescribed, null_space: [2, 0, 1]}}", "duration=0.5")
    more = ("control.motion={law: computed_wrench}",) if law == "computed_wrench" else ()
    result, rows = run_to(tmp_path / law, "rest", *overrides, *more)
    assert result.failure is None
    assert result.statistics.infeasible_share == 0.0
    assert np.abs(result.statistics.max_error[:3]).max() < 2e-3
    commands = rows[TENSION_COMMAND].rows
    np.testing.assert_allclose(commands @ basis, np.tile([2.0, 0.0, 1.0], (50, 1)), atol=0.05)
