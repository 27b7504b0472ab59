import numpy as np
import pytest

from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.sensor_spec import Sensor
from cspm_msgs_py.topics import contract_topics
from cspm_sim.sensors import SensorModel

TOPICS = contract_topics(["left", "right"], has_bar=True, has_winch_frame=True)
PERIOD_NS = 1_000_000
POSE = np.array([0.1, -0.2, 2.0, 0.3, -0.4, 0.5])
WINCHES = np.array([1.0, -2.0, 3.0, -4.0, 0.5, -0.6])
TENSIONS = np.array([7.0, 9.0])


def sensor(name, *, ideal=False, rate=1000, seed=1, period_ns=PERIOD_NS, **description):
    spec = Sensor(**{"noise": 0.0, "resolution": 0.0, "rate": 1000, **description})
    return SensorModel(TOPICS[name], spec, rate=rate, period_ns=period_ns, seed=seed, ideal=ideal)


def observed(model, steps, values):
    """Offer values at `steps` steps; return arrival steps, stamps and rows."""
    at = values if callable(values) else lambda step: values
    found = [(step, model.observe(step, step * PERIOD_NS, at(step))) for step in range(steps)]
    arrived = [(step, *message) for step, message in found if message is not None]
    arrivals, stamps, rows = zip(*arrived, strict=True)
    return np.array(arrivals), np.array(stamps), np.array(rows)


def test_noise_has_the_described_deviation_per_quantity_and_is_white():
    noise = (0.01, 0.2, 0.003)
    model = sensor("/winches/state", noise=noise, resolution=(0.0, 0.0, 0.0))
    *_, rows = observed(model, 20_000, WINCHES)
    deviations = np.repeat(noise, 2)
    errors = (rows - WINCHES) / deviations
    bound = 4.5 / np.sqrt(len(errors))
    assert np.abs(errors.mean(axis=0)).max() < bound
    np.testing.assert_allclose(errors.std(axis=0), 1.0, atol=bound)
    # Neither one sample of the next, nor one quantity of another, shows anything.
    for lag in (1, 2, 10, 1000):
        assert np.abs((errors[lag:] * errors[:-lag]).mean(axis=0)).max() < bound
    correlation = np.corrcoef(errors.T) - np.eye(6)
    assert np.abs(correlation).max() < bound
    # Gaussian: 4.55 % beyond two deviations, 0.27 % beyond three.
    shares = [(np.abs(errors) > k).mean() for k in (2, 3)]
    np.testing.assert_allclose(shares, [0.0455, 0.0027], rtol=0.1)


def test_resolution_puts_values_on_the_nearest_step():
    model = sensor("/cables/tension", noise=0.02, resolution=0.005)
    *_, rows = observed(model, 500, TENSIONS)
    np.testing.assert_allclose(rows / 0.005, np.round(rows / 0.005), atol=1e-9)
    assert len(np.unique(rows[:, 0])) > 5
    exact = sensor("/cables/tension", resolution=0.005)
    *_, rows = observed(exact, 100, lambda step: np.full(2, 0.0007 * step))
    assert np.abs(rows[:, 0] - 0.0007 * np.arange(100)).max() <= 0.0025 + 1e-12


def test_delay_moves_the_arrival_and_not_the_stamp():
    model = sensor("/cables/tension", delay=0.007, rate=100)
    arrivals, stamps, rows = observed(model, 1000, lambda step: np.full(2, float(step)))
    np.testing.assert_array_equal(arrivals, np.arange(7, 1000, 10))
    np.testing.assert_array_equal(stamps, (arrivals - 7) * PERIOD_NS)
    # The value is that of the stamped instant.
    np.testing.assert_array_equal(rows[:, 0], arrivals - 7)


@pytest.mark.parametrize(("rate", "delay"), [(1000, 0.0), (1000, 0.025), (100, 0.025), (50, 0.02)])
def test_no_sample_is_lost(rate, delay):
    model = sensor("/cables/tension", delay=delay, rate=rate)
    _, stamps, _ = observed(model, 400, TENSIONS)
    late = round(delay * 1000)
    np.testing.assert_array_equal(stamps, np.arange(0, 400 - late, 1000 // rate) * PERIOD_NS)


def test_the_grid_is_that_of_the_plants_period():
    model = sensor("/cables/tension", rate=100, period_ns=500_000)
    due = [step for step in range(100) if model.observe(step, step * 500_000, TENSIONS)]
    assert due == [0, 20, 40, 60, 80]


def test_the_same_seed_gives_the_same_bits_and_another_does_not():
    def rows(name, seed, count=1500):
        width = 1 if name == "/cables/tension" else 2
        model = sensor(name, noise=(0.1,) * width, resolution=(0.0,) * width, seed=seed)
        return observed(model, count, np.zeros(2 if width == 1 else 6))[2]

    first = rows("/cables/tension", 1)
    assert first.tobytes() == rows("/cables/tension", 1).tobytes()
    # More samples do not change earlier ones.
    assert first.tobytes() == rows("/cables/tension", 1, 3500)[:1500].tobytes()
    assert not np.isin(first, rows("/cables/tension", 2)).any()
    twists = [rows(f"/{body}/twist", 1) for body in ("bar", "winch_frame")]
    assert not np.isin(*twists).any()


def test_an_ideal_sensor_measures_the_truth_at_once():
    description = {"noise": (0.1, 0.1), "resolution": (0.5, 0.5), "delay": 0.01}
    model = sensor("/bar/twist", ideal=True, **description)
    truth = np.random.default_rng(0).normal(size=(50, 6))
    arrivals, stamps, rows = observed(model, 50, lambda step: truth[step])
    np.testing.assert_array_equal(arrivals, np.arange(50))
    np.testing.assert_array_equal(stamps, np.arange(50) * PERIOD_NS)
    assert rows.tobytes() == truth.tobytes()


def test_a_sample_does_not_change_with_the_plant():
    model = sensor("/cables/tension", delay=0.002)
    values = TENSIONS.copy()
    model.observe(0, 0, values)
    values[:] = 0.0
    model.observe(1, PERIOD_NS, values)
    _, row = model.observe(2, 2 * PERIOD_NS, values)
    np.testing.assert_array_equal(row, TENSIONS)


def test_pose_noise_acts_on_position_and_angles():
    model = sensor("/bar/pose", noise=(5e-5, 1e-4), resolution=(0.0, 0.0))
    *_, rows = observed(model, 10_000, POSE)
    assert rows.shape == (10_000, 7)
    np.testing.assert_allclose(np.linalg.norm(rows[:, 3:], axis=1), 1.0, atol=1e-14)
    angles = np.array([euler_from_quaternion(row[3:]) for row in rows])
    errors = np.hstack([rows[:, :3], angles]) - POSE
    np.testing.assert_allclose(errors[:, :3].std(axis=0), 5e-5, rtol=0.04)
    np.testing.assert_allclose(errors[:, 3:].std(axis=0), 1e-4, rtol=0.04)
    assert np.abs(errors.mean(axis=0) / np.repeat([5e-5, 1e-4], 3)).max() < 0.045


def test_pose_resolution_acts_on_angles_and_comes_back_from_the_quaternion():
    model = sensor("/bar/pose", noise=(0.0, 0.0), resolution=(0.01, 0.07))
    _, row = model.observe(0, 0, POSE)
    np.testing.assert_allclose(row[:3], [0.1, -0.2, 2.0], atol=1e-12)
    np.testing.assert_allclose(euler_from_quaternion(row[3:]), [0.28, -0.42, 0.49], atol=1e-12)


def test_a_rate_above_the_sensors_is_refused():
    spec = Sensor(noise=(0.0, 0.0), resolution=(0.0, 0.0), rate=100)
    settings = {"period_ns": PERIOD_NS, "seed": 1, "ideal": True}
    SensorModel(TOPICS["/bar/pose"], spec, rate=100, **settings)
    with pytest.raises(InputError) as caught:
        SensorModel(TOPICS["/bar/pose"], spec, rate=200, **settings)
    assert str(caught.value) == (
        "rates: /bar/pose at 200 Hz, allowed: at most 100 Hz, the sensor's"
    )


def test_a_delay_between_two_steps_is_refused():
    with pytest.raises(InputError) as caught:
        sensor("/cables/tension", delay=0.0015)
    assert str(caught.value) == (
        "sensors./cables/tension.delay: 0.0015 s, allowed: a multiple of the plant's period of"
        " 0.001 s"
    )
    sensor("/cables/tension", delay=0.0015, period_ns=500_000)
    sensor("/cables/tension", delay=0.0015, ideal=True)
