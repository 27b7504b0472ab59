"""Goals for the bar, from whoever publishes them while a run in real time is under way."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_control.stages.wave_stage import WaveStage
from cspm_control.waves.goal_trajectory import GoalTrajectory
from cspm_model.equilibrium import find_equilibrium
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import ConvergenceError, InputError
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.schedule import BAR_REFERENCE
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE, WORLD_FRAME, Topic

Array = NDArray[np.float64]
GOAL = Topic("/bar/goal", "geometry_msgs/msg/PoseStamped", WORLD_FRAME, POSE)


def add_goals(
    node: ContractNode, stage: WaveStage, scenario: Scenario, testbed: Testbed, duration: float
) -> None:
    """Have the bar's reference go to poses that come on `/bar/goal`, and back by `~/home`.

    `duration` is how long a passage takes [s].
    """
    holds = _Holds(scenario, testbed)
    # What is compiled is loaded now and not by the first goal.
    holds.check(np.array(scenario.bar_mean_pose, dtype=float))
    motion = stage.trajectories[BAR_REFERENCE].motion
    trajectory = GoalTrajectory(motion, duration, holds.check)
    stage.trajectories = {**stage.trajectories, BAR_REFERENCE: trajectory}
    GoalPort(node, trajectory)


class GoalPort:
    """Takes goals; one that cannot be is refused by a line in the node's log."""

    def __init__(self, node: ContractNode, trajectory: GoalTrajectory) -> None:
        """Subscribe, and offer the service."""
        self._node, self._trajectory = node, trajectory
        node.subscribe_rows(GOAL, self._go, self._refuse)
        node.node.create_service(ros_class("std_srvs/srv/Trigger"), "~/home", self._home)

    def _go(self, _: int, row: Array) -> None:
        self._trajectory.go(np.concatenate([row[:3], euler_from_quaternion(row[3:7])]))

    def _refuse(self, reason: str) -> None:
        text = reason if reason.startswith(GOAL.name) else f"{GOAL.name}: {reason}"
        self._node.warn(text)

    def _home(self, _: Any, response: Any) -> Any:  # noqa: ANN401 - rosidl's classes
        try:
            self._trajectory.go(None)
        except InputError as err:
            response.success, response.message = False, str(err)
        else:
            seconds = self._trajectory.remaining
            response.success, response.message = True, f"at the motion in {seconds:.1f} s"
        return response


class _Holds:
    """Where tensions within their limits hold the bar at rest."""

    def __init__(self, scenario: Scenario, testbed: Testbed) -> None:
        self._parameters = nominal_parameters(testbed)
        self._frame = scenario.winch_frame.mean_pose
        self._limits = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)

    def check(self, pose: Array) -> None:
        """Refuse a pose x y z φ θ ψ where none do.

        Raises:
            InputError: none do.
        """
        try:
            find_equilibrium(self._parameters, pose, self._frame, self._limits)
        except ConvergenceError as err:
            raise InputError(str(err)) from None
