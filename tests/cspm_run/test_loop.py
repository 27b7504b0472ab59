"""The lockstep schedule, seen from its messages."""

from pathlib import Path

import numpy as np
import pytest
from loops import WILD, Listener
from run_samples import SCENARIOS, THESIS_CABLES, bundle_of, stamps

from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.rows import bar_twist_row, pose_row
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.errors import DivergenceError
from cspm_run.assembly import assemble

FAST = (
    "rates.motion_capture=1000",
    "rates.motion_controller=500",
    "rates.tension_distribution=500",
)


def after(bundle, steps, sensors=None):
    return Listener(bundle, sensors).run(steps)


@pytest.fixture(scope="module")
def waves():
    """0.3 s of the worst case, controllers at 500 Hz, with the test-bed's noise."""
    return after(bundle_of("worst_case", *FAST), 300)


def test_command_k_moves_the_plant_from_state_k_to_state_k_plus_1(waves):
    """An open-loop plant under the recorded commands repeats every true state, bit for bit."""
    plant = assemble(waves.parts.scenario, waves.parts.testbed, Path()).plant
    commands = waves.rows("/winches/torque_command")
    poses, twists = waves.rows("/truth/bar/pose"), waves.rows("/truth/bar/twist")
    states, tensions = waves.rows("/truth/winches/state"), waves.rows("/truth/cables/tension")
    pose, twist = np.empty(7), np.empty(6)
    for k, command in enumerate(commands):
        pose_row(plant.bar_state, pose)
        bar_twist_row(plant.bar_state, twist)
        np.testing.assert_array_equal(pose, poses[k])
        np.testing.assert_array_equal(twist, twists[k])
        np.testing.assert_array_equal(tensions[k], plant.tensions)
        np.testing.assert_array_equal(states[k, :16], np.concatenate([plant.angles, plant.speeds]))
        plant.step(command)
    # The commands matter: what is one step late ends elsewhere.
    late = assemble(waves.parts.scenario, waves.parts.testbed, Path()).plant
    for command in np.vstack([commands[:1], commands[:-1]]):
        late.step(command)
    assert np.abs(late.state - plant.state).max() > 1e-9


def test_the_torque_in_the_winch_state_is_the_one_that_led_to_it(waves):
    found = waves.rows("/truth/winches/state")[:, 16:]
    cables = waves.parts.plant.parameters.cables
    np.testing.assert_array_equal(found[1:], waves.rows("/winches/torque_command")[:-1])
    first = cables[:, RADIUS] * waves.rows("/truth/cables/tension")[0]
    np.testing.assert_array_equal(found[0], first)


def test_command_k_comes_from_what_was_measured_at_k(waves):
    """Controllers of their own, fed with the messages, repeat every command bit for bit."""
    wave, motion, distribution, force = assemble(
        waves.parts.scenario, waves.parts.testbed, Path()
    ).stages
    assert wave.node == "wave_trajectory"
    measured = {name: waves.rows(name) for name in waves.parts.sensors}
    references = waves.rows("/bar/reference")
    known = {}
    for k, torque in enumerate(waves.rows("/winches/torque_command")):
        known |= {name: rows[k] for name, rows in measured.items()}
        known["/bar/reference"] = references[k]
        if k % 2 == 0:
            for stage, topic in ((motion, "/wrench_command"), (distribution, "/tension_command")):
                stage.step(k * 1_000_000, known, known.__setitem__)
                np.testing.assert_array_equal(known[topic], waves.rows(topic)[k // 2])
        force.step(k * 1_000_000, known, known.__setitem__)
        np.testing.assert_array_equal(known["/winches/torque_command"], torque)


def test_what_is_measured_is_not_the_truth(waves):
    for topic in ("/bar/pose", "/winch_frame/pose", "/winches/state", "/cables/tension"):
        found, truth = waves.rows(topic), waves.rows("/truth" + topic)
        assert found.shape == truth.shape
        assert (found != truth).any(axis=1).all()
        np.testing.assert_allclose(found, truth, atol=0.2)


def test_the_truth_is_smooth_where_nothing_feeds_noise_back():
    locked = ("control={mode: locked_winches}", "rates.motion_capture=1000")
    found = after(bundle_of("worst_case", *locked), 200)

    def jumps(name):
        return np.abs(np.diff(found.rows(name), 3, axis=0)).max()

    assert jumps("/truth/cables/tension") < 1e-3
    assert jumps("/cables/tension") > 0.1
    assert jumps("/truth/bar/pose") < 1e-7
    assert jumps("/bar/pose") > 2e-4


RATES = {
    "winches": (250, ["/winches/state"]),
    "load_cells": (500, ["/cables/tension"]),
    "motion_capture": (50, ["/bar/pose", "/winch_frame/pose"]),
    "wave_trajectory": (200, ["/bar/reference", "/winch_frame/reference"]),
    "motion_controller": (100, ["/wrench_command"]),
    "tension_distribution": (125, ["/tension_command"]),
    "force_controller": (500, ["/winches/torque_command"]),
}


def test_every_part_runs_at_its_own_rate():
    overrides = [f"rates.{name}={rate}" for name, (rate, _) in RATES.items()]
    found = after(bundle_of("worst_case", *overrides), 400)
    for rate, topics in RATES.values():
        for topic in topics:
            np.testing.assert_array_equal(found.stamp(topic), stamps(rate, 0.4))
            np.testing.assert_array_equal(found.log(topic), stamps(rate, 0.4))
    for topic in ("/clock", "/truth/bar/pose", "/truth/cables/unstretched_length"):
        np.testing.assert_array_equal(found.stamp(topic), stamps(1000, 0.4))
    for node in ("plant", "wave_trajectory", "motion_controller", "force_controller"):
        reported = [now for now, _ in found.statuses_of(node)]
        assert reported == [0, 100_000_000, 200_000_000, 300_000_000]
    # At 125 Hz no computation falls on a multiple of 0.1 s; the next one does.
    reported = [now for now, _ in found.statuses_of("tension_distribution")]
    assert reported == [0, 104_000_000, 208_000_000, 312_000_000]


def test_the_plants_rate_sets_the_grid():
    found = after(bundle_of("rest", "rates.plant=2000"), 200)
    np.testing.assert_array_equal(found.stamp("/clock"), np.arange(200) * 500_000)
    np.testing.assert_array_equal(found.stamp("/cables/tension"), stamps(1000, 0.1))
    np.testing.assert_array_equal(found.stamp("/bar/pose"), stamps(100, 0.1))


def test_a_late_pose_is_used_when_it_arrives():
    bundle = bundle_of("worst_case")
    sensors = bundle.testbed.testbed.sensors
    late = {"/bar/pose": sensors["/bar/pose"].model_copy(update={"delay": 0.02})}
    found = after(bundle, 200, late)
    np.testing.assert_array_equal(found.log("/bar/pose"), np.arange(20, 200) * 1_000_000)
    np.testing.assert_array_equal(found.stamp("/bar/pose"), np.arange(180) * 1_000_000)
    # Nothing is commanded on nothing; the winches hold what hangs on them until then.
    np.testing.assert_array_equal(found.stamp("/wrench_command"), np.arange(20, 200) * 1_000_000)
    before = found.rows("/truth/winches/state")[:21, 16:]
    np.testing.assert_array_equal(before, np.repeat(before[:1], 21, axis=0))
    tensions = found.rows("/truth/cables/tension")[:20]
    np.testing.assert_allclose(tensions, np.repeat(tensions[:1], 20, axis=0), atol=0.02)


def test_hanging_at_rest_stays_at_the_reference_within_the_noise():
    found = after(bundle_of("rest"), 3000)
    error = found.parts.plant.bar_state[:6] - found.parts.references["/bar/reference"].values[:6]
    assert np.abs(error[:3]).max() < 3e-4
    assert np.abs(error[4:]).max() < 5e-4
    assert abs(error[3]) < 5e-3
    poses = found.rows("/truth/bar/pose")
    assert np.abs(poses[:, :3] - [0.0, 0.0, 2.0]).max() < 3e-4
    assert poses[:, :3].std() > 0.0


def test_with_ideal_sensors_rest_is_rest():
    found = after(bundle_of("rest", "sensors=ideal"), 500)
    poses, tensions = found.rows("/truth/bar/pose"), found.rows("/truth/cables/tension")
    np.testing.assert_allclose(poses, np.repeat(poses[:1], 500, axis=0), atol=1e-9)
    np.testing.assert_allclose(tensions, np.repeat(tensions[:1], 500, axis=0), atol=1e-6)
    np.testing.assert_array_equal(found.rows("/bar/pose"), poses[::10])


def test_all_is_well_at_rest():
    found = after(bundle_of("rest"), 200)
    assert not found.loop.slack
    assert not found.loop.infeasible
    names = ["plant", *found.parts.schedule.nodes]
    assert [status.name for _, status in found.statuses] == 2 * names
    assert {status.level for _, status in found.statuses} == {Level.OK}
    assert found.loop.history().startswith("before it: bar at [")


def test_slack_cables_are_reported():
    unwinding = "control={mode: torque, torque: {surge_1: {offset: -0.2}}}"
    found = after(bundle_of("rest", unwinding), 400)
    tensions = found.rows("/truth/cables/tension")
    assert (tensions[-1] <= 0.0).any()
    assert found.loop.slack
    assert not found.loop.infeasible
    first = np.flatnonzero((tensions <= 0.0).any(axis=1))[0]
    assert f"slack since {(first - 1) * 1e-3:.3f} s (surge_1)" in found.loop.history()
    now, plant = found.statuses_of("plant")[-1]
    assert (now, plant.level, plant.message) == (300_000_000, Level.WARN, "slack cable")
    shares = [float(reported.values["slack_share"]) for _, reported in found.statuses_of("plant")]
    expected = (tensions <= 0.0).any(axis=1)
    # A status counts the steps since the last one, its own among them.
    np.testing.assert_allclose(
        shares[1:], [expected[i - 99 : i + 1].mean() for i in (100, 200, 300)]
    )


def test_a_wrench_out_of_reach_is_reported():
    asked = "control={mode: closed_loop, motion: {gains: {surge: {kp: 9000, ki: 0, kd: 0}}}}"
    calm = after(bundle_of("rest", asked), 50)
    assert not calm.loop.infeasible
    noisy = bundle_of("rest", asked.replace("9000", "90000000"))
    found = after(noisy, 150)
    assert found.loop.infeasible
    assert "wrench infeasible since 0." in found.loop.history()
    _, distribution = found.statuses_of("tension_distribution")[-1]
    assert (distribution.level, distribution.message) == (Level.WARN, "wrench infeasible")
    assert float(distribution.values["infeasible_share"]) > 0.5


def test_a_divergence_says_when_which_and_what_preceded_it():
    found = Listener(bundle_of("rest", *WILD))
    with pytest.raises(DivergenceError, match=r"^t = \d+\.\d{3} s: \S") as caught:
        found.run(20_000)
    assert f"t = {found.parts.plant.time:.3f} s" in str(caught.value)
    assert "wrench infeasible since 0." in found.loop.history()


def test_locked_winches_command_nothing():
    found = after(bundle_of("verification_mid"), 100)
    for topic in ("/wrench_command", "/tension_command", "/winches/torque_command"):
        assert found.messages[topic] == []
    angles = found.rows("/truth/winches/state")[:, :16]
    np.testing.assert_array_equal(angles, np.zeros((100, 16)))


def test_prescribed_torques_are_what_the_scenario_says():
    found = after(bundle_of("one_winch"), 500)
    torque = found.rows("/winches/torque_command")[:, 0]
    time = np.arange(500) * 1e-3
    sines = [(0.5, 0.0), (1.7, 1.0), (4.1, 2.0), (9.7, 3.0)]
    expected = 0.75 + 0.06 * sum(np.sin(2 * np.pi * f * time + phase) for f, phase in sines)
    np.testing.assert_allclose(torque, expected, atol=1e-12)
    # The cable starts with what the first torque holds, and stays taut.
    tension = found.rows("/truth/cables/tension")[:, 0]
    assert tension[0] == pytest.approx(expected[0] / 0.025, rel=1e-6)
    assert np.abs(tension - expected / 0.025).max() < 8.0


def test_the_cables_are_in_the_files_order():
    text = (SCENARIOS / "testbeds" / "thesis.yaml").read_text(encoding="utf-8")
    places = [text.index(f"name: {name}\n") for name in THESIS_CABLES]
    assert places == sorted(places)
    topics = bundle_of("rest").testbed.testbed.topics
    for name in ("/winches/state", "/cables/tension", "/winches/torque_command"):
        assert topics[name].joint_names == THESIS_CABLES


def test_a_trip_with_brakes_stops_the_winches():
    free = Listener(bundle_of("worst_case")).run(50)
    braked = Listener(bundle_of("worst_case", "safety.state=brake")).run(50)
    braked.parts.stages[-1].trip(50_000_000, "for a test")
    for found in (free, braked):
        found.run(50)
    speeds = braked.rows("/truth/winches/state")[:, 8:16]
    assert np.abs(speeds[49]).min() > 0.0
    assert np.abs(speeds[52:]).max() == 0.0
    np.testing.assert_array_equal(braked.rows("/winches/torque_command")[51:], 0.0)
    assert np.abs(free.rows("/truth/winches/state")[52:, 8:16]).max() > 0.0
