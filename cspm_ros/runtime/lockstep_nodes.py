"""The nodes of a lockstep run, made from its description."""

from __future__ import annotations

from cspm_control.phases.compiled_stage import compiled_stage
from cspm_control.safety import GuardedStage
from cspm_msgs_py.graph import PLAYER, followers
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.stage_node import StageNode
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.stepping.lockstep import WINDOW
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_ros.runtime.nodes_of_run import NodesOfRun
from cspm_ros.runtime.recorder_node import RecorderNode
from cspm_run.assembly import assemble_stage, check_lockstep
from cspm_sim.plant_node import PlantNode


class LockstepRun(NodesOfRun):
    """A run in lockstep whose nodes are to be made; attributes as `NodesOfRun`."""

    def plant(self, node: ContractNode, steps: int, link: DriveLink | None = None) -> PlantNode:
        """Return the plant's node.

        Args:
            node: the ROS node.
            steps: how many plant steps to make.
            link: to the controller inside its drives, if it is there.

        Raises:
            InputError: somebody's driver is to send a topic, who cannot keep the schedule.
        """
        self.name_machine(node)
        self.claim(node)
        check_lockstep(self.schedule)
        with self.bundle.unpacked() as place:
            run = self.plant_run(steps, place, link)
        return PlantNode(node, run)

    def stage(self, node: ContractNode, link: DriveLink | None = None) -> StageNode:
        """Return the node of the controller that `node` is named after; `link` as in `plant`."""
        self.name_machine(node)
        bundle, schedule = self.bundle, self.schedule
        with bundle.unpacked() as place:
            stage = assemble_stage(node.name, bundle.scenario, bundle.testbed.testbed, place)
        plan, period_ns = schedule.nodes[node.name], schedule.period_ns
        return StageNode(
            node,
            compiled_stage(stage, plan, bundle.testbed.testbed.topics, period_ns),
            schedule,
            self.testbed_topics,
            self.edges,
            tells_progress=node.name in followers(schedule, self.members, WINDOW),
            guard=stage if isinstance(stage, GuardedStage) else None,
            own=self.own,
            link=link if node.name in self.hosted else None,
        )

    def recorder(self, node: ContractNode, writer: RecordingWriter) -> RecorderNode:
        """Return the recorder's node."""
        schedule, topics = self.schedule, self.testbed_topics
        # A player speaks for all who are absent, in one row of messages.
        reporting = self.edges[DIAGNOSTICS.name].senders
        statuses = set(reporting) - {PLAYER, *self.own}
        return RecorderNode(node, schedule, topics, writer, statuses, own=self.own)
