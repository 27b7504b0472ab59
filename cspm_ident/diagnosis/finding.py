"""A finding: an effect on some elements, from the search that selects it to the report."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.parameter import Coefficients, Parameter, parameters_of
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    Rival,
    is_number,
    may_be_none,
)
from cspm_ident.diagnosis.residuals.file_effects import is_less
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Place

Array = NDArray[np.float64]

# Elements whose equations contain every tension.
_FED_BY_ALL = frozenset({"bar", "winch_frame"})
_UNCERTAIN = "cannot tell: its 95 % interval contains zero, or a tension beside it is aliased"
_HARMFUL = "cannot tell: it raises held-out residuals of {}, so that it may stand for another cause"
_UNTESTED = "cannot tell: held-out data move too little to test it"


class Status(Enum):
    """The status of a finding.

    Reported and tied ones are named: a tied one has alternatives that explain the data equally
    well. A doubtful one is in the model, and its interval contains zero, so it is not named. A
    negligible one is in the model, but no larger than in a healthy machine. A rejected one is
    neither named nor in the model.
    """

    REPORTED = "reported"
    TIED = "tied"
    DOUBTFUL = "doubtful"
    NEGLIGIBLE = "negligible"
    REJECTED = "rejected"


class Rejection(Enum):
    """The reason for the rejection of a finding."""

    HOLDOUT_TEST = "is contradicted by held-out data"
    UNDECIDED = "is neither confirmed nor contradicted by held-out data"
    NOT_TESTABLE = "held-out data cannot test it, and no unexplained residual is as large"
    FED_BACK = "is noise that controllers feed back"
    IMPOSSIBLE = "has parameters that no such machine has"
    INSIGNIFICANT = "has only parameters whose 95 % intervals contain zero"
    DEGRADES_HOLDOUT = "raises the residuals of held-out data"
    NO_IMPROVEMENT = "lowers the error of no simulation of held-out data"


class HoldOut(Enum):
    """The result of the hold-out test of a finding."""

    NOT_TESTED = "not tested"
    CONFIRMED = "lowers a residual"
    DOMINANT = "takes more than half of a squared residual"
    FAINT = "moves too little for a single residual, and lowers all together as predicted"
    SILENT = "moves too little to say anything"
    UNDECIDED = "should lower a residual, and neither lowers nor raises any significantly"


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
        status: see `Status`.
        rejection: the reason for its rejection; None if it is not rejected.
        holdout: result of the hold-out test.
        coefficients: as fitted, one entry per element.
        onset: when it began; None where it acts all the time or began between recordings.
        region: range of a signal that holds most of its gain; None where no range does.
        improvement: of simulations of held-out data; None where no simulation depends on it.
        raises: hold-out residuals that it raises significantly.
    """

    hypothesis: Hypothesis
    gain: Gain
    share: float
    alternatives: tuple[Rival, ...] = ()
    status: Status = Status.REPORTED
    rejection: Rejection | None = None
    holdout: HoldOut = HoldOut.NOT_TESTED
    coefficients: tuple[Coefficients, ...] = field(default=(), compare=False)
    onset: Onset | None = None
    region: Region | None = None
    improvement: Improvement | None = None
    raises: tuple[Place, ...] = ()

    @property
    def effect(self) -> str:
        """The effect's id in the catalogue."""
        return self.hypothesis.effect.id

    @property
    def elements(self) -> tuple[str, ...]:
        """The elements on which it acts, as a test-bed file lists them."""
        return self.hypothesis.scope

    @property
    def is_reported(self) -> bool:
        """Whether it is named in the report; tied findings are."""
        return self.status in (Status.REPORTED, Status.TIED)

    @property
    def is_doubtful(self) -> bool:
        """Whether it is in the model, and too uncertain to be named."""
        return self.status is Status.DOUBTFUL

    @property
    def is_less(self) -> bool:
        """Whether it is less of an effect than the file says."""
        return any(is_less(self.effect, {n.name: n.value}) for n in self.parameters)

    @property
    def is_of_file(self) -> bool:
        """Whether it is another number of the file: a wrong one, or less of an effect it has."""
        return is_number(self.hypothesis) or self.is_less

    @property
    def is_faint(self) -> bool:
        """Whether it moves held-out data too little for the hold-out test of a single residual."""
        return self.holdout in (HoldOut.FAINT, HoldOut.SILENT)

    @property
    def reason_not_kept(self) -> str:
        """Why it is not named, in words; empty if it is."""
        if self.is_doubtful:
            if self.raises:
                return _HARMFUL.format(", ".join(dict.fromkeys(e.element for e in self.raises)))
            return _UNTESTED if self.holdout is HoldOut.SILENT else _UNCERTAIN
        return "" if self.rejection is None else self.rejection.value

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, element by element; those of all load cells once."""
        elements = self.elements
        if elements == self.hypothesis.elements:
            return tuple(p for own in self.coefficients for p in self.parameters_on(own))
        once = (self.parameters_on(own) for own in self.coefficients[:1])
        return tuple(p._replace(element=elements[0]) for each in once for p in each)

    def parameters_on(self, own: Coefficients) -> list[Parameter]:
        """Return the parameters on the element of the coefficients `own`."""
        return parameters_of(own)


def reported_status(finding: Finding, aliased: Collection[str] = ()) -> Status:
    """Return the status of a finding that is reported.

    It is doubtful where the intervals of all its coefficients contain zero. They include what a
    free function of any signal beside it may move them by. It is doubtful as well where held-out
    data cannot test it, where it raises a residual of theirs, and where it depends on an aliased
    tension, which alternates from one reading to the next.

    Args:
        finding: the finding to judge.
        aliased: cables with aliased tension.
    """
    intervals = {c.candidate: (c.values, c.half_widths) for c in finding.coefficients}
    misread = {*aliased, *_FED_BY_ALL} if aliased else set()
    untested = finding.holdout is HoldOut.SILENT or finding.raises
    if may_be_none(intervals) or untested or misread & set(finding.elements):
        return Status.DOUBTFUL
    return Status.TIED if finding.alternatives else Status.REPORTED
