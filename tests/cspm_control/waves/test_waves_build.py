from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from vessel_samples import SUPPLY, small_body_vessel, written

from cspm_control.waves.build import build_motion, sea_of, wave_amplitudes
from cspm_control.waves.spectrum import jonswap
from cspm_control.waves.vessel import read_vessel
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import (
    FileMotion,
    JonswapMotion,
    Move,
    MovesMotion,
    StillMotion,
    VesselMotion,
)

ORIGIN = (0.0,) * 6
FRAME = (0.0188, 0.0088, 0.0248, 0.0067, 0.0065, 0.0033)
TARGET = (0.1105, 0.0865, 0.318, 0.027, 0.2164, 0.1068)


def sea(amplitudes=TARGET, band=(0.23, 1.16), **changes):
    keys = {"peak_period": 2.1, "heading": 3.9, "band": band, "period": 200.0}
    return JonswapMotion(**{**keys, "amplitudes": amplitudes, **changes})


def built(spec, mean=ORIGIN, seed=1, folder=Path(), duration=200.0):
    return build_motion(spec, mean, seed=seed, duration=duration, gravity=9.81, folder=folder)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(("amplitudes", "band"), [(FRAME, (0.21, 1.16)), (TARGET, (0.23, 1.16))])
def test_every_coordinate_reaches_its_amplitude_and_no_farther(amplitudes, band, seed):
    motion = built(sea(amplitudes, band), seed=seed)
    assert np.abs(motion.knots[:, :6]).max(axis=0).tolist() == list(amplitudes)
    assert motion.spacing <= 0.02
    assert motion.duration == pytest.approx(200.0, rel=1e-12)
    assert motion.periodic


def test_rms_is_that_of_some_hundred_waves():
    ratio = [np.std(built(sea(), seed=s).knots[:, :6], axis=0) / TARGET for s in range(10)]
    assert np.mean(ratio, axis=0) == pytest.approx(np.full(6, 0.3), abs=0.03)


def test_motion_adds_to_the_mean_pose():
    mean = (0.1, -0.2, 2.0, 0.01, 0.02, 0.0)
    moved, plain = built(sea(), mean), built(sea())
    for time in (0.0, 31.7, 450.0):
        difference = moved.at(time) - plain.at(time)
        assert difference == pytest.approx([*mean, *[0.0] * 12], abs=1e-12)


def test_same_seed_gives_the_same_bits_and_another_seed_another_motion():
    first, again, other = (built(sea(), seed=seed).knots for seed in (7, 7, 8))
    assert (first == again).all()
    assert np.corrcoef(first[:, 2], other[:, 2])[0, 1] < 0.5


def test_zero_amplitude_is_no_motion():
    knots = built(sea((0.0, 0.1, 0.0, 0.0, 0.0, 0.02))).knots
    assert (knots[:, [0, 2, 3, 4]] == 0.0).all()
    assert (knots[:, [6, 8, 15]] == 0.0).all()
    assert np.abs(knots[:, [1, 5]]).max(axis=0).tolist() == [0.1, 0.02]


def test_spectrum_of_the_heave_is_the_spectrum_asked_for():
    spec = sea(band=(0.25, 0.9))
    motion = built(spec)
    frequency, density = signal.periodogram(motion.knots[:, 2], 1.0 / motion.spacing, detrend=False)
    inside = (frequency > 0.25 - 1e-9) & (frequency < 0.9 + 1e-9)
    wanted = jonswap(frequency[inside], 1.0, spec.peak_period, spec.peak_enhancement)
    assert density[inside] / density[inside].sum() == pytest.approx(wanted / wanted.sum(), rel=1e-9)
    assert density[~inside].max() < 1e-20 * density.max()


def test_an_angle_has_the_spectrum_of_the_waves_and_not_that_of_their_slope():
    spec = sea(heading=0.0, spreading=10_000.0)
    motion = built(spec)
    frequency, density = signal.periodogram(motion.knots[:, 4], 1.0 / motion.spacing)
    inside = (frequency > 0.23 - 1e-9) & (frequency < 1.16 + 1e-9)
    wanted = jonswap(frequency[inside], 1.0, spec.peak_period)
    assert density[inside] / density[inside].sum() == pytest.approx(wanted / wanted.sum(), rel=2e-2)


def test_welch_estimate_over_many_seeds_finds_the_spectrum():
    spec = sea()
    estimates = []
    for seed in range(30):
        heave = built(spec, seed=seed).knots[::5, 2]
        frequency, density = signal.welch(heave / heave.std(), 10.0, nperseg=500)
        estimates.append(density)
    inside = (frequency > 0.3) & (frequency < 1.05)
    fine = np.arange(46, 233) / 200.0
    m0 = jonswap(fine, 1.0, spec.peak_period).sum() / 200.0
    wanted = jonswap(frequency[inside], 1.0, spec.peak_period) / m0
    estimate = np.mean(estimates, axis=0)
    # Windows of 50 s see the peak through a kernel 0.03 Hz wide.
    assert np.abs(estimate[inside] - wanted).max() < 0.12 * wanted.max()
    assert estimate[(frequency > 1.3) | (frequency < 0.15)].max() < 1e-3 * wanted.max()


def test_heave_crests_are_where_the_waves_are():
    spec = sea(position=(0.3, -0.2))
    motion, waves = built(spec), sea_of(spec, 1)
    elevation = wave_amplitudes(spec, waves, 1.0)
    omega = waves.angular_frequency
    along = 0.3 * np.cos(waves.direction) - 0.2 * np.sin(waves.direction)
    times = np.linspace(0.0, 199.0, 101)
    surface = np.array(
        [elevation @ np.cos(omega * (t - omega / 9.81 * along) + waves.phase) for t in times]
    )
    heave = np.array([motion.at(t)[2] for t in times])
    assert np.corrcoef(heave, surface)[0, 1] == pytest.approx(-1.0, abs=1e-9)


def test_frame_and_target_ride_on_the_same_waves():
    frame = built(sea(FRAME, (0.21, 1.16)))
    target = built(sea(TARGET, (0.23, 1.16)))
    for dof in range(6):
        assert np.corrcoef(frame.knots[:, dof], target.knots[:, dof])[0, 1] > 0.98


def test_a_body_downstream_meets_the_waves_later():
    spec = sea(heading=0.0, spreading=10_000.0, band=(0.45, 0.5))
    lag = sea(heading=0.0, spreading=10_000.0, band=(0.45, 0.5), position=(0.5, 0.0))
    delay = 2 * np.pi * 0.475 / 9.81 * 0.5
    here, there = built(spec), built(lag)
    times = np.linspace(10.0, 190.0, 200)
    now = [here.at(t)[2] for t in times]
    later, earlier = ([there.at(t + side * delay)[2] for t in times] for side in (1, -1))
    assert np.corrcoef(now, later)[0, 1] > 0.995
    assert np.corrcoef(now, earlier)[0, 1] < 0.95


@pytest.mark.parametrize(("heading", "sign"), [(0.0, 1.0), (np.pi, -1.0)])
def test_heading_decides_how_surge_and_pitch_go_with_heave(heading, sign):
    knots = built(sea(heading=heading, spreading=10_000.0)).knots
    # Under a crest (heave up) a body moves along with the waves, and pitch goes with surge.
    assert sign * np.corrcoef(knots[:, 6], -knots[:, 2])[0, 1] > 0.9
    assert sign * np.corrcoef(knots[:, 4], -knots[:, 8])[0, 1] < -0.9
    assert np.corrcoef(knots[:, 4], knots[:, 0])[0, 1] > 0.8


def test_waves_that_do_not_excite_a_coordinate_are_not_scaled_up():
    one_wave = {"band": (0.46, 0.52), "period": 20.0, "spreading": 10_000.0}
    heading = -float(sea_of(sea(heading=0.0, **one_wave), 1).direction[0])
    with pytest.raises(InputError) as caught:
        built(sea(heading=heading, **one_wave))
    assert str(caught.value) == (
        "motion.amplitudes: the waves do not excite sway, allowed: 0, another heading or more"
        " spreading"
    )
    calm = (0.1, 0.0, 0.1, 0.0, 0.1, 0.0)
    knots = built(sea(calm, heading=heading, **one_wave)).knots
    assert np.abs(knots[:, :6]).max(axis=0).tolist() == list(calm)


def test_a_ramp_starts_at_rest_and_lasts_as_long_as_the_scenario():
    mean = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
    ramped, plain = built(sea(ramp=15.0), mean, duration=470.0), built(sea(), mean)
    assert (ramped.at(0.0) == [*mean, *[0.0] * 12]).all()
    assert not ramped.periodic
    assert ramped.duration >= 470.0
    for time in (15.0, 77.77, 469.99):
        assert ramped.at(time) == pytest.approx(plain.at(time), abs=1e-8)
    assert np.abs(ramped.at(7.5)[:6] - mean) == pytest.approx(
        0.5 * np.abs(plain.at(7.5)[:6] - mean), abs=1e-8
    )


def vessel(**changes):
    keys = {"peak_period": 2.1, "heading": 3.9, "band": (0.23, 0.9), "period": 100.0}
    return VesselMotion(
        **{**keys, "significant_wave_height": 0.375, "rao": "vessel.mat", **changes}
    )


def _ship_and_body(mean, scale, band, folder):
    spec = vessel(scale=scale, band=band)
    ship = built(spec, mean, folder=folder).knots[:, :6] - mean
    excursion = np.abs(ship).max(axis=0)
    follower = sea(tuple(excursion), band=band, period=spec.period)
    return ship, built(follower, mean).knots[:, :6] - mean, excursion


@pytest.mark.parametrize("yaw", [0.0, 0.6, -2.0])
@pytest.mark.parametrize("scale", [1.0, 12.0])
def test_a_vessel_that_is_a_small_body_moves_as_one(tmp_path, yaw, scale):
    """Independent roads: the file's table with Froude's law, and the law at the model's scale."""
    written(tmp_path, small_body_vessel(np.linspace(0.1, 6.0, 600)))
    mean = (0.0, 0.0, 0.0, 0.0, 0.0, yaw)
    ship, body, excursion = _ship_and_body(mean, scale, (0.23, 0.9), tmp_path)
    assert ship[:, :3] == pytest.approx(body[:, :3], abs=3e-3 * excursion.max())
    waves = sea_of(vessel(), 1)
    assert np.std(ship[:, 2]) == pytest.approx(
        np.sqrt(np.sum(wave_amplitudes(vessel(), waves, 0.375) ** 2) / 2), rel=1e-3
    )
    # Over a band this narrow the waves' slope is a constant times their height.
    ship, body, excursion = _ship_and_body(mean, scale, (0.4, 0.42), tmp_path)
    assert ship / excursion == pytest.approx(body / excursion, abs=0.08)


def test_in_one_regular_wave_the_supply_vessel_moves_as_its_table_says():
    if not SUPPLY.exists():
        pytest.skip("the supply vessel's response is not at hand")
    spec = vessel(rao=SUPPLY.name, band=(0.38, 0.44), period=20.0, scale=12.0, spreading=10_000.0)
    motion, waves = built(spec, folder=SUPPLY.parent), sea_of(spec, 1)
    assert waves.frequency.tolist() == [0.4]
    table = read_vessel(SUPPLY)
    operator = table.at(waves.angular_frequency, waves.direction, 12.0)[0]
    height = wave_amplitudes(spec, waves, 0.375)[0]
    for time in (0.0, 0.31, 1.4, 55.5):
        crest = 2 * np.pi * 0.4 * time + waves.phase[0]
        expected = height * np.abs(operator) * np.cos(crest + np.angle(operator))
        assert motion.at(time)[:6] == pytest.approx(expected, abs=1e-8)
    # Roll and pitch of the model in radians per metre: the table's, times the scale.
    assert np.abs(operator[3:]).max() > 3 * np.abs(table.operator[:, :, 3:]).max()


def test_a_vessel_that_would_capsize_is_refused(tmp_path):
    written(tmp_path, small_body_vessel(np.linspace(0.1, 6.0, 60)))
    with pytest.raises(InputError) as caught:
        built(vessel(significant_wave_height=30.0), folder=tmp_path)
    assert str(caught.value).startswith("motion: roll reaches ")
    assert str(caught.value).endswith(" rad about the mean pose, allowed: less than π/2")


def test_a_missing_file_is_named_with_the_scenarios_folder(tmp_path):
    for spec in (vessel(), FileMotion(path="vessel.mat")):
        with pytest.raises(InputError) as caught:
            built(spec, folder=tmp_path)
        assert str(caught.value).startswith(f"{tmp_path / 'vessel.mat'}: no such file")


def test_still_file_and_moves_are_about_the_mean_pose(tmp_path):
    mean = (0.0, 0.1, 2.0, 0.0, 0.0, -0.1)
    (tmp_path / "m.csv").write_text("t,x,y,z,roll,pitch,yaw\n0,1,0,0,0,0,0\n5,3,0,0,0,0,0\n")
    still = built(StillMotion(), mean)
    file = built(FileMotion(path="m.csv"), mean, folder=tmp_path)
    moves = built(MovesMotion(moves=(Move(at=1, duration=2, by=(0, 0, 0.3, 0, 0, 0)),)), mean)
    assert still.at(9.0)[:6].tolist() == list(mean)
    assert file.at(2.5)[:6] == pytest.approx([2.0, 0.1, 2.0, 0.0, 0.0, -0.1])
    assert moves.at(0.5)[:6] == pytest.approx(mean)
    assert moves.at(5.0)[:6] == pytest.approx([0.0, 0.1, 2.3, 0.0, 0.0, -0.1])


def test_the_waves_of_a_wide_band_have_the_significant_height():
    spec = sea(band=(0.05, 10.0))
    amplitude = wave_amplitudes(spec, sea_of(spec, 1), 0.375)
    assert 4.0 * np.sqrt(np.sum(amplitude**2) / 2.0) == pytest.approx(0.375, rel=1e-3)
