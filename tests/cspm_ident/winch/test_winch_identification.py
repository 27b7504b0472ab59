from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from winch_samples import EFFECTS, STEP, Winch, closed_loop, readings

from cspm_ident.estimation import Interval
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.winch import identify_winch, torque_error, winch_signals
from cspm_ident.winch.weak_form import make_window, weigh
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed, parse_testbed

WINCH = Winch()
SCENARIOS = Path(__file__).resolve().parents[3] / "scenarios"


def test_window_integrates_by_parts():
    """∫φ·q̈ for a curve without closed form on the grid: by quadrature of what is known of it."""
    half, step = 40, 1e-3
    window = make_window(half, step)
    time = np.arange(-half, half + 1) * step
    assert window.weights.sum() == pytest.approx(1.0, rel=1e-12)
    found = weigh(window.second, np.exp(9.0 * time), 1)[0]

    def phi(t):
        return (1.0 - (t / 0.04) ** 2) ** 4

    area = quad(phi, -0.04, 0.04)[0]
    expected = quad(lambda t: phi(t) / area * 81.0 * np.exp(9.0 * t), -0.04, 0.04)[0]
    # Differences of second order: (9 · 1 ms)²/12.
    assert found == pytest.approx(expected, rel=2e-5)


def test_readings_at_instants_are_averaged_as_the_second_difference_averages():
    """A swing of 15 Hz read at 1 kHz: a force that makes it is in step with what it makes."""
    half, step, rate = 20, 1e-3, 2.0 * np.pi * 15.0
    window = make_window(half, step)
    angle = np.cos(rate * step * np.arange(200))
    force = -(rate**2) * angle
    moved = weigh(window.second, angle, 1)
    largest = np.abs(moved).max()
    # By hand: (ω·1 ms)²/12 is 7.4e-4, and (ω·1 ms)⁴/240 is 3.3e-7.
    assert np.abs(weigh(window.averaged(step), force, 1) - moved).max() < 1e-6 * largest
    assert np.abs(weigh(window.weights, force, 1) - moved).max() > 6e-4 * largest


def test_straight_lines_have_no_acceleration():
    window = make_window(7, 0.01)
    line = 3.0 + 20.0 * np.arange(60) * 0.01
    np.testing.assert_allclose(weigh(window.second, line, 1), 0.0, atol=1e-9)
    curve = 0.5 * 2.5 * (np.arange(60) * 0.01) ** 2
    np.testing.assert_allclose(weigh(window.second, curve, 1), 2.5, rtol=1e-9)
    rows = weigh(window.weights, np.stack([line, curve], axis=1), 10)
    assert rows.shape == (5, 2)
    assert rows[2, 0] == pytest.approx(line[27])


@pytest.mark.parametrize("half_width", [0.01, 0.02, 0.04])
def test_a_winch_is_found_again(half_width):
    """Simulated by other code; torque read with noise. The result does not hang on the window."""
    made = closed_loop(WINCH, 8000, torque_noise=0.01, seed=1)
    found = identify_winch([made], EFFECTS, half_width=half_width)
    estimate = found.estimate
    assert estimate.names == (
        "inertia",
        "winch_viscous_friction coefficient",
        "winch_coulomb_friction torque",
        "winch_torque_offset torque",
    )
    np.testing.assert_allclose(estimate.values, WINCH.values, rtol=0.02)
    assert np.all(np.abs(estimate.values - WINCH.values) < 3.5 * estimate.sd)
    assert np.all(estimate.sd < 0.02 * np.abs(WINCH.values))
    assert found.error < 1.0
    assert found.exogeneity is None


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        (WINCH._replace(viscous=-1e-3), "winch_viscous_friction coefficient"),
        (WINCH._replace(constant=-0.015), "winch_torque_offset torque"),
    ],
)
def test_signs_are_kept(changed, name):
    """No bound hides an implausible value."""
    made = closed_loop(changed, 5000, torque_noise=0.005, seed=2)
    estimate = identify_winch([made], EFFECTS).estimate
    expected = dict(zip(estimate.names, changed.values, strict=True))[name]
    assert np.sign(expected) != np.sign(dict(zip(estimate.names, WINCH.values, strict=True))[name])
    assert estimate.value(name) == pytest.approx(expected, rel=0.1)


def test_the_cable_pulls_against_winding_in():
    """With tension measured the parameters stay; left out, it would pass for a torque."""
    load = 40.0 + 15.0 * np.sin(2 * np.pi * 0.9 * np.arange(6000) * STEP)
    made = closed_loop(WINCH, 6000, torque_noise=0.005, seed=3, load=load)
    with_load = identify_winch([made], EFFECTS).estimate
    np.testing.assert_allclose(with_load.values, WINCH.values, rtol=0.03)
    bare = readings(made.angle.values[:, 0], made.torque.values[:, 0])
    without = identify_winch([bare], EFFECTS).estimate
    assert without.value("winch_torque_offset torque") < -0.3


def test_holes_and_several_recordings_are_windows_of_their_own():
    """A hole in the angle: no window spans it, and what was moved behind it does not matter."""
    made = closed_loop(WINCH, 8000, torque_noise=0.005, seed=4)
    kept = np.r_[0:3000, 3600:8000]
    angle = Samples(made.angle.times[kept], made.angle.values[kept])
    angle.values[3000:] += 5.0
    holed = made.__class__(angle, made.torque, None, made.radius, 1.0, made.torque_age)
    found = identify_winch([holed], EFFECTS).estimate
    np.testing.assert_allclose(found.values, WINCH.values, rtol=0.02)
    two = identify_winch([made, closed_loop(WINCH, 6000, seed=5, shift=1.0)], EFFECTS).estimate
    np.testing.assert_allclose(two.values, WINCH.values, rtol=0.02)


def test_standstill_excites_nothing():
    still = readings(np.full(2000, 1.0), np.full(2000, 0.02))
    estimate = identify_winch([still], EFFECTS, band=100.0).estimate
    unseen = {name for direction in estimate.unexcited for name, _ in direction.weights}
    assert unseen == set(estimate.names) - {"winch_torque_offset torque"}
    assert estimate.value("winch_torque_offset torque") == pytest.approx(-0.02)
    for name in unseen:
        assert estimate.interval(name) == (-np.inf, np.inf)


def test_a_load_that_never_changes_is_an_offset():
    """Drum radius and torque offset act equally at constant tension; the rest stays known."""
    load = np.full(5000, 40.0)
    made = closed_loop(WINCH, 5000, torque_noise=0.005, seed=6, load=load)
    estimate = identify_winch([made], [*EFFECTS, "winch_drum_radius"]).estimate
    assert len(estimate.unexcited) == 1
    assert {name for name, _ in estimate.unexcited[0].weights} >= {"winch_drum_radius radius"}
    assert np.isinf(estimate.sd[3:]).all()
    np.testing.assert_allclose(estimate.values[:3], WINCH.values[:3], rtol=0.02)
    assert np.isfinite(estimate.sd[:3]).all()


def test_torque_error_is_that_of_the_prediction():
    made = closed_loop(WINCH, 5000)
    effects = {
        "winch_viscous_friction": {"coefficient": WINCH.viscous},
        "winch_coulomb_friction": {"torque": WINCH.coulomb},
        "winch_torque_offset": {"torque": -WINCH.constant},
    }
    right = torque_error(made, WINCH.inertia, effects, 40.0)
    assert right.percent < 1.0
    without = {name: effects[name] for name in list(effects)[:2]}
    wrong = torque_error(made, WINCH.inertia, without, 40.0)
    missing = np.mean(wrong.measured - wrong.predicted)
    assert missing == pytest.approx(WINCH.constant, rel=0.02)
    expected = 100.0 * np.linalg.norm(wrong.measured - wrong.predicted)
    assert wrong.percent == pytest.approx(expected / np.linalg.norm(wrong.measured))
    assert wrong.percent > 5.0 * right.percent


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"effects": ["cable_creep"]}, "effect cable_creep of a winch; allowed: winch_coulomb"),
        ({"effects": ["winch_inertia"]}, "effect winch_inertia of a winch; allowed: winch_coulomb"),
        ({"effects": ["winch_stribeck_friction"]}, "winch_stribeck_friction of a winch; allowed:"),
        ({"signals": []}, "no stretch of angle and torque is as long as a window, 0.04 s"),
        ({"half_width": 3.0}, "as long as a window, 6 s; allowed: longer stretches"),
        ({"instruments": []}, "0 instruments for 1 recordings; allowed: one for each"),
        (
            {"instruments": [closed_loop(WINCH, 300)]},
            "instruments have other stretches than the recording",
        ),
    ],
)
def test_what_does_not_fit_is_refused(arguments, words):
    usual = {"signals": [closed_loop(WINCH, 400)], "effects": EFFECTS, "band": 100.0}
    given = {**usual, **arguments}
    with pytest.raises(InputError, match=words):
        identify_winch(given.pop("signals"), given.pop("effects"), **given)


def measurement(bed, **sensors):
    return Measurement(Path("some"), "", load_testbed(SCENARIOS / "testbeds" / bed), **sensors)


def test_readings_come_from_the_recording():
    times = np.arange(50) * STEP
    wide = Samples(times, np.arange(400.0).reshape(50, 8))
    whole = measurement("thesis.yaml", angle=wide, torque=wide, tension=wide)
    found = winch_signals(whole, "surge_1", 0.5 * STEP)
    assert np.array_equal(found.angle.values[:, 0], wide.values[:, 2])
    assert np.array_equal(found.tension.values[:, 0], wide.values[:, 2])
    cable = whole.machine.cables[2]
    assert found.radius == cable.drum_radius / cable.gear_ratio
    assert found.torque_age == 0.5 * STEP
    single = Samples(times, np.zeros((50, 1)))
    bare = winch_signals(measurement("emps.yaml", angle=single, torque=single), "carriage")
    assert bare.tension is None
    for recorded, cable_name, words in (
        (whole, "surge_9", "some: no cable surge_9, allowed: hoist_1"),
        (measurement("thesis.yaml", angle=wide), "surge_1", "surge_1 has no angle or no torque"),
        (
            measurement("thesis.yaml", angle=wide, torque=wide),
            "surge_1",
            "surge_1 pulls a cable whose tension was not recorded",
        ),
    ):
        with pytest.raises(InputError, match=words):
            winch_signals(recorded, cable_name)


def test_a_force_at_a_winch_without_described_cable_counts_where_it_stands_out_of_noise():
    times = np.arange(50) * STEP
    text = (SCENARIOS / "testbeds" / "emps.yaml").read_text(encoding="utf-8")
    cell = "  /cables/tension: {noise: 0.5, resolution: 0.0, rate: 1000}\n"
    loaded = text.replace(
        "cables:\n  - name: carriage", "cables:\n  - load: {mass: 1.0}\n    name: carriage"
    )
    still, pulled = np.random.default_rng(1).normal(0.0, 0.5, (50, 1)), np.full((50, 1), 20.0)
    partly = np.where(np.arange(50)[:, None] < 9, np.nan, pulled)
    for file, force, counts in (
        (text, pulled, True),
        (text, partly, True),
        (text, still, False),
        (text, np.zeros((50, 1)), False),
        (text, np.full((50, 1), np.nan), False),
        (loaded, pulled, False),
    ):
        bed = parse_testbed(file.replace("effects:\n", f"{cell}effects:\n"), "t.yaml")
        parts = {"angle": Samples(times, pulled), "torque": Samples(times, pulled)}
        recorded = Measurement(Path("some"), "", bed, **parts, tension=Samples(times, force))
        found = winch_signals(recorded, "carriage").tension
        assert (found is not None) == counts
        assert found is None or np.array_equal(found.values, force, equal_nan=True)


def test_default_interval_is_the_bootstrap():
    made = closed_loop(WINCH, 5000, torque_noise=0.005, seed=7)
    first = identify_winch([made], EFFECTS).estimate
    second = identify_winch([made], EFFECTS, interval=Interval.SANDWICH).estimate
    assert first.method == "least squares, bootstrap"
    assert second.method == "least squares, sandwich"
    # Two roads to one covariance, with a handful of reversals.
    np.testing.assert_allclose(first.sd, second.sd, rtol=0.4)


def test_inertia_alone_is_identified_where_no_effect_is_seen():
    signals = closed_loop(WINCH, 3000, torque_noise=0.005, seed=8)
    alone, whole = (identify_winch([signals], effects) for effects in ((), EFFECTS))
    assert alone.estimate.names == ("inertia",)
    assert alone.error > whole.error
    assert np.isfinite(alone.estimate.interval("inertia")).all()
