"""What keeps a search from being misled; each can be left out, to measure what it is worth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cspm_ident.diagnosis.regression.block_gram import Evidence
from cspm_ident.diagnosis.regression.block_regression import Sums
from cspm_ident.diagnosis.regression.white_regression import WhiteSums
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_sim.effects import Effect, catalogue


@dataclass(frozen=True)
class Safeguards:
    """Which safeguards a diagnosis has.

    Attributes:
        joint_refit: numbers of the file are fitted together with effects; otherwise they stay.
        block_null: what is sure is told by the scatter between blocks; otherwise by white rows.
        held_out: findings have to stand on data that was not searched; otherwise all are kept that
            may be.
    """

    joint_refit: bool = True
    block_null: bool = True
    held_out: bool = True

    @property
    def effects(self) -> list[Effect]:
        """What is looked for."""
        return [e for e in catalogue().values() if self.joint_refit or e.physics.alter is None]

    @property
    def sums(self) -> Callable[[Evidence, Thresholds], Sums]:
        """What tells what is sure."""
        return Sums if self.block_null else WhiteSums


ALL_SAFEGUARDS = Safeguards()
