"""A sensor that sends and measures no more, told from one whose reading may well repeat."""

import math

import numpy as np
from run_samples import bundle_of

from cspm_control.plausibility.make import make_plausibility
from cspm_control.plausibility.repeated_reading import RepeatedReading, repeats_needed

MS = 1_000_000
ALLOWED = 0.05
POSE, FROZEN = "/bar/pose", "the same reading for 60 ms, allowed: 50 ms (safety.stale_after)"


def judged(reading, rows, period=10):
    return [reading.fault(i * period * MS, np.asarray(row)) for i, row in enumerate(rows)]


def noise(count=40, width=1):
    """Readings of white noise, which end with one of ones."""
    rng = np.random.default_rng(5)
    return [*(1.0 + 1e-3 * rng.standard_normal((count, width))), np.ones(width)]


def test_a_noisy_sensor_may_repeat_as_long_as_silence_is_allowed():
    rows = [*noise(), *[[1.0]] * 6]
    found = judged(RepeatedReading(POSE, [0.001], [0.0], ALLOWED), rows)
    assert found[:-1] == [None] * (len(rows) - 1)
    assert found[-1] == f"{POSE}: {FROZEN}"


def test_a_motion_that_hides_the_noise_does_not_hide_a_stuck_sensor():
    moving = 1.0 + 0.05 * np.arange(1.0, 201.0)[:, None]
    rows = [*noise(), *moving, *[moving[-1]] * 6]
    found = judged(RepeatedReading(POSE, [0.001], [0.0], ALLOWED), rows)
    assert found[:-1] == [None] * (len(rows) - 1)
    assert found[-1] == f"{POSE}: {FROZEN}"


def test_what_never_was_noisy_may_repeat_for_ever():
    """A driver that repeats a constant, and one that simulates without noise and comes to rest."""
    constant = [[1.0]] * 300
    settling = [*(1.0 + np.exp(-np.arange(100.0)[:, None] / 9.0)), *[[1.0]] * 200]
    for rows in (constant, settling):
        reading = RepeatedReading(POSE, [0.001], [0.0], ALLOWED)
        assert judged(reading, rows) == [None] * len(rows)


def test_one_bit_of_difference_begins_again():
    rows = [*noise(), *[[1.0]] * 5, *[[np.nextafter(1.0, 2.0)]] * 6]
    assert judged(RepeatedReading(POSE, [0.001], [0.0], ALLOWED), rows) == [None] * len(rows)
    both = RepeatedReading(POSE, [0.001, 0.001], [0.0, 0.0], ALLOWED)
    halved = [*noise(width=2), *[[1.0, float(i % 2)] for i in range(60)]]
    assert judged(both, halved) == [None] * len(halved)


def test_an_exact_sensor_may_repeat_for_ever():
    rows = [*noise(), *[[1.0]] * 500]
    assert judged(RepeatedReading(POSE, [0.0], [0.001], ALLOWED), rows) == [None] * len(rows)
    assert repeats_needed([0.0], [0.0]) == math.inf


def test_a_coarse_sensor_may_repeat_for_ever():
    assert repeats_needed([0.001], [1.0]) == math.inf


def test_the_chance_of_a_repetition_is_that_of_rounded_noise():
    """Readings of a quantity at rest, drawn: the independent road."""
    rng, deviation, step = np.random.default_rng(3), 0.02, 0.01
    drawn = np.round((rng.uniform() + deviation * rng.standard_normal(400_000)) / step)
    chance = float((drawn[1:] == drawn[:-1]).mean())
    needed = repeats_needed([deviation], [step])
    assert abs(needed - math.log(1e12) / -math.log(chance)) < 1.5
    assert repeats_needed([deviation] * 8, [step] * 8) < needed


def test_nodes_judge_the_sensors_that_they_read():
    bundle = bundle_of("rest")
    machine = bundle.testbed.testbed

    def topics(node, scenario=bundle.scenario):
        return set(make_plausibility(node, scenario, machine).repeated)

    assert POSE in topics("motion_controller")
    assert topics("force_controller") == {"/cables/tension"}
    ideal = bundle_of("rest", "sensors=ideal").scenario
    assert topics("motion_controller", ideal) == set()
