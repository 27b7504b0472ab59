"""Factors between signals are found through noise, and named."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cspm_ros.check_drivers.driver_relation import (
    DEGREES,
    SPEED_UNITS,
    Series,
    factor_fault,
    grouped,
    rate_relation,
    value_relation,
    verdict_on,
)

UNITS = {1000.0: "in millimetres", 1.0 / 9.80665: "in kilograms"}


def swinging(seed, count=2000, rate=1000.0):
    """Times, a sum of slow sines and its exact derivative."""
    rng = np.random.default_rng(seed)
    times = np.arange(count) / rate
    omega, phase = rng.uniform(2.0, 12.0, (2, 3))
    value = np.sin(np.outer(times, omega) + phase).sum(axis=1)
    rate_of_it = (np.cos(np.outer(times, omega) + phase) * omega).sum(axis=1)
    return times, value, rate_of_it


class TestRate:
    @given(
        exponent=st.floats(-3.0, 3.0), sign=st.sampled_from([-1.0, 1.0]), seed=st.integers(0, 1000)
    )
    def test_the_factor_is_found_whatever_its_size(self, exponent, sign, seed):
        times, value, speed = swinging(seed)
        rng = np.random.default_rng(seed)
        factor = sign * 10.0**exponent
        measured = factor * (speed + rng.normal(0.0, 0.05, len(times)))
        coarse = 1e-3 * np.round((value + rng.normal(0.0, 1e-4, len(times))) / 1e-3)
        relation = rate_relation(Series(times, coarse), Series(times, measured))
        assert relation.clear
        assert relation.factor == pytest.approx(factor, rel=0.03)
        assert abs(relation.correlation) > 0.99

    def test_clocks_of_both_may_differ_in_rate_and_start(self):
        times, value, speed = swinging(5)
        slow = Series(times[::10], value[::10])
        relation = rate_relation(slow, Series(times[100:], speed[100:]))
        assert relation.factor == pytest.approx(1.0, rel=0.03)

    def test_noise_alone_cannot_decide(self):
        rng = np.random.default_rng(6)
        times = np.arange(2000) * 1e-3
        noise = [Series(times, rng.normal(0.0, 1.0, 2000)) for _ in range(2)]
        assert verdict_on(rate_relation(*noise), {}, "it") == (
            None,
            "cannot decide whether it is it: it hardly moves",
        )

    def test_a_rate_of_zero_beside_a_moving_value_is_wrong(self):
        times, value, _ = swinging(7)
        relation = rate_relation(Series(times, value), Series(times, np.zeros(len(times))))
        assert verdict_on(relation, {}, "its rate", ": why?") == (False, "is not its rate: why?")

    def test_an_unrelated_rate_is_wrong(self):
        times, value, _ = swinging(8)
        _, _, other = swinging(9)
        verdict = verdict_on(rate_relation(Series(times, value), Series(times, other)), {}, "it")
        assert verdict == (False, "is not it")

    def test_too_short_a_time_cannot_decide(self):
        times, value, speed = swinging(10, count=100)
        relation = rate_relation(Series(times, value), Series(times, speed))
        assert verdict_on(relation, {}, "it")[0] is None


class TestValue:
    def test_a_constant_between_both_does_not_matter(self):
        times, value, _ = swinging(11)
        relation = value_relation(Series(times, value), Series(times, 7.0 - value), 1e-3)
        assert relation.factor == pytest.approx(-1.0)

    @pytest.mark.parametrize(("floor", "clear"), [(1e-3, True), (1.0, False)])
    def test_changes_within_the_floor_do_not_count(self, floor, clear):
        times, value, _ = swinging(12)
        assert value_relation(Series(times, value), Series(times, value), floor).clear is clear


def test_noise_is_estimated_beside_motion_and_steps():
    rng = np.random.default_rng(13)
    times, value, _ = swinging(13)
    noisy = Series(times, value + rng.normal(0.0, 0.01, len(times)))
    assert noisy.noise == pytest.approx(0.01, rel=0.1)
    stepped = Series(times, 0.01 * np.round(value / 0.01))
    assert 0.005 <= stepped.noise < 0.012
    assert Series(times[:3], value[:3]).noise == np.inf


@pytest.mark.parametrize(
    ("factor", "fault"),
    [
        (1.0, ""),
        (1.09, ""),
        (-0.95, "its sign inverted"),
        (1040.0, "in millimetres"),
        (-980.0, "in millimetres, its sign inverted"),
        (0.1, "in kilograms"),
        (1.2, "times 1.2"),
        (-3.0, "times -3"),
    ],
)
def test_a_factor_is_said_in_words(factor, fault):
    assert factor_fault(factor, UNITS) == fault


def test_no_two_units_of_speed_are_confused():
    for factor, phrase in SPEED_UNITS.items():
        assert factor_fault(factor * 1.05, SPEED_UNITS) == phrase
    assert factor_fault(DEGREES, SPEED_UNITS) == "in degrees per second"


def test_equal_verdicts_are_said_once():
    verdicts = {"a": (True, "fine"), "b": (False, "bad"), "c": (True, "fine")}
    assert [(f.ok, f.text) for f in grouped("/t", "check", verdicts)] == [
        (True, "a, c: fine"),
        (False, "b: bad"),
    ]
    assert grouped("/t", "check", dict.fromkeys("ab", (True, "fine")))[0].text == "all: fine"
    assert grouped("/t", "check", {"a": (True, "fine")})[0].text == "a: fine"
