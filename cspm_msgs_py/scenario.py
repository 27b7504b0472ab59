"""The scenario file: which machine, which motions, which controllers, at which rates."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Discriminator,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)
from typing_extensions import Self

from cspm_msgs_py.control_spec.distribution import TensionDistribution
from cspm_msgs_py.control_spec.force import ForceControl
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS, Dof
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.scenario_keys.bodies import ORIGIN, Body, Pose, Target
from cspm_msgs_py.scenario_keys.curves import Sine
from cspm_msgs_py.scenario_keys.drive import TORQUE_DRIVE, Drive, check_drive
from cspm_msgs_py.scenario_keys.events import CableCut, check_times
from cspm_msgs_py.scenario_keys.faults import Fault
from cspm_msgs_py.scenario_keys.operation import Operation, check_operation
from cspm_msgs_py.scenario_keys.own_controller import OwnControllers
from cspm_msgs_py.yaml_file import StrictModel, parse_yaml, read_yaml, validate

Wrench = tuple[float, float, float, float, float, float]
# The operating point of the thesis.
DESIGN_POSE: Pose = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)


class Rates(StrictModel):
    """How often each part runs [Hz]; every rate divides the plant's."""

    plant: PositiveInt = 1000
    winches: PositiveInt = 1000
    load_cells: PositiveInt = 1000
    motion_capture: PositiveInt = 100
    wave_trajectory: PositiveInt = 1000
    motion_controller: PositiveInt = 100
    tension_distribution: PositiveInt = 100
    force_controller: PositiveInt = 1000

    @model_validator(mode="after")
    def _divide(self) -> Self:
        if 1_000_000_000 % self.plant:
            raise ValueError(
                f"plant: {self.plant} Hz, allowed: a rate whose period is a whole number of ns"
            )
        for name, rate in self:
            if self.plant % rate:
                raise ValueError(
                    f"{name}: {rate} Hz does not divide the plant's {self.plant} Hz, allowed: a"
                    f" divisor of {self.plant}"
                )
        return self


class PidGains(StrictModel):
    """Gains of Kp·e + Ki·∫e + Kd·ė, thesis (7-2); per metre or radian."""

    kp: float
    ki: float
    kd: float


class MotionControl(StrictModel):
    """The thesis's controller, designed by its procedure, for crossovers, or with gains given.

    `dofs` are the coordinates to control; absent, all that the cables give along the reference.
    Gains that are absent are designed at `design_pose`: with the largest bandwidth that the margins
    of section 7-1 let each loop have, or for the `crossover` frequencies [rad/s] of those DOFs that
    it names. The derivative term has a pole at `derivative_filter` [rad/s]; integral terms stop at
    `integral_limits` [N, N·m].
    """

    law: Literal["pid"] = "pid"
    dofs: tuple[Dof, ...] | None = None
    crossover: dict[Dof, PositiveFloat] = {}
    design_pose: Pose = DESIGN_POSE
    derivative_filter: PositiveFloat = 200.0
    integral_limits: tuple[PositiveFloat, PositiveFloat] = (20.0, 5.0)
    gains: dict[Dof, PidGains] | None = None

    @property
    def controlled(self) -> tuple[Dof, ...]:
        """The controlled DOFs: those named, with gains, or of the thesis."""
        return self.dofs or tuple(self.gains or (DOFS[axis] for axis in CONTROLLED_AXES))


class Governor(StrictModel):
    """How a plan leaves its reference.

    `preview` [s] is how far ahead the reference is known, `reserve` [N] what plans keep above the
    lower limit, `excess_weight` what one requirement beyond the requirement counts beside half the
    square of each deviation.
    """

    preview: PositiveFloat = 0.5
    reserve: NonNegativeFloat = 0.2
    excess_weight: NonNegativeFloat = 0.0


class MassAdaptation(StrictModel):
    """Up to what share of itself the bar's mass may be wrong."""

    largest: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.5


class ComputedWrenchControl(StrictModel):
    """Inverse dynamics of the bar with an observer of its pose error.

    `dofs` are the coordinates to control; absent, all that the cables give along the reference.
    `bandwidth` [rad/s] is that of the error's dynamics per controlled DOF, 20 rad/s where it names
    none, `observer_bandwidth` [rad/s] that of the observer. With a `governor` the bar leaves its
    reference, ahead of time and as little as can be, where no tensions can give it. `known_wrench`
    [N, N·m] is a constant one on the bar's origin in world_ned, such as wind that was measured.
    With `mass_adaptation` the bar's mass is estimated from its heave. The force controllers are
    designed at `design_pose`.
    """

    law: Literal["computed_wrench"]
    dofs: tuple[Dof, ...] | None = None
    bandwidth: dict[Dof, PositiveFloat] = {}
    observer_bandwidth: PositiveFloat = 40.0
    governor: Governor | None = None
    known_wrench: Wrench = ORIGIN
    mass_adaptation: MassAdaptation | None = None
    design_pose: Pose = DESIGN_POSE

    @property
    def controlled(self) -> tuple[Dof, ...]:
        """The controlled DOFs: those named, or with a bandwidth."""
        return self.dofs or tuple(self.bandwidth)


class FeedbackControl(StrictModel):
    """What PD+ and LQR share: state feedback about the bar's inverse dynamics.

    `dofs` are the coordinates to control; absent, all that the cables give along the reference.
    `bandwidth` [rad/s] is that of the error's dynamics per controlled DOF, 7.3 rad/s where it names
    none. The derivative term has a pole at `derivative_filter` [rad/s]. Gains that are absent
    follow from the bandwidths and from the bar's inertia at `design_pose`.
    """

    dofs: tuple[Dof, ...] | None = None
    bandwidth: dict[Dof, PositiveFloat] = {}
    derivative_filter: PositiveFloat = 200.0
    design_pose: Pose = DESIGN_POSE
    gains: dict[Dof, PidGains] | None = None

    @property
    def controlled(self) -> tuple[Dof, ...]:
        """The controlled DOFs: those named, or with a bandwidth."""
        return self.dofs or tuple(self.bandwidth)


class PdPlusControl(FeedbackControl):
    """Two poles of the error at the bandwidth, and no integral action."""

    law: Literal["pd_plus"]

    @property
    def integral_limits(self) -> tuple[float, float]:
        """None [N, N·m]."""
        return 0.0, 0.0


class LqrControl(FeedbackControl):
    """Feedback of pose error, its integral and its rate, of least quadratic cost.

    The error's integral costs as much as the error when it is `integral_time` [s] times it. The
    integral terms stop at `integral_limits` [N, N·m].
    """

    law: Literal["lqr"]
    integral_time: PositiveFloat = 1.0
    integral_limits: tuple[PositiveFloat, PositiveFloat] = (20.0, 5.0)


def law(motion: object) -> object:
    """Return a motion controller's law: the thesis's by default."""
    if isinstance(motion, dict):
        return motion.get("law", "pid")
    return getattr(motion, "law", "pid")


MotionLaw = Annotated[
    Annotated[MotionControl, Tag("pid")]
    | Annotated[ComputedWrenchControl, Tag("computed_wrench")]
    | Annotated[PdPlusControl, Tag("pd_plus")]
    | Annotated[LqrControl, Tag("lqr")],
    Discriminator(law),
]


class ClosedLoop(StrictModel):
    """Motion controller, tension distribution and force controllers (chapter 7).

    With `record_internals` each also sends what it computes on the way, for the recording.
    """

    mode: Literal["closed_loop"] = "closed_loop"
    motion: MotionLaw = MotionControl()
    tension_distribution: TensionDistribution = TensionDistribution()
    force: ForceControl = ForceControl()
    record_internals: bool = False

    @model_validator(mode="after")
    def _knows_its_cables(self) -> Self:
        computed = self.motion.law == "computed_wrench"
        if self.tension_distribution.lost_cable and computed:
            raise ValueError(
                f"tension_distribution.lost_cable: with law {self.motion.law}, whose observer"
                " counts on every cable, allowed: with law pid, pd_plus or lqr"
            )
        return self


class LockedWinches(StrictModel):
    """All winches braked at their initial angle; the bar moves by the winch frame alone."""

    mode: Literal["locked_winches"] = "locked_winches"


class Signal(StrictModel):
    """A constant plus sines."""

    offset: float = 0.0
    sines: tuple[Sine, ...] = ()


class TorqueProfile(StrictModel):
    """Prescribed motor torque per cable [N·m]; a cable that is not named gets zero."""

    mode: Literal["torque"] = "torque"
    torque: dict[str, Signal] = {}


class AnglePath(StrictModel):
    """Motor angle over time, counted from where the motor is at the start, positive winds in.

    `points` are pairs of time [s] and angle [rad], joined by straight lines and gone through
    `cycles` times; then the last angle stays. `tension` is what the cable carries at the start [N],
    where there is no bar.
    """

    points: Annotated[tuple[tuple[NonNegativeFloat, float], ...], Field(min_length=1)]
    cycles: PositiveInt = 1
    tension: NonNegativeFloat = 0.0

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        times = [time for time, _ in self.points]
        if times[0] != 0.0 or any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError(f"points: times {times}, allowed: from 0, each later than the last")
        first, last = self.points[0][1], self.points[-1][1]
        if self.cycles > 1 and (len(times) < 2 or first != last):
            raise ValueError(
                f"cycles: {self.cycles} of points from {first:g} to {last:g} rad, allowed: 1, or"
                " points that end where they began"
            )
        return self


class AngleProfile(StrictModel):
    """Prescribed motor angle per cable, kept by a position servo; one not named stays where it is.

    `bandwidth` [rad/s] is that of the servo on the rotor alone.
    """

    mode: Literal["angle"] = "angle"
    bandwidth: PositiveFloat = 60.0
    angle: dict[str, AnglePath] = {}


Control = Annotated[
    ClosedLoop | LockedWinches | TorqueProfile | AngleProfile, Field(discriminator="mode")
]


class Requirement(StrictModel):
    """Largest allowed error of the bar's pose [m], [rad]."""

    position: PositiveFloat = 0.002
    angle: PositiveFloat = 0.004


class Scenario(StrictModel):
    """One experiment. Build it with `load_scenario` or `parse_scenario`."""

    name: str
    description: str = ""
    testbed: str
    duration: PositiveFloat
    seed: NonNegativeInt = 1
    rates: Rates = Rates()
    sensors: Literal["testbed", "ideal"] = "testbed"
    winch_frame: Body = Body()
    target: Target = Target()
    bar_offset: Pose = ORIGIN
    control: Control = ClosedLoop()
    drive: Drive = TORQUE_DRIVE
    controllers: OwnControllers = {}
    safety: Safety = Safety()
    events: tuple[CableCut, ...] = ()
    faults: tuple[Fault, ...] = ()
    operation: tuple[Operation, ...] = ()
    requirement: Requirement = Requirement()

    @model_validator(mode="after")
    def _whole_steps(self) -> Self:
        steps = self.duration * self.rates.plant
        if abs(steps - round(steps)) > 1e-6 * max(1.0, steps) or round(steps) < 1:
            raise ValueError(
                f"duration: {self.duration:g} s, allowed: a whole number of the plant's periods"
                f" of 1/{self.rates.plant} s"
            )
        check_times(self.events, self.duration, self.rates.plant)
        check_operation(self.operation, self.duration, self.target.source)
        return self

    @model_validator(mode="after")
    def _plans_with_what_is_known(self) -> Self:
        check_drive(self.drive, self.control.mode)
        motion = self.control.motion if isinstance(self.control, ClosedLoop) else None
        if self.target.is_measured and getattr(motion, "governor", None) is not None:
            raise ValueError(
                f"target.source: {self.target.source} with a governor, which plans with the"
                " target's motion to come, allowed: prescribed, or no governor"
            )
        return self

    @model_serializer(mode="wrap")
    def _written(self, write: SerializerFunctionWrapHandler) -> dict[str, object]:
        """Leave the usual drive out, so that recordings of before it stay the same."""
        return {k: v for k, v in write(self).items() if k != "drive" or v != TORQUE_DRIVE}

    @property
    def bar_mean_pose(self) -> Pose:
        """The bar's mean reference: the target's mean pose plus the offset [m, rad]."""
        x, y, z, roll, pitch, yaw = (
            a + b for a, b in zip(self.target.mean_pose, self.bar_offset, strict=True)
        )
        return (x, y, z, roll, pitch, yaw)


def load_scenario(path: Path, overrides: Sequence[str] = ()) -> Scenario:
    """Read and check a scenario file, with `key.path=value` overrides put over it first.

    Raises:
        InputError: naming file, key, value and what is allowed.
    """
    return _checked(read_yaml(path), str(path), overrides)


def parse_scenario(text: str, source: str, overrides: Sequence[str] = ()) -> Scenario:
    """Check a scenario's YAML text, overrides as above; `source` names it in errors.

    Raises:
        InputError: naming source, key, value and what is allowed.
    """
    return _checked(parse_yaml(text, source), source, overrides)


def _checked(content: object, source: str, overrides: Sequence[str]) -> Scenario:
    for override in overrides:
        content = _override(content, override)
    return validate(Scenario, content, source)


def _override(content: object, override: str) -> dict[str, Any]:
    key, separator, text = override.partition("=")
    if not separator or not key or not all(key.split(".")):
        raise InputError(f"--set {override}: allowed: key.path=value, such as seed=2")
    if not isinstance(content, dict):
        raise InputError(f"--set {override}: the scenario is not a mapping of keys to values")
    value = parse_yaml(text, f"--set {override}")
    root: dict[str, Any] = dict(content)
    node = root
    *parents, leaf = key.split(".")
    for parent in parents:
        inner = node.get(parent, {})
        if not isinstance(inner, dict):
            raise InputError(f"--set {override}: {parent} is no mapping, allowed: keys inside one")
        node[parent] = dict(inner)
        node = node[parent]
    if key == "control.mode" and node.get("mode") != value:
        # What the file sets for one mode is unknown to another.
        node.clear()
    node[leaf] = value
    return root
