"""Whether a machine can take its bar to a goal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.reference_demand import demand_of
from cspm_control.plausibility.make import (
    body_points,
    fastest,
    largest_acceleration,
    machine_size,
)
from cspm_control.stages.make import governed, wanted_tension_limits
from cspm_model.equilibrium import find_equilibrium
from cspm_model.kernels.rotation import rotation_from_euler
from cspm_model.kernels.rows import reference_row
from cspm_model.motion import Motion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import ConvergenceError, InputError
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]


class GoalLimits:
    """Refuses passages that end, or lead, where the machine cannot take its bar.

    The goal has to be within `safety.workspace` of the bar's mean position, and tensions within
    their limits have to hold the bar there. On the way its points may not be faster than
    `safety.pose_speed` nor accelerate by more than `safety.pose_acceleration`, and tensions and
    torques have to suffice.
    """

    def __init__(self, scenario: Scenario, testbed: Testbed, frame: Motion) -> None:
        """Take a scenario with a controlled bar, the machine, and its winch frame's motion."""
        assert isinstance(scenario.control, ClosedLoop)
        safety = scenario.safety
        self._frame, self._mean_frame = frame, scenario.winch_frame.mean_pose
        self._middle = np.array(scenario.bar_mean_pose[:3])
        self._parameters = nominal_parameters(testbed)
        self._tensions = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)
        self._torques = np.array([cable.torque_limit for cable in testbed.cables])
        self._names, self._points = testbed.cable_names, body_points(testbed)[1]
        limits = wanted_tension_limits(scenario.control, testbed)
        self._machine = governed(scenario, testbed, limits)
        self._reach = safety.workspace or machine_size(testbed)
        self._speed = safety.pose_speed or fastest(testbed)
        self._acceleration = safety.pose_acceleration or largest_acceleration(testbed)

    def check(self, times: Array, rows: Array) -> None:
        """Refuse a passage that the machine cannot make.

        Args:
            times: instants of the run (k,) [s], the last that of the arrival.
            rows: pose and derivatives at each, (k, 18).

        Raises:
            InputError: it ends outside the workspace, or needs more than the machine has.
        """
        self._check_place(rows[-1, :6])
        self._check_points(rows)
        self._check_effort(times, rows)

    def _check_place(self, pose: Array) -> None:
        try:
            find_equilibrium(self._parameters, pose, self._mean_frame, self._tensions)
        except ConvergenceError as err:
            raise InputError(str(err)) from None
        distance = float(np.linalg.norm(pose[:3] - self._middle))
        if not distance <= self._reach:
            raise InputError(
                f"{distance:.3g} m from the bar's mean position, allowed: at most"
                f" {self._reach:.3g} m (safety.workspace)"
            )

    def _check_points(self, rows: Array) -> None:
        speed, acceleration = fastest_point(rows, self._points)
        for what, found, most, unit, key in (
            ("speed", speed, self._speed, "m/s", "pose_speed"),
            ("acceleration", acceleration, self._acceleration, "m/s²", "pose_acceleration"),
        ):
            if not found <= most:
                raise InputError(
                    f"{what} of {found:.3g} {unit} on the way, allowed: at most {most:.3g} {unit}"
                    f" (safety.{key}): a longer goal_duration, or a nearer goal"
                )

    def _check_effort(self, times: Array, rows: Array) -> None:
        frames = np.array([self._frame.at(time) for time in times])
        found = demand_of(self._machine, times, rows, frames)
        if found.worst is not None:
            raise InputError(
                f"no tensions within the limits move the bar along the way, in {found.worst[1]}"
                f" {found.worst[0] - times[0]:.3g} s after its beginning, allowed: a longer"
                " goal_duration, or another goal"
            )
        share = np.abs(found.torques).max(axis=0) / self._torques
        worst = int(np.argmax(share))
        if share[worst] > 1.0:
            raise InputError(
                f"torque of {share[worst] * self._torques[worst]:.3g} N·m of {self._names[worst]}"
                f" on the way, allowed: at most {self._torques[worst]:.3g} N·m: a longer"
                " goal_duration, or another goal"
            )


def fastest_point(rows: Array, points: Array) -> tuple[float, float]:
    """Return the largest speed [m/s] and acceleration [m/s²] of a body's origin and points.

    Args:
        rows: pose and derivatives of the body, (k, 18).
        points: in the body's axes, (n, 3) [m].
    """
    points = np.vstack([np.zeros(3), points])
    row, speed, acceleration = np.empty(19), 0.0, 0.0
    for values in rows:
        reference_row(values, row)
        arms = points @ np.reshape(rotation_from_euler(*values[3:6]), (3, 3)).T
        turning = np.cross(row[10:13], arms)
        speeds = row[7:10] + turning
        changes = row[13:16] + np.cross(row[16:19], arms) + np.cross(row[10:13], turning)
        speed = max(speed, float(np.linalg.norm(speeds, axis=1).max()))
        acceleration = max(acceleration, float(np.linalg.norm(changes, axis=1).max()))
    return speed, acceleration
