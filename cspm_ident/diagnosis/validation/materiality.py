"""Whether a finding is large enough to matter, in the unit that was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.diagnosis.validation.remainder import is_immaterial
from cspm_ident.signals.measurement import TENSION, TORQUE
from cspm_ident.signals.noise_source import declared_noise
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects import Channel

Array = NDArray[np.float64]

_SENSORS = {Channel.DRIVE: TORQUE, Channel.SHAFT: TORQUE, Channel.TENSION: TENSION}


def accuracy_of(machine: Testbed, place: Place) -> float:
    """Return the noise of the sensor whose quantity a residual compares; nan if not stated.

    Args:
        machine: as described; its sensors have a noise and a resolution.
        place: the residual. The bar's wrench is measured by no sensor.
    """
    topic = _SENSORS.get(place.channel)
    declared = None if topic is None else declared_noise(machine, topic, 1)
    return float("nan") if declared is None else float(declared[0])


def acts_immaterially(
    weights: Mapping[Candidate, Array],
    parts: Sequence[Sequence[Equation]],
    noise: Mapping[Place, Array],
    machine: Testbed,
    thresholds: Thresholds,
) -> bool:
    """Return whether a finding changes every residual by less than matters.

    With long recordings any difference becomes significant, such as that between a machine and a
    model at its sensors' resolution. A finding that acts on a residual without a stated accuracy is
    material.

    Args:
        weights: of the finding's candidates.
        parts: searched equations, in units of their noise, without reversals.
        noise: noise of each residual.
        machine: as described.
        thresholds: `immaterial_share`.
    """
    rows: dict[Place, list[Equation]] = {}
    for part in parts:
        for each in part:
            if not weights.keys().isdisjoint(each.columns) and len(each.times):
                rows.setdefault(each.place, []).append(each)
    return bool(rows) and all(
        np.isfinite(accuracy := accuracy_of(machine, place))
        and is_immaterial(*_sizes(own, weights, float(noise[place][0])), accuracy, thresholds)
        for place, own in rows.items()
    )


def _sizes(
    equations: Sequence[Equation], weights: Mapping[Candidate, Array], unit: float
) -> tuple[float, float]:
    """Return the RMS of a finding's part in a residual, and the spread of what was measured."""
    acting = np.concatenate([e.left - e.less(weights).left for e in equations])
    measured = np.concatenate([e.measured for e in equations])
    return unit * float(np.sqrt(np.mean(acting**2))), unit * float(np.std(measured))
