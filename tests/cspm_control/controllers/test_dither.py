"""Whether the dither on the torques is the sine that is described, and keeps a winch moving."""

import numpy as np
import pytest
from machines import build, entry, rig_content
from run_samples import bundle_of, run_to

from cspm_control.controllers.dither import Dither
from cspm_control.controllers.force_controller import ForceController
from cspm_control.stages.make import make_controller
from cspm_model.motion import Motion
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    WINCH_STATE,
)
from cspm_sim.plant import Plant

MS = 1_000_000
N = 8
KEY = "control.force.dither"
ON = KEY + "={{amplitude: {}, frequency: {}}}"


def dither(amplitude=0.05, frequency=150.0, limit=2.0):
    return Dither(np.array([amplitude]), np.array([frequency]), np.array([limit]))


def test_the_sine_begins_at_zero_and_rises():
    found = dither(0.05, 125.0)
    torque = np.array([0.3])
    values = [float(found.added_to(torque, k * MS)[0] - 0.3) for k in range(8)]
    np.testing.assert_allclose(values, 0.05 * np.sin(2 * np.pi * np.arange(8) / 8), atol=1e-15)


def test_each_winch_has_its_own():
    found = Dither(np.array([0.02, 0.0]), np.array([250.0, 0.0]), np.array([2.0, 2.0]))
    np.testing.assert_allclose(found.added_to(np.array([0.1, 0.1]), MS), [0.12, 0.1], rtol=1e-12)


@pytest.mark.parametrize("torque", [0.0, 0.7, -0.7, 0.97, -0.97, 1.0, -1.0])
def test_the_mean_torque_is_unchanged_and_the_limit_holds(torque):
    found = dither(0.1, 125.0, limit=1.0)
    sent = np.array([found.added_to(np.array([torque]), k * MS)[0] for k in range(8)])
    assert sent.mean() == pytest.approx(torque, abs=1e-15)
    assert np.abs(sent).max() <= 1.0
    assert np.ptp(sent) == pytest.approx(2.0 * min(0.1, 1.0 - abs(torque)), abs=1e-15)


def test_the_phase_is_that_of_the_stamp_alone_also_on_the_clock_of_a_real_machine():
    found, torque = dither(0.05, 140.0), np.zeros(1)
    late = 1_800_000_000_000_000_000  # a whole number of cycles
    for k in range(1, 8):
        now, then = (found.added_to(torque, at + k * MS)[0] for at in (late, 0))
        assert now == then != 0.0


def tracked(effect, *, amplitude):
    """A winch follows a slow sine of tension; return its error [N] and mean torque added [N·m]."""
    content = rig_content()
    content["effects"] = [effect]
    plant = Plant(build(content), Motion.still(np.zeros(6)), MS, tensions=[12.0])
    gains, limit = [PiGains(kp=0.02, integral_frequency=20.0)], np.array([2.0])
    controller = ForceController(gains, np.array([0.025]), limit, period=1e-3)
    added, errors, more = dither(amplitude), np.empty(8000), np.empty(8000)
    for k in range(8000):
        wanted = np.array([12.0 + 3.0 * np.sin(2.0 * np.pi * k / 4000)])
        errors[k] = wanted[0] - plant.tensions[0]
        torque = controller.step(wanted, plant.tensions.copy())
        sent = added.added_to(torque, k * MS)
        more[k] = sent[0] - torque[0]
        plant.step(sent)
    return errors[2000:], more[2000:].mean()


# From a reversal, at a quarter and three quarters of each 4 s, on for half a second.
AFTER_REVERSALS = np.concatenate([np.arange(1000, 1500) + k for k in (0, 2000, 4000)])
COULOMB = entry("winch_coulomb_friction", torque=0.03)
STRIBECK = entry(
    "winch_stribeck_friction", breakaway_torque=0.04, coulomb_torque=0.025, stribeck_speed=1.0
)


@pytest.mark.compiled
@pytest.mark.parametrize("friction", [COULOMB, STRIBECK], ids=["coulomb", "stribeck"])
def test_a_winch_does_not_stick_where_it_reverses(friction):
    """Without dither the error grows until the integrator has wound up to breakaway."""
    (sticks, _), (moves, mean) = (tracked(friction, amplitude=a) for a in (0.0, 0.05))
    assert np.abs(moves[AFTER_REVERSALS]).max() < 0.5 * np.abs(sticks[AFTER_REVERSALS]).max()
    assert mean == pytest.approx(0.0, abs=1e-12)


def torques_of(*overrides, count=3, slew=None):
    """Return the torques that the thesis's force controllers send, all wanted tensions met."""
    bundle = bundle_of("rest", *overrides)
    stage = make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
    rows = {TENSION: np.full(N, 6.0), TENSION_COMMAND: np.full(N, 6.0)}
    rows[WINCH_STATE] = np.zeros(3 * N)
    sent = []
    for k in range(count):
        stage.step(k * MS, rows, lambda topic, row: sent.append((topic, row.copy())))
    assert {topic for topic, _ in sent} == {TORQUE_COMMAND}
    return np.array([row for _, row in sent])


def test_the_stage_adds_it_to_the_torque_of_the_cables_that_are_named():
    plain = torques_of()
    more = torques_of(ON.format("{hoist: 0.004, hoist_2: 0.008, sway_1: 0.02}", 250)) - plain
    np.testing.assert_allclose(more[0], 0.0, atol=1e-15)
    expected = [0.004, 0.008, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(more[1], expected, atol=1e-12)
    everywhere = torques_of(ON.format(0.003, "{hoist: 125, surge: 250, sway: 250}")) - plain
    assert everywhere[1, 0] == pytest.approx(0.003 * np.sin(0.25 * np.pi))
    np.testing.assert_allclose(everywhere[1, 2:], 0.003, atol=1e-12)


def test_the_largest_change_of_a_torque_holds_for_the_dither_too():
    slow = torques_of(ON.format(0.02, 250), "safety.torque_slew=5")
    np.testing.assert_allclose(np.diff(slow, axis=0)[0], 0.005, atol=1e-12)


@pytest.mark.compiled
def test_in_a_run_only_the_torque_changes_and_at_the_first_instant_nothing(tmp_path):
    off, on = (
        run_to(tmp_path / name, "rest", "duration=0.2", *more)[1][TORQUE_COMMAND]
        for name, more in (("off", ()), ("on", (ON.format(0.004, 100),)))
    )
    np.testing.assert_array_equal(on.rows[0], off.rows[0])
    assert np.abs(on.rows[1] - off.rows[1]).min() > 1e-3


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (
            ("{hoist_9: 0.01}", 80),
            ".amplitude: hoist_9, allowed: hoist, surge, sway, hoist_1, hoist_2, surge_1, surge_2,"
            " sway_1, sway_2, sway_3, sway_4; did you mean hoist_2, hoist_1 or hoist?",
        ),
        (
            (5.0, 80),
            ".amplitude: 5 N·m of hoist_1, allowed: at most its torque limit of 0.5 N·m",
        ),
        (
            (0.01, 500),
            ".frequency: 500 Hz of hoist_1, allowed: above 0 and below 500 Hz, half the rate of"
            " force_controller",
        ),
        (
            (0.01, "{hoist: 80}"),
            ".frequency: missing for surge_1, allowed: above 0 and below 500 Hz, half the rate of"
            " force_controller",
        ),
    ],
)
def test_what_no_winch_can_do_is_refused_in_one_line(given, text):
    with pytest.raises(InputError) as caught:
        torques_of(ON.format(*given))
    assert str(caught.value) == KEY + text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("{amplitude: -1, frequency: 80}", "amplitude: -1, allowed: greater than 0"),
        ("{amplitude: {hoist: 0}, frequency: 80}", "amplitude.hoist: 0, allowed: greater than 0"),
        ("{amplitude: big, frequency: 80}", "amplitude: 'big', allowed: a number"),
        ("{amplitude: 0.01}", "frequency: missing, a value is required"),
        ("{amplitude: 0.01, frequency: 80, phase: 1}", "phase: unknown key, allowed: amplitude,"),
    ],
)
def test_each_fault_of_the_file_is_one_line(value, text):
    with pytest.raises(InputError) as caught:
        bundle_of("rest", f"{KEY}={value}")
    assert f"{KEY}.{text}" in str(caught.value)
    assert "\n" not in str(caught.value)
