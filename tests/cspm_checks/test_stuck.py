"""Values that stand still though what they measure does not."""

import numpy as np
import pytest
from import_samples import imported, table

from cspm_checks.series import SensorSeries
from cspm_checks.stuck import frozen_suspicions, stuck_suspicions

STATE, TENSION = "/winches/state", "/cables/tension"
T = np.arange(4000) * 1e-3


def motion(seed=0):
    rng = np.random.default_rng(seed)
    angle = np.round(2.0 * np.sin(3.0 * T) / 1e-3) * 1e-3
    return angle, 6.0 * np.cos(3.0 * T) + rng.normal(0.0, 0.01, len(T))


def stuck(angle, speed):
    return stuck_suspicions("w", SensorSeries(T, angle), SensorSeries(T, speed))


def test_an_encoder_that_stands_still_while_the_drive_turns_is_reported():
    angle, speed = motion()
    assert stuck(angle, speed) == []
    angle[1000:1300] = angle[1000]
    one = stuck(angle, speed)[0]
    assert one.kind == "stuck"
    assert one.at_s == pytest.approx((1.0,), abs=0.002)
    assert one.numbers["longest"] == pytest.approx(0.3, abs=0.01)


def test_an_encoder_that_stands_still_at_rest_is_not():
    angle, speed = motion()
    angle[1000:1300], speed[1000:1300] = angle[1000], 0.0
    assert stuck(angle, speed) == []
    speed[1000:1300] = np.random.default_rng(1).normal(0.0, 0.05, 300)
    assert stuck(angle, speed) == []


def test_a_load_cell_that_repeats_itself_is_reported_and_a_slack_cable_is_not():
    rng = np.random.default_rng(2)
    force = np.round((20.0 + np.sin(T) + rng.normal(0, 0.02, len(T))) / 0.005) * 0.005
    assert frozen_suspicions("c", force[:, None], T) == []
    held = force.copy()
    held[2000:2400] = held[2000]
    one = frozen_suspicions("c", held[:, None], T)[0]
    assert one.text == "stands still 1 times, the longest 0.399 s from 2 s on"
    slack = force.copy()
    slack[2000:2400] = 0.0
    assert frozen_suspicions("c", slack[:, None], T) == []
    # A coarse cell repeats itself always.
    assert frozen_suspicions("c", np.round(force)[:, None], T) == []


MAPPING = """
name: rig
clocks: {pc: {column: t}}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad}
    velocity/surge: {column: v, unit: rad/s}
  /cables/tension: {effort/surge: {column: n, unit: N}}
"""


def test_all_of_it_in_an_import(tmp_path):
    rng = np.random.default_rng(3)
    angle, speed = motion()
    force = 20.0 + np.sin(T) + rng.normal(0, 0.02, len(T))
    columns = {"t": T, "q": angle, "v": speed, "n": force}
    assert "stuck" not in imported(table(tmp_path / "a.csv", columns), MAPPING).kinds
    angle[500:900], force[1500:1800] = angle[500], force[1500]
    found = imported(table(tmp_path / "b.csv", columns), MAPPING)
    assert {(f"{STATE} position/surge", "stuck"), (f"{TENSION} effort/surge", "stuck")} <= (
        found.suspected
    )


def test_a_part_that_is_held_while_the_others_change_is_reported(tmp_path):
    angle, speed = motion()
    held = np.repeat((2.0 * np.sin(3.0 * T) + 0.3 * np.sin(17.0 * T))[::4], 4)
    columns = {"t": T, "q": held, "v": speed, "n": 20.0 + speed}
    found = imported(table(tmp_path / "a.csv", columns), MAPPING)
    assert (f"{STATE} position", "held") in found.suspected
    columns["q"] = angle
    assert "held" not in imported(table(tmp_path / "b.csv", columns), MAPPING).kinds
