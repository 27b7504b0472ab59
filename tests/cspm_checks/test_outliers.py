"""Samples that no machine can have made: found with their instants, mended when asked."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from import_samples import imported, table

from cspm_checks.outlier_suspicions import nearest_round
from cspm_checks.outliers import outliers_of

STATE = "/winches/state"
COUNT, STEP = 3000, 0.004
MAPPING = """
name: rig
clocks: {pc: {column: t}}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad%s}
    effort/surge: {column: u, unit: N·m}
"""
TIME = STEP * np.arange(COUNT)
ANGLE = np.round((2.0 * np.sin(1.3 * TIME) + 12.0 * np.sin(0.4 * TIME)) / 5e-5) * 5e-5
TORQUE = 0.3 * np.sign(np.cos(1.3 * TIME)) + 0.1 * np.sin(2.9 * TIME)


def read(tmp_path, angle=ANGLE, torque=TORQUE, key=""):
    path = table(tmp_path / "a.csv", {"t": TIME, "q": angle, "u": torque})
    return imported(path, MAPPING % key)


def reported(found, kind):
    return [one for one in found.report.suspicions if one.kind == kind]


OUT = {"spike", "zero", "jump", "rollover", "mended"}


@pytest.mark.parametrize(("size", "places"), [(10.0, []), (30.0, [400])])
def test_what_noise_cannot_do_is_a_spike_and_what_it_can_is_none(size, places):
    """Of white noise with a standard deviation of 1."""
    values = np.random.default_rng(2).standard_normal(1000)
    values[400] = size
    assert outliers_of(values, np.ones(999, dtype=bool)).spikes.tolist() == places


def test_nothing_is_found_in_a_clean_recording(tmp_path):
    assert read(tmp_path).kinds.isdisjoint(OUT)


def test_spikes_are_reported_with_their_instants_and_masked_when_asked(tmp_path):
    angle = ANGLE.copy()
    at = [700, 1500, 2200]
    angle[at] += 20.0
    one = reported(read(tmp_path, angle), "spike")[0]
    assert one.where == f"{STATE} position/surge"
    assert one.at_s == pytest.approx(TIME[at])
    assert one.text == "3 samples leave and come back at once, at 2.8, 6, 8.8 s"
    assert one.remedy == "`spikes: mask` in the channel"
    mended = read(tmp_path, angle, key=", spikes: mask")
    assert mended.rows[STATE][:, 0].tolist() == np.delete(ANGLE, at).tolist()
    assert "spike" not in mended.kinds
    assert reported(mended, "mended")[0].text == "3 samples were masked, at 2.8, 6, 8.8 s"


def test_spikes_in_the_torque_are_reported_and_its_steps_are_not(tmp_path):
    torque = TORQUE.copy()
    torque[900] -= 3.0
    found = reported(read(tmp_path, torque=torque), "spike")
    assert [(one.where, one.at_s) for one in found] == [(f"{STATE} effort/surge", (3.6,))]


def test_short_runs_of_zeros_are_reported_and_long_ones_are_not(tmp_path):
    angle = ANGLE + 30.0
    angle[1000:1005] = 0.0
    found = read(tmp_path, angle)
    assert reported(found, "zero")[0].at_s == pytest.approx(TIME[1000:1005])
    assert not reported(found, "spike")
    assert not reported(found, "jump")
    mended = read(tmp_path, angle, key=", invalid: [0]")
    assert "zero" not in mended.kinds
    torque = TORQUE + 2.0
    torque[1000:1400] = 0.0
    assert read(tmp_path, torque=torque).kinds.isdisjoint({"zero", "spike"})


def test_a_reset_is_reported_and_joined_when_asked(tmp_path):
    angle = ANGLE.copy()
    angle[1500:] -= 30.0
    one = reported(read(tmp_path, angle), "jump")[0]
    assert one.at_s == (6.0,)
    assert one.text.startswith("1 steps that no motion explains, -30 rad: a reset?, at 6 s")
    joined = read(tmp_path, angle, key=", jumps: join")
    assert "jump" not in joined.kinds
    np.testing.assert_allclose(joined.rows[STATE][:, 0], ANGLE, atol=2e-4)
    assert reported(joined, "mended")[0].text == "1 steps were taken out, -30, at 6 s"


def test_a_step_over_a_gap_is_no_jump(tmp_path):
    keep = np.ones(COUNT, dtype=bool)
    keep[1000:1200] = False
    path = table(tmp_path / "a.csv", {"t": TIME[keep], "q": ANGLE[keep], "u": TORQUE[keep]})
    found = imported(path, MAPPING % "")
    assert found.kinds.isdisjoint(OUT)
    assert "gap" in found.kinds


@pytest.mark.parametrize("period", [6.0, 2 * np.pi, 7.25])
def test_an_undeclared_counter_is_reported_with_its_period(tmp_path, period):
    angle = np.mod(ANGLE, period)
    one = reported(read(tmp_path, angle), "rollover")[0]
    assert one.numbers["period"] == pytest.approx(period, rel=1e-3)
    assert float(one.remedy.split()[1].strip("`")) == pytest.approx(period, rel=1e-9)
    assert one.at_s[0] == TIME[np.flatnonzero(np.abs(np.diff(angle)) > period / 2)[0] + 1]
    declared = read(tmp_path, angle, key=f", wrap: {period!r}")
    assert declared.kinds.isdisjoint(OUT)
    np.testing.assert_allclose(np.diff(declared.rows[STATE][:, 0]), np.diff(ANGLE), atol=1e-9)


def test_a_relay_between_two_positions_is_no_counter():
    values = np.repeat([0.0, 1.0, 0.0, 1.0, 0.0], 40)
    assert outliers_of(values, np.ones(len(values) - 1, dtype=bool)).period is None


def test_the_first_and_the_last_samples_can_be_spikes():
    values = np.sin(0.01 * np.arange(400.0))
    whole = np.ones(399, dtype=bool)
    values[0], values[398:] = 50.0, -7.0
    assert outliers_of(values, whole).spikes.tolist() == [0, 398, 399]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(["noise", "walk", "rest", "chirp", "reversal"]))
def test_healthy_signals_have_no_outlier(seed, kind):
    rng = np.random.default_rng(seed)
    t = np.arange(4000) * 1e-3
    values = {
        "noise": rng.normal(size=4000),
        "walk": np.cumsum(np.cumsum(rng.normal(size=4000))),
        "rest": np.round(np.where(t < 2.0, 0.0, np.sin(9.0 * (t - 2.0))) / 1e-3) * 1e-3,
        "chirp": np.sin(2 * np.pi * (0.1 + rng.uniform(1, 10) * t) * t),
        "reversal": np.sign(np.sin(2 * t + 0.1)) + rng.normal(0, 0.02, 4000),
    }[kind]
    found = outliers_of(values, np.ones(3999, dtype=bool))
    assert not len(found.spikes)
    assert not len(found.zeros)
    assert kind == "reversal" or not len(found.jumps)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(30, 3900), st.floats(20.0, 1e6), st.booleans())
def test_any_large_spike_or_jump_is_found_where_it_is(seed, place, size, stays):
    rng = np.random.default_rng(seed)
    values = np.sin(np.arange(4000) * 1e-3 * rng.uniform(1, 9)) + rng.normal(0, 1e-3, 4000)
    values[place : None if stays else place + 1] += size
    found = outliers_of(values, np.ones(3999, dtype=bool))
    assert (found.jumps if stays else found.spikes).tolist() == [place]
    assert not len(found.spikes if stays else found.jumps)
    if stays:
        assert found.sizes[0] == pytest.approx(size, abs=0.05)


def test_numbers_are_rounded_within_their_error():
    assert nearest_round(65535.8, 9.0) == 65536.0
    assert nearest_round(3599.8, 0.5) == 3600.0
    assert nearest_round(5.99998, 1e-4) == 6.0
    assert nearest_round(6.28319, 1e-4) == 2 * np.pi
    assert nearest_round(7.12345678, 0.0) == 7.12345678
