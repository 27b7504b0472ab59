"""Surveyed places of a machine: what effects that move one of them share."""

from __future__ import annotations

from collections.abc import Sequence

from cspm_sim.effects.effect import EffectParameter, Values

ACCURACY = 1e-3
"""Standard deviation of a surveyed coordinate [m], as of a tape, calliper or total station."""

# Two-sided normal deviate at 1 % for the 48 coordinates of eight cables' ends (Bonferroni).
_DEVIATES = 3.7
HEALTHY = {axis: (-_DEVIATES * ACCURACY, _DEVIATES * ACCURACY) for axis in "xyz"}
"""How far surveyed coordinates may be off in a healthy machine [m], by name."""


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
