"""The residuals of a recording beside every effect's columns: what peers choose from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.diagnose import BLOCKS, GAP_SHARE, SEARCHED_SHARE
from cspm_ident.diagnosis.equation import Equation, in_noise, steady
from cspm_ident.diagnosis.evidence import Evidence, gather
from cspm_ident.diagnosis.recorded import equations_of
from cspm_ident.diagnosis.white_sums import WhiteSums
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import catalogue

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Library(NamedTuple):
    """Equations in units of their noise, parted as the diagnosis parts them.

    Attributes:
        searched: what may be fitted to.
        judge: what may not.
        evidence: the sums of what is searched.
        sums: the same, with the errors of white residuals.
        judge_evidence: the sums of what is not searched.
    """

    searched: Sequence[Equation]
    judge: Sequence[Equation]
    evidence: Evidence
    sums: WhiteSums
    judge_evidence: Evidence

    @property
    def candidates(self) -> list[Candidate]:
        """Effects on elements whose columns are not zero."""
        return [
            term
            for term in self.evidence.terms
            if isinstance(term, Candidate)
            and self.sums.excited[self.evidence.columns_of([term])].all()
        ]


def library_of(measurement: Measurement) -> Library:
    """Return the library of a recording, with all of the catalogue.

    Raises:
        InputError: the recording has no residual.
    """
    equations = equations_of(measurement, list(catalogue().values()))
    if not equations:
        raise InputError(f"{measurement.path}: no residual, allowed: recordings to be diagnosed")
    start = min(float(e.times[0]) for e in equations if len(e.times))
    end = max(float(e.times[-1]) for e in equations if len(e.times))
    cut, gap = start + SEARCHED_SHARE * (end - start), GAP_SHARE * (end - start)
    (early,) = steady([[e.within(-np.inf, cut) for e in equations]])
    noise = _noise(early)
    (searched,) = in_noise([early], noise)
    (judge,) = in_noise([[e.within(cut + gap, np.inf) for e in equations]], noise)
    block = (end - start) / BLOCKS
    evidence = gather([searched], block)
    return Library(searched, judge, evidence, WhiteSums(evidence), gather([judge], block))


def _noise(equations: Sequence[Equation]) -> dict[Place, Array]:
    found: dict[Place, list[Array]] = {}
    for equation in equations:
        if len(equation.times) > 8:
            found.setdefault(equation.place, []).append(equation.noise)
    return {place: np.asarray(np.median(each, axis=0)) for place, each in found.items()}
