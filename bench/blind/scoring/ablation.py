"""The diagnosis without one of its safeguards, to measure what each adds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cspm_ident.block_simulation import BlockSimulation, Input
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.selection.safeguards import ALL_SAFEGUARDS, Safeguards
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline


class Ablation(NamedTuple):
    """A safeguard left out.

    Attributes:
        prepare: what it makes of a measurement.
        safeguards: those that the search keeps.
    """

    prepare: Callable[[Measurement], Measurement] = lambda measurement: measurement
    safeguards: Safeguards = ALL_SAFEGUARDS


def with_modelled_tensions(measurement: Measurement) -> Measurement:
    """Return the measurement with tensions that the model computes instead of the load cells.

    Cables and bar are simulated from motor angles and the frame's pose; blocks are then no longer
    with what was measured as input between them. Left as it is where sensors do not allow that.
    """
    timeline = Timeline(measurement)
    simulation = BlockSimulation(timeline, measurement.machine)
    if measurement.tension is None or simulation.missing(Input.WINCH):
        return measurement
    simulated = simulation.run(Input.WINCH, simulation.windows(Input.WINCH, None))
    rows = np.isfinite(simulated.tensions).all(axis=1)
    times = timeline.times[rows]
    stamps = measurement.tension.times
    stamps = stamps[(stamps >= times[0]) & (stamps <= times[-1])]
    columns = [np.interp(stamps, times, column) for column in simulated.tensions[rows].T]
    return measurement.with_samples("tension", Samples(stamps, np.stack(columns, axis=1)))


def _pointwise(measurement: Measurement) -> Measurement:
    return replace(measurement, pointwise=True)


ABLATIONS: Mapping[str, Ablation] = {
    "measured-interfaces": Ablation(prepare=with_modelled_tensions),
    "weak-form": Ablation(prepare=_pointwise),
    "joint-refit": Ablation(safeguards=Safeguards(joint_refit=False)),
    "block-null": Ablation(safeguards=Safeguards(block_null=False)),
    "held-out": Ablation(safeguards=Safeguards(held_out=False)),
}


def diagnose_without(measurement: Measurement, safeguard: str) -> Diagnosis:
    """Return what the diagnosis finds without a safeguard, one of `ABLATIONS`.

    Raises:
        InputError: the recording has no residual that could be looked at.
    """
    ablation = ABLATIONS[safeguard]
    return diagnose([ablation.prepare(measurement)], safeguards=ablation.safeguards)
