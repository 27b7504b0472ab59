"""The plant's own guard, and the brakes of both plants that it sets."""

import numpy as np
import pytest
from machines import THESIS

from cspm_model.motion import Motion
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.plant_guard import make_watchdog
from cspm_sim.plant import Plant

MS = 1_000_000
N = 8
POSE = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
PLANTS = ["sim", "mujoco"]


def scenario(safety="{}"):
    return parse_scenario(
        "name: plain\ntestbed: none.yaml\nduration: 1.0\n"
        f"target: {{mean_pose: {POSE}}}\nsafety: {safety}\n",
        "my.yaml",
    )


def hanging(name="sim", **arguments):
    """The thesis's machine at rest, by either plant."""
    testbed, motion = load_testbed(THESIS).testbed, Motion.still(np.zeros(6))
    if name == "sim":
        return Plant(testbed, motion, MS, bar_pose=POSE, **arguments)
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    from cspm_sim.mujoco.plant import MujocoPlant

    return MujocoPlant(testbed, motion.at, MS, bar_pose=POSE, **arguments)


def carried(plant):
    """Return the torques that carry what hangs on the winches."""
    radii = [c.drum_radius / c.gear_ratio for c in plant.testbed.cables]
    return np.array(radii) * plant.tensions


class Drives:
    """A plant with its watchdog, stepped as a node in real time does it."""

    def __init__(self, safety="{}", plant="sim"):
        self.plant = hanging(plant)
        self.start = self.plant.bar_state[2]
        self.dog = make_watchdog(scenario(safety), self.plant)
        self.torque = carried(self.plant)

    @property
    def now_ns(self):
        return self.plant.steps * MS

    @property
    def sunk(self):
        return self.plant.bar_state[2] - self.start

    def go(self, count, command=None):
        """Step, with a command at each step or none; return whether it was safe, by step."""
        safe = []
        for _ in range(count):
            if command is not None:
                self.dog.command(self.now_ns, command)
                self.torque = command
            own = self.dog.torque(self.now_ns)
            safe.append(own is not None)
            self.plant.step(self.torque if own is None else own)
        return safe


def test_it_waits_for_a_first_command():
    drives = Drives()
    assert not any(drives.go(500))
    assert drives.dog.status()[:3] == (
        Level.OK,
        "plant/watchdog",
        "waits for the first torque command",
    )
    assert not drives.dog.safe


def test_commands_that_come_in_time_are_followed():
    drives = Drives()
    assert not any(drives.go(1, drives.torque))
    # Silent for as long as it is allowed.
    assert not any(drives.go(50))
    assert not any(drives.go(1, drives.torque))
    found = drives.dog.status()
    assert found[:3] == (Level.OK, "plant/watchdog", "ok")
    assert found.values["state"] == "running"


def test_silence_ends_in_the_safe_state_which_stays():
    drives = Drives()
    drives.go(1, drives.torque)
    # The command of step 0 is 50 ms old at step 50, and older than allowed from step 51 on.
    assert drives.go(60) == [False] * 50 + [True] * 10
    found = drives.dog.status()
    assert found.level == Level.ERROR
    silent = "no /winches/torque_command for 51 ms, allowed: 50 ms"
    assert found.message == f"safe state hold since 0.051 s: {silent}"
    # Commands alone do not bring it back.
    assert all(drives.go(10, drives.torque))
    assert drives.dog.safe
    assert drives.dog.reset() is None
    assert not any(drives.go(10, drives.torque))


def test_reset_is_refused_while_no_command_comes():
    drives = Drives("{watchdog: 0.1}")
    drives.go(1, drives.torque)
    drives.go(200)
    silent = "no /winches/torque_command for 200 ms, allowed: 100 ms"
    assert drives.dog.reset() == f"reset refused: {silent}"
    assert drives.dog.safe
    drives.go(1, drives.torque)
    assert drives.dog.reset() is None
    assert not drives.dog.safe


@pytest.mark.parametrize(
    ("index", "value", "reason"),
    [
        (3, np.nan, "/winches/torque_command: nan N·m of surge_2, allowed: finite numbers"),
        (0, -np.inf, "/winches/torque_command: -inf N·m of hoist_1, allowed: finite numbers"),
    ],
)
def test_a_torque_that_is_no_number_is_not_applied(index, value, reason):
    drives = Drives()
    drives.go(1, drives.torque)
    bad = drives.torque.copy()
    bad[index] = value
    assert drives.go(5, bad) == [True] * 5
    assert drives.dog.status().values["reason"] == reason
    assert np.isfinite(drives.plant.state).all()
    assert drives.dog.reset() == f"reset refused: {reason}"
    drives.go(1, carried(drives.plant))
    assert drives.dog.reset() is None


def test_a_command_of_another_width_is_not_applied():
    drives = Drives()
    drives.dog.command(0, np.zeros(7))
    assert drives.dog.torque(0) is not None
    assert drives.dog.status().values["reason"] == (
        "/winches/torque_command: a row of shape (7,), allowed: (8,)"
    )


def test_a_clock_that_goes_back_ends_in_the_safe_state():
    drives = Drives()
    drives.dog.command(5000 * MS, drives.torque)
    assert drives.dog.torque(5000 * MS) is None
    assert drives.dog.torque(4999 * MS) is not None
    reason = drives.dog.status().values["reason"]
    assert reason == "clock went back from 5.000 s to 4.999 s"


@pytest.mark.compiled
@pytest.mark.parametrize("plant", PLANTS)
def test_hold_carries_the_bar_where_the_last_torque_would_not(plant):
    """The controller dies while it asks for less than the bar weighs."""
    drives = Drives(plant=plant)
    less = 0.5 * drives.torque
    drives.go(50, less)
    drives.go(1000)
    assert abs(drives.sunk) < 0.05
    assert not drives.plant.locked
    assert (drives.plant.tensions > 1.0).all()
    unwatched = hanging(plant)
    for _ in range(1050):
        unwatched.step(less)
    assert unwatched.bar_state[2] - drives.start > 0.5


@pytest.mark.compiled
@pytest.mark.parametrize("plant", PLANTS)
def test_brake_sets_the_brakes_until_it_is_reset(plant):
    drives = Drives("{state: brake}", plant)
    held = drives.torque
    drives.go(50, 0.5 * held)
    assert not drives.plant.locked
    drives.go(1000)
    assert drives.plant.locked
    np.testing.assert_array_equal(drives.dog.torque(drives.now_ns), np.zeros(N))
    assert abs(drives.sunk) < 0.05
    drives.go(1, held)
    assert drives.dog.reset() is None
    assert not drives.plant.locked
    drives.go(50, held)
    assert np.abs(drives.plant.speeds).max() > 0.0


def test_brakes_are_set_by_command_too():
    drives = Drives("{state: brake}")
    drives.dog.brake(True)
    assert drives.plant.locked
    drives.dog.brake(False)
    assert not drives.plant.locked
    drives.go(1, drives.torque)
    drives.go(60)
    # Nobody releases what the watchdog holds.
    drives.dog.brake(False)
    assert drives.plant.locked
    drives.dog.brake(True)
    drives.go(1, drives.torque)
    assert drives.dog.reset() is None
    assert drives.plant.locked
    drives.dog.brake(False)
    assert not drives.plant.locked


def test_a_plant_whose_winches_are_locked_for_good_stays_so():
    plant = hanging(locked=True)
    dog = make_watchdog(scenario(), plant)
    dog.command(0, np.zeros(N))
    assert dog.torque(51 * MS) is not None
    assert plant.locked


# The brakes themselves


@pytest.mark.compiled
@pytest.mark.parametrize("name", PLANTS)
def test_brakes_stop_the_motors_at_once_and_release_them_from_rest(name):
    plant = hanging(name)
    for _ in range(100):
        plant.step(np.zeros(N))
    angles, lengths = plant.angles.copy(), plant.unstretched_lengths.copy()
    assert (np.abs(plant.speeds) > 1.0).all()
    plant.locked = True
    for _ in range(200):
        plant.step(np.full(N, 0.3))
        np.testing.assert_array_equal(plant.speeds, 0.0)
    np.testing.assert_array_equal(plant.angles, angles)
    np.testing.assert_array_equal(plant.unstretched_lengths, lengths)
    assert plant.locked
    plant.locked = False
    plant.step(np.zeros(N))
    assert (plant.speeds != 0.0).all()
    assert not plant.locked


@pytest.mark.compiled
def test_both_plants_brake_equally():
    ours, theirs = hanging("sim"), hanging("mujoco")
    for plant in (ours, theirs):
        torque = carried(plant)
        for braked in (False, True, False):
            plant.locked = braked
            for _ in range(150):
                plant.step(0.7 * torque)
    np.testing.assert_allclose(ours.bar_state, theirs.bar_state, atol=1e-5)
    np.testing.assert_allclose(ours.angles, theirs.angles, atol=1e-4)
    assert np.abs(ours.bar_state[:3] - POSE[:3]).max() > 0.01


@pytest.mark.parametrize("state", ["hold", "brake"])
def test_it_joins_the_force_controller_in_its_safe_state_and_leaves_it_with_it(state):
    """By no reason of its own; and not before its own reason is over."""
    drives = Drives(f"{{state: {state}}}")
    command = carried(drives.plant)
    assert not any(drives.go(20, command))
    drives.dog.hold(True)
    # What is commanded meanwhile would drop the bar.
    assert all(drives.go(500, np.zeros(N)))
    assert abs(drives.sunk) < 0.01
    assert drives.plant.locked == (state == "brake")
    assert not drives.dog.safe
    assert drives.dog.status().level == Level.OK
    drives.dog.hold(False)
    assert not any(drives.go(20, command))
    assert not drives.plant.locked
    drives.dog.trip(drives.now_ns, "broken")
    drives.dog.hold(True)
    drives.dog.hold(False)
    assert all(drives.go(20, command))
    assert drives.dog.reset() is None
    assert not any(drives.go(20, command))
