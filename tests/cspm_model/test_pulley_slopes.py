"""Slopes over a pulley's radius, against pulleys of two radii."""

import numpy as np
import pytest

from cspm_model.kernels.pulley import around_pulley
from cspm_model.pulley_slopes import Span, pulley_slopes

STEP = 1e-6


def unit(vector):
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize("radius", [2e-6, 0.03, 0.2])
def test_they_are_differences_between_pulleys_of_two_radii(radius):
    rng, checked = np.random.default_rng(5), 0
    for _ in range(20):
        line, axis, arm = (
            unit(rng.normal(size=3)) * 1.7,
            unit(rng.normal(size=3)),
            rng.normal(size=3),
        )
        ends = []
        for r in (radius + STEP, radius - STEP, radius):
            length, direction = around_pulley(tuple(line), tuple(axis), r)
            pull = -np.array(direction)
            ends.append((length, np.hstack([pull, np.cross(arm, pull)]), -pull))
        (more, wrench_more, _), (less, wrench_less, _), (length, _, direction) = ends
        # Beyond half a turn the cable leaves on the far side.
        if direction @ (line - (line @ axis) * axis) < 0.0:
            continue
        checked += 1
        span = Span(direction[None], arm[None], np.array([length]), axis[None], radius)
        by_length, by_wrench = pulley_slopes(span)
        assert by_length[0] == pytest.approx((more - less) / (2 * STEP), abs=1e-7)
        assert by_wrench[0] == pytest.approx((wrench_more - wrench_less) / (2 * STEP), abs=1e-6)
    assert checked > 15


def test_a_cable_that_leaves_as_it_enters_does_not_touch_the_pulley():
    along = np.array([[0.0, 0.0, 1.0]])
    length, wrench = pulley_slopes(Span(along, np.ones((1, 3)), np.array([2.0]), along, 0.0))
    assert length == pytest.approx([0.0])
    assert wrench == pytest.approx(np.zeros((1, 6)))


def test_an_upright_mast_takes_more_cable_than_a_quarter_turn():
    """Cable that enters upwards and leaves level: a quarter of the rim less the radius."""
    level, up = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])
    length, wrench = pulley_slopes(Span(level, np.zeros((1, 3)), np.array([2.0]), up, 0.0))
    assert length == pytest.approx([np.pi / 2 - 1.0])
    # It leaves the pulley higher up, so that it pulls less upwards: force on the bar downwards.
    assert wrench[0] == pytest.approx([0.0, 0.0, -0.5, 0.0, 0.0, 0.0])
