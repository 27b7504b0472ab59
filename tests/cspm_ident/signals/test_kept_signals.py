"""What follows from a sensor's readings alone is made once, and belongs to those readings."""

import numpy as np

from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import smooth, smoothed
from cspm_ident.signals.winch_motion import joined_motion, winch_motion


def swinging(seed=1):
    times = np.arange(4000) * 1e-3
    noise = 1e-4 * np.random.default_rng(seed).standard_normal((2, len(times)))
    turns = 2.0 * np.pi * 0.7
    angle = np.sin(turns * times) + noise[0]
    speed = turns * np.cos(turns * times) + noise[1]
    return Samples(times, angle[:, None]), Samples(times, speed[:, None])


def test_a_column_is_one_object_and_every_column_another():
    samples = Samples(np.arange(5.0), np.arange(10.0).reshape(5, 2))
    assert samples.column(0) is samples.column(0)
    assert samples.column(1) is not samples.column(0)
    np.testing.assert_array_equal(samples.column(1).values[:, 0], [1.0, 3.0, 5.0, 7.0, 9.0])


def test_what_is_kept_is_made_once_for_each_key():
    samples, made = Samples(np.arange(3.0), np.zeros((3, 1))), []

    def make():
        made.append(len(made))
        return made[-1]

    assert [samples.kept(key, make) for key in ("a", "b", "a", "b")] == [0, 1, 0, 1]
    # Other values at the same times keep their own.
    assert samples.of_others(np.ones((3, 1))).kept("a", make) == 2


def test_bands_do_not_share_a_smooth_function():
    angle, _ = swinging()
    assert smooth(angle, 20.0) is smooth(angle, 20.0)
    assert (smooth(angle, 20.0).band, smooth(angle, 30.0).band) == (20.0, 30.0)
    other, _ = swinging(seed=2)
    assert not np.array_equal(
        smooth(angle, 20.0).at(angle.times), smooth(other, 20.0).at(angle.times)
    )


def test_motion_depends_on_speeds_and_times():
    (angle, speed), (_, other) = swinging(), swinging(seed=2)
    times = angle.times[100:-100]
    found = winch_motion(angle, speed, times)
    assert winch_motion(angle, speed, times.copy()) is found
    assert not np.array_equal(winch_motion(angle, other, times).speeds, found.speeds)
    assert len(winch_motion(angle, speed, times[:-1]).angles) == len(times) - 1
    assert not np.array_equal(winch_motion(angle, None, times).speeds, found.speeds)


def test_columns_share_stamps_knots_and_clocks():
    angle, _ = swinging()
    both = Samples(angle.times, np.hstack([angle.values, 2.0 * angle.values]))
    first, second = (smooth(both.column(i), 20.0).pieces[0] for i in range(2))
    assert first.t is second.t
    assert both.column(0).even.times is both.column(1).even.times
    # The shared knots are those that either has alone.
    alone = smooth(Samples(angle.times, 2.0 * angle.values), 20.0)
    np.testing.assert_array_equal(alone.pieces[0].t, second.t)
    np.testing.assert_array_equal(
        alone.at(angle.times), smooth(both.column(1), 20.0).at(both.times)
    )
    # Another band has other knots, and other times their own.
    assert smooth(both.column(0), 2.0).pieces[0].t is not first.t
    assert smooth(Samples(angle.times + 1.0, angle.values), 20.0).pieces[0].t is not first.t


def test_a_cut_is_one_object_and_all_of_them_are_the_samples_themselves():
    samples = Samples(np.arange(5.0), np.arange(5.0)[:, None])
    assert samples.since(2.0) is samples.since(2.0)
    assert samples.since(3.0) is not samples.since(2.0)
    np.testing.assert_array_equal(samples.since(2.0).times, [2.0, 3.0, 4.0])
    assert samples.within(0.0, 4.0) is samples
    assert samples.within(-1.0, 9.0) is samples
    for start, end in ((0.5, 4.0), (0.0, 3.5)):
        assert len(samples.within(start, end).times) == 4


def test_what_is_not_kept_is_made_anew_and_is_the_same():
    angle, speed = swinging()
    assert smoothed(angle, 20.0) is not smoothed(angle, 20.0)
    np.testing.assert_array_equal(
        smoothed(angle, 20.0).at(angle.times), smooth(angle, 20.0).at(angle.times)
    )
    found, kept = (made(angle, speed, angle.times) for made in (joined_motion, winch_motion))
    np.testing.assert_array_equal(found.angles, kept.angles)
    assert joined_motion(angle, speed, angle.times) is not found
