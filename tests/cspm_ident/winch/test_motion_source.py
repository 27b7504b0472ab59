"""Accelerations against the noise of the angle, and of stamps that scatter."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from winch_samples import EFFECTS, STEP, Winch, closed_loop

from cspm_ident.diagnosis.residuals.winch_torque import shaft_equations
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.prediction_noise import prediction_noise
from cspm_ident.signals.samples import Samples
from cspm_ident.winch import identify_winch
from cspm_ident.winch.identify_winches import identify_winches
from cspm_ident.winch.motion_source import source_of, speed_agrees, with_source
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import catalogue

WINCH = Winch()
SCENARIOS = Path(__file__).resolve().parents[3] / "scenarios"


@pytest.fixture(scope="module")
def made():
    return closed_loop(WINCH, 8000, torque_noise=0.005, seed=12)


def speed_of(made):
    """As a drive reports it."""
    return Samples(made.angle.times, np.gradient(made.angle.values, STEP, axis=0))


def scattered(samples, every=4, share=0.4):
    """Every so manieth reading, its stamp off by up to a share of the time between two."""
    times, values = samples.times[::every], samples.values[::every]
    apart = share * every * STEP * np.random.default_rng(3).uniform(-1.0, 1.0, len(times))
    return Samples(times + apart, values)


@pytest.mark.parametrize("apart", [np.full(4000, STEP), None])
def test_noise_is_what_a_cubic_does_not_predict(apart):
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.2, 1.8, 4000) * STEP if apart is None else apart)
    smooth = 2.0 * np.sin(2.0 * np.pi * 1.1 * times)
    noisy = Samples(times, (smooth + 1e-3 * rng.standard_normal(4000))[:, None])
    assert np.sqrt(prediction_noise(noisy)) == pytest.approx(1e-3, rel=0.05)
    assert np.sqrt(prediction_noise(Samples(times, smooth[:, None]))) < 1e-5


def by_angle(signals):
    return source_of([signals], EFFECTS, reversals=False)


@pytest.mark.parametrize("steps", [2e-4, 2e-2])
def test_the_less_noisy_of_angle_and_speed_is_taken(made, steps):
    """An encoder's steps of 0.2 and 20 mrad, against a speed's of 40 mrad/s."""
    coarse = Samples(made.angle.times, steps * np.round(made.angle.values / steps))
    coarse = dataclasses.replace(made, angle=coarse)
    speed = speed_of(made)
    reported = Samples(speed.times, 0.04 * np.round(speed.values / 0.04))
    found = with_source(coarse, reported)
    assert found.speed is (reported if steps > 1e-3 else None)
    assert with_source(coarse, None) is coarse


def test_a_quiet_speed_is_not_taken_where_it_is_late_or_filtered(made):
    noisy = made.angle.values + 2e-5 * np.random.default_rng(2).standard_normal((8000, 1))
    noisy = dataclasses.replace(made, angle=Samples(made.angle.times, noisy))
    quiet = speed_of(made)
    late = Samples(quiet.times, np.roll(quiet.values, 6, axis=0))
    slow = lfilter([0.2], [1.0, -0.8], quiet.values, axis=0)
    assert with_source(noisy, quiet).speed is quiet
    for wrong in (late, Samples(quiet.times, slow)):
        assert speed_agrees(noisy.angle, wrong)
        assert with_source(noisy, wrong).speed is None


def test_scattering_stamps_hide_accelerations(made):
    jittered = dataclasses.replace(made, angle=scattered(made.angle))
    found = by_angle(jittered)
    assert not found.shows_acceleration
    # Uniform: 0.4/√3 of the period.
    assert found.stamp_error == pytest.approx(0.4 * 4 * STEP / np.sqrt(3.0), rel=0.25)
    inertia = identify_winch(found.signals, EFFECTS, reversals=False).estimate.values[0]
    assert inertia < (1.0 - 0.7 * found.noise_share) * WINCH.inertia


def test_many_readings_in_a_window_average_their_stamps_scatter(made):
    jittered = dataclasses.replace(made, angle=scattered(made.angle, every=1))
    found = by_angle(jittered)
    assert found.shows_acceleration
    inertia = identify_winch(found.signals, EFFECTS, reversals=False).estimate.values[0]
    assert inertia == pytest.approx(WINCH.inertia, rel=0.03)


def test_the_drives_speed_shows_them_instead(made):
    reported = scattered(speed_of(made))
    found = with_source(dataclasses.replace(made, angle=scattered(made.angle)), reported)
    assert found.speed is reported
    assert by_angle(found).shows_acceleration
    estimate = identify_winch([found], EFFECTS, reversals=False).estimate
    np.testing.assert_allclose(estimate.values[:3], WINCH.values[:3], rtol=0.05)


@pytest.mark.parametrize("held_out", [0, 1])
def test_the_drives_speed_serves_with_recordings_held_out_and_without(made, held_out):
    every = [
        Measurement(
            Path(name),
            name,
            load_testbed(SCENARIOS / "testbeds" / "emps.yaml"),
            angle=scattered(made.angle),
            speed=scattered(speed_of(made)),
            torque=made.torque,
        )
        for name in ("searched", "judging")[: 1 + held_out]
    ]
    found = identify_winches(every[:1], held_out=every[1:], torque_age=made.torque_age)
    (winch,) = found.winches
    assert winch.from_speed
    assert [each.held_out for each in winch.judgements] == [False, True][: 1 + held_out]
    np.testing.assert_allclose(winch.fit.estimate.values[:3], WINCH.values[:3], rtol=0.05)


def at_30_hz(jitter, steps):
    """Two swings; an angle read up to `jitter` periods beside its stamp, a speed in `steps`."""
    rng, rates = np.random.default_rng(4), 2.0 * np.pi * np.array([0.23, 0.61])
    times = np.arange(3000) / 30.0
    turned = Samples(times, swings(times + jitter / 30.0 * rng.uniform(-1.0, 1.0, 3000), rates, 0))
    speed, pull = (swings(times, rates, order) for order in (1, 2))
    torque = WINCH.inertia * pull + WINCH.viscous * speed + WINCH.coulomb * np.sign(speed)
    torque += WINCH.constant + 0.002 * rng.standard_normal(torque.shape)
    machine = load_testbed(SCENARIOS / "testbeds" / "emps.yaml")
    stepped = turned.of_others(steps * np.round(speed / steps))
    sensors = {"angle": turned, "speed": stepped, "torque": turned.of_others(torque)}
    return Measurement(Path("some"), "", machine, **sensors)


def swings(times, rates, derivative):
    """Of 3 rad each, or a derivative of them."""
    phases = np.outer(times, rates) + 0.5 * np.pi * derivative
    return 3.0 * (rates**derivative * np.sin(phases)).sum(axis=1, keepdims=True)


@pytest.mark.parametrize(("jitter", "steps", "by_speed"), [(0.4, 1e-3, True), (0.0, 1.0, False)])
def test_identification_and_diagnosis_agree_on_a_recording_of_30_hz(jitter, steps, by_speed):
    recorded = at_30_hz(jitter, steps)
    (found,) = identify_winches([recorded], effects=EFFECTS, reversals=False).winches
    assert found.from_speed is by_speed
    effects = [catalogue()[name] for name in ("winch_inertia", *EFFECTS)]
    (equation,) = shaft_equations(recorded, effects, (), None, ["carriage"])
    rows = equation.steady
    columns = np.concatenate([each[:, 0] for each in rows.columns.values()], axis=1)
    diagnosed = np.linalg.lstsq(columns, rows.target[:, 0], rcond=None)[0]
    diagnosed[0] += recorded.machine.cables[0].rotor_inertia
    scale = np.abs(WINCH.values)
    assert np.abs((diagnosed - found.fit.estimate.values) / scale).max() < 0.01
    assert np.abs((diagnosed - WINCH.values) / scale).max() < 0.01


def test_a_speed_in_another_unit_is_none(made):
    speed = speed_of(made)
    assert speed_agrees(made.angle, speed)
    for wrong in (speed.values / 60.0, -speed.values, 1.2 * speed.values):
        assert not speed_agrees(made.angle, Samples(speed.times, wrong))
