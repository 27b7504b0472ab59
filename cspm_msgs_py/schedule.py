"""Who computes when, and from what: the lockstep schedule as whole numbers of plant steps.

State k, command k, step k + 1: at plant step k each sensor that is due delivers, each node that is
due computes, and the plant then advances with the new torques held. Which stamps a node needs at
step k follows from the rates and the sensors' delays alone, so that every way of running a
scenario can agree on it without a clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import (
    AngleProfile,
    ClosedLoop,
    ComputedWrenchControl,
    Scenario,
    TorqueProfile,
)
from cspm_msgs_py.scenario_keys.bodies import EXTERNAL, PRESCRIBED
from cspm_msgs_py.scenario_keys.drive import TENSION_DRIVE
from cspm_msgs_py.testbed import Testbed

DIAGNOSTICS_RATE = 10
PLANT, WAVE_TRAJECTORY, MOTION_CONTROLLER = "plant", "wave_trajectory", "motion_controller"
TARGET_TRACKER = "target_tracker"
TENSION_DISTRIBUTION, FORCE_CONTROLLER = "tension_distribution", "force_controller"

RATE_OF_SENSOR = {
    "/winch_frame/pose": "motion_capture",
    "/winch_frame/twist": "motion_capture",
    "/bar/pose": "motion_capture",
    "/bar/twist": "motion_capture",
    "/target/pose": "motion_capture",
    "/winches/state": "winches",
    "/cables/tension": "load_cells",
}
CLOCK = "/clock"
BAR_REFERENCE, FRAME_REFERENCE = "/bar/reference", "/winch_frame/reference"
TARGET_REFERENCE, TARGET_POSE = "/target/reference", "/target/pose"
BAR_POSE, FRAME_POSE = "/bar/pose", "/winch_frame/pose"
TENSION, WRENCH, WINCH_STATE = "/cables/tension", "/wrench_command", "/winches/state"
TENSION_COMMAND, TORQUE_COMMAND = "/tension_command", "/winches/torque_command"
# What controllers compute on the way, sent where `control.record_internals` asks for it.
MOTION_INTERNALS = f"/{MOTION_CONTROLLER}/internals"
DISTRIBUTION_INTERNALS = f"/{TENSION_DISTRIBUTION}/internals"
FORCE_INTERNALS = f"/{FORCE_CONTROLLER}/internals"
INTERNALS = (MOTION_INTERNALS, DISTRIBUTION_INTERNALS, FORCE_INTERNALS)

# What a node reads once it is there, beside what it cannot compute without. The force controller
# needs the winches' state in its safe state. What computes more often than anything comes to it
# reads the clock as well.
HELD = {TENSION_DISTRIBUTION: (FRAME_POSE,), FORCE_CONTROLLER: (WINCH_STATE,)}


class Timing(NamedTuple):
    """When a topic's messages are there, in plant steps.

    Attributes:
        first: the step at which the first message arrives.
        divider: steps from one message to the next.
        delay: steps from the instant stamped to the arrival.
    """

    first: int
    divider: int
    delay: int = 0

    def latest(self, step: int) -> int | None:
        """Return the step stamped on the latest message there at `step`, None before the first."""
        if step < self.first:
            return None
        return step - (step - self.first) % self.divider - self.delay

    def count(self, steps: int) -> int:
        """Return how many messages arrive during the first `steps` steps."""
        return max(0, -(-(steps - self.first) // self.divider))


@dataclass(frozen=True)
class NodePlan:
    """One node's share of the schedule.

    Attributes:
        first: the first step at which all its inputs are there.
        divider: steps from one computation to the next.
        status_divider: steps from one diagnostics message to the next.
        inputs: topics that it cannot compute without.
        held: further topics that it reads once they are there.
        outputs: what it publishes at each computation.
    """

    first: int
    divider: int
    status_divider: int
    inputs: tuple[str, ...]
    held: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Schedule:
    """The whole schedule of a scenario.

    Attributes:
        period_ns: the plant's period [ns].
        topics: timing of every topic of rows that this scenario publishes, in contract order.
        nodes: plans of all nodes but the plant, in the order in which they compute.
        plant_status_divider: steps from one of the plant's diagnostics messages to the next.
        foreign: topics that somebody else's driver sends, in this simulation too.
        hosted: nodes that are part of the plant: what they and it hand each other is no message.
    """

    period_ns: int
    topics: Mapping[str, Timing]
    nodes: Mapping[str, NodePlan]
    plant_status_divider: int
    foreign: tuple[str, ...] = ()
    hosted: tuple[str, ...] = ()

    def idle_through(self, node: str) -> int:
        """Return the last step through which nothing comes to a node, nor has it to compute."""
        plan = self.nodes.get(node)
        if plan is None:
            return -1
        read = (self.topics[name] for name in (*plan.inputs, *plan.held))
        return min(plan.first, *(timing.first for timing in read)) - 1

    def needs(self, node: str, step: int) -> dict[str, int]:
        """Return the stamps [ns] that `node` needs at `step`, by topic."""
        plan = self.nodes[node]
        found = {}
        for topic in (*plan.inputs, *plan.held):
            latest = self.topics[topic].latest(step)
            if latest is not None:
                found[topic] = latest * self.period_ns
        return found


def schedule_of(scenario: Scenario, testbed: Testbed) -> Schedule:
    """Return the schedule of a scenario on a test-bed.

    Raises:
        InputError: a closed loop is wanted of a machine without bar or without the sensors for it,
            angles of one that does not measure them, or a measured target where none is.
    """
    if isinstance(scenario.control, ClosedLoop):
        _check_closed_loop(testbed)
    rates, source = scenario.rates, scenario.target.source
    names = _topics_of(source, testbed)
    period_ns = 1_000_000_000 // rates.plant
    timings = {name: Timing(0, 1) for name in names if name.startswith("/truth/") or name == CLOCK}
    for name, sensor in testbed.sensors.items():
        if name not in names:
            continue
        delay = 0 if scenario.sensors == "ideal" else round(sensor.delay * 1e9 / period_ns)
        divider = rates.plant // int(getattr(rates, RATE_OF_SENSOR[name]))
        timings[name] = Timing(delay, divider, delay)
    nodes: dict[str, NodePlan] = {}
    references = tuple(name for name in names if name.endswith("/reference"))
    prescribed = tuple(n for n in references if source == PRESCRIBED or n != BAR_REFERENCE)

    def add(
        node: str,
        rate: int,
        inputs: tuple[str, ...],
        outputs: tuple[str, ...],
        more: tuple[str, ...] = (),
    ) -> None:
        divider = rates.plant // rate
        first = -(-max(timings[name].first for name in inputs) // divider) * divider
        held = tuple(n for n in (*HELD.get(node, ()), *more) if n in timings and n not in inputs)
        paced = [timings[name] for name in (*inputs, *held) if timings[name].first <= first]
        if divider < min(each.divider for each in paced):
            # Else it would compute from one message all that is due until the next one.
            held = (*held, CLOCK)
        every = status_divider(rates.plant, divider)
        nodes[node] = NodePlan(first, divider, every, inputs, held, outputs)
        timings.update(dict.fromkeys(outputs, Timing(first, divider)))

    def outputs(command: str, internals: str) -> tuple[str, ...]:
        wanted = isinstance(scenario.control, ClosedLoop) and scenario.control.record_internals
        # A controller of the user's own has no internals of ours.
        wanted = wanted and internals.split("/")[1] not in scenario.controllers
        return (command, internals) if wanted else (command,)

    if prescribed:
        add(WAVE_TRAJECTORY, rates.wave_trajectory, (CLOCK,), prescribed)
    if source != PRESCRIBED:
        add(TARGET_TRACKER, rates.wave_trajectory, (TARGET_POSE,), (BAR_REFERENCE,))
    if isinstance(scenario.control, ClosedLoop):
        # The computed wrench looks at what the tensions can give, as the distribution does.
        computed = isinstance(scenario.control.motion, ComputedWrenchControl)
        frame = (FRAME_POSE,) if computed else ()
        motion = (BAR_POSE, BAR_REFERENCE), outputs(WRENCH, MOTION_INTERNALS)
        add(MOTION_CONTROLLER, rates.motion_controller, *motion, frame)
        distribution = (WRENCH, BAR_POSE), outputs(TENSION_COMMAND, DISTRIBUTION_INTERNALS)
        looks = (TENSION,) if scenario.control.tension_distribution.lost_cable else ()
        add(TENSION_DISTRIBUTION, rates.tension_distribution, *distribution, looks)
        force = (TENSION_COMMAND, TENSION), outputs(TORQUE_COMMAND, FORCE_INTERNALS)
        followed = tuple(name for name in references if name != TARGET_REFERENCE)
        ahead = followed if scenario.control.force.looks_ahead else ()
        add(FORCE_CONTROLLER, rates.force_controller, *force, ahead)
    elif isinstance(scenario.control, TorqueProfile):
        add(FORCE_CONTROLLER, rates.plant, (CLOCK,), (TORQUE_COMMAND,))
    elif isinstance(scenario.control, AngleProfile):
        add(FORCE_CONTROLLER, rates.force_controller, _servo_inputs(testbed), (TORQUE_COMMAND,))
    ordered = {name: timings[name] for name in names if name in timings}
    foreign = (TARGET_POSE,) if source == EXTERNAL else ()
    hosted = (FORCE_CONTROLLER,) if scenario.drive == TENSION_DRIVE else ()
    return Schedule(period_ns, ordered, nodes, status_divider(rates.plant, 1), foreign, hosted)


def _topics_of(source: str, testbed: Testbed) -> list[str]:
    """Return the topics that a machine may have whose target has this source, in contract order.

    Raises:
        InputError: the target is to be measured and the test-bed has no sensor for it.
    """
    if source != PRESCRIBED and TARGET_POSE not in testbed.sensors:
        raise InputError(
            f"target.source: {source} without sensor {TARGET_POSE}, allowed: prescribed, or a"
            f" test-bed with a bar and {TARGET_POSE} among its sensors"
        )
    absent = {PRESCRIBED: ("/target/", "/truth/target/"), EXTERNAL: ("/truth/target/",)}
    left_out = absent.get(source, ())
    unknown = TARGET_REFERENCE if source == EXTERNAL else ""
    return [n for n in testbed.topics if not n.startswith(left_out) and n != unknown]


def _check_closed_loop(testbed: Testbed) -> None:
    if testbed.bar is None:
        raise InputError(
            "control.mode: closed_loop without a bar, allowed: torque, angle, locked_winches"
        )
    needed = [BAR_POSE, TENSION] + [FRAME_POSE] * bool(testbed.winch_frame)
    missing = [name for name in needed if name not in testbed.sensors]
    if missing:
        raise InputError(
            f"sensors: {', '.join(missing)} missing, allowed in closed loop: {', '.join(needed)}"
        )


def _servo_inputs(testbed: Testbed) -> tuple[str, ...]:
    if WINCH_STATE not in testbed.sensors:
        raise InputError(f"sensors: {WINCH_STATE} missing, allowed in mode angle: {WINCH_STATE}")
    # The servo itself needs no tension; its guard trips where one is too high.
    return (WINCH_STATE,) + (TENSION,) * (TENSION in testbed.sensors)


def status_divider(plant_rate: int, divider: int) -> int:
    """Return plant steps between diagnostics of a node that computes every `divider` steps."""
    wanted = max(1, plant_rate // DIAGNOSTICS_RATE)
    return divider * -(-wanted // divider)
