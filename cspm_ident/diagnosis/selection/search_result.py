"""What a search through the catalogue finds."""

from __future__ import annotations

from typing import NamedTuple

from cspm_ident.diagnosis.finding import Finding, Unexplained


class SearchResult(NamedTuple):
    """What a search finds.

    Attributes:
        findings: those of the largest gain first.
        unexplained: residuals that no effect explains, likewise.
        tested: number of hypotheses of one effect on one element that were tested.
    """

    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    tested: int
