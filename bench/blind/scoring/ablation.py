"""The diagnosis without one of its safeguards, to measure what each adds.

The diagnosis itself has no switch for that: a safeguard is left out by replacing what it consists
of while the diagnosis runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from types import MappingProxyType
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from bench.blind.scoring.point_window import make_point
from bench.blind.white_regression import WhiteSums
from cspm_ident.block_simulation import BlockSimulation, Input
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.validation.found_model import Model
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_sim.effects import Effect, catalogue

_DIAGNOSIS = "cspm_ident.diagnosis"


class Ablation(NamedTuple):
    """A safeguard left out.

    Attributes:
        prepare: what it makes of a measurement.
        replaced: names of what is replaced in the diagnosis, by what is put there.
        effects: those that are looked for.
    """

    prepare: Callable[[Measurement], Measurement] = lambda measurement: measurement
    replaced: Mapping[str, Any] = MappingProxyType({})
    effects: Callable[[], Sequence[Effect]] = lambda: list(catalogue().values())

    @contextmanager
    def active(self) -> Iterator[None]:
        """Put the replacements in place for a while.

        Raises:
            AttributeError: the diagnosis has no such part.
        """
        with ExitStack() as stack:
            for name, new in self.replaced.items():
                stack.enter_context(patch(f"{_DIAGNOSIS}.{name}", new))
            yield


def _untested(_: object, __: object, found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return findings that no held-out data have rejected."""
    return tuple(found)


def _without_corrections() -> list[Effect]:
    """Return the catalogue without wrong numbers of the file."""
    return [effect for effect in catalogue().values() if effect.physics.alter is None]


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


ABLATIONS: Mapping[str, Ablation] = {
    # Blocks take what the model computes between them as inputs, not what was measured.
    "measured-interfaces": Ablation(prepare=with_modelled_tensions),
    # Equations hold at single samples instead of under windows.
    "weak-form": Ablation(
        replaced={
            f"residuals.{module}.make_window": make_point
            for module in ("drive_torque", "residual_window", "winch_torque")
        }
    ),
    # Numbers of the file stay, instead of being fitted together with effects.
    "joint-refit": Ablation(effects=_without_corrections),
    # Significance is that of white rows, not that of the scatter between blocks.
    "block-null": Ablation(
        replaced={
            "selection.search.BlockRegression": WhiteSums,
            "validation.reversals.BlockRegression": WhiteSums,
        }
    ),
    # All findings are kept that a machine may have, whatever held-out data show.
    "held-out": Ablation(
        replaced={
            "validation.acceptance.holdout_tested": _untested,
            "validation.found_model.Model.useless": Model.untenable,
        }
    ),
}


def diagnose_without(measurement: Measurement, safeguard: str) -> Diagnosis:
    """Return what the diagnosis finds without a safeguard, one of `ABLATIONS`.

    Raises:
        InputError: the recording has no residual that could be looked at.
    """
    ablation = ABLATIONS[safeguard]
    with ablation.active():
        return diagnose([ablation.prepare(measurement)], effects=ablation.effects())
