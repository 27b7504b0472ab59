"""Periodic forces from outside: found at their frequency, and nothing else taken for one."""

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.residuals.spectral_lines import Line, highest_line, with_lines
from cspm_sim.effects import Channel

PLACE = Place(Channel.WRENCH, "bar")
STEP, ROWS = 0.02, 1500
TIMES = 5.0 + STEP * np.arange(ROWS)


def noise(seed, colour=0.8):
    rng = np.random.default_rng(seed)
    found = rng.standard_normal(ROWS)
    for k in range(1, ROWS):
        found[k] += colour * found[k - 1]
    return found


def line_in(values, lowest=1.0):
    return highest_line(PLACE, 1, TIMES, values, lowest, 6)


@pytest.mark.parametrize("frequency", [1.5, 2.7, 6.31])
def test_a_line_is_found_with_its_size(frequency):
    """Of the amplitude noise leaves 0.3 at most, by its spectrum."""
    found = line_in(noise(1) + 4.0 * np.sin(2.0 * np.pi * frequency * TIMES + 0.4))
    assert found is not None
    assert found.frequency == pytest.approx(frequency, abs=0.005)
    assert found.amplitude == pytest.approx(4.0, abs=0.9)
    assert found[:2] == (PLACE, 1)


def test_a_line_where_the_machine_is_driven_is_none():
    values = noise(1) + 1.5 * np.sin(2.0 * np.pi * 2.7 * TIMES)
    assert line_in(values, lowest=2.6) is not None
    assert line_in(values, lowest=2.8) is None


def test_what_rings_down_is_no_line():
    ringing = sum(
        8.0 * np.exp(-(TIMES - at)) * np.sin(2.0 * np.pi * 2.7 * (TIMES - at)) * (at <= TIMES)
        for at in (6.0, 14.1, 22.7, 29.25)
    )
    assert line_in(noise(1) + ringing) is None


@pytest.mark.parametrize("colour", [0.0, 0.8, 0.98])
def test_noise_has_no_line(colour):
    """At a chance of 1e-3 each, none of a hundred is expected."""
    assert [line_in(noise(seed, colour)) for seed in range(100)].count(None) >= 99


def test_equations_with_a_line_leave_it_out():
    turned = 2.0 * np.pi * 2.7 * TIMES
    rest = np.column_stack([noise(2), noise(3)])
    target = rest + np.outer(np.sin(turned + 1.0), [0.0, 4.0])
    equation = Equation(PLACE, TIMES, target, {}, target)
    own, other = Line(PLACE, 1, 2.7, 4.0, 0.0), Line(Place(Channel.TENSION, "a"), 0, 2.7, 4.0, 0.0)
    (found,) = with_lines([equation], [own, other])
    left = found.left
    np.testing.assert_array_equal(left[:, 0], target[:, 0])
    assert np.std(left[:, 1] - rest[:, 1]) < 0.1
    assert with_lines([equation], [other])[0] is equation
