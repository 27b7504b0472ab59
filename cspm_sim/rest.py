"""What effects do to a machine at rest: loads on the bar, a shifted frame, states of memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_model.kernels.bar import GRAVITY
from cspm_model.kernels.cable import ATTACHMENT, RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import geometry, rotation
from cspm_sim.effect_entries import Action
from cspm_sim.effects import Hook
from cspm_sim.kernels import affected_cables as cable_hooks
from cspm_sim.kernels import bar_effects as bar_hooks
from cspm_sim.kernels import winch as winch_hooks
from cspm_sim.kernels.bar_effects import WRENCH

Array = NDArray[np.float64]


def static_wrench(
    actions: Sequence[Action], parameters: PlantParameters, bar_pose: ArrayLike, frame: ArrayLike
) -> Array:
    """Return the wrench of all effects on a bar that is held still, (6,), world axes."""
    still, hanging = np.zeros(bar_hooks.BAR_SIGNALS), np.zeros(bar_hooks.PENDANT_SIGNALS)
    still[bar_hooks.POSE : bar_hooks.POSE + 6] = bar_pose
    hanging[bar_hooks.PENDANT_GRAVITY] = parameters.bar[GRAVITY]
    for action in actions:
        for hook, signals in ((Hook.BAR, still), (Hook.PENDANT, hanging)):
            _call(action, hook, signals, np.zeros(action.effect.physics.states))
    wrench = still[WRENCH : WRENCH + 6] + hanging[WRENCH : WRENCH + 6]
    return wrench + _end_wrench(actions, parameters, bar_pose, frame)


def _end_wrench(
    actions: Sequence[Action], parameters: PlantParameters, bar_pose: ArrayLike, frame: ArrayLike
) -> Array:
    wrench = np.zeros(6)
    lengths, jacobian, _ = geometry(parameters.cables, bar_pose, frame)
    for action in actions:
        if Hook.ATTACHMENT not in action.effect.physics.kernels:
            continue
        i, signals = action.element, np.zeros(bar_hooks.END_SIGNALS)
        signals[bar_hooks.END_DIRECTION : bar_hooks.END_DIRECTION + 3] = jacobian[i, :3]
        signals[bar_hooks.END_LENGTH] = lengths[i]
        signals[bar_hooks.END_GRAVITY] = parameters.bar[GRAVITY]
        _call(action, Hook.ATTACHMENT, signals, np.zeros(action.effect.physics.states))
        force = signals[bar_hooks.END_FORCE : bar_hooks.END_FORCE + 3]
        arm = rotation(bar_pose) @ parameters.cables[i, ATTACHMENT : ATTACHMENT + 3]
        wrench += np.concatenate([force, np.cross(arm, force)])
    return wrench


def frame_shift(actions: Sequence[Action], force: Array) -> Array:
    """Return by how much the exits give way to the cables' force on the frame, (3,) [m, N]."""
    signals = np.zeros(cable_hooks.FRAME_SIGNALS)
    for action in actions:
        states = _states(action, Hook.FRAME, _frame_signals(force))
        _call(action, Hook.FRAME, signals, states)
    return signals[cable_hooks.FRAME_SHIFT : cable_hooks.FRAME_SHIFT + 3].copy()


def memory_at_rest(
    actions: Sequence[Action],
    parameters: PlantParameters,
    tensions: Array,
    lengths: Array,
    force: Array,
) -> Array:
    """Return the states of all effects, in the actions' order.

    Args:
        actions: of the machine.
        parameters: of the machine.
        tensions: of the cables at rest, (n,) [N].
        lengths: unstretched, of the cables, (n,) [m].
        force: of all cables on the winch frame, (3,) [N].
    """
    found = [np.zeros(0)]
    for action in actions:
        hook, i = min(action.effect.physics.kernels, default=Hook.BAR), action.element
        if hook is Hook.FRAME:
            signals = _frame_signals(force)
        elif hook is Hook.CABLE:
            signals = _cable_signals(tensions[i], lengths[i])
        elif hook is Hook.DRIVE:
            signals = _drive_signals(tensions[i], parameters.cables[i, RADIUS])
        else:
            signals = np.zeros(0)
        found.append(_states(action, hook, signals))
    return np.concatenate(found)


def _frame_signals(force: Array) -> Array:
    signals = np.zeros(cable_hooks.FRAME_SIGNALS)
    signals[cable_hooks.FRAME_FORCE : cable_hooks.FRAME_FORCE + 3] = force
    return signals


def _cable_signals(tension: float, length: float) -> Array:
    signals = np.zeros(cable_hooks.CABLE_SIGNALS)
    signals[cable_hooks.ELASTIC_TENSION], signals[cable_hooks.UNSTRETCHED] = tension, length
    return signals


def _drive_signals(tension: float, radius: float) -> Array:
    signals = np.zeros(winch_hooks.WINCH_SIGNALS)
    signals[winch_hooks.WINCH_TENSION], signals[winch_hooks.WINDING_RADIUS] = tension, radius
    return signals


def _states(action: Action, hook: Hook, signals: Array) -> Array:
    effect = action.effect
    if effect.physics.rest is None or hook not in effect.physics.kernels:
        return np.zeros(effect.physics.states)
    return np.array(effect.physics.rest(np.array(action.numbers), signals), dtype=float)


def _call(action: Action, hook: Hook, signals: Array, states: Array) -> None:
    kernel = action.effect.physics.kernels.get(hook)
    if kernel is None:
        return
    values = np.array(action.numbers)
    memory = (states, np.zeros(len(states))) if action.effect.physics.states else ()
    kernel(values, signals, *memory)
