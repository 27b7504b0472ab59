"""Acceptance of findings on held-out data, and the unexplained residuals beside them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

from cspm_ident.diagnosis.finding import (
    Finding,
    HoldOut,
    Rejection,
    Status,
    Unexplained,
)
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.validation.holdout_test import holdout_tested
from cspm_ident.diagnosis.validation.instrumental_variables import (
    instruments_of,
    is_proportional,
    shows_in_reference_motion,
)
from cspm_ident.signals.measurement import Measurement

Parts = Sequence[Sequence[Equation]]


@dataclass(frozen=True)
class Acceptance:
    """Findings after the hold-out test.

    Attributes:
        findings: the kept ones, then the rejected ones in the order of their rejection.
    """

    findings: tuple[Finding, ...]

    @property
    def kept(self) -> tuple[Finding, ...]:
        """Findings that are not rejected."""
        return tuple(each for each in self.findings if each.status is not Status.REJECTED)

    @property
    def beside(self) -> tuple[Hypothesis, ...]:
        """Hypotheses that stay in the fits, which held-out data neither confirm nor contradict."""
        undecided = (e for e in self.findings if e.rejection is Rejection.UNDECIDED)
        return tuple(each.hypothesis for each in undecided)

    @property
    def tested(self) -> tuple[Finding, ...]:
        """Kept findings that held-out data excite."""
        return tuple(each for each in self.kept if each.holdout is not HoldOut.SILENT)

    @property
    def rejected(self) -> tuple[Finding, ...]:
        """Rejected findings, except those of fed-back noise."""
        gone = (each for each in self.findings if each.status is Status.REJECTED)
        return tuple(each for each in gone if each.rejection is not Rejection.FED_BACK)

    @property
    def fed_back(self) -> tuple[Finding, ...]:
        """Findings rejected as fed-back noise, which the reference motion does not show."""
        return tuple(each for each in self.findings if each.rejection is Rejection.FED_BACK)

    @property
    def has_rejected(self) -> bool:
        """Whether any finding is rejected."""
        return any(each.status is Status.REJECTED for each in self.findings)

    def rejecting(self, gone: Sequence[Finding]) -> Acceptance:
        """Return the acceptance with further findings rejected.

        Args:
            gone: the rejected findings, each with its reason.
        """
        hypotheses = [each.hypothesis for each in gone]
        rest = (each for each in self.findings if each.hypothesis not in hypotheses)
        return Acceptance((*rest, *gone))

    def unexplained(self, search: Search, found: SearchResult) -> tuple[Unexplained, ...]:
        """Return the residuals left unexplained by the findings that held-out data confirm."""
        left_open = tuple(each for each in self.kept if each not in self.tested)
        if not (self.has_rejected or left_open):
            return found.unexplained
        return unexplained_beside(search, self.tested, (*self.rejected, *left_open), self.fed_back)


def accepted(
    search: Search,
    found: SearchResult,
    judge: BlockGram,
    searched: Sequence[Measurement],
    rows: Parts,
    block: float,
) -> Acceptance:
    """Accept or reject the findings of a search.

    Args:
        search: the search.
        found: its result.
        judge: Gram matrices of the held-out data.
        searched: the recordings.
        rows: their equations, in units of their noise.
        block: length of the blocks [s].
    """
    tested = _tested(search, judge, found.findings)
    confirmed = [e for e in tested if _is_confirmed(e)]
    contradicted = [e for e in tested if e.status is Status.REJECTED]
    silent = [e for e in tested if _is_silent(e)]
    undecided = [
        replace(e, status=Status.REJECTED, rejection=Rejection.UNDECIDED)
        for e in tested
        if e.holdout is HoldOut.UNDECIDED
    ]
    kept, fed_back = _shown_by_reference(search, confirmed, searched, rows, block)
    left_open = _left_open(search, kept, [*contradicted, *undecided], silent, fed_back)
    untestable = [
        replace(e, status=Status.REJECTED, rejection=Rejection.NOT_TESTABLE)
        for e in silent
        if e not in left_open
    ]
    rejected = (*contradicted, *undecided, *untestable)
    # Otherwise a residual would be reported as unexplained that held-out data excite as little.
    # What takes less than most of a residual may stand for what is left of it.
    if left_open and not unexplained_beside(search, (*kept, *left_open), rejected, fed_back):
        most = search.thresholds.majority_share
        left_open = tuple(
            replace(each, holdout=HoldOut.FAINT) if each.share > most else each
            for each in left_open
        )
    return Acceptance((*kept, *left_open, *rejected, *fed_back))


def with_rivals(
    search: Search, judge: BlockGram, acceptance: Acceptance, gone: Sequence[Finding]
) -> Acceptance:
    """Return the acceptance with a rival in place of a finding that a model cannot have.

    A law whose parameters are insignificant or impossible may stand for a simpler one that explains
    the same. A law that no element shows alone may be shown by all with one set of parameters. The
    closest rival that passes the hold-out test beside the kept findings is taken; one that was
    rejected before is not tried again.

    Args:
        search: the search.
        judge: Gram matrices of the held-out data.
        acceptance: in which the findings are rejected.
        gone: the rejected findings.
    """
    tried = {_form(each) for each in acceptance.findings}
    for each in gone:
        rivals = _rivals(search, each, [*acceptance.kept, each])
        for rival in (*_shared(search, each, acceptance.kept), *rivals):
            if _form(rival) in tried:
                continue
            tested = holdout_tested(search.fits, judge, [*acceptance.kept, rival])[-1]
            if _is_confirmed(tested):
                return _with(acceptance, tested)
    return acceptance


def _with(acceptance: Acceptance, finding: Finding) -> Acceptance:
    """Return an acceptance with a further finding, without rejected ones of the same candidates."""
    own, kept = finding.hypothesis.candidates, acceptance.kept
    rest = acceptance.findings[len(kept) :]
    return Acceptance((*kept, finding, *(e for e in rest if e.hypothesis.candidates != own)))


def _form(finding: Finding) -> tuple[tuple[Candidate, ...], bool]:
    return finding.hypothesis.candidates, finding.hypothesis.common


def _shared(search: Search, finding: Finding, kept: Sequence[Finding]) -> Iterator[Finding]:
    """Yield a finding with one set of parameters, where it has one on each of several elements."""
    own = finding.hypothesis
    if finding.rejection is Rejection.INSIGNIFICANT and len(own.candidates) > 1 and not own.common:
        yield search.finding_of(replace(own, common=True), _hypotheses(kept))


def _is_confirmed(finding: Finding) -> bool:
    failed = finding.status is Status.REJECTED or finding.holdout is HoldOut.UNDECIDED
    return not failed and not _is_silent(finding)


def _is_silent(finding: Finding) -> bool:
    return finding.holdout is HoldOut.SILENT


def _tested(search: Search, judge: BlockGram, found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return findings tested on held-out data, a rejected one replaced by a rival that passes.

    Example: a bar that comes to rest contradicts linear drag, but not quadratic drag.
    """
    tested = holdout_tested(search.fits, judge, found)
    for k, each in enumerate(tested):
        if _is_confirmed(each) or _is_silent(each):
            continue
        for rival in _rivals(search, found[k], found):
            others = [*found[:k], rival, *found[k + 1 :]]
            rated = holdout_tested(search.fits, judge, others)[k]
            uncontradicted = each.status is Status.REJECTED and _is_silent(rated)
            if _is_confirmed(rated) or uncontradicted:
                return _tested(search, judge, others)
    return tested


def _rivals(search: Search, finding: Finding, found: Sequence[Finding]) -> Iterator[Finding]:
    """Yield alternatives that replace a finding by a single effect, the closest first."""
    others = [h for h in _hypotheses(found) if h is not finding.hypothesis]
    base = search.fits.columns(others)
    alone = [a for a in finding.alternatives if a.beside is None]
    for rival in sorted(alone, key=lambda each: each.behind):
        if not search.fits.is_plausible([*others, rival.hypothesis]):
            continue
        gain = search.fits.gain(rival.hypothesis, base)
        share = search.significance.share(base, search.fits.own_columns(rival.hypothesis))
        rest = tuple(a for a in finding.alternatives if a is not rival)
        yield Finding(replace(rival.hypothesis, onset=finding.hypothesis.onset), gain, share, rest)


def _shown_by_reference(
    search: Search,
    kept: Sequence[Finding],
    searched: Sequence[Measurement],
    rows: Parts,
    block: float,
) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """Return the findings that pass the test by instrumental variables, and the rejected ones.

    Findings that are not proportional to motion or tension need no such test.
    """
    hypotheses, limits = _hypotheses(kept), search.thresholds
    wanted = [instruments_of(each, limits) for each in searched]
    values = search.fits.values(hypotheses)

    def is_shown(finding: Finding) -> bool:
        own = finding.hypothesis
        return (
            not is_proportional(own.effect)
            or own.onset > 0
            or search.fits.is_negligible(own, hypotheses)
            or shows_in_reference_motion(rows, wanted, own.candidates, values, block, limits)
        )

    shown = [is_shown(each) for each in kept]
    fed_back = (each for each, stays in zip(kept, shown, strict=True) if not stays)
    return tuple(compress(kept, shown)), tuple(
        replace(each, status=Status.REJECTED, rejection=Rejection.FED_BACK) for each in fed_back
    )


def _left_open(
    search: Search,
    kept: Sequence[Finding],
    contradicted: Sequence[Finding],
    silent: Sequence[Finding],
    fed_back: Sequence[Finding],
) -> tuple[Finding, ...]:
    """Return the findings that stay in the model, though held-out data do not excite them.

    Each explains as much as the residual that is unexplained without it, which held-out data do
    not excite either.
    """
    if not silent:
        return ()
    unexplained = unexplained_beside(search, kept, (*contradicted, *silent), fed_back)
    if not unexplained:
        return tuple(e for e in silent if _would_be_unexplained(search, e, kept))
    most = search.thresholds.majority_share * max(each.gain.total for each in unexplained)
    return tuple(each for each in silent if each.gain.total >= most)


def _would_be_unexplained(search: Search, finding: Finding, kept: Sequence[Finding]) -> bool:
    """Return whether a finding explains the share from which a residual counts as unexplained.

    It may do so where no free function does. It must exceed what a healthy machine has.
    """
    every = _hypotheses([*kept, finding])
    enough = finding.share >= search.thresholds.unknown_share
    return enough and not search.fits.is_negligible(finding.hypothesis, every)


def unexplained_beside(
    search: Search,
    kept: Sequence[Finding],
    rejected: Sequence[Finding],
    fed_back: Sequence[Finding] = (),
) -> tuple[Unexplained, ...]:
    """Return the residuals that the kept findings leave unexplained.

    Rejected findings explain nothing, with two exceptions. Negligible ones occur in a healthy
    machine and may vanish in held-out data, as clock drift does. Controllers feed noise back.
    """
    every = _hypotheses([*kept, *rejected])
    healthy = [h for h in _hypotheses(rejected) if search.fits.is_negligible(h, every)]
    return search.unexplained(_hypotheses(kept), [*healthy, *_hypotheses(fed_back)])


def _hypotheses(findings: Sequence[Finding]) -> list[Hypothesis]:
    return [each.hypothesis for each in findings]
