import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError


def random_motion(periodic, count=7, spacing=0.3, seed=3):
    knots = np.random.default_rng(seed).normal(size=(count, 18))
    return Motion(knots, spacing, periodic)


@pytest.mark.parametrize("periodic", [False, True])
@settings(max_examples=60, deadline=None)
@given(piece=st.integers(0, 5), share=st.floats(0.01, 0.99))
def test_velocity_and_acceleration_are_derivatives_of_the_pose(periodic, piece, share):
    motion = random_motion(periodic)
    time, step = (piece + share) * 0.3, 1e-5
    before, now, after = (motion.at(time + k * step) for k in (-1, 0, 1))
    assert (after[:12] - before[:12]) / (2 * step) == pytest.approx(now[6:], abs=1e-5, rel=1e-6)


@pytest.mark.parametrize("periodic", [False, True])
def test_passes_through_its_knots(periodic):
    motion = random_motion(periodic)
    for i, knot in enumerate(motion.knots):
        assert motion.at(i * motion.spacing) == pytest.approx(knot, abs=1e-12)


@pytest.mark.parametrize("periodic", [False, True])
def test_has_no_jump_in_acceleration_at_its_knots(periodic):
    motion = random_motion(periodic)
    last = 8 if periodic else 6
    for i in range(1, last):
        left, right = (motion.at(i * motion.spacing + side * 1e-11) for side in (-1, 1))
        assert left == pytest.approx(right, abs=1e-6)


def test_is_exact_for_a_quintic():
    polynomial = np.polynomial.Polynomial([0.3, -1.0, 0.5, 2.0, -0.7, 0.1])
    times = np.arange(4) * 0.5
    rows = [
        np.repeat(polynomial.deriv(n)(times)[:, None] if n else polynomial(times)[:, None], 6, 1)
        for n in range(3)
    ]
    motion = Motion(np.hstack(rows), 0.5)
    for time in np.linspace(0.0, 1.5, 23):
        assert motion.at(time)[0] == pytest.approx(polynomial(time), abs=1e-12)
        assert motion.at(time)[17] == pytest.approx(polynomial.deriv(2)(time), abs=1e-11)


@settings(max_examples=60, deadline=None)
@given(time=st.floats(-5.0, 5.0), turns=st.integers(-3, 3))
def test_a_periodic_motion_repeats(time, turns):
    motion = random_motion(periodic=True)
    assert motion.duration == pytest.approx(7 * 0.3)
    again = motion.at(time + turns * motion.duration)
    assert again == pytest.approx(motion.at(time), abs=1e-9)


@pytest.mark.parametrize(("time", "knot"), [(-0.01, 0), (1.81, -1), (1e6, -1)])
def test_outside_its_time_a_body_stands_still(time, knot):
    motion = random_motion(periodic=False)
    assert motion.duration == pytest.approx(6 * 0.3)
    row = motion.at(time)
    assert (row[:6] == motion.knots[knot, :6]).all()
    assert (row[6:] == 0.0).all()


def test_still_stands_at_its_pose_for_ever():
    pose = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    motion = Motion.still(pose)
    for time in (-1.0, 0.0, 0.5, 1e5):
        assert (motion.at(time) == np.concatenate([pose, np.zeros(12)])).all()


def test_knots_cannot_be_changed_afterwards():
    motion = random_motion(periodic=True)
    with pytest.raises(ValueError, match="read-only"):
        motion.knots[0, 0] = 1.0


@pytest.mark.parametrize(
    ("knots", "spacing", "text"),
    [
        (np.zeros((4, 17)), 0.1, "motion: knots have shape (4, 17), allowed: (n ≥ 1, 18)"),
        (np.zeros((0, 18)), 0.1, "motion: knots have shape (0, 18), allowed: (n ≥ 1, 18)"),
        (np.full((2, 18), np.nan), 0.1, "motion: a knot is not finite, allowed: finite numbers"),
        (np.zeros((2, 18)), 0.0, "motion: spacing 0.0 s, allowed: > 0"),
        (np.zeros((2, 18)), float("nan"), "motion: spacing nan s, allowed: > 0"),
    ],
)
def test_refuses_what_is_no_motion(knots, spacing, text):
    with pytest.raises(InputError) as caught:
        Motion(knots, spacing)
    assert str(caught.value) == text
