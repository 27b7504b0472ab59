"""Workspace algorithms against literal codings and linear programs, limits against table 6-1."""

from itertools import combinations

import numpy as np
import pytest
from altered_machines import CENTRE, THESIS, with_bar, with_cables
from machines import build, general_content, point_content, pulley_content, route_content
from scipy.optimize import linprog

from cspm_control.analysis.cable_structure import cable_structure, structures, wanted_at_rest
from cspm_control.analysis.manipulability import conditions, measures
from cspm_control.analysis.pose_grid import GRIDS, Grid, steps, workspace_grids
from cspm_control.analysis.published_workspace import OURS, workspace_claims
from cspm_control.analysis.workspace import ALGORITHMS, CHUNK, static_workspace
from cspm_control.analysis.workspace_limits import limits, sweep
from cspm_control.analysis.workspace_result import analyse_workspace
from cspm_control.analysis.wrench_set import wrench_set
from cspm_model.equilibrium import gravity_wrench
from cspm_model.kernels.cable import PULLEY_AXIS, PULLEY_RADIUS
from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError

ORIGIN = np.zeros(6)
GENERAL = with_cables(build(general_content()), tension_limits=(1.0, 40.0))
MACHINES = {
    "thesis": THESIS,
    "general": GENERAL,
    "centre_of_mass_off": with_bar(THESIS, com=(0.02, 0.0, 0.01)),
    "pulleys": build(pulley_content()),
    "routes": build(route_content()),
}


def ragged(seed, count=3, width=1.0):
    """A small grid of poses that lie nowhere in particular."""
    rng = np.random.default_rng(seed)
    x, y, pitch, yaw = (width * rng.uniform(-1, 1, count) for _ in range(4))
    z = rng.uniform(0.6, 3.0, count)
    return Grid(*(np.sort(values) for values in (0.3 * x, 0.3 * y, z, 1.2 * pitch, 0.7 * yaw)))


def poses_of(grid):
    x, y, z, pitch, yaw = (values.ravel() for values in np.meshgrid(*grid, indexing="ij"))
    return np.column_stack([x, y, z, 0.0 * x, pitch, yaw])


def structure_at(testbed, axes, pose):
    """−Jᵀ by the plant's own geometry."""
    cables = nominal_parameters(testbed).cables
    return -geometry(cables, pose, ORIGIN).bar.T[list(axes)]


@pytest.mark.parametrize("name", MACHINES)
def test_structures_and_wrenches_are_those_of_the_plant(name):
    testbed, grid = MACHINES[name], ragged(0, 2)
    machine = cable_structure(testbed, CENTRE)
    assert len(machine.axes) == (6 if name in ("general", "pulleys", "routes") else 5)
    found = structures(machine, grid)
    turns = len(grid.pitch) * len(grid.yaw)
    for i, pose in enumerate(poses_of(grid)):
        np.testing.assert_allclose(found[i], structure_at(testbed, machine.axes, pose), atol=1e-13)
        gravity = gravity_wrench(nominal_parameters(testbed), pose)[list(machine.axes)]
        np.testing.assert_allclose(wanted_at_rest(machine, grid)[i % turns], -gravity, atol=1e-12)


@pytest.mark.parametrize("name", MACHINES)
def test_algorithm_1_is_the_pseudo_inverse_within_its_limits(name):
    testbed, grid = MACHINES[name], ragged(1)
    machine = cable_structure(testbed, CENTRE)
    found = static_workspace(machine, grid, "pseudo_inverse").ravel()
    parameters = nominal_parameters(testbed)
    wanted = []
    for pose in poses_of(grid):
        structure = structure_at(testbed, machine.axes, pose)
        gravity = gravity_wrench(parameters, pose)[list(machine.axes)]
        tensions = np.linalg.pinv(structure) @ -gravity
        wanted.append((tensions >= 0.0).all() and (tensions <= machine.limits[:, 1]).all())
    np.testing.assert_array_equal(found, wanted)
    assert 0 < found.sum() < len(found)


def held_by_any_basis(structure, wanted, most):
    """Algorithm 2 as the thesis writes it."""
    size, cables = structure.shape
    bases = [list(basis) for basis in combinations(range(cables), size)]
    regular = [b for b in bases if np.linalg.matrix_rank(structure[:, b], tol=1e-9) == size]
    solved = [(np.linalg.solve(structure[:, b], wanted), most[b]) for b in regular]
    return any((t >= 0.0).all() and (t <= high).all() for t, high in solved)


@pytest.mark.parametrize("name", MACHINES)
def test_algorithm_2_tries_all_bases_and_wrench_sets_all_tensions(name):
    """That any tensions exist is judged by linear programs."""
    machine = cable_structure(MACHINES[name], CENTRE)
    most = machine.limits[:, 1]
    counts = np.zeros(3, dtype=int)
    for grid in (ragged(4, 2, 0.4), ragged(2, 2, 0.7)):
        structure = structures(machine, grid)
        wanted = np.tile(wanted_at_rest(machine, grid), (8, 1))
        basis = static_workspace(machine, grid, "general").ravel()
        sets = [
            wrench_set(structure, np.c_[low, most], wanted).holds
            for low in (0 * most, 0 * most + 2)
        ]
        for i in range(len(structure)):
            assert basis[i] == held_by_any_basis(structure[i], wanted[i], most)
            for low, held in zip((0.0, 2.0), sets, strict=True):
                bounds = np.c_[low + 0.0 * most, most]
                program = linprog(0.0 * most, A_eq=structure[i], b_eq=wanted[i], bounds=bounds)
                assert held[i] == (program.status == 0)
        assert (basis <= sets[0]).all()
        assert (sets[1] <= sets[0]).all()
        counts += [basis.sum(), sets[0].sum(), sets[1].sum()]
    assert (counts > 0).all()
    assert (counts < 64).all()


@pytest.mark.slow
def test_on_the_thesis_slices_bases_find_all_that_any_tensions_hold():
    machine, fine = cable_structure(THESIS, CENTRE), GRIDS["general"]
    zero, depth = np.zeros(1), np.array([2.0])
    slices = (fine._replace(pitch=zero, yaw=zero), fine._replace(x=zero, y=zero, z=depth))
    assert sum(grid.size for grid in slices) == 5628
    for grid in slices:
        wanted = np.tile(wanted_at_rest(machine, grid), (len(grid.positions), 1))
        sets = wrench_set(structures(machine, grid), machine.limits * [0.0, 1.0], wanted)
        held = static_workspace(machine, grid, "general").ravel()
        np.testing.assert_array_equal(held, sets.holds)
        assert 0 < held.sum() < len(held)


def test_a_pose_inside_a_pulley_is_outside_the_workspace():
    """Though the other cables could hold the bar there; a pose beside it is judged as ever."""
    plain = cable_structure(THESIS, CENTRE)
    cables = plain.cables.copy()
    cables[0, PULLEY_RADIUS], cables[0, PULLEY_AXIS] = 0.8, 1.0
    machine = plain._replace(cables=cables)
    others = plain._replace(cables=plain.cables[1:], limits=plain.limits[1:])
    zero = np.zeros(1)
    grid = Grid(zero, zero, np.array([1.0, 2.0]), zero, zero)
    found = structures(machine, grid)
    np.testing.assert_array_equal(np.isnan(found).all(axis=(1, 2)), [True, False])
    for algorithm in ALGORITHMS:
        assert static_workspace(others, grid, algorithm).all()
        held = static_workspace(machine, grid, algorithm).ravel()
        np.testing.assert_array_equal(held, [False, True])
    wanted = np.tile(wanted_at_rest(machine, grid), (2, 1))
    sets = wrench_set(found, machine.limits, wanted)
    np.testing.assert_array_equal(sets.holds, [False, True])
    for numbers in (sets.reach(wanted), conditions(found), measures(machine, found, 0.1)):
        np.testing.assert_array_equal(np.isnan(numbers), [True, False])


def test_an_attachment_at_its_exit_is_outside_the_workspace():
    machine = cable_structure(GENERAL, CENTRE)
    corner = machine.exits[0] - machine.attachments[0]
    grid = Grid(*(np.array([v]) for v in (*corner, 0.0, 0.0)))
    assert np.isnan(structures(machine, grid)).all()
    assert not any(static_workspace(machine, grid, each).item() for each in ALGORITHMS)


def test_reach_and_factor_are_what_linear_programs_find():
    machine = cable_structure(THESIS, CENTRE)
    grid = Grid(*(np.array([v]) for v in (0.02, -0.05, 1.7, 0.1, -0.08)))
    structure, wanted = structures(machine, grid), wanted_at_rest(machine, grid)
    found = wrench_set(structure, machine.limits, wanted)
    rng = np.random.default_rng(5)
    for _ in range(6):
        direction = rng.normal(size=5) * [1, 1, 1, 0.2, 0.2]
        # max s with S·t − s·direction = wanted.
        program = linprog(
            np.r_[np.zeros(8), -1.0],
            A_eq=np.column_stack([structure[0], -direction]),
            b_eq=wanted[0],
            bounds=[*machine.limits, (0, None)],
        )
        assert found.reach(direction[None])[0] == pytest.approx(-program.fun)
    edges = np.diag([0.3, 0.2, 2.0, 0.1, 0.02])
    corners = np.array(np.meshgrid(*[(-1.0, 1.0)] * 5)).reshape(5, -1)
    least = min(found.reach((edges @ corner)[None])[0] for corner in corners.T)
    assert found.factor(edges[None])[0] == pytest.approx(least)


def test_where_the_bar_cannot_rest_nothing_can_be_added():
    machine = cable_structure(THESIS, CENTRE)
    grid = Grid(*(np.array([v]) for v in (0.34, 0.0, 2.0, 0.0, 0.0)))
    found = wrench_set(structures(machine, grid), machine.limits, wanted_at_rest(machine, grid))
    assert not found.holds[0]
    assert np.isnan(found.reach(np.ones((1, 5)))[0])
    assert np.isnan(found.factor(np.eye(5)[None])[0])


def test_nothing_required_is_given_any_number_of_times():
    machine = cable_structure(THESIS, CENTRE)
    grid = sweep(GRIDS["general"], "yaw", CENTRE).every(50)
    found = wrench_set(structures(machine, grid), machine.limits, wanted_at_rest(machine, grid))
    assert found.factor(np.zeros((1, 5, 5)))[0] == np.inf


def test_limits_are_those_of_table_6_1():
    machine = cable_structure(THESIS, CENTRE)
    table = {
        "pseudo_inverse": {"surge": 0.075, "sway": 0.2, "pitch": 1.1, "yaw": 0.5},
        "general": {"surge": 0.25, "sway": 0.275, "pitch": 1.24, "yaw": 0.74},
    }
    for name, row in table.items():
        found = limits(
            lambda grid, name=name: static_workspace(machine, grid, name), GRIDS[name], CENTRE
        )
        assert found == row


def test_a_limit_ends_at_the_first_gap_and_may_be_none():
    grid = Grid(*(steps(0.0, 0.1, 0.5),) * 5)
    held = np.array([True, True, False, True, True, True])
    assert limits(lambda line: held, grid, CENTRE)["surge"] == 0.1
    assert limits(lambda line: ~held, grid, CENTRE)["yaw"] is None
    assert limits(lambda line: held | True, grid, CENTRE)["sway"] == 0.5


def test_grids_are_those_of_the_thesis():
    assert GRIDS["pseudo_inverse"].shape == (15, 15, 19, 66, 81)
    assert GRIDS["general"].shape == (15, 15, 19, 33, 41)
    assert GRIDS["pseudo_inverse"].size == 22_854_150
    assert GRIDS["pseudo_inverse"].pitch[-1] == 1.3
    assert GRIDS["general"].pitch[-1] == 1.28
    assert GRIDS["pseudo_inverse"].every(4).shape == (4, 4, 5, 17, 21)


def test_the_thesis_machine_is_the_same_on_both_sides_and_another_is_not():
    mirrored = Grid(
        *(np.array(v) for v in ([-0.1, 0.1], [-0.1, 0.1], [1.5], [-0.8, 0.8], [-0.3, 0.3]))
    )
    for name in ALGORITHMS:
        held = static_workspace(cable_structure(THESIS, CENTRE), mirrored, name)
        assert 0 < held.sum() < held.size
        np.testing.assert_array_equal(held, held[::-1, :, :, ::-1, ::-1])
        np.testing.assert_array_equal(held, held[:, ::-1, :, :, ::-1])
        # In surge and sway together, so that a quarter of the poses says it all, not a sixteenth.
        assert (held != held[..., ::-1]).any()
    wide = ragged(7, 3)
    other = cable_structure(GENERAL, CENTRE)
    flipped = wide._replace(x=-wide.x[::-1])
    held = static_workspace(other, wide, "general")
    assert (held != static_workspace(other, flipped, "general")[::-1]).any()


def test_progress_counts_every_pose_and_a_stop_ends_the_work():
    machine, grid = cable_structure(THESIS, CENTRE), GRIDS["pseudo_inverse"].every(3)
    done = []
    static_workspace(machine, grid, "pseudo_inverse", done.append)
    assert sum(done) == grid.size > 2 * CHUNK
    held = static_workspace(machine, grid, "pseudo_inverse", stopped=lambda: True)
    assert not held.any()


def analysed(testbed=THESIS, pose=CENTRE, coarse=14, stopped=lambda: False):
    reported = {name: 0 for name in ALGORITHMS}

    def advance(name, count):
        reported[name] += count

    required = np.array([0.2, 0.2, 0.5, 0.0, 0.2, 0.2])
    return analyse_workspace(testbed, pose, required, coarse, advance, stopped), reported


@pytest.fixture(scope="module")
def found():
    return analysed()


@pytest.mark.slow
def test_whole_analysis(found):
    result, reported = found
    assert reported == {name: whole.poses for name, whole in result.whole.items()}
    order = ("pseudo_inverse", "general")
    for dof, value in result.limits["wrench_feasible"].items():
        assert value <= result.limits["general"][dof]
        assert (result.limits["accelerated"][dof] or 0.0) <= value
        assert result.limits[order[0]][dof] <= result.limits[order[1]][dof]
    for each in result.maps.values():
        assert (each.static["pseudo_inverse"] <= each.static["general"]).all()
        assert (np.isfinite(each.factor) == each.feasible).all()
    centre = result.maps["surge, sway"]
    middle = len(centre.factor) // 2
    assert result.factor == pytest.approx(centre.factor[middle])
    assert result.factor == np.nanmax(centre.factor)


@pytest.mark.slow
def test_published_tables_hold_but_for_the_last_digits_of_one(found):
    claims = {claim.what: claim for claim in workspace_claims(found[0])}
    assert len(claims) == 9
    assert [what for what, claim in claims.items() if not claim.holds(OURS)] == ["max κ, rotation"]
    assert claims["max κ, rotation"].found[OURS] == pytest.approx(68.867, rel=1e-4)
    assert found[0].largest_condition["translation"] == pytest.approx(41.645, abs=1e-3)


@pytest.mark.slow
def test_twice_the_requirement_is_met_half_as_often(found):
    machine, parameters = cable_structure(THESIS, CENTRE), nominal_parameters(THESIS)
    from cspm_control.analysis.pose_map import pose_map

    grid = found[0].maps["surge, sway"].grid
    double = pose_map(machine, parameters, grid, 2.0 * found[0].acceleration)
    np.testing.assert_allclose(2.0 * double.factor, found[0].maps["surge, sway"].factor)


def test_interrupted_there_is_no_result():
    assert analysed(stopped=lambda: True)[0] is None


def test_the_axes_are_those_that_the_cables_give():
    point = cable_structure(build(point_content()), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert point.axes == (0, 1, 2)
    assert cable_structure(THESIS, CENTRE).axes == (0, 1, 2, 4, 5)
    assert cable_structure(GENERAL, CENTRE).axes == (0, 1, 2, 3, 4, 5)


def test_the_grid_of_another_machine_is_the_box_of_its_exits():
    exits = np.array([[1.0, -2.0, 0.1], [1.0, 2.0, 0.1], [-1.0, 0.0, 0.0]])
    grid = workspace_grids("own", exits, (0, 1, 2, 4), (0.0, 0.0, 1.0, 0.0, 0.0, 0.3))["general"]
    ends = [(values[0], values[-1]) for values in grid]
    # As deep below its ceiling as the box is wide; yaw is not given by the cables.
    expected = [(-1.0, 1.0), (-2.0, 2.0), (0.0, 4.1), (-0.8, 0.8), (0.3, 0.3)]
    np.testing.assert_allclose(ends, expected)
    assert grid.shape[-1] == 1
    tall = workspace_grids("own", exits * [1, 1, 20], range(6), CENTRE)["pseudo_inverse"]
    assert (tall.z[0], tall.z[-1]) == (0.0, 2.0)
    assert workspace_grids("thesis", exits, range(6), CENTRE) is GRIDS


def test_a_machine_without_a_bar_is_refused():
    with pytest.raises(InputError, match="analysis: this test-bed has no bar, allowed: a t"):
        cable_structure(THESIS.model_copy(update={"bar": None}), CENTRE)
