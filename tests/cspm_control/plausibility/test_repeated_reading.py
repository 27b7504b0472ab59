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


def test_a_noisy_sensor_may_repeat_as_long_as_silence_is_allowed():
    found = judged(RepeatedReading(POSE, [0.001], [0.0], ALLOWED), [[1.0]] * 7)
    assert found[:6] == [None] * 6
    assert found[6] == f"{POSE}: {FROZEN}"


def test_one_bit_of_difference_begins_again():
    rows = [[1.0]] * 5 + [[np.nextafter(1.0, 2.0)]] * 6
    assert judged(RepeatedReading(POSE, [0.001], [0.0], ALLOWED), rows) == [None] * 11
    both = RepeatedReading(POSE, [0.001, 0.001], [0.0, 0.0], ALLOWED)
    assert judged(both, [[1.0, float(i % 2)] for i in range(30)]) == [None] * 30


def test_an_exact_sensor_may_repeat_for_ever():
    assert judged(RepeatedReading(POSE, [0.0], [0.001], ALLOWED), [[1.0]] * 500) == [None] * 500
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
