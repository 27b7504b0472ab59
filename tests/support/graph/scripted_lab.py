"""A clamped machine whose drivers send what a test says, in the session of its witness."""

from pathlib import Path

import numpy as np
from run_samples import bundle_of

from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros.contract_node import ros_class
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.schedule import (
    BAR_POSE,
    FRAME_POSE,
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    WINCH_STATE,
)

CLAMPED = Path(__file__).resolve().parents[3] / "examples" / "clamped_bar.yaml"
RATE = 200
# The way that a body moves from one message to the next: 2 m/s.
STEP = 0.01
# Of the load cells [N], as in the test-bed file.
NOISE = 0.02
# Of the cables, which give way to the torques while the bar is clamped [N/m].
STIFFNESS = 5000.0


def clamped_bundle(*overrides):
    """Return the scenario of the clamped bar, patient with a busy computer."""
    keys = ("stale_after", "watchdog", "lateness", "following_error")
    patient = [f"safety.{key}=0.5" for key in keys]
    return bundle_of(CLAMPED, "duration=600", *patient, *overrides)


class ScriptedLab:
    """Sends poses, winches and tensions while its session is spun; tensions follow the torques.

    Load cells have noise: one that repeats itself is taken for one that measures no more.

    Attributes:
        bar: position of the bar, (3,) [m]; it goes there at 2 m/s, or at once by `jump`.
        reported: what is added to the torques that the drives report, (n,) [N·m].
        at_fault: the drive that reports wrong torques, by its number.
        stuck: the load cell that repeats itself, by its number; None: none does.
        takes_tensions: whether the drives obey tension commands.
        turning: speed of all motors [rad/s].
        standing: the encoder that stands while its motor turns, by its number.
    """

    def __init__(self, session, testbed, unreliable=(), mute=()):
        """Send in a session: topics that are `unreliable` by best effort, those `mute` nothing."""
        self._node = session.node("lab")
        self._cables = testbed.cables
        self.radii = np.array([cable.drum_radius / cable.gear_ratio for cable in self._cables])
        self.bar, self._at = np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 2.0])
        self.torques = 5.0 * self.radii
        self.reported, self.at_fault = np.zeros(len(self.radii)), 0
        self.stuck: int | None = None
        self.takes_tensions = False
        self.turning, self.standing = 0.0, None
        self._wound = np.zeros(len(self.radii))
        self._tensions, self._angles = np.zeros(len(self.radii)), np.zeros(len(self.radii))
        self._rng = np.random.default_rng(1)
        topics = testbed.topics
        self._send = {
            name: self._best_effort(topics[name])
            if name in unreliable
            else self._node.publisher(topics[name])
            for name in (FRAME_POSE, BAR_POSE, WINCH_STATE, TENSION)
        }
        self._send |= dict.fromkeys(mute, lambda *_: None)
        self._node.subscribe_rows(topics[TORQUE_COMMAND], self._command, lambda _: None)
        self._node.subscribe_rows(topics[TENSION_COMMAND], self._wind, lambda _: None)
        session.every(1.0 / RATE, self._measure)

    def _best_effort(self, topic):
        qos = contract_qos(reliability="best_effort")
        publisher = self._node.node.create_publisher(ros_class(topic.ros_type), topic.name, qos)
        return lambda _, stamp, row: publisher.publish(serialize(message_of(topic, stamp, row)))

    def jump(self, x, y, z):
        """Put the bar somewhere."""
        self.bar = np.array([x, y, z])
        self._at = self.bar.copy()

    def go(self, x):
        """Move the bar along x."""
        self.bar[0] = x

    def report(self, wrong=0.0):
        """Let the drive at fault report so much more torque than it has [N·m]."""
        self.reported[self.at_fault] = wrong

    @property
    def arrived(self):
        return bool((self.bar == self._at).all())

    def _command(self, _, row):
        self.torques = np.maximum(row, 0.0)

    def _wind(self, _, row):
        """Close the loop of drives that take tensions."""
        if self.takes_tensions:
            self.torques = row * self.radii

    def _noise(self):
        return NOISE * self._rng.standard_normal(len(self.radii))

    def _measure_winches(self):
        numbers = np.arange(len(self.radii))
        tensions = self.torques / self.radii + self._noise()
        self._tensions = np.where(numbers == self.stuck, self._tensions, tensions)
        self._angles = self._angles + (numbers != self.standing) * self.turning / RATE

    def _stretch(self):
        """Return by how much the torques wind the cables' stretch up (n,) [rad]."""
        wound = (self.torques / self.radii - 5.0) / STIFFNESS / self.radii
        stands = np.arange(len(self.radii)) == self.standing
        self._wound = np.where(stands, self._wound, wound)
        return self._wound

    def _measure(self):
        way = self.bar - self._at
        self._at = self._at + np.clip(way, -STEP, STEP)
        self._measure_winches()
        speeds = np.full(len(self.radii), self.turning)
        rows = {
            FRAME_POSE: np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            BAR_POSE: np.array([*self._at, 0.0, 0.0, 0.0, 1.0]),
            WINCH_STATE: np.concatenate(
                [self._angles + self._stretch(), speeds, self.torques + self.reported]
            ),
            TENSION: self._tensions,
        }
        stamp = self._node.now_ns()
        for name, row in rows.items():
            self._send[name](stamp, stamp, row)
