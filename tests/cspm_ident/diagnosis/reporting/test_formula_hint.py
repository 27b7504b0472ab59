"""Formulas that are hints."""

import numpy as np
import pytest

from cspm_ident.diagnosis.reporting.formula_hint import sketch

GEAR = 101.0


@pytest.mark.parametrize("name", ["angle", "speed"])
def test_gravity_on_a_joint_hints_at_a_gear_that_the_file_lacks(name):
    """A wave of the motor's angle with a period of its own; of a speed it would mean nothing."""
    knots = np.linspace(-300.0, 330.0, 7)
    said = sketch(knots, 0.03 * np.cos(knots / GEAR + 0.4), name)
    if name == "speed":
        assert said is None
        return
    assert said.startswith("0.03·cosine of angle/")
    assert said.endswith(" (is gear_ratio missing?)")
    assert float(said.split("/")[1].split()[0]) == pytest.approx(GEAR, rel=0.02)


def test_a_wave_once_per_turn_needs_no_gear():
    knots = np.linspace(-3.0, 4.0, 7)
    assert sketch(knots, 2.0 * np.cos(knots), "angle") == "2·cosine of angle/1"


@pytest.mark.parametrize("seed", range(5))
def test_noise_at_the_knots_is_no_wave_and_no_alias_of_one(seed):
    rng = np.random.default_rng(seed)
    assert (
        sketch(
            np.linspace(0.0, 600.0, 7), rng.choice([-1.0, 1.0], 7) * [1, 3, 1, 2, 3, 1, 2], "angle"
        )
        is None
    )
