"""The residuals of a recording beside every effect's columns: what peers choose from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from bench.blind.white_regression import WhiteSums
from cspm_ident.diagnosis.regression.block_gram import BlockGram, gather
from cspm_ident.diagnosis.residuals.data_split import first_part, last_part, span_of
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise, steady
from cspm_ident.diagnosis.selection.search_pass import noise_of
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import catalogue


class Library(NamedTuple):
    """Equations in units of their noise, parted as the diagnosis parts them.

    Attributes:
        searched: what may be fitted to.
        judge: what may not.
        gram: the sums of what is searched.
        sums: the same, with the errors of white residuals.
        judge_evidence: the sums of what is not searched.
    """

    searched: Sequence[Equation]
    judge: Sequence[Equation]
    gram: BlockGram
    sums: WhiteSums
    judge_evidence: BlockGram

    @property
    def candidates(self) -> list[Candidate]:
        """Effects on elements whose columns are not zero."""
        return [
            term
            for term in self.gram.terms
            if isinstance(term, Candidate) and self.sums.excited[self.gram.columns_of([term])].all()
        ]


def library_of(
    measurements: Sequence[Measurement], held_out: Sequence[Measurement] = ()
) -> Library:
    """Return the library of recordings, with all of the catalogue.

    Args:
        measurements: what is searched.
        held_out: what is judged; if empty, the last part of what is searched.

    Raises:
        InputError: a recording has no residual.
    """
    parts = [_equations(each) for each in measurements]
    first = steady(parts if held_out else first_part(parts))
    last = [_equations(each) for each in held_out] or last_part(parts)
    noise = noise_of(first)
    searched, judge = in_noise(first, noise), in_noise(last, noise)
    block = sum(_length(part) for part in searched) / DEFAULT_THRESHOLDS.block_count
    gram = gather(searched, block)
    return Library(
        [e for part in searched for e in part],
        [e for part in judge for e in part],
        gram,
        WhiteSums(gram),
        gather(judge, block),
    )


def _equations(measurement: Measurement) -> list[Equation]:
    found = equations_of(measurement, list(catalogue().values()))
    if not found:
        raise InputError(f"{measurement.path}: no residual, allowed: recordings to be diagnosed")
    return found


def _length(part: Sequence[Equation]) -> float:
    start, end = span_of(part)
    return end - start
