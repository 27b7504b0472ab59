"""Loading controllers of the user's own from the files that a scenario names."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

from cspm_control.safe_state import make_safe_state
from cspm_control.stages.make import tension_trips
from cspm_control.stages.own_stage import (
    Computes,
    GuardedOwnStage,
    NamedStage,
    WinchLimits,
    fault_of,
)
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.scenario_keys.own_controller import OwnController, path_of
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    INTERNALS,
    Schedule,
    schedule_of,
)
from cspm_msgs_py.stepping.stage import Stage
from cspm_msgs_py.testbed import Testbed

CLASSES = "a class with step(self, time, inputs)"


def own_stage(
    node: str, scenario: Scenario, testbed: Testbed, folder: Path, replaced: Stage | None
) -> Stage:
    """Return the stage whose class the scenario names; this runs the user's file.

    Args:
        node: the stage, one of those in `scenario.controllers`.
        scenario: resolved.
        testbed: the machine.
        folder: where the scenario's relative paths start.
        replaced: the wave trajectory whose place it takes, if it does.

    Raises:
        InputError: no such file or class, or one that cannot take its parameters.
    """
    named, schedule = scenario.controllers[node], schedule_of(scenario, testbed)  # type: ignore[index]
    controller = load_controller(node, named, folder)
    begin = starter(controller, node, schedule, testbed)
    source = str(path_of(named, folder))
    try:
        begin()
    except Exception as err:
        raise InputError(f"controllers.{node}: {fault_of(err, source)}, in its start") from err
    own = NamedStage(node, controller, replaced, row_sizes(node, schedule, testbed), begin)
    own.source = source
    if node != FORCE_CONTROLLER:
        return own
    limits = WinchLimits(
        tension_trips(scenario, testbed), np.array([each.torque_limit for each in testbed.cables])
    )
    period_ns = schedule.nodes[node].divider * schedule.period_ns
    safe_state, safety = make_safe_state(scenario, testbed), scenario.safety
    return GuardedOwnStage(own, limits, testbed.cable_names, safe_state, safety, period_ns)


def starter(
    controller: object, node: str, schedule: Schedule, testbed: Testbed
) -> Callable[[], None]:
    """Return what lets a controller begin: its `start(period, testbed)`, if it has one."""
    start = getattr(controller, "start", None)
    if start is None:
        return lambda: None
    period = schedule.nodes[node].divider * schedule.period_ns * 1e-9
    return lambda: start(period, testbed)


def row_sizes(node: str, schedule: Schedule, testbed: Testbed) -> dict[str, int]:
    """Return how long the rows are that a stage sends, by topic."""
    outputs = schedule.nodes[node].outputs
    return {name: testbed.topics[name].width for name in outputs if name not in INTERNALS}


def load_controller(node: str, named: OwnController, folder: Path) -> Computes:
    """Return the object that a scenario in `folder` names for a stage; this runs its file.

    Raises:
        InputError: no such file or class, another file than that of the SHA-256, a class without
            such a `step`, or that does not take the parameters.
    """
    path, where = path_of(named, folder), f"controllers.{node}"
    text = read_code(path)
    found = sha256_of(text)
    if named.sha256 not in (None, found):
        raise InputError(
            f"{where}: {path} has SHA-256 {found[:12]}…, allowed: {named.sha256}, or no sha256"
        )
    made = getattr(_module(path, text, where), named.class_name, None)
    if not isinstance(made, type):
        raise InputError(f"{where}: {path} has no class {named.class_name}, allowed: {CLASSES}")
    _check_step(made, where, path)
    return _constructed(made, named, where, path)


def read_code(path: Path) -> bytes:
    """Return a controller's file.

    Raises:
        InputError: it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as err:
        raise InputError(
            f"{path}: not readable ({err.strerror}), allowed: a Python file, its path relative to"
            " the scenario's"
        ) from None


def sha256_of(text: bytes) -> str:
    """Return the SHA-256 of a file in hexadecimal digits."""
    return hashlib.sha256(text).hexdigest()


def _module(path: Path, text: bytes, where: str) -> ModuleType:
    """Return the file as a module, anew each time: runs share nothing."""
    module = ModuleType(f"cspm_own_{path.stem}")
    module.__file__ = str(path)
    # Where `dataclass` and `pickle` look for what a class belongs to.
    sys.modules[module.__name__] = module
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    except SyntaxError as err:
        raise InputError(f"{where}: {path} line {err.lineno}: {err.msg}") from None
    except Exception as err:
        raise InputError(
            f"{where}: {fault_of(err, str(path))}, allowed: one file that imports what is installed"
        ) from err
    return module


def _check_step(made: type, where: str, path: Path) -> None:
    step, has = getattr(made, "step", None), "no step"
    if callable(step):
        try:
            inspect.signature(step).bind(None, 0.0, {})
        except TypeError:
            has = f"step{inspect.signature(step)}"
        else:
            return
    raise InputError(f"{where}: {made.__name__} of {path} has {has}, allowed: {CLASSES}")


def _constructed(made: type, named: OwnController, where: str, path: Path) -> Computes:
    signature = inspect.signature(made)
    try:
        signature.bind(**named.parameters)
    except TypeError as err:
        taken = ", ".join(signature.parameters) or "none"
        raise InputError(
            f"{where}.parameters: {err}, allowed by {made.__name__}: {taken}"
        ) from None
    try:
        controller: Computes = made(**named.parameters)
    except Exception as err:
        raise InputError(f"{where}: {fault_of(err, str(path))}, in {made.__name__}()") from err
    return controller
