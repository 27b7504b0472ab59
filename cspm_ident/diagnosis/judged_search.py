"""A search of recordings whose findings were held against held-out data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, Reason, Unexplained
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.data_split import span_of
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise, steady
from cspm_ident.diagnosis.selection.refinement import needs_refining
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_pass import (
    Parts,
    Progress,
    Recordings,
    SearchPass,
    searched_for,
)
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.diagnosis.validation.found_model import Data, Model
from cspm_ident.diagnosis.validation.holdout_residuals import equations_with
from cspm_ident.diagnosis.validation.instrumental_variables import (
    instruments_of,
    is_proportional,
    shows_in_reference_motion,
)
from cspm_ident.diagnosis.validation.materiality import accuracy_of
from cspm_ident.diagnosis.validation.remainder import (
    independent_noise,
    remainders_of,
)
from cspm_ident.diagnosis.validation.reversals import with_wider
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Effect

Array = NDArray[np.float64]


class JudgedSearch(NamedTuple):
    """A search whose findings are held against held-out data.

    Attributes:
        recordings: those searched and those held out.
        thresholds: of the diagnosis.
        last: the last search pass.
        found: its result.
        rejected: findings that were found before, and rejected.
        rows: equations of the searched data, in units of their noise.
        retuned: weights of the test-bed file's own parameters, without any added effect.
    """

    recordings: Recordings
    thresholds: Thresholds
    last: SearchPass
    found: SearchResult
    rejected: tuple[Finding, ...]
    rows: Parts
    retuned: Mapping[Candidate, Array]

    @property
    def search(self) -> Search:
        """The search in the residuals of the last pass."""
        return self.last.search

    @property
    def judges(self) -> Sequence[Measurement]:
        """The recordings of the hold-out test: those held out, or else those searched."""
        return self.recordings.held_out or self.recordings.searched

    @property
    def starts(self) -> list[float]:
        """Time at which the held-out part of each of `judges` begins [s]."""
        return [span_of(part)[0] for part in self.last.judge_parts]

    @property
    def first(self) -> dict[Candidate, Array]:
        """The weights of the findings in the search."""
        return self.search.fits.values(self.hypotheses)

    def without(self, rejected: Sequence[Finding]) -> JudgedSearch:
        """Return the search repeated without hypotheses that were rejected."""
        gone = (*self.rejected, *rejected)
        search = self.search.without([each.hypothesis for each in gone])
        last = self.last._replace(search=search)
        found = with_wider(search.run(), self.rows, last.block, self.thresholds)
        return self._replace(last=last, found=found, rejected=gone)

    def searched_left(self, data: Data, model: Model) -> dict[Place, list[Equation]]:
        """Return what a model leaves of the searched data, without reversals, by residual.

        Columns of first order serve where no parameter was refined.
        """
        first, parts = self.first, self.rows
        if any(needs_refining(each.hypothesis.effect) for each in self.found.findings):
            exact = [equations_with(m, model.values, self.thresholds) for m in data.searched]
            first, parts = {}, in_noise(data.searched_part(exact), self.last.noise)
        left: dict[Place, list[Equation]] = {}
        for part in steady(parts):
            for each in part:
                left.setdefault(each.place, []).append(each.less(first))
        return left

    @property
    def fed_back(self) -> list[Finding]:
        """Findings in proportion to motion or tension that the reference motion does not show."""
        limits, values = self.thresholds, self.first
        wanted = [instruments_of(each, limits) for each in self.recordings.searched]
        given = self.rows, wanted
        return [
            each.rejected(Reason.FED_BACK)
            for each in self.found.findings
            if is_proportional(each.hypothesis.effect)
            and not each.hypothesis.onset
            and not self.search.fits.is_negligible(each.hypothesis, self.hypotheses)
            and not shows_in_reference_motion(
                *given, each.hypothesis.candidates, values, self.last.block, limits
            )
        ]

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """Those of the findings."""
        return [each.hypothesis for each in self.found.findings]

    def beyond_noise(
        self, unexplained: Sequence[Unexplained], left: Mapping[Place, Sequence[Equation]]
    ) -> tuple[Unexplained, ...]:
        """Return unexplained functions of residuals that the findings leave beyond their noise.

        In few blocks a function with many knots follows noise. Beside a large error of a parameter
        it follows what columns of first order leave. With too few rows to know the noise, nothing
        can be said to exceed it.

        Args:
            unexplained: beside the findings, to first order.
            left: what the model leaves of the searched data.
        """
        return tuple(
            e for e in unexplained if not self._is_noise(e.driver, left.get(e.driver.place, []))
        )

    def _is_noise(self, driver: Driver, rows: Sequence[Equation]) -> bool:
        place, rows = driver.place, [each for each in rows if len(each.times)]
        if not rows:
            return False
        accuracy = accuracy_of(self.judges[0].machine, place)
        found = remainders_of(rows, independent_noise(rows), self.last.noise[place], accuracy)
        own = [each for each in found if each.component in driver.signal]
        return all(not each.is_judged or each.is_at_noise(self.thresholds) for each in own)


def searched_and_judged(
    recordings: Recordings,
    effects: Sequence[Effect],
    progress: Progress,
    thresholds: Thresholds,
) -> JudgedSearch:
    """Search recordings, with findings that controllers feed back from noise rejected."""
    last, found = searched_for(recordings, effects, progress, thresholds)
    rows = in_noise(last.search_parts, last.noise)
    found = with_wider(found, rows, last.block, thresholds)
    retuned = last.search.without([]).retuned()
    own = JudgedSearch(recordings, thresholds, last, found, (), rows, retuned)
    while fed_back := own.fed_back:
        own = own.without(fed_back)
    return own
