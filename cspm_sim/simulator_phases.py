"""A simulated test-bed as compiled phases of a step: observed, measured, advanced."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cspm_model.kernels.cable import TORQUE_LIMIT
from cspm_model.kernels.native import address_of
from cspm_model.motion import Motion
from cspm_model.phase import Phase, Slots, make_phase
from cspm_sim.kernels import phases as kernel
from cspm_sim.kernels.affected_cables import reported_torques
from cspm_sim.plant import Plant
from cspm_sim.sensor_phases import SensorPhases
from cspm_sim.sensors import SensorModel
from cspm_sim.simulator import Simulator
from cspm_sim.truth import Quantity

# Signals of a step that no topic carries: the bar's pose as x y z φ θ ψ.
BAR_COORDINATES = "bar"
_SIGNALS = {
    "/truth/winch_frame/pose": kernel.FRAME_POSE,
    "/truth/winch_frame/twist": kernel.FRAME_TWIST,
    "/truth/bar/pose": kernel.BAR_POSE,
    "/truth/bar/twist": kernel.BAR_TWIST,
    "/truth/target/pose": kernel.TARGET_POSE,
    "/truth/target/twist": kernel.TARGET_TWIST,
    "/truth/winches/state": kernel.WINCHES,
    "/truth/cables/tension": kernel.TENSION,
    "/truth/cables/unstretched_length": kernel.UNSTRETCHED,
    BAR_COORDINATES: kernel.BAR,
}


class SimulatorPhases(NamedTuple):
    """What a simulator does in a step.

    Attributes:
        truth: brings the true quantities into the row.
        sensors: by topic; of one with faults, which Python computes, its quantity.
        advance: moves the plant.
    """

    truth: Phase
    sensors: dict[str, SensorPhases | Quantity]
    advance: Phase


def true_signals(simulator: Simulator) -> dict[str, int]:
    """Return the width of each signal of the truth, by topic, and of the bar's coordinates."""
    found = {"/truth" + q.topic: len(q.row) for q in simulator.truth.quantities}
    return found | {BAR_COORDINATES: 6}


def simulator_phases(simulator: Simulator, slots: Slots, command: str) -> SimulatorPhases:
    """Return a simulator's phases.

    Args:
        simulator: with our own plant; the phases go on from where it is.
        slots: have places for `true_signals`, what is measured, and the torques.
        command: name of the torques' signal.
    """
    plant = simulator.plant
    assert isinstance(plant, Plant)
    sensors: dict[str, SensorPhases | Quantity] = {}
    for quantity in simulator.truth.quantities:
        sensor = simulator.sensors.get(quantity.topic)
        if isinstance(sensor, SensorModel) and not sensor.is_faulty:
            column = slots.first(quantity.topic)
            sensors[quantity.topic] = SensorPhases(sensor, quantity.values, column)
        elif sensor is not None:
            sensors[quantity.topic] = quantity
    return SimulatorPhases(
        truth_phase(simulator, plant, slots, command),
        sensors,
        plant.advance_phase(slots.first(command), upright=simulator.controlled),
    )


def truth_phase(simulator: Simulator, plant: Plant, slots: Slots, command: str) -> Phase:
    """Return what brings the true quantities into the row."""
    truth, parameters, scratch = simulator.truth, plant.parameters, plant.scratch
    integers = np.full(kernel.TRUTH_INTEGERS, -1, dtype=np.int64)
    for topic, place in _SIGNALS.items():
        integers[place] = slots.first(topic)
    integers[kernel.COMMAND] = slots.first(command)
    integers[kernel.DRIVES], integers[kernel.STATES] = plant.has_drives, len(plant.bar_state)
    integers[kernel.PERIOD_NS] = simulator.period_ns
    if plant.has_drives:
        integers[kernel.REPORT_ADDRESS] = address_of(reported_torques, kernel.REPORT)
    target = truth.target or Motion.still(np.zeros(6))
    integers[kernel.TARGET_PERIODIC] = target.periodic
    return make_phase(
        kernel.truth_phase,
        integers,
        simulator.counts,
        plant.state,
        plant.frame,
        plant.outputs,
        *(truth.frame_pose, truth.frame_twist, truth.bar_pose, truth.bar_twist, truth.winches),
        simulator.slack_limit,
        parameters.cables[:, TORQUE_LIMIT].copy(),
        *(parameters.cables, parameters.effects, parameters.effect_parameters),
        *(scratch.signals, scratch.stages),
        *(truth.target_motion, truth.target_pose, truth.target_twist),
        target.knots,
        np.array([target.spacing]),
    )
