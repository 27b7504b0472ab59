"""One stuck quantity among others that go on, told from one that may well repeat."""

import numpy as np
import pytest

from cspm_control.plausibility.repeated_quantity import RepeatedQuantity

MS = 1_000_000
ALLOWED = 0.05
TOPIC, NAMES = "/cables/tension", ("effort of a", "effort of b", "effort of c")
DEVIATION = 0.02


def judge(noise=DEVIATION, resolution=0.005):
    return RepeatedQuantity(TOPIC, NAMES, [noise] * 3, [resolution] * 3, ALLOWED)


def readings(count, step=0.005, seed=5):
    """Readings of three cells with noise, rounded."""
    drawn = 10.0 + DEVIATION * np.random.default_rng(seed).standard_normal((count, 3))
    return np.round(drawn / step) * step if step else drawn


def says(judge, rows, period=1):
    return [judge.fault(i * period * MS, row) for i, row in enumerate(rows)]


def frozen(rows, begin, column):
    held = rows.copy()
    held[begin:, column] = held[begin - 1, column]
    return held


@pytest.mark.parametrize("column", range(3))
@pytest.mark.parametrize("step", [0.0, 0.005])
def test_one_of_several_is_named_once_it_is_older_than_allowed(column, step):
    found = says(judge(resolution=step), frozen(readings(300, step), 200, column))
    assert found[:250] == [None] * 250
    assert found[251] == (
        f"{TOPIC}: the same {NAMES[column]} for 52 ms, allowed: 50 ms (safety.stale_after): a"
        " stuck sensor?"
    )


def test_all_that_go_on_are_healthy_for_long():
    """Also one that is rounded more coarsely than its test-bed says."""
    for step in (0.0, 0.005, 0.02):
        assert not any(says(judge(), readings(20_000, step)))


def test_it_is_healthy_again_with_another_reading():
    rows = frozen(readings(400), 200, 1)
    rows[300:, 1] = readings(400, seed=7)[300:, 1]
    found = says(judge(), rows)
    assert found[299] is not None
    assert not any(found[300:])


@pytest.mark.parametrize("noise", [0.0, 0.001])
def test_one_without_noise_or_coarser_than_it_may_repeat_for_ever(noise):
    rows = frozen(readings(500), 200, 1)
    assert not any(says(judge(noise), rows))


def test_zero_may_repeat_and_what_never_was_noisy():
    rows = readings(500)
    rows[200:, 1] = 0.0
    rows[:, 2] = 4.0
    assert not any(says(judge(), rows))
    rows[200:, 1] = 0.005
    assert any(says(judge(), rows))


def test_seldom_readings_need_as_many_repetitions():
    found = says(judge(), frozen(readings(300), 200, 1), period=10)
    first = next(i for i, text in enumerate(found) if text)
    assert first == 239
