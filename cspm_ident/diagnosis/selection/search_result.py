"""The result of a search in the catalogue."""

from __future__ import annotations

from typing import NamedTuple

from cspm_ident.diagnosis.finding import Finding, Unexplained


class SearchResult(NamedTuple):
    """The result of a search.

    Attributes:
        findings: the largest gain first.
        unexplained: residuals that no effect explains, the largest gain first.
        tested: number of hypotheses of one effect on one element that were tested.
    """

    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    tested: int
