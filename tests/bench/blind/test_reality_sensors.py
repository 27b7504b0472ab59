"""Sensors of the concealed machine: their noise, their clocks, what they lose."""

import numpy as np
import pytest

from cspm_msgs_py.sensor_spec import Sensor
from cspm_msgs_py.topics import contract_topics

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind.reality.sensors import COLOUR_TIME, PLAIN, QUALITIES, REAL, RealSensor

TOPICS = contract_topics(["a", "b"], has_bar=True, has_winch_frame=True)
GIVEN = QUALITIES[REAL]
MS = 1_000_000
STEPS = 40_000


def read(topic, spec, values, rate=1000, seed=1, faults=(), steps=STEPS):
    sensor = RealSensor(TOPICS[topic], spec, rate=rate, period_ns=MS, seed=seed, faults=faults)
    found = [sensor.observe(step, step * MS, values) for step in range(steps)]
    return [each for each in found if each is not None]


@pytest.fixture(scope="module")
def readings():
    return read("/cables/tension", Sensor(noise=(0.02,), resolution=(0.0,), rate=1000), np.ones(2))


def test_noise_of_one_reading_is_the_test_beds_and_part_of_it_is_coloured(readings):
    noise = np.array([row for _, row in readings]) - 1.0
    assert noise.std(axis=0) == pytest.approx([0.02, 0.02], rel=0.05)
    after = round(2e-3 / 1e-3)
    correlation = np.corrcoef(noise[:-after, 0], noise[after:, 0])[0, 1]
    expected = GIVEN.coloured_share * np.exp(-2e-3 / COLOUR_TIME)
    assert correlation == pytest.approx(expected, abs=0.04)


def test_some_readings_are_lost_and_stamps_jitter_about_a_clock_of_their_own(readings):
    lost = 1.0 - len(readings) / STEPS
    assert 0.2 * GIVEN.dropout < lost < 3.0 * GIVEN.dropout
    stamps = np.array([stamp for stamp, _ in readings])
    assert (np.diff(stamps) > 0).all()
    beside = stamps[1:] - MS * np.round(stamps[1:] / MS)
    drift = np.polyfit(np.arange(len(beside)), beside, 1)
    beside = beside - np.polyval(drift, np.arange(len(beside)))
    assert beside.std() == pytest.approx(1e9 * GIVEN.jitter, rel=0.1)
    other = read("/bar/pose", Sensor(noise=(0.0, 0.0), resolution=(0.0, 0.0), rate=1000),
                 np.zeros(6), steps=500)  # fmt: skip
    assert abs(np.mean([s % MS for s, _ in other[1:]]) - np.mean(stamps[1:] % MS)) > 1000.0


def test_readings_come_in_steps_and_at_the_sensors_rate():
    spec = Sensor(noise=(1.0,), resolution=(0.25,), rate=1000)
    rows = [row for _, row in read("/cables/tension", spec, np.ones(2), rate=100, steps=2000)]
    assert 195 <= len(rows) <= 200
    assert np.unique(np.mod(rows, 0.25)).tolist() == [0.0]


def test_a_pose_is_given_as_a_quaternion():
    spec = Sensor(noise=(0.0, 0.0), resolution=(0.0, 0.0), rate=1000)
    _, row = read("/bar/pose", spec, np.array([1.0, 2, 3, 0, 0, np.pi / 2]), steps=1)[0]
    assert row == pytest.approx([1, 2, 3, 0, 0, np.sqrt(0.5), np.sqrt(0.5)])


def test_faults_act_before_noise_and_one_seed_gives_one_series():
    spec = Sensor(noise=(0.1,), resolution=(0.0,), rate=1000)
    plain, same, faulty = (
        read("/cables/tension", spec, np.ones(2), seed=4, faults=f, steps=50)
        for f in ((), (), (lambda values, time: values + 10.0 * time,))
    )
    assert np.array_equal([r for _, r in plain], [r for _, r in same])
    moved = np.array([r for _, r in faulty]) - np.array([r for _, r in plain])
    assert moved[-1] == pytest.approx(10.0 * 0.049 * np.ones(2))


def test_plain_sensors_are_white_complete_and_on_time():
    spec = Sensor(noise=(1.0,), resolution=(0.0,), rate=1000)
    sensor = RealSensor(
        TOPICS["/cables/tension"], spec, rate=1000, period_ns=MS, seed=1, quality=QUALITIES[PLAIN]
    )
    found = [sensor.observe(step, step * MS, np.zeros(2)) for step in range(5000)]
    assert [stamp for stamp, _ in found] == [step * MS for step in range(5000)]
    noise = np.array([row[0] for _, row in found])
    assert abs(np.corrcoef(noise[:-1], noise[1:])[0, 1]) < 4.0 / np.sqrt(5000)


def test_a_fast_clock_runs_ahead_of_one_that_is_not_by_its_skew():
    spec = Sensor(noise=(0.0,), resolution=(0.0,), rate=1000)
    topic, stamps = TOPICS["/cables/tension"], []
    for skew in (0.0, 1e-4):
        sensor = RealSensor(topic, spec, rate=1000, period_ns=MS, seed=1, quality=QUALITIES[PLAIN],
                            skew=skew)  # fmt: skip
        stamps.append([sensor.observe(k, k * MS, np.ones(2))[0] for k in (0, 5000, 10_000)])
    assert np.subtract(stamps[1], stamps[0]).tolist() == [0, 500_000, 1_000_000]
