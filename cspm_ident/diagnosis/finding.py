"""A finding: an effect on some elements, from the search that selects it to the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.parameter import Coefficients, Parameter, parameters_of
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]


class Status(Enum):
    """The status of a finding.

    Reported and tied ones are in the report: a tied one has alternatives that explain the data
    equally well. An undecided one is fitted beside them, but the data cannot tell whether it is
    there. A negligible one is no larger than in a healthy machine. A rejected one is in no model.
    """

    REPORTED = "reported"
    TIED = "tied"
    UNDECIDED = "undecided"
    NEGLIGIBLE = "negligible"
    REJECTED = "rejected"


class Reason(Enum):
    """Why a finding is undecided or rejected."""

    MISSED = "models without it predict as well"
    INSIGNIFICANT = "all its 95 % intervals contain zero"
    NOT_CONFIRMED = "lowers no held-out residual beyond its scatter"
    FED_BACK = "is noise that controllers feed back"
    IMPOSSIBLE = "has parameters that no such machine has"
    RAISES_HOLDOUT = "raises a held-out residual"


class Onset(NamedTuple):
    """When an effect began [s], with its 95 % interval from `low` to `high`."""

    time: float
    low: float
    high: float


class Region(NamedTuple):
    """Range of a signal that holds most of a finding's gain.

    Attributes:
        driver: the signal, with its unit.
        low, high: ends of the interval.
        share: share of the data in the interval.
        held: share of the finding's gain in the interval.
    """

    driver: str
    low: float
    high: float
    share: float
    held: float


class Improvement(NamedTuple):
    """Change of a simulation of held-out data by a finding.

    Attributes:
        channel: the quantity that improves most, such as `cables/tension/surge_2`.
        unit: of the quantity and both errors.
        without: root mean square error with all other findings.
        with_it: root mean square error with all findings.
    """

    channel: str
    unit: str
    without: float
    with_it: float


class Shape(NamedTuple):
    """A free function of a signal.

    Attributes:
        knots: in the signal's unit, shape (k,).
        values: of the function at the knots, less their mean, in the residual's unit, (k,).
    """

    knots: Array
    values: Array


class Unexplained(NamedTuple):
    """A part of a residual that no effect of the catalogue explains.

    Attributes:
        driver: the signal that explains most of it, and the residual.
        gain: reduction of the squared residuals by a free function of that signal.
        share: share of the residual's squares.
        shape: that function, fitted beside all reported findings; None before that fit.
    """

    driver: Driver
    gain: Gain
    share: float
    shape: Shape | None = None


@dataclass(frozen=True)
class Finding:
    """An effect on some elements, with the results known so far.

    Attributes:
        hypothesis: the effect and its elements.
        gain: in hold-out blocks, beside all other selected hypotheses.
        share: largest share of a residual's squares that it explains.
        alternatives: hypotheses that explain the same equally well.
        spread: how far its weights lie apart in models that predict as well, by candidate.
        status: see `Status`.
        reason: why it is undecided or rejected; None if it is neither.
        coefficients: as fitted, one entry per element.
        onset: when it began; None where it acts all the time or began between recordings.
        region: range of a signal that holds most of its gain; None where no range does.
        improvement: of simulations of held-out data; None where no simulation depends on it.
    """

    hypothesis: Hypothesis
    gain: Gain
    share: float
    alternatives: tuple[Rival, ...] = ()
    status: Status = Status.REPORTED
    reason: Reason | None = None
    spread: Mapping[Candidate, Array] = field(default_factory=dict, compare=False)
    coefficients: tuple[Coefficients, ...] = field(default=(), compare=False)
    onset: Onset | None = None
    region: Region | None = None
    improvement: Improvement | None = None

    @property
    def effect(self) -> str:
        """The effect's id in the catalogue."""
        return self.hypothesis.effect.id

    @property
    def elements(self) -> tuple[str, ...]:
        """The elements on which it acts."""
        return self.hypothesis.elements

    @property
    def is_reported(self) -> bool:
        """Whether it is in the report; tied findings are."""
        return self.status in (Status.REPORTED, Status.TIED)

    @property
    def reason_words(self) -> str:
        """Why it is undecided or rejected, in words; empty if it is neither."""
        return "" if self.reason is None else self.reason.value

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, element by element."""
        return tuple(p for own in self.coefficients for p in parameters_of(own))

    def undecided(self, reason: Reason) -> Finding:
        """Return the finding as one of which the data cannot tell whether it is there."""
        return replace(self, status=Status.UNDECIDED, reason=reason)

    def rejected(self, reason: Reason) -> Finding:
        """Return the finding, rejected."""
        return replace(self, status=Status.REJECTED, reason=reason)
