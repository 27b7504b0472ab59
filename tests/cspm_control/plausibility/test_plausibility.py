"""What can be true on a machine: healthy runs pass, and each kind of nonsense is named."""

import re

import numpy as np
import pytest
from run_samples import SCENARIOS, bundle_of, run_to

from cspm_control.plausibility.make import fastest, machine_size, make_plausibility
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    FORCE_CONTROLLER,
    FRAME_POSE,
    MOTION_CONTROLLER,
    TARGET_POSE,
    TARGET_TRACKER,
    TENSION,
    TENSION_DISTRIBUTION,
    WINCH_STATE,
    schedule_of,
)

MS = 1_000_000
N = 8
# The thesis's machine: of 1 m, with cables of 2·60 + 2·35 + 4·15 N on 4.06 kg.
FASTEST = np.sqrt(2.0 * (250.0 / 4.06 + 9.81))


def at(x=0.0, y=0.0, z=2.0, yaw=0.0):
    """Return the bar's row at a place, turned about the vertical."""
    return np.array([x, y, z, 0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)])


class Judge:
    """What one node says of messages, given one by one at times in ms."""

    def __init__(self, node, *overrides, scenario="rest"):
        bundle = bundle_of(scenario, *overrides)
        self._found = make_plausibility(node, bundle.scenario, bundle.testbed.testbed)
        self.rows = {}

    def says(self, topic, ms, row, *, running=True):
        fault = self._found.fault(topic, round(ms * MS), row, self.rows, running=running)
        if fault is None:
            self.rows[topic] = row
        return fault


def every_fault(folder, scenario, *overrides):
    """Simulate a scenario; return what its nodes say of what they hear, and how much they hear."""
    bundle = bundle_of(scenario, *overrides)
    testbed = bundle.testbed.testbed
    _, rows = run_to(folder, scenario, *overrides)
    faults, count = [], 0
    for node, plan in schedule_of(bundle.scenario, testbed).nodes.items():
        judge = Judge(node, *overrides, scenario=scenario)
        heard = [name for name in (*plan.inputs, *plan.held) if name in rows]
        messages = [
            (stamp, name, row)
            for name in heard
            for stamp, row in zip(rows[name].stamp_ns.tolist(), rows[name].rows, strict=True)
        ]
        count += len(messages)
        for stamp, name, row in sorted(messages, key=lambda message: message[:2]):
            faults.append(judge.says(name, stamp / MS, row))
    return [fault for fault in faults if fault], count


@pytest.mark.slow
@pytest.mark.parametrize(
    "scenario", ["calm", "worst_case", "worst_case_cut_cable", "calm_measured_target", "cogiro"]
)
def test_a_healthy_run_is_plausible(tmp_path, scenario):
    faults, count = every_fault(tmp_path / "run", scenario, "duration=30")
    assert faults == []
    assert count > 10_000


def test_a_short_run_is_plausible(tmp_path):
    faults, count = every_fault(tmp_path / "run", "worst_case", "duration=2")
    assert faults == []
    assert count > 10_000


@pytest.mark.slow
def test_dry_friction_that_a_diagnosis_finds_is_plausible(tmp_path):
    friction = (
        "  - {effect: winch_coulomb_friction, elements: [sway_3], parameters: {torque: 0.03}}"
    )
    (tmp_path / "testbeds").mkdir()
    for path in ("worst_case.yaml", "testbeds/thesis_refitted.yaml"):
        text = (SCENARIOS / path).read_text(encoding="utf-8")
        changed = text.replace("\neffects:\n", f"\neffects:\n{friction}\n")
        (tmp_path / path).write_text(changed, encoding="utf-8")
    faults, count = every_fault(tmp_path / "run", tmp_path / "worst_case.yaml", "duration=10")
    assert faults == []
    assert count > 10_000


def test_defaults_follow_from_the_machine():
    testbed = bundle_of("rest").testbed.testbed
    assert machine_size(testbed) == 1.0
    assert fastest(testbed) == pytest.approx(FASTEST)


# Workspace


@pytest.mark.parametrize("node", [MOTION_CONTROLLER, TENSION_DISTRIBUTION])
def test_a_pose_in_millimetres_is_outside_the_workspace(node):
    judge = Judge(node)
    assert judge.says(BAR_POSE, 0.0, at(z=2000.0), running=False) == (
        "/bar/pose: 2e+03 m from its mean position, allowed: at most 1 m (safety.workspace)"
    )
    assert judge.says(BAR_POSE, 10.0, at(), running=False) is None


def test_the_workspace_is_a_ball_about_the_mean_pose():
    assert Judge(MOTION_CONTROLLER).says(BAR_POSE, 0.0, at(x=0.6, y=0.79)) is None
    assert Judge(MOTION_CONTROLLER).says(BAR_POSE, 0.0, at(x=0.6, y=0.81)) is not None
    smaller = Judge(MOTION_CONTROLLER, "safety.workspace=0.3")
    assert smaller.says(BAR_POSE, 0.0, at(z=2.29)) is None
    assert smaller.says(BAR_POSE, 0.0, at(z=2.31)) == (
        "/bar/pose: 0.31 m from its mean position, allowed: at most 0.3 m (safety.workspace)"
    )


def test_the_winch_frame_has_a_workspace_too():
    judge = Judge(TENSION_DISTRIBUTION)
    assert judge.says(FRAME_POSE, 0.0, at(z=0.1)) is None
    assert judge.says(FRAME_POSE, 1.0, at(z=1.1)).startswith("/winch_frame/pose: 1.1 m from")


def test_the_target_has_a_workspace_too():
    judge = Judge(TARGET_TRACKER, scenario="calm_measured_target")
    mean = bundle_of("calm_measured_target").scenario.target.mean_pose
    assert judge.says(TARGET_POSE, 0.0, at(*mean[:3])) is None
    assert judge.says(TARGET_POSE, 10.0, at(z=mean[2] + 1.5)).startswith("/target/pose: 1.5 m")


# Jumps


def test_a_pose_that_jumps_is_refused_until_the_machine_could_be_there():
    judge = Judge(MOTION_CONTROLLER)
    assert judge.says(BAR_POSE, 0.0, at()) is None
    assert judge.says(BAR_POSE, 10.0, at(x=0.2)) == (
        "/bar/pose: jumped by 0.2 m in 10 ms, allowed: 11.9 m/s (safety.pose_speed)"
    )
    assert judge.says(BAR_POSE, 16.0, at(x=0.2)) is not None
    assert judge.says(BAR_POSE, 20.0, at(x=0.2)) is None


@pytest.mark.parametrize(("share", "plausible"), [(0.95, True), (1.05, False)])
def test_the_fastest_movement_is_allowed(share, plausible):
    judge = Judge(MOTION_CONTROLLER)
    assert judge.says(BAR_POSE, 0.0, at()) is None
    moved = at(x=share * 0.01 * FASTEST)
    assert (judge.says(BAR_POSE, 10.0, moved) is None) is plausible


def test_a_bar_that_turns_end_for_end_jumps():
    judge = Judge(MOTION_CONTROLLER)
    assert judge.says(BAR_POSE, 0.0, at()) is None
    assert "jumped by 1 m in 10 ms" in judge.says(BAR_POSE, 10.0, at(yaw=np.pi))
    assert judge.says(BAR_POSE, 20.0, at(yaw=0.2)) is None


def test_stamps_that_tremble_do_not_make_a_movement_fast():
    judge = Judge(MOTION_CONTROLLER)
    assert judge.says(BAR_POSE, 0.0, at()) is None
    assert judge.says(BAR_POSE, 0.001, at(x=0.05)) is None


def test_after_a_restarted_clock_a_pose_is_the_first():
    judge = Judge(MOTION_CONTROLLER)
    assert judge.says(BAR_POSE, 1000.0, at()) is None
    assert judge.says(BAR_POSE, 5.0, at(x=0.5)) is None


def test_the_allowed_speed_is_the_scenarios():
    judge = Judge(MOTION_CONTROLLER, "safety.pose_speed=1.0")
    assert judge.says(BAR_POSE, 0.0, at()) is None
    assert judge.says(BAR_POSE, 10.0, at(x=0.009)) is None
    assert judge.says(BAR_POSE, 20.0, at(x=0.02)) == (
        "/bar/pose: jumped by 0.011 m in 10 ms, allowed: 1 m/s (safety.pose_speed)"
    )


# Following


def reference(**place):
    return np.concatenate([at(**place), np.zeros(12)])


def follow(judge, ms, x, **options):
    judge.rows[BAR_REFERENCE] = reference()
    return judge.says(BAR_POSE, ms, at(x=x), **options)


def test_a_bar_far_from_its_reference_does_not_follow():
    judge = Judge(MOTION_CONTROLLER)
    assert follow(judge, 0.0, 0.49) is None
    assert follow(judge, 10.0, 0.51) == (
        "/bar/pose: 0.51 m from /bar/reference, allowed: at most 0.5 m (safety.following_error)"
    )
    stricter = Judge(MOTION_CONTROLLER, "safety.following_error=0.3")
    assert follow(stricter, 0.0, 0.29) is None
    assert follow(stricter, 10.0, 0.31) is not None


def test_a_turned_bar_does_not_follow():
    judge = Judge(MOTION_CONTROLLER)
    judge.rows[BAR_REFERENCE] = reference()
    assert judge.says(BAR_POSE, 0.0, at(yaw=1.0)) is None
    assert "/bar/reference" in judge.says(BAR_POSE, 80.0, at(yaw=1.1))


def test_after_the_safe_state_the_bar_has_to_come_near_first():
    judge = Judge(MOTION_CONTROLLER)
    assert follow(judge, 0.0, 0.6, running=False) is None
    assert follow(judge, 100.0, 0.6) is None
    # Where it was held just within the limit it may sag beyond before it comes nearer.
    assert follow(judge, 200.0, 0.49) is None
    assert follow(judge, 300.0, 0.51) is None
    assert follow(judge, 400.0, 0.25) is None
    assert follow(judge, 500.0, 0.51) is not None


def test_a_bar_that_was_held_within_the_limit_has_to_come_nearer_too():
    judge = Judge(MOTION_CONTROLLER)
    assert follow(judge, 0.0, 0.51) is not None
    assert follow(judge, 100.0, 0.49, running=False) is None
    assert follow(judge, 200.0, 0.51) is None
    assert follow(judge, 300.0, 0.24) is None
    assert follow(judge, 400.0, 0.51) is not None


# Torques


class Winches:
    """A force controller's judge of winches that hold 10 N each, every millisecond."""

    def __init__(self, *overrides):
        self.judge, self.ms = Judge(FORCE_CONTROLLER, *overrides), 0
        bundle = bundle_of("rest")
        cables = bundle.testbed.testbed.cables
        self.radii = np.array([cable.drum_radius / cable.gear_ratio for cable in cables])
        self.inertia = np.array([cable.rotor_inertia for cable in cables])
        self.tensions, self.speeds = np.full(N, 10.0), np.zeros(N)
        self.angles = np.zeros(N)
        self.torques = self.radii * self.tensions

    def go(self, ms, *, running=True, spin=0.0):
        """Go on for so long; return the faults."""
        found = []
        for _ in range(ms):
            self.ms += 1
            self.angles += 1e-3 * self.speeds
            self.speeds += 1e-3 * spin
            self.judge.rows[TENSION] = self.tensions
            row = np.concatenate([self.angles, self.speeds, self.torques])
            found.append(self.judge.says(WINCH_STATE, self.ms, row, running=running))
        return [fault for fault in found if fault]


def test_tension_that_no_torque_holds():
    winches = Winches()
    assert winches.go(700) == []
    winches.torques[5] = 0.0
    assert winches.go(300)[0] == (
        "/winches/state: tension without torque of sway_2: 0 N·m where tension and motion need"
        " 0.25 N·m, allowed: 0.12 N·m off (safety.torque_mismatch)"
    )


def test_torque_that_nothing_moves_for():
    winches = Winches()
    assert winches.go(700) == []
    winches.torques[2] += 0.3
    found = winches.go(300)[0]
    assert found.startswith("/winches/state: torque without motion of surge_1: 0.55 N·m where")
    assert found.endswith("allowed: 0.12 N·m off (safety.torque_mismatch)")


def test_torque_that_speeds_a_winch_up_is_none():
    winches = Winches()
    spin = np.full(N, 0.0)
    spin[2] = 0.3 / winches.inertia[2]
    winches.torques[2] += 0.3
    assert winches.go(1200, spin=spin) == []


def test_half_of_the_tension_may_be_friction():
    winches = Winches()
    winches.torques[5] *= 0.55
    assert winches.go(1200) == []
    winches.torques[5] *= 0.8
    assert winches.go(300) != []


def test_the_mismatch_is_the_scenarios():
    winches = Winches("safety.torque_mismatch=0.3")
    winches.torques[5] = 0.0
    assert winches.go(1200) == []


def test_brakes_may_take_half_a_second_to_open():
    winches = Winches()
    torques, winches.torques = winches.torques, np.zeros(N)
    assert winches.go(300, running=False) == []
    assert winches.go(490) == []
    winches.torques = torques
    assert winches.go(500) == []


def test_nothing_is_judged_across_a_silence():
    winches = Winches()
    assert winches.go(700) == []
    winches.torques[5] = 0.0
    for _ in range(10):
        assert winches.go(60) == []
        winches.ms += 30


def test_the_torque_of_a_winch_without_cable_is_not_judged():
    bundle = bundle_of("emps")
    plans = schedule_of(bundle.scenario, bundle.testbed.testbed).nodes
    for node in plans:
        found = make_plausibility(node, bundle.scenario, bundle.testbed.testbed)
        assert found.poses == found.noise == {}
        assert found.following is None


# Drives


def test_a_drive_whose_angle_jumps():
    winches = Winches()
    assert winches.go(10) == []
    winches.angles[2] += 1.0
    assert winches.go(1)[0] == (
        "/winches/state: angle of surge_1 jumped by 1 rad in 1 ms, allowed: 0.01 rad (the motor's"
        " rotor_inertia and torque_limit)"
    )


def test_a_trip_at_a_higher_tension_lets_motors_accelerate_more():
    for trip, plausible in ((100.0, False), (10_000.0, True)):
        winches = Winches(f"safety.tension_trip={trip}")
        assert winches.go(10) == []
        winches.angles[2] += 0.1
        assert (winches.go(1) == []) is plausible


@pytest.mark.parametrize(
    "key", ["workspace", "pose_speed", "pose_acceleration", "following_error", "torque_mismatch"]
)
def test_limits_are_positive(key):
    with pytest.raises(Exception, match=re.escape(f"safety.{key}")):
        bundle_of("rest", f"safety.{key}=0")
