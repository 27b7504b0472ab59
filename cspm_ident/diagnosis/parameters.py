"""Parameters of what was named, with intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.equation import Equation
from cspm_ident.diagnosis.evidence import Evidence, gather
from cspm_ident.diagnosis.refine import Weights
from cspm_ident.diagnosis.sums import Sums
from cspm_sim.effects import Channel

Parts = Sequence[Sequence[Equation]]


def weights_of(evidence: Evidence, sums: Sums, candidates: Sequence[Candidate]) -> Weights:
    """Return each candidate's weights with half the width of their 95 % intervals."""
    columns = evidence.with_nuisance(candidates)
    values = evidence.parted(candidates, sums.weights(columns))
    widths = evidence.parted(candidates, sums.half_width(columns))
    return {c: (values[c], widths[c]) for c in candidates}


def with_turns(weights: Weights, parts: Parts, block_s: float) -> Weights:
    """Return the weights of winches' effects from all rows, unless these contradict them.

    Rows in which a shaft turns round say much of dry friction, but where it sticks they mislead.
    They are used where no weight leaves the interval that the other rows gave (Hausman,
    Econometrica 46(6), 1978: what is efficient, unless what is safe says otherwise).

    Args:
        weights: found without these rows.
        parts: all rows, in units of their noise.
        block_s: length of the blocks [s].
    """
    winches = {e.place.element for part in parts for e in part if e.turning.any()}
    found = dict(weights)
    for winch in winches:
        own = [
            c
            for c in weights
            if c.element == winch and c.effect.regression.channel is Channel.SHAFT
        ]
        if not own:
            continue
        here = [[e.only(own) for e in part if e.place == (Channel.SHAFT, winch)] for part in parts]
        evidence = gather(here, block_s)
        whole = weights_of(evidence, Sums(evidence), own)
        if all(np.all(np.abs(whole[c][0] - weights[c][0]) <= weights[c][1]) for c in own):
            found |= whole
    return found
