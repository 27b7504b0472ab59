"""Drives, load cells and motion capture: to fill in; see docs/reference/driver-topics.md.

What makes it safe: it refuses commands that are old, wrong or beyond the limits, and then holds the
winches where they are by itself, without any message, until it is started anew.
"""

import signal
import sys
import time

import rclpy
from geometry_msgs.msg import Point, Pose, PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Header

CABLES = ["hoist_1", "hoist_2", "surge_1", "surge_2", "sway_1", "sway_2", "sway_3", "sway_4"]
RADII = [0.0025] * 2 + [0.025] * 6  # drum radius over gear ratio [m]
LIMITS = [0.5] * 2 + [2.0] * 2 + [1.0] * 4  # largest torques [N·m]
# Of the hold: a mass of 1.4 kg at each cable on a critically damped spring of 10 rad/s.
SPRINGS = [140.0 * radius**2 for radius in RADII]  # [N·m/rad]
DAMPERS = [28.0 * radius**2 for radius in RADII]  # [N·m·s/rad]
POSES = {"/winch_frame/pose": Pose(), "/bar/pose": Pose(position=Point(z=2.0))}  # z down [m]


class Hardware:
    """Simulates a machine whose bar is clamped: tensions and stretch follow the torques."""

    tensions, torques = [5.0] * 8, [5.0 * radius for radius in RADII]
    stiffness = 5000.0  # of the cables [N/m]

    def read(self) -> tuple[list[float], ...]:
        """Return angles [rad], speeds [rad/s] and torques [N·m] of the motors, tensions [N]."""
        pulls = [max(0.0, m / r) for m, r in zip(self.torques, RADII, strict=True)]
        self.tensions = [t + 0.2 * (p - t) for t, p in zip(self.tensions, pulls, strict=True)]
        stretch = [(t - 5.0) / self.stiffness for t in self.tensions]
        angles = [length / radius for length, radius in zip(stretch, RADII, strict=True)]
        return angles, [0.0] * 8, self.torques, self.tensions

    def write(self, torques: list[float], brakes: bool) -> None:
        """Command motor torques [N·m], positive winds in, and set or release the brakes."""
        self.torques = self.torques if brakes else torques


class Driver(Node):
    """Publishes what is measured, writes what is commanded, holds where commands fail."""

    def __init__(self) -> None:
        super().__init__("driver")
        self.hardware, self.commanded = Hardware(), float("inf")  # when the last command came
        self.braked = self.tripped = False
        self.held: tuple[list[float], list[float]] | None = None  # torques and angles at the trip
        tension = self.declare_parameter("drive", "torque").value == "tension"  # the scenario's
        self.scales = RADII if tension else [1.0] * len(RADII)  # from commands to torques
        self.watchdog = self.declare_parameter("watchdog", 0.04).value  # s; the loop's delay margin
        self.winches = self.create_publisher(JointState, "/winches/state", 10)
        self.cells = self.create_publisher(JointState, "/cables/tension", 10)
        self.poses = {name: self.create_publisher(PoseStamped, name, 10) for name in POSES}
        command = "/tension_command" if tension else "/winches/torque_command"
        self.create_subscription(JointState, command, self._command, 10)
        self.create_subscription(Bool, "/winches/brake", self._brake, 10)
        self.create_timer(1.0 / self.declare_parameter("rate", 200.0).value, self._measure)

    def _measure(self) -> None:
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id="world_ned")
        angles, speeds, torques, tensions = self.hardware.read()
        self.tripped |= time.monotonic() - self.commanded > self.watchdog
        if self.tripped:  # until it is restarted; without winch state the controllers stop as well
            self._hold(angles, speeds, torques)
        else:
            measured = {"position": angles, "velocity": speeds, "effort": torques}
            self.winches.publish(JointState(header=header, name=CABLES, **measured))
        self.cells.publish(JointState(header=header, name=CABLES, effort=tensions))
        for name, pose in POSES.items():
            self.poses[name].publish(PoseStamped(header=header, pose=pose))

    def _hold(self, angles: list[float], speeds: list[float], torques: list[float]) -> None:
        """Hold each winch where it was when this began, within its torque limit."""
        self.held = self.held or (torques, angles)
        wanted = [
            torque - k * (angle - before) - d * speed
            for torque, before, angle, speed, k, d in zip(
                *self.held, angles, speeds, SPRINGS, DAMPERS, strict=True
            )
        ]
        limited = [max(-m, min(m, t)) for t, m in zip(wanted, LIMITS, strict=True)]
        self.hardware.write(limited, self.braked)

    def _command(self, message: JointState) -> None:
        self.commanded = time.monotonic()
        torques = [scale * each for scale, each in zip(self.scales, message.effort, strict=False)]
        age = (self.get_clock().now() - rclpy.time.Time.from_msg(message.header.stamp)).nanoseconds
        fits = [*message.name, len(message.effort)] == [*CABLES, len(CABLES)]
        ok = fits and age < 1e9 * self.watchdog
        self.tripped |= not (ok and all(abs(t) <= m for t, m in zip(torques, LIMITS, strict=True)))
        if not self.tripped:
            self.hardware.write(torques, self.braked)

    def _brake(self, message: Bool) -> None:
        self.braked = message.data


if __name__ == "__main__":
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)  # none ends a call
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit())
    rclpy.spin(Driver())
