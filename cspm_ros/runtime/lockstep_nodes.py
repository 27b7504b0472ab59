"""The nodes of a lockstep run, made from its description."""

from __future__ import annotations

from dataclasses import dataclass

from cspm_control.safety import GuardedStage
from cspm_msgs_py.graph import PLAYER, followers, graph_of
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.stage_node import StageNode
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.schedule import Schedule, schedule_of
from cspm_msgs_py.stepping.lockstep import WINDOW
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_ros.runtime.recorder_node import RecorderNode
from cspm_run.assembly import assemble_simulator, assemble_stage
from cspm_run.bundle import Bundle
from cspm_sim.plant_node import PlantNode


@dataclass(frozen=True)
class LockstepRun:
    """A run whose nodes are to be made.

    Attributes:
        bundle: what to run, resolved.
        members: names of the nodes that take part.
    """

    bundle: Bundle
    members: tuple[str, ...]

    @property
    def schedule(self) -> Schedule:
        """The run's schedule."""
        return schedule_of(self.bundle.scenario, self.bundle.testbed.testbed)

    def plant(self, node: ContractNode, steps: int) -> PlantNode:
        """Return the plant's node; `steps` is how many plant steps to make."""
        bundle, schedule = self.bundle, self.schedule
        with bundle.unpacked() as place:
            plant, sensors = assemble_simulator(
                bundle.scenario, bundle.testbed.testbed, place, bundle.plant
            )
        return PlantNode(
            node,
            plant,
            sensors,
            schedule,
            steps,
            graph_of(schedule, self.members),
            self.members,
            controlled=isinstance(bundle.scenario.control, ClosedLoop),
        )

    def stage(self, node: ContractNode) -> StageNode:
        """Return the node of the controller that `node` is named after."""
        bundle, schedule = self.bundle, self.schedule
        with bundle.unpacked() as place:
            stage = assemble_stage(node.name, bundle.scenario, bundle.testbed.testbed, place)
        return StageNode(
            node,
            stage,
            schedule,
            bundle.testbed.testbed.topics,
            graph_of(schedule, self.members),
            tells_progress=node.name in followers(schedule, self.members, WINDOW),
            guard=stage if isinstance(stage, GuardedStage) else None,
        )

    def recorder(self, node: ContractNode, writer: RecordingWriter) -> RecorderNode:
        """Return the recorder's node."""
        schedule, topics = self.schedule, self.bundle.testbed.testbed.topics
        # A player speaks for all who are absent, in one row of messages.
        reporting = graph_of(schedule, self.members)[DIAGNOSTICS.name].senders
        return RecorderNode(node, schedule, topics, writer, set(reporting) - {PLAYER})
