"""A search of recordings whose findings were held against held-out data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import (
    Unexplained,
)
from cspm_ident.diagnosis.regression.block_gram import BlockGram, gather
from cspm_ident.diagnosis.residuals.corrected_measurement import as_found
from cspm_ident.diagnosis.residuals.data_split import span_of
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise, steady
from cspm_ident.diagnosis.selection.delay_or_low_pass import with_lateness_separated
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
from cspm_ident.diagnosis.validation.acceptance import Acceptance, accepted
from cspm_ident.diagnosis.validation.found_model import Data, Model
from cspm_ident.diagnosis.validation.materiality import accuracy_of
from cspm_ident.diagnosis.validation.remainder import (
    independent_noise,
    remainders_of,
)
from cspm_ident.diagnosis.validation.reversals import with_wider
from cspm_ident.freed_memory import give_back
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Effect

Array = NDArray[np.float64]


class JudgedSearch(NamedTuple):
    """A search whose findings were held against held-out data.

    Attributes:
        recordings: those searched and those held out.
        thresholds: of the diagnosis.
        last: the last search pass, with the columns of findings and alternatives only.
        found: its result.
        acceptance: the findings after the hold-out test.
        judge: Gram matrices of held-out residuals.
        rows: equations of the searched data, in units of their noise.
        retuned: weights of the test-bed file's own parameters, without any added effect.
    """

    recordings: Recordings
    thresholds: Thresholds
    last: SearchPass
    found: SearchResult
    acceptance: Acceptance
    judge: BlockGram
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
        """The weights of the kept findings in the search."""
        kept = [each.hypothesis for each in self.acceptance.kept]
        return self.search.fits.values(kept, self.acceptance.beside)

    def searched_left(self, data: Data, model: Model) -> dict[Place, list[Equation]]:
        """Return what a model leaves of the searched data, without reversals, by residual.

        Columns of first order serve where no parameter was refined.
        """
        first, parts = self.first, self.rows
        if any(needs_refining(each.hypothesis.effect) for each in self.acceptance.kept):
            exact = [
                equations_of(as_found(m, model.values), (), thresholds=self.thresholds)
                for m in data.searched
            ]
            first, parts = {}, in_noise(data.searched_part(exact), self.last.noise)
        left: dict[Place, list[Equation]] = {}
        for part in steady(parts):
            for each in part:
                left.setdefault(each.place, []).append(each.less(first))
        return left

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
    """Search recordings, and hold what is found against held-out data."""
    last, found = searched_for(recordings, effects, progress, thresholds)
    last, found = with_lateness_separated(found, last, recordings, thresholds)
    found = with_wider(found, in_noise(last.search_parts, last.noise), last.block, thresholds)
    progress("held-out data")
    judge = _judge(in_noise(last.judge_parts, last.noise), found, last.block)
    # Columns take most of the memory, so those of what was not found are freed.
    last = last._replace(
        search_parts=_found_only(last.search_parts, found),
        judge_parts=_found_only(last.judge_parts, found),
    )
    give_back()
    search, rows = last.search, in_noise(last.search_parts, last.noise)
    acceptance = accepted(search, found, judge, recordings.searched, rows, last.block)
    retuned = search.retuned()
    return JudgedSearch(recordings, thresholds, last, found, acceptance, judge, rows, retuned)


def _judge(parts: Parts, found: SearchResult, block: float) -> BlockGram:
    """Return Gram matrices of held-out residuals, findings, alternatives and free functions."""
    terms = _candidates(found) | {
        t for part in parts for e in part for t in e.columns if isinstance(t, Driver)
    }
    return gather([[e.only(terms) for e in part] for part in parts], block)


def _candidates(found: SearchResult) -> set[Candidate | Driver]:
    own = [each.hypothesis.candidates for each in found.findings]
    rivals = [rival.candidates for each in found.findings for rival in each.alternatives]
    return {candidate for each in (*own, *rivals) for candidate in each}


def _found_only(parts: Parts, found: SearchResult) -> Parts:
    """Return equations with the columns of findings and alternatives only, to free memory."""
    terms = _candidates(found)
    return [[equation.only(terms) for equation in part] for part in parts]
