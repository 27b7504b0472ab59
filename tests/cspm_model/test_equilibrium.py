import numpy as np
import pytest
from machines import THESIS, build, general_content, point_content, random_poses, with_bar
from scipy.optimize import linprog, minimize
from scipy.spatial.transform import Rotation

from cspm_model.equilibrium import (
    find_equilibrium,
    gravity_wrench,
    least_tensions,
    unstretched_lengths,
)
from cspm_model.kernels.cable import elastic_tension, law_scale
from cspm_model.kinematics import geometry
from cspm_msgs_py.errors import ConvergenceError
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.parameters import plant_parameters

ORIGIN = np.zeros(6)
CENTRE = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]


def limits_of(testbed):
    return np.array([cable.tension_limits for cable in testbed.cables], dtype=float)


def rest(testbed, pose, frame=ORIGIN):
    return find_equilibrium(plant_parameters(testbed), pose, frame, limits_of(testbed))


def balance(testbed, found, frame=ORIGIN):
    """Force and moment on the bar, summed end by end about the world's origin, over its weight."""
    bar = testbed.bar
    turn, base = (Rotation.from_euler("ZYX", p[:2:-1]).as_matrix() for p in (found.bar_pose, frame))
    weight = np.array([0, 0, bar.mass * testbed.gravity])
    force, moment = weight.copy(), np.cross(found.bar_pose[:3] + turn @ bar.com, weight)
    for tension, cable in zip(found.tensions, testbed.cables, strict=True):
        end = found.bar_pose[:3] + turn @ cable.attachment
        pull = frame[:3] + base @ cable.exit - end
        pull *= tension / np.linalg.norm(pull)
        force, moment = force + pull, moment + np.cross(end, pull)
    return np.concatenate([force, moment]) / (bar.mass * testbed.gravity)


def test_the_thesis_machine_at_its_operating_point(thesis):
    found = rest(thesis, CENTRE)
    p = plant_parameters(thesis)
    lengths = geometry(p.cables, found.bar_pose, ORIGIN).lengths
    kinds = np.repeat([0, 1, 2], [2, 2, 4])
    assert found.bar_pose == pytest.approx(CENTRE, abs=1e-12)
    assert found.tensions == pytest.approx(np.array([5.0786, 5.0355, 5.0063])[kinds], abs=5e-5)
    assert lengths == pytest.approx(np.array([2.23302, 2.25214, 2.26529])[kinds], abs=6e-6)
    # Stiffness at the elastic length of the secant reading, for which it is published.
    published = np.array([2169.0, 1393.0, 1197.0])[kinds]
    elastic = np.array([2.23067, 2.24852, 2.26111])[kinds] + 0.3
    for i, (length, tension) in enumerate(zip(elastic, found.tensions, strict=True)):
        scale = law_scale(length, p.cables, i)
        stretch = np.linspace(0.008, 0.022, 20001)
        law = [elastic_tension(e, length, scale, p.cables, p.tables, i) for e in stretch[::20]]
        tangent = np.interp(tension, *np.array(law).T)
        assert tangent == pytest.approx(published[i], abs=0.6)


@pytest.mark.parametrize("name", ["thesis", "general", "point"])
def test_forces_and_moments_balance_at_rest(request, name):
    testbed = request.getfixturevalue(name)
    poses = random_poses(6, seed=4, reach=0.02, angle=0.01)
    frame = np.array([0.01, 0.005, 0.03, 0.002, -0.003, 0.005])
    for pose in poses:
        if name == "point":
            pose[3:] = 0.0
        found = rest(testbed, pose, frame)
        assert balance(testbed, found, frame) == pytest.approx(0.0, abs=1e-8)
        assert (found.tensions >= limits_of(testbed)[:, 0]).all()
        lengths = geometry(plant_parameters(testbed).cables, found.bar_pose, frame).lengths
        assert (found.unstretched_lengths <= lengths).all()


def test_the_thesis_machine_rolls_to_where_it_hangs(thesis):
    """Its cables hold no roll: below their line the centre of mass hangs straight down."""
    shifted = with_bar(thesis, com=(0.0, 0.01, 0.0))
    found = rest(shifted, CENTRE)
    assert found.bar_pose[3] == pytest.approx(np.arctan2(0.01, 0.02), abs=1e-9)
    assert np.delete(found.bar_pose, 3) == pytest.approx(np.delete(CENTRE, 3), abs=0.0)
    assert balance(shifted, found) == pytest.approx(0.0, abs=1e-9)
    sideways = rest(thesis, [0.0, 0.1, 2.0, 0.3, 0.0, 0.0])
    assert balance(thesis, sideways) == pytest.approx(0.0, abs=1e-9)
    assert sideways.bar_pose[3] != pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_the_thesis_machine_rolls_a_little_where_its_ends_are_a_millimetre_off(thesis, seed):
    """Its cables then hold a little roll, and with tensions far beyond their limits any."""
    rng = np.random.default_rng(seed)
    off = thesis.model_copy(
        update={
            "cables": tuple(
                cable.model_copy(
                    update={
                        "exit": tuple(rng.normal(cable.exit, 1e-3)),
                        "attachment": tuple(rng.normal(cable.attachment, 1e-3)),
                    }
                )
                for cable in thesis.cables
            )
        }
    )
    found = rest(off, CENTRE)
    assert balance(off, found) == pytest.approx(0.0, abs=1e-6)
    assert np.delete(found.bar_pose, 3) == pytest.approx(np.delete(CENTRE, 3), abs=0.0)
    assert abs(found.bar_pose[3]) < 0.1
    assert (found.tensions >= limits_of(off)[:, 0] - 1e-9).all()


def test_a_plate_on_four_cables_turns_to_where_they_balance_it():
    """They give four directions of six; beside the middle of the frame it does not hang level."""
    testbed = load_testbed(THESIS.with_name("suspended_four.yaml")).testbed
    pose = np.array([0.2, 0.1, 1.2, 0.0, 0.0, 0.0])
    found = rest(testbed, pose)
    assert balance(testbed, found) == pytest.approx(0.0, abs=1e-8)
    assert np.abs(found.bar_pose - pose).max() > 1e-3
    assert (found.tensions >= limits_of(testbed)[:, 0]).all()


def test_a_machine_that_holds_every_moment_keeps_its_roll(general):
    pose = [0.0, 0.0, 2.0, 0.05, 0.0, 0.0]
    assert (rest(general, pose).bar_pose == pose).all()


@pytest.mark.parametrize("name", ["general", "thesis"])
@pytest.mark.parametrize("side", [0, 1])
def test_tensions_are_the_least_within_their_limits(request, name, side):
    testbed = request.getfixturevalue(name)
    p, limits = plant_parameters(testbed), limits_of(testbed)
    active = 0
    for pose in random_poses(40, seed=5, reach=0.1, angle=0.1):
        if name == "thesis":
            pose[[1, 3]] = 0.0
        structure = -geometry(p.cables, pose, ORIGIN).bar.T
        wrench = -gravity_wrench(p, pose)
        free = np.linalg.pinv(structure, rcond=1e-9) @ wrench
        limits[:, 0], limits[:, 1] = ((1.0, 60.0), (0.0, 0.99 * free.max()))[side]
        slack = [*(np.zeros(8)), *np.ones(12)]
        rows = np.hstack([structure, np.eye(6), -np.eye(6)])
        bounds = [*map(tuple, limits), *[(0, None)] * 12]
        if linprog(slack, A_eq=rows, b_eq=wrench, bounds=bounds).fun > 1e-9:
            continue
        found = least_tensions(structure, wrench, limits)
        assert structure @ found == pytest.approx(wrench, abs=1e-9)
        image = np.linalg.svd(structure)[0][:, : np.linalg.matrix_rank(structure, tol=1e-9)].T
        best = minimize(
            lambda t: 0.5 * t @ t,
            found,
            jac=lambda t: t,
            bounds=limits,
            constraints={
                "type": "eq",
                "fun": lambda t, m=image, s=structure, w=wrench: m @ (s @ t - w),
                "jac": lambda t, m=image, s=structure: m @ s,
            },
            method="SLSQP",
            options={"ftol": 1e-14},
        ).x
        assert found == pytest.approx(best, abs=1e-7)
        active += bool(np.isclose(found, limits[:, side]).any())
    assert active >= 3


def test_where_no_tensions_hold_the_bar_it_says_so(thesis, point):
    with pytest.raises(ConvergenceError) as caught:
        rest(thesis, [2.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    assert str(caught.value).startswith(
        "no tensions within the limits hold the bar at rest at [2, 0, 2, 0, 0, 0] (m, rad): wrench"
        " residual 0."
    )
    above = point_content()
    with pytest.raises(ConvergenceError, match="hold the bar at rest at"):
        rest(build(above), [0.0, 0.0, -2.0, 0.0, 0.0, 0.0])
    heavy = with_bar(point, mass=200.0)
    with pytest.raises(ConvergenceError, match="hold the bar at rest at"):
        rest(heavy, CENTRE)


def test_without_gravity_and_limits_from_zero_nothing_need_hold_the_bar():
    found = rest(build({**general_content(), "gravity": 0.0}), CENTRE)
    assert found.tensions == pytest.approx(0.0, abs=1e-12)


def test_gravity_pulls_down_at_the_centre_of_mass(general):
    pose = np.array([0.1, 0.2, 2.0, 0.3, -0.2, 0.5])
    step, weight = 1e-6, general.bar.mass * general.gravity

    def height(turn):
        turned = Rotation.from_rotvec(turn) * Rotation.from_euler("ZYX", pose[:2:-1])
        return weight * turned.apply(general.bar.com)[2]

    found = gravity_wrench(plant_parameters(general), pose)
    assert found[:3] == pytest.approx([0, 0, weight])
    for axis in range(3):
        turn = step * np.eye(3)[axis]
        slope = (height(turn) - height(-turn)) / (2 * step)
        assert found[3 + axis] == pytest.approx(slope, abs=1e-8)


def test_a_slack_cable_is_as_long_as_its_span(general):
    lengths = np.linspace(1.0, 2.0, 8)
    assert (unstretched_lengths(plant_parameters(general), lengths, np.zeros(8)) == lengths).all()
