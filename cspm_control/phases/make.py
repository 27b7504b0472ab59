"""From a stage to its compiled phase."""

from __future__ import annotations

from cspm_control.phases.angle_phase import angle_phase
from cspm_control.phases.distribution_phase import distribution_phase
from cspm_control.phases.force_phase import force_phase
from cspm_control.phases.motion_phase import motion_phase
from cspm_control.phases.target_phase import target_phase
from cspm_control.phases.torque_phase import torque_phase
from cspm_control.phases.wave_phase import wave_phase
from cspm_control.stages.angle_stage import AngleStage
from cspm_control.stages.distribution_stage import DistributionStage
from cspm_control.stages.force_stage import ForceStage
from cspm_control.stages.motion_stage import MotionStage
from cspm_control.stages.target_stage import TargetStage
from cspm_control.stages.torque_stage import TorqueStage
from cspm_control.stages.wave_stage import WaveStage
from cspm_model.phase import Phase, Slots
from cspm_msgs_py.stepping.stage import Stage


def stage_phase(stage: Stage, slots: Slots, period_ns: int) -> Phase | None:
    """Return a stage as a phase of a step of `period_ns` [ns]; None: it computes in Python."""
    if isinstance(stage, WaveStage):
        return wave_phase(stage, slots, period_ns)
    if isinstance(stage, TargetStage):
        return target_phase(stage, slots)
    if isinstance(stage, MotionStage):
        return motion_phase(stage, slots, period_ns)
    if isinstance(stage, DistributionStage):
        return distribution_phase(stage, slots)
    if isinstance(stage, ForceStage):
        return force_phase(stage, slots, period_ns)
    if isinstance(stage, AngleStage):
        return angle_phase(stage, slots, period_ns)
    if isinstance(stage, TorqueStage):
        return torque_phase(stage, slots, period_ns)
    return None
