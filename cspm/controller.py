"""Controllers of one's own in place of the cascade's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm.scenario import AnyScenario, as_scenario
from cspm.testbed import AnyTestbed, as_file
from cspm_control.stages.own_code import row_sizes, starter
from cspm_control.stages.own_stage import Output, OwnStage
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import WAVE_TRAJECTORY, Schedule, schedule_of
from cspm_msgs_py.stepping.stage import Stage
from cspm_msgs_py.testbed import Testbed
from cspm_run.assembly import assemble_stage, resolve

Array = NDArray[np.float64]


class Controller(Protocol):
    """What takes the place of one stage: any object with `step`.

    It is called once per period of its stage, in simulated time, with the latest rows of the
    topics that the stage reads, and returns the row that the stage sends:

    - `wave_trajectory` reads `/clock`; it returns rows by topic: `/bar/reference` and
      `/winch_frame/reference`, (19,) each. What it leaves out stays as the scenario has it.
    - `motion_controller` reads `/bar/pose` (7,) and `/bar/reference` (19,); it returns the wrench
      on the bar in world_ned (6,).
    - `tension_distribution` reads `/wrench_command` (6,), `/bar/pose` (7,), `/winch_frame/pose`
      (7,); it returns tensions (n,).
    - `force_controller` reads `/tension_command` (n,), `/cables/tension` (n,), `/winches/state`
      (3n,); it returns motor torques (n,).

    n cables in the order of the test-bed; N, N·m, m, rad, s. A pose is x y z and a quaternion x y z
    w in world_ned, a reference a pose, a twist and an acceleration, `/winches/state` angles, speeds
    and torques at the motor shafts. Nothing limits tensions and torques after the controller, and
    there is no safe state.

    An object that has `start(period, testbed)` is given its period [s] and the machine before the
    first step.

    Examples:
        >>> import cspm
        >>> class Proportional:
        ...     def step(self, time, inputs):
        ...         return 0.004 * (inputs["/tension_command"] - inputs["/cables/tension"])
        >>> own = {"force_controller": Proportional()}
        >>> cspm.simulate("rest", duration=0.1, controllers=own).failure is None
        True
    """

    def step(self, time: float, inputs: Mapping[str, Array]) -> Output:
        """Return the stage's output at `time` [s] from the latest rows by topic."""


class BuiltIn:
    """A stage of the cascade as a `Controller`."""

    def __init__(self, stage: Stage) -> None:
        """Take the stage."""
        self._stage = stage

    def step(self, time: float, inputs: Mapping[str, ArrayLike]) -> Output:
        """Return the stage's output at `time` [s] from the latest rows by topic.

        Raises:
            InputError: a row that the stage needs is missing.
        """
        rows = {name: np.array(row, dtype=np.float64) for name, row in inputs.items()}
        sent: dict[str, Array] = {}
        try:
            self._stage.step(round(time * 1e9), rows, sent.__setitem__)
        except KeyError as err:
            raise InputError(f"{self._stage.node}: needs {err.args[0]}") from None
        return sent if self._stage.node == WAVE_TRAJECTORY else next(iter(sent.values()))


def builtin_controller(
    stage: str, scenario: AnyScenario, *, testbed: AnyTestbed | None = None
) -> BuiltIn:
    """Return a stage of a scenario's cascade, to use in a program of one's own or inside another.

    Args:
        stage: `wave_trajectory`, `motion_controller`, `tension_distribution` or
            `force_controller`; see `Controller` for what each reads and returns.
        scenario: with its controllers and rates.
        testbed: another machine than the scenario's.

    Raises:
        InputError: no such scenario, test-bed or stage, or scenario and test-bed do not fit.

    Examples:
        >>> import cspm
        >>> distribution = cspm.builtin_controller("tension_distribution", "calm")
        >>> pose = [0, 0, 1.8, 0, 0, 0, 1]
        >>> wrench = [0, 0, -40, 0, 0, 0]
        >>> distribution.step(0.0, {"/bar/pose": pose, "/wrench_command": wrench}).shape
        (8,)
    """
    chosen = as_scenario(scenario)
    machine = (chosen.testbed_file if testbed is None else as_file(testbed)).testbed
    described = resolve(chosen.description, machine, chosen.path.parent)
    nodes = schedule_of(described, machine).nodes
    if stage not in nodes:
        raise InputError(f"stage {stage}: allowed: {', '.join(nodes) or 'none'}")
    return BuiltIn(assemble_stage(stage, described, machine, chosen.path.parent))


def with_own(
    stages: list[Stage], controllers: Mapping[str, Controller], testbed: Testbed, parts: Schedule
) -> list[Stage]:
    """Return the stages, those replaced that have a controller of one's own.

    Raises:
        InputError: the scenario has no such stage, or a controller has no `step`.
    """
    for node, controller in controllers.items():
        if node not in parts.nodes:
            raise InputError(f"controllers: {node}, allowed: {', '.join(parts.nodes) or 'none'}")
        if not callable(getattr(controller, "step", None)):
            raise InputError(
                f"controllers: {node}: {type(controller).__name__} has no step, allowed: an object"
                " with step(time, inputs)"
            )
        starter(controller, node, parts, testbed)()
    return [
        OwnStage(stage.node, controllers[stage.node], stage, row_sizes(stage.node, parts, testbed))
        if stage.node in controllers
        else stage
        for stage in stages
    ]
