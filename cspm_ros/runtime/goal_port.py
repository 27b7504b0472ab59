"""Goals for the bar, from one publisher, while a run in real time is under way."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_control.plausibility.goal_limits import GoalLimits
from cspm_control.stages.wave_stage import WaveStage
from cspm_control.waves.goal_trajectory import GoalTrajectory
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.bound_flag import BoundFlag
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.graph_publishers import GraphPublishers
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.schedule import BAR_REFERENCE, FORCE_CONTROLLER, FRAME_REFERENCE
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE, SAFE, WORLD_FRAME, Topic

Array = NDArray[np.float64]
GOAL = Topic("/bar/goal", "geometry_msgs/msg/PoseStamped", WORLD_FRAME, POSE)
# The force controller says five times a second whether it is in its safe state.
_UNHEARD_NS = 1_000_000_000


def make_goals(
    stage: WaveStage, scenario: Scenario, testbed: Testbed, duration: float
) -> GoalTrajectory:
    """Return the bar's reference, now one that goes to poses, and have the stage send it.

    `duration` is how long a passage takes [s].
    """
    frames = stage.trajectories.get(FRAME_REFERENCE)
    mean = np.array(scenario.winch_frame.mean_pose, dtype=float)
    limits = GoalLimits(scenario, testbed, frames.motion if frames else Motion.still(mean))
    motion = stage.trajectories[BAR_REFERENCE].motion
    # What is compiled is loaded now and not by the first goal.
    limits.check(np.zeros(1), Motion.still(np.array(scenario.bar_mean_pose)).at(0.0)[None])
    trajectory = GoalTrajectory(motion, duration, limits.check)
    stage.trajectories = {**stage.trajectories, BAR_REFERENCE: trajectory}
    return trajectory


class GoalPort:
    """Takes goals of one publisher; one that cannot be is refused by a line in the node's log.

    The first publisher is bound, if there is one alone. Another counts once that one has left.
    """

    def __init__(self, node: ContractNode, trajectory: GoalTrajectory, sender: str = "") -> None:
        """Subscribe, and offer the service; `sender` is the node that may send, empty: any."""
        self._node, self._trajectory = node, trajectory
        publishers = GraphPublishers(node.node, GOAL)
        self._binding = PublisherBinding(GOAL.name, [sender] if sender else [], publishers)
        self._heard_ns: int | None = None
        self._safe = False
        BoundFlag(node, SAFE, FORCE_CONTROLLER, self._note_safe, self._complain)
        node.subscribe_tagged_rows(GOAL, self._go, partial(self._complain, GOAL.name))
        node.node.create_service(ros_class("std_srvs/srv/Trigger"), "~/home", self._home)

    def _note_safe(self, safe: bool) -> None:
        self._heard_ns, self._safe = self._node.now_ns(), safe

    def _go(self, _: int, row: Array, gid: bytes | None) -> None:
        binding, now_ns = self._binding, self._node.now_ns()
        fault = binding.fault(gid, now_ns, safe=binding.left)
        if fault is not None:
            raise InputError(fault)
        try:
            self._lead(np.concatenate([row[:3], euler_from_quaternion(row[3:7])]))
        except InputError as err:
            self._node.warn(f"{GOAL.name}: {err}")

    def _lead(self, pose: Array | None) -> None:
        """Have the bar go to a pose x y z φ θ ψ, or back to the motion.

        Raises:
            InputError: the winches are not known to run, or the machine cannot go there.
        """
        if self._safe:
            raise InputError("the winches are in their safe state, allowed: a goal after a reset")
        heard = self._heard_ns
        if heard is None or self._node.now_ns() - heard > _UNHEARD_NS:
            raise InputError(
                f"no {SAFE.name} for 1 s, allowed: a goal while winches are controlled"
            )
        self._trajectory.go(pose)

    def _complain(self, topic: str, reason: str) -> None:
        """Say what is wrong with a message; strangers' do not fill the log."""
        self._node.complain(topic, reason if reason.startswith(topic) else f"{topic}: {reason}")

    def _home(self, _: Any, response: Any) -> Any:  # noqa: ANN401 - rosidl's classes
        try:
            self._lead(None)
        except InputError as err:
            response.success, response.message = False, str(err)
        else:
            seconds = self._trajectory.remaining
            response.success, response.message = True, f"at the motion in {seconds:.1f} s"
        return response
