"""Channels that are late against what they must follow, clocks that scatter or were rounded."""

import numpy as np
import pytest
from import_samples import imported, mapping_file, table

from cspm_checks.lateness import lateness
from cspm_checks.pace import pace_of
from cspm_checks.series import SensorSeries
from cspm_ident.importing.time_base import single_precision

STATE = "/winches/state"
INERTIA, VISCOUS, COULOMB = 0.0095, 0.02, 0.2


def shaft(seed=0, count=3000, step=0.004, late=0.0, stretch=0.0):
    """A motor shaft with friction, turned by many sines; its torque late by `late` [s]."""
    rng = np.random.default_rng(seed)
    t = step * np.arange(count)
    tones = [(rng.uniform(0.5, 4.0), rng.uniform(0, 6), 3.0 / (k + 1)) for k in range(5)]

    def motion(at):
        angle, speed, acceleration = np.zeros((3, len(at)))
        for frequency, phase, size in tones:
            w = 2 * np.pi * frequency
            angle = angle + size * np.sin(w * at + phase)
            speed = speed + size * w * np.cos(w * at + phase)
            acceleration = acceleration - size * w * w * np.sin(w * at + phase)
        return angle, speed, acceleration

    angle = np.round(motion(t)[0] / 5e-5) * 5e-5
    _, speed, acceleration = motion(t - late - stretch * t)
    torque = INERTIA * acceleration + VISCOUS * speed + COULOMB * np.sign(speed)
    return t, angle, torque + rng.normal(0.0, 0.005, count)


def judged(late=0.0, stretch=0.0, **how):
    t, angle, torque = shaft(late=late, stretch=stretch, **how)
    return lateness(SensorSeries(t, torque), SensorSeries(t, angle), [], (1, 2))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("late", [-0.02, -0.006, 0.006, 0.02, 0.05])
def test_a_late_torque_is_found_with_its_interval(seed, late):
    found = judged(late, seed=seed)
    assert found.matters
    assert found.seconds == pytest.approx(late, abs=found.error + 5e-4)
    assert found.drift == 0.0


@pytest.mark.parametrize("late", [0.0, 0.002, -0.002])
def test_less_than_a_sample_is_nothing(late):
    assert not judged(late).matters


@pytest.mark.parametrize("stretch", [2e-3, -2e-3])
def test_a_drift_between_clocks_is_found(stretch):
    found = judged(stretch=stretch, count=8000)
    assert found.matters
    assert found.drift == pytest.approx(stretch, abs=max(found.drift_error, 2e-4))


def test_what_is_unrelated_or_short_or_uneven_is_not_judged():
    t, angle, torque = shaft()
    noise = np.random.default_rng(1).normal(size=len(t))
    assert lateness(SensorSeries(t, noise), SensorSeries(t, angle), [], (1, 2)) is None
    still = SensorSeries(t, np.full(len(t), 0.1259))
    assert lateness(still, SensorSeries(t, angle), [], (1, 2)) is None
    short = slice(500)
    few = SensorSeries(t[short], torque[short]), SensorSeries(t[short], angle[short])
    assert lateness(*few, [], (1, 2)) is None
    scattered = t + np.random.default_rng(2).uniform(-0.0016, 0.0016, len(t))
    assert lateness(SensorSeries(t, torque), SensorSeries(scattered, angle), [], (1, 2)) is None


MAPPING = """
name: shaft
clocks: {pc: {column: t}}
channels:
  /winches/state:
    position/m: {column: q, unit: rad}
    effort/m: {column: u, unit: N·m}
"""
SHAFT = """
name: shaft
cables: [{name: m, drum_radius: 0.01, rotor_inertia: 9.5e-3, torque_limit: 20.0}]
"""


def read(tmp_path, t, angle, torque, mapping=MAPPING):
    testbed = tmp_path / "shaft.yaml"
    testbed.write_text(SHAFT)
    path = table(tmp_path / "a.csv", {"t": t, "q": angle, "u": torque})
    mapping_file(tmp_path, mapping)
    return imported(path, mapping, testbed)


def reported(found, kind):
    return [one for one in found.report.suspicions if one.kind == kind]


def test_a_late_torque_is_reported_and_a_clock_of_its_own_repairs_it(tmp_path):
    columns = shaft(late=0.02)
    one = reported(read(tmp_path, *columns), "late")[0]
    assert one.where == f"{STATE} effort/m"
    assert one.text.endswith(" ms late against the motion")
    assert one.numbers["seconds"] == pytest.approx(0.02, abs=one.numbers["error"] + 5e-4)
    own = MAPPING.replace("pc: {column: t}", "pc: {column: t, offset: 0.02}, late: {column: t}")
    own = own.replace("column: u,", "clock: late, column: u,")
    repaired = read(tmp_path, *columns, own)
    assert not reported(repaired, "late")
    assert len(repaired.stamps[STATE]) == 2995
    assert not reported(read(tmp_path, *shaft()), "late")


def test_stamps_that_scatter_are_distinguished_from_those_that_wander(tmp_path):
    rng = np.random.default_rng(3)
    t, angle, torque = shaft()
    scattered = read(tmp_path, t + rng.uniform(0.0, 0.0032, len(t)), angle, torque)
    assert scattered.kinds.isdisjoint({"gap", "irregular"})
    one = reported(scattered, "jitter")[0]
    assert one.numbers["rate"] == pytest.approx(250.0, rel=1e-3)
    assert one.numbers["sigma"] == pytest.approx(0.0032 / np.sqrt(12), rel=0.1)
    even = read(tmp_path, t, angle, torque, MAPPING.replace("column: t", "rate: 250.0"))
    assert even.kinds.isdisjoint({"jitter", "irregular"})
    wandering = np.cumsum(rng.uniform(3.6e6, 4.4e6, 3000)).astype(np.int64)
    assert pace_of(wandering, 0).jitter_s == 0.0
    assert pace_of(wandering, 0).irregular > 0.5


def test_a_gap_among_scattered_stamps_is_still_one():
    rng = np.random.default_rng(4)
    stamps = np.arange(3000) * 4_000_000 + rng.uniform(0, 3_200_000, 3000).astype(np.int64)
    stamps[2000:] += 12_000_000
    pace = pace_of(stamps, 0)
    assert pace.jitter_s > 0.0
    assert pace.gaps == 1
    assert pace.gap_at_s == pytest.approx(8.0, abs=0.01)


def test_times_in_single_precision_are_reported(tmp_path):
    t, angle, torque = shaft()
    late = (t + 9000.0).astype(np.float32).astype(float)
    found = read(
        tmp_path, late, angle, torque, MAPPING.replace("column: t", "column: t, disorder: keep")
    )
    assert reported(found, "single")[0].numbers["rounded"] == pytest.approx(2.0**-10)
    assert not reported(read(tmp_path, t + 9000.0, angle, torque), "single")
    assert single_precision(np.arange(2.0**23, 2.0**23 + 9), "ms") == 0.0
    assert single_precision(2.0**25 + 4 * np.arange(9.0), "ms") == pytest.approx(0.004)
    assert single_precision(np.array([0.1, 0.2]), "s") == 0.0
