"""A load cell's bias is distinguished from a weak drive, dry friction and the rotor's inertia."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import bundle_of

from bench.results.tracking import Case, assembled
from cspm_control.controllers.force_controller import ForceController
from cspm_control.controllers.load_cell_bias import LoadCellBias
from cspm_control.stages.make import make_controller
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import FORCE_CONTROLLER, TENSION, TENSION_COMMAND, WINCH_STATE
from cspm_run.loop import Loop

PERIOD = 1e-3
RADII, INERTIAS = np.array([0.0025, 0.025]), np.array([6.5e-6, 2.4e-4])
ON = "control.force.load_cell_bias={largest: 2.0}"


def winches(seconds, *, bias=0.0, gain=1.0, dry=0.0, seed=1):
    """Yield measured tensions, speeds, and torques till now of winches in waves.

    Speeds and tensions are given; what the torque has to be follows from J·q̈ = g·τ − r·t − f·sgn q̇.
    """
    rng = np.random.default_rng(seed)
    steps = round(seconds / PERIOD)
    times = PERIOD * np.arange(steps + 1)[:, None]
    tensions = 8.0 + 5.0 * np.sin(2.9 * times + np.array([0.0, 1.0]))
    speeds = 9.0 * np.sin(2.3 * times) * 0.025 / RADII
    between = 0.5 * (tensions[1:] + tensions[:-1])
    direction = np.sign(0.5 * (speeds[1:] + speeds[:-1]))
    torques = INERTIAS * np.diff(speeds, axis=0) / PERIOD + RADII * (between + dry * direction)
    noisy = tensions + bias + rng.normal(0.0, 0.02, tensions.shape)
    return noisy, speeds + rng.normal(0.0, 0.01, speeds.shape), torques / gain


def reported(largest=2.0, seconds=8.0, **machine):
    """Return the biases that are reported at the end."""
    found = LoadCellBias(RADII, INERTIAS, largest, period=PERIOD)
    measured, speeds, torques = winches(seconds, **machine)
    for k in range(len(measured)):
        found.step(measured[k], speeds[k], torques[max(0, k - 1)])
    return found.values


@pytest.mark.parametrize("bias", [-1.0, 0.0, 0.4])
def test_a_bias_is_reported_with_its_sign(bias):
    np.testing.assert_allclose(reported(bias=bias), bias, atol=0.02)


@pytest.mark.parametrize("machine", [{"gain": 0.5}, {"dry": 0.8}, {"gain": 0.7, "dry": 0.4}])
def test_weak_drives_and_dry_friction_are_no_bias(machine):
    np.testing.assert_allclose(reported(**machine), 0.0, atol=0.05)
    np.testing.assert_allclose(reported(bias=0.6, **machine), 0.6, atol=0.05)


def test_no_more_is_believed_than_the_largest():
    np.testing.assert_array_equal(reported(largest=0.5, bias=3.0), 0.5)
    np.testing.assert_array_equal(reported(largest=0.5, bias=-3.0), -0.5)


def test_at_rest_a_bias_cannot_be_distinguished_from_a_weak_drive():
    """Nothing moves: the prior shares out what is seen, and never beyond it."""
    found = LoadCellBias(RADII, INERTIAS, 2.0, period=PERIOD)
    for _ in range(3000):
        found.step(np.full(2, 6.0), np.zeros(2), RADII * 5.0)
    np.testing.assert_allclose(found.values, 1.0 / (1.0 + (0.3 * 5.0) ** 2), atol=0.02)


def test_a_balance_is_believed_as_far_as_what_it_leaves_unexplained_allows():
    """The same at rest after 30 ms, by a batch: 0.1 N within 10 rad/s are 2 N² in a sample."""
    found = LoadCellBias(RADII, INERTIAS, 2.0, period=PERIOD)
    for _ in range(31):
        found.step(np.full(2, 6.0), np.zeros(2), RADII * 5.0)
    share = 1.0 - np.exp(-10.0 * PERIOD * np.arange(1, 31))
    prior, taken = 1.0 + (0.3 * 5.0) ** 2, np.sum(share**2)
    np.testing.assert_allclose(found.values, taken / (prior * taken + 2.0), rtol=1e-3)


def test_after_a_restart_what_was_learnt_stays():
    found = LoadCellBias(RADII, INERTIAS, 2.0, period=PERIOD)
    measured, speeds, torques = winches(8.0, bias=0.7)
    for k in range(len(measured)):
        found.step(measured[k], speeds[k], torques[max(0, k - 1)])
    found.restart()
    # Torques that were not ours lie between: the jump in speed is not an acceleration of theirs.
    found.step(measured[0], speeds[0] + 500.0, torques[0])
    np.testing.assert_allclose(found.values, 0.7, atol=0.02)
    for k in range(200):
        found.step(measured[k + 1], speeds[k + 1] + 500.0, torques[k])
    np.testing.assert_allclose(found.values, 0.7, atol=0.05)


class Stage:
    """A force stage, stepped with all tensions near 6 N."""

    def __init__(self, *overrides):
        self.bundle = bundle_of("worst_case_steep_past_thesis", *overrides)
        self.testbed = self.bundle.testbed.testbed
        self.stage = make_controller(FORCE_CONTROLLER, self.bundle.scenario, self.testbed)
        self.rng = np.random.default_rng(3)
        self.now_ms, self.sent = 0, None

    def step(self, first_cell=0.0, *, reported=True):
        """Step; return measured tensions and motor speeds. The first load cell is off."""
        n = len(self.testbed.cables)
        measured = self.rng.uniform(5.9, 6.1, n)
        measured[0] += first_cell
        winches = self.rng.normal(size=3 * n)
        inputs = {TENSION: measured, TENSION_COMMAND: np.full(n, 6.0)}
        self.stage.step(
            self.now_ms * 1_000_000,
            inputs | ({WINCH_STATE: winches} if reported else {}),
            self._keep,
        )
        self.now_ms += 1
        return measured, winches[n : 2 * n]

    def _keep(self, _, row):
        self.sent = row.copy()

    def status(self):
        return self.stage.status().values


def test_the_stage_controls_tensions_without_what_is_given():
    stage = Stage(ON)
    cables = stage.testbed.cables
    radii = np.array([cable.drum_radius / cable.gear_ratio for cable in cables])
    inertias = np.array([cable.rotor_inertia for cable in cables])
    gains = stage.bundle.scenario.control.force.gains
    limits = np.array([cable.torque_limit for cable in cables])
    alone = ForceController([gains[c.name] for c in cables], radii, limits, period=PERIOD)
    cells, torque = LoadCellBias(radii, inertias, 2.0, period=PERIOD), None
    for _ in range(300):
        measured, speeds = stage.step(1.0)
        if torque is not None:
            cells.step(measured, speeds, torque)
        torque = alone.step(np.full(len(cables), 6.0), measured - cells.values)
        np.testing.assert_array_equal(stage.sent, torque)
    assert np.abs(cells.values).max() > 0.1
    most = np.argmax(np.abs(cells.values))
    expected = f"{cables[most].name} {cells.values[most]:+.2f} N"
    assert stage.status()["load_cell_bias"] == expected


def test_without_the_option_or_the_winches_state_nothing_is_reported():
    plain, blind = Stage(), Stage(ON)
    for _ in range(50):
        plain.step(1.0)
        blind.step(1.0, reported=False)
        np.testing.assert_array_equal(plain.sent, blind.sent)
    assert "load_cell_bias" not in plain.status()
    assert blind.status()["load_cell_bias"] == "hoist_1 +0.00 N"


def test_what_trips_is_what_the_load_cells_say():
    stage = Stage(ON, "safety.tension_trip=8.0")
    stage.step()
    assert not stage.stage.safe
    stage.step(2.5)
    assert stage.stage.safe
    assert "allowed: at most 8 N" in stage.status()["reason"]


def test_the_largest_bias_is_above_zero():
    with pytest.raises(InputError, match=r"load_cell_bias.largest: 0, .*greater than 0"):
        bundle_of("worst_case_steep_past_thesis", "control.force.load_cell_bias={largest: 0}")


class OffBy:
    """A force stage before which a load cell is off; the MuJoCo plant has no such effect."""

    def __init__(self, stage, offset):
        self._stage, self._offset, self.node = stage, offset, stage.node
        self.reported = ""

    def step(self, now_ns, inputs, send):
        self._stage.step(now_ns, inputs | {TENSION: inputs[TENSION] + self._offset}, send)

    def status(self):
        status = self._stage.status()
        self.reported = status.values["load_cell_bias"]
        return status


@pytest.mark.slow
@pytest.mark.compiled
def test_a_biased_load_cell_on_the_other_plant():
    """MuJoCo's winches have dry friction besides."""
    friction = (("winch_coulomb_friction", (), {"torque": 0.002}),)
    overrides = ("duration=7.0", "control.motion.governor=null", ON)
    bundle = Case("worst_case_steep_past_thesis", overrides, friction, plant="mujoco").bundle()
    parts = assembled(bundle)
    offset = np.array([1.0 * (name == "surge_1") for name in bundle.testbed.testbed.cable_names])
    force = OffBy(parts.stages[-1], offset)
    loop = Loop(replace(parts, stages=[*parts.stages[:-1], force]), {}, lambda *_: None)
    for _ in range(7000):
        loop.step()
    name, value, _ = force.reported.split()
    assert name == "surge_1"
    assert float(value) == pytest.approx(1.0, abs=0.1)
