"""The result of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.finding import Finding, Status, Unexplained
from cspm_ident.diagnosis.regression.hypothesis import is_surveyed
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.detection_limits import Limit
from cspm_ident.diagnosis.validation.extrapolation import Extrapolation
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import SimulatedFit
from cspm_ident.diagnosis.validation.remainder import Remainder
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_ident.signals.measurement import Measurement

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis:
    """The result of a diagnosis.

    Attributes:
        searched: recordings that were searched.
        held_out: recordings of the hold-out test; empty where it used the end of each searched one.
        findings: all that were selected: first the reported ones, the most important first.
        unexplained: residuals that no effect explains, the largest first.
        tables: values of tables that describe what is unexplained, by effect and element.
        tested: number of hypotheses that were tested.
        fit: hold-out errors of each residual.
        simulated: hold-out errors of each simulated quantity.
        lines: aliased tensions, then periodic forces from outside.
        limits: detection limits: the smallest sizes at which effects would have been reported.
        not_excited: effects, and their elements, that these recordings do not excite.
        places: all residuals.
        curves: the residuals on held-out data, over time.
        noise: standard deviation of each residual from row to row, one per channel.
        extrapolated: signals that held-out data take beyond what was searched, where effects act.
        thresholds: those that were used.
    """

    searched: Sequence[Measurement]
    held_out: Sequence[Measurement]
    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    tested: int
    tables: dict[Candidate, Array] = field(default_factory=dict)
    fit: tuple[HeldOut, ...]
    simulated: tuple[SimulatedFit, ...]
    lines: tuple[Line, ...]
    limits: tuple[Limit, ...]
    not_excited: tuple[tuple[str, tuple[str, ...]], ...]
    places: tuple[Place, ...]
    curves: tuple[Curve, ...]
    noise: dict[Place, Array]
    extrapolated: tuple[Extrapolation, ...] = ()
    thresholds: Thresholds = DEFAULT_THRESHOLDS

    @property
    def remainders(self) -> tuple[Remainder, ...]:
        """What is left of every component of every residual on held-out data, with the findings."""
        return tuple(left for fit in self.fit for left in fit.remainders)

    @property
    def beyond_noise(self) -> tuple[Remainder, ...]:
        """What is left beyond the noise, the largest multiple of its noise first."""
        left = (e for e in self.remainders if e.is_judged and not e.is_at_noise(self.thresholds))
        return tuple(sorted(left, key=lambda each: -each.ratio))

    @property
    def undescribed(self) -> tuple[Remainder, ...]:
        """What is left beyond the noise where no function and no spectral line describes it."""
        described = {e.driver.place for e in self.unexplained} | {e.place for e in self.lines}
        return tuple(each for each in self.beyond_noise if each.place not in described)

    @property
    def simulated_beyond(self) -> tuple[SimulatedFit, ...]:
        """Simulations of cables and bar far from what was measured, the farthest first.

        Those from torques integrate their noise twice, in any machine. Without load cells the state
        in which a simulation begins is not known well enough.
        """
        if any(each.tension is None for each in (*self.searched, *self.held_out)):
            return ()
        far = self.thresholds.driven_noise_ratio
        torques = Input.SHAFT, Input.TORQUE
        own = (e for e in self.simulated if e.output.drive not in torques)
        beyond = (e for e in own if e.final > far * e.floor > 0.0)
        return tuple(sorted(beyond, key=lambda each: -each.final / each.floor))

    @property
    def is_excited(self) -> bool:
        """Whether any residual is known well enough, and moves enough, to judge the model by it."""
        return any(each.is_excited(self.thresholds) for each in self.remainders)

    @property
    def reported(self) -> tuple[Finding, ...]:
        """Findings that are named, tied ones included, the most important first."""
        return tuple(each for each in self.findings if each.is_reported)

    @property
    def doubtful(self) -> tuple[Finding, ...]:
        """Findings that are in the model, and too uncertain to be named."""
        return tuple(each for each in self.findings if each.is_doubtful)

    @property
    def negligible(self) -> tuple[Finding, ...]:
        """Findings that are no larger than in a healthy machine."""
        return tuple(each for each in self.findings if each.status is Status.NEGLIGIBLE)

    @property
    def rejected(self) -> tuple[Finding, ...]:
        """Findings that are not in the model."""
        return tuple(each for each in self.findings if each.status is Status.REJECTED)

    @property
    def calibrated(self) -> tuple[Finding, ...]:
        """Surveyed places that are off by no more than their accuracy."""
        return tuple(e for e in self.negligible if is_surveyed(e.hypothesis.effect))

    @property
    def in_model(self) -> tuple[Finding, ...]:
        """Findings whose numbers are in the improved file."""
        return (*self.reported, *self.doubtful, *self.calibrated)

    @property
    def considered(self) -> tuple[Finding, ...]:
        """Findings that are not named, each with its reason."""
        return (*self.doubtful, *self.rejected)
