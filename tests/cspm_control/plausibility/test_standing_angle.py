"""An encoder that stands while its motor turns, told from a motor that stands."""

import numpy as np
import pytest

from cspm_control.plausibility.standing_angle import StandingAngle

MS = 1_000_000
COUNTS = 2.0 * np.pi / 8192
NOISE = 0.01


def judge():
    return StandingAngle(("a", "b"), (0.0, NOISE), COUNTS, 0.05)


def rows(speed, count=1000, seed=2, offset=0.0):
    """States of two motors at a speed, one a ms: angles in counts, speeds with noise."""
    times = 1e-3 * np.arange(count)
    noise = NOISE * np.random.default_rng(seed).standard_normal((count, 2))
    angle = np.floor(speed * times / COUNTS) * COUNTS
    found = np.zeros((count, 6))
    found[:, :2] = angle[:, None]
    found[:, 2:4] = speed + offset + noise
    return found


def says(judge, states):
    return [judge.fault(i * MS, row) for i, row in enumerate(states)]


@pytest.mark.parametrize("speed", [0.0, 0.005, 0.3, -40.0])
def test_a_motor_that_turns_and_one_that_stands_are_healthy(speed):
    assert not any(says(judge(), rows(speed)))


def test_a_speed_that_is_a_little_off_or_runs_out_is_healthy():
    assert not any(says(judge(), rows(0.0, 20_000, offset=0.1)))
    filtered = rows(0.0)
    filtered[:, 2:4] += 30.0 * np.exp(-np.arange(1000) / 8.0)[:, None]
    assert not any(says(judge(), filtered))


@pytest.mark.parametrize("speed", [1.0, -1.0, 40.0])
def test_an_encoder_that_stands_is_named(speed):
    states = rows(speed)
    states[300:, 1] = states[299, 1]
    found = says(judge(), states)
    first = next(i for i, text in enumerate(found) if text)
    assert 349 <= first < 370
    assert found[first].startswith("/winches/state: the same angle of b for ")
    assert found[first].endswith("(sensors./winches/state): a stuck encoder?")
