"""The nodes of a run in real time, made from its description."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cspm_control.plausibility.make import MachinePlausibility, make_plausibility
from cspm_control.safety import GuardedStage, check_real_time
from cspm_control.stages.angle_stage import AngleStage
from cspm_control.stages.motion_stage import MotionStage
from cspm_control.stages.own_stage import GuardedOwnStage, OwnStage
from cspm_control.stages.torque_stage import TorqueStage
from cspm_control.stages.wave_stage import WaveStage
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.recording.run_record import EXTERNAL
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.leader import Leader
from cspm_msgs_py.ros.realtime_node import RealtimeNode, RealtimeWaveNode
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    CLOCK,
    FORCE_CONTROLLER,
    PLANT,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
    WAVE_TRAJECTORY,
    WINCH_STATE,
)
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.topics import (
    BRAKE,
    DIAGNOSTICS,
    EMERGENCY_STOP,
    PARAMETER_EVENTS,
    ROSOUT,
    SAFE,
    Topic,
)
from cspm_ros.check_drivers.proof_port import ProofPort
from cspm_ros.inject.fault_port import FaultPort
from cspm_ros.margins.lateness import lateness_ns
from cspm_ros.runtime.goal_port import GoalPort, make_goals
from cspm_ros.runtime.node_parameters import GOAL_S
from cspm_ros.runtime.nodes_of_run import NodesOfRun
from cspm_ros.runtime.realtime_recorder_node import RealtimeRecorderNode
from cspm_ros.runtime.tracking_error import following_error
from cspm_ros.runtime.warm_up import warm_up
from cspm_run.assembly import assemble_stage
from cspm_run.plant_guard import make_watchdog
from cspm_run.recorded_run import recording_of
from cspm_sim.realtime_plant_node import RealtimePlantNode


class RealtimeRun(NodesOfRun):
    """A run in real time; attributes as `NodesOfRun`. Hardware may be in the plant's place."""

    @property
    def leader(self) -> str:
        """The node that starts and ends the run.

        Raises:
            InputError: neither the plant nor the recorder takes part.
        """
        for name in (PLANT, RECORDER):
            if name in self.members:
                return name
        raise InputError(f"nodes: {', '.join(self.members)}, allowed: with {PLANT} or {RECORDER}")

    def topics(self) -> dict[str, Topic]:
        """Return what such a run publishes, in contract order."""
        schedule = self.schedule
        all_topics = self.testbed_topics
        found = {
            name: all_topics[name]
            for name in schedule.topics
            if name != CLOCK and (PLANT in self.members or not name.startswith("/truth/"))
        }
        others = (DIAGNOSTICS, EMERGENCY_STOP, BRAKE, SAFE, ROSOUT, PARAMETER_EVENTS)
        return found | {topic.name: topic for topic in others}

    def measured(self) -> list[str]:
        """Return the measured topics that the controllers need."""
        schedule, sensors = self.schedule, self.bundle.testbed.testbed.sensors
        used = {name for plan in schedule.nodes.values() for name in (*plan.inputs, *plan.held)}
        return [name for name in sensors if name in used]

    def plant(
        self, node: ContractNode, steps: int, link: DriveLink | None = None
    ) -> RealtimePlantNode:
        """Return the plant's node.

        Args:
            node: the ROS node.
            steps: how many plant steps to make.
            link: to the controller inside its drives, if it is there.
        """
        self.name_machine(node)
        self.claim(node)
        bundle = self.bundle
        check_real_time(bundle.scenario.safety, self.schedule)
        with bundle.unpacked() as place:
            warm_up(PLANT, bundle, place)
            run = self.plant_run(steps, place, link, realtime=True)
        if run.faults is not None:
            FaultPort(node.node, run.faults)
        # Drives that close the loop themselves are never late for it.
        lateness, oldest = None if link else lateness_ns(bundle), None
        if lateness is not None:
            # Until the next command has come.
            oldest = (
                lateness + self.schedule.topics[TORQUE_COMMAND].divider * self.schedule.period_ns
            )
        watchdog = make_watchdog(bundle.scenario, run.plant, oldest)
        return RealtimePlantNode(node, run, watchdog, lateness)

    def stage(
        self,
        node: ContractNode,
        goal_duration: float = GOAL_S,
        goal_sender: str = "",
        link: DriveLink | None = None,
    ) -> RealtimeNode | RealtimeWaveNode:
        """Return the node of the controller that `node` is named after.

        `goal_duration` is how long the bar takes to a goal [s], `goal_sender` the node whose goals
        count, empty: the first to publish. `link` is as in `plant`.
        """
        self.name_machine(node)
        bundle, schedule = self.bundle, self.schedule
        topics, edges = self.testbed_topics, self.edges
        safety = bundle.scenario.safety if link is None else self._safety_of_drives()
        check_real_time(safety, schedule)
        scenario = bundle.scenario.model_copy(update={"safety": safety})
        with bundle.unpacked() as place:
            warm_up(node.name, bundle, place)
            stage = assemble_stage(node.name, scenario, bundle.testbed.testbed, place)
        if node.name == WAVE_TRAJECTORY:
            if isinstance(stage, WaveStage) and BAR_REFERENCE in stage.trajectories:
                goals = make_goals(stage, bundle.scenario, bundle.testbed.testbed, goal_duration)
                GoalPort(node, goals, goal_sender)
            return RealtimeWaveNode(node, stage, schedule, topics, edges)
        guard = stage if isinstance(stage, GuardedStage) else None
        timed = TorqueStage | AngleStage | MotionStage | OwnStage | GuardedOwnStage
        return RealtimeNode(
            node,
            stage,
            guard,
            schedule,
            topics,
            edges,
            safety.stale_after,
            plausibility=self._plausibility(node.name),
            lateness_ns=None if guard is None or link is not None else lateness_ns(bundle),
            on_start=stage.start if isinstance(stage, timed) else None,
            on_safe=stage.suspend if isinstance(stage, MotionStage | OwnStage) else None,
            proof=self._proof(node) if self._proves and node.name == self._commands else None,
            link=link,
        )

    def _safety_of_drives(self) -> Safety:
        """Return the safety of drives that take tensions: these are stale beyond the margin."""
        safety, margin_ns = self.bundle.scenario.safety, lateness_ns(self.bundle)
        if margin_ns is None:
            return safety
        return safety.model_copy(update={"stale_after": min(safety.stale_after, margin_ns * 1e-9)})

    @property
    def _proves(self) -> bool:
        """Whether somebody's drivers have to prove what they are by a wiggle of their winches."""
        commanded = self._commands in self.members and WINCH_STATE in self.measured()
        return commanded and PLANT not in self.members

    @property
    def _commands(self) -> str:
        """The node that commands the drives."""
        return TENSION_DISTRIBUTION if self.schedule.hosted else FORCE_CONTROLLER

    def _proof(self, node: ContractNode) -> ProofPort:
        # Loads parts of SciPy, which no other run needs.
        from cspm_ros.check_drivers.driver_proof import DriverProof

        testbed, scenario = self.bundle.testbed.testbed, self.bundle.scenario
        proof = DriverProof(testbed, scenario.rates, self.measured(), scenario.drive)
        return ProofPort(node, testbed, proof)

    def _plausibility(self, node: str) -> MachinePlausibility:
        """Return what a node judges its inputs by, with a following error from the machine."""
        scenario, testbed = self.bundle.scenario, self.bundle.testbed.testbed
        plan = self.schedule.nodes[node]
        if {BAR_POSE, BAR_REFERENCE} <= {*plan.inputs, *plan.held}:
            near = {"following_error": following_error(self.bundle)}
            safety = scenario.safety.model_copy(update=near)
            scenario = scenario.model_copy(update={"safety": safety})
        return make_plausibility(node, scenario, testbed)

    def new_recording(self, folder: Path, mode: str) -> RecordingWriter:
        """Return the recording that the run fills.

        Raises:
            InputError: the folder exists or cannot be created.
        """
        simulated = PLANT in self.members
        bundle = self.bundle if simulated else replace(self.bundle, plant=EXTERNAL)
        return recording_of(bundle, folder, mode, self.topics())

    def recorder(
        self, node: ContractNode, writer: RecordingWriter, steps: int, patience_s: float
    ) -> tuple[RealtimeRecorderNode, Leader | None]:
        """Return the recorder's node, and the leader if it leads.

        `patience_s` is how long it waits for drivers that are there to fit [s].
        """
        self.name_machine(node)
        period_ns = self.schedule.period_ns
        made = RealtimeRecorderNode(node, period_ns, self.topics(), self.edges, writer)
        if self.leader != RECORDER:
            made.follow()
            return made, None
        self.claim(node)
        others = [name for name in self.members if name != RECORDER]
        needed, duration_ns = self.measured(), steps * period_ns
        testbed, rates = self.bundle.testbed.testbed, self.bundle.scenario.rates
        # Loads parts of SciPy, which no other run needs.
        from cspm_ros.check_drivers.driver_statics import DriverStatics

        statics = DriverStatics(testbed, rates, needed)
        return made, made.lead(others, needed, duration_ns, patience_s, statics)
