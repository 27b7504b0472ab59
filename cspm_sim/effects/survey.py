"""Surveyed places of a machine: what effects that move one of them share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from cspm_model.accuracies import ACCURACIES
from cspm_sim.effects.effect import Array, Effect, EffectParameter, Values
from cspm_sim.effects.signals import CableSignal, EndSignal

ACCURACY = ACCURACIES["exit"].sd
"""Standard deviation of a surveyed coordinate [m]; that of an attachment is the same."""

# Two-sided normal deviate at 1 % for the 48 coordinates of eight cables' ends (Bonferroni).
_DEVIATES = 3.7


def healthy(names: Iterable[str], accuracy: float = ACCURACY) -> dict[str, tuple[float, float]]:
    """Return how far below and above surveyed numbers may lie in a healthy machine, by name.

    Args:
        names: of the parameters.
        accuracy: standard deviation of each [m, rad].
    """
    return dict.fromkeys(names, (-_DEVIATES * accuracy, _DEVIATES * accuracy))


def surveyed_to(effect: Effect, accuracy: float) -> Effect:
    """Return an effect that moves a place of the file, where a survey had another accuracy.

    Args:
        effect: with `survey_parameters`.
        accuracy: standard deviation of a coordinate [m].
    """
    parameters = tuple(replace(p, usual=accuracy) for p in effect.parameters)
    limits = healthy((parameter.name for parameter in parameters), accuracy)
    signature = replace(effect.signature, negligible=limits)
    return replace(effect, parameters=parameters, signature=signature)


def survey_parameters(key: str, axes: str) -> tuple[EffectParameter, ...]:
    """Return the three parameters of an effect that moves a place of the file.

    Args:
        key: of the test-bed file.
        axes: name of the axes that it is in.
    """
    meaning = f"added to {key}, in {axes}"
    return tuple(
        EffectParameter(axis, "m", -1.0, 1.0, meaning=meaning, usual=ACCURACY) for axis in "xyz"
    )


def shifted(place: Sequence[float], values: Values) -> list[float]:
    """Return a place with its offsets x, y, z added."""
    return [old + values[axis] for old, axis in zip(place, "xyz", strict=True)]


def pulling_columns(signals: Array, at: slice) -> Array:
    """Return the first order of another geometry in its cable's tension: a longer one pulls more.

    Args:
        signals: `CableSignal` rows.
        at: slopes of the length over what has changed.
    """
    stiffness = signals[:, CableSignal.STIFFNESS, None]
    return np.asarray((stiffness * signals[:, at])[:, None])


def wrench_columns(signals: Array, at: slice) -> Array:
    """Return the change of the wrench on the bar at constant tension.

    Args:
        signals: `EndSignal` rows.
        at: slopes of the wrench per newton over what has changed, six rows of them.
    """
    slopes = signals[:, at].reshape(len(signals), 6, -1)
    return np.asarray(signals[:, EndSignal.TENSION, None, None] * slopes)
