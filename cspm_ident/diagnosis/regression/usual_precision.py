"""What is known of weights before any data: the usual sizes of numbers that come together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.hypothesis import are_places
from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]


def usual_precision(gram: BlockGram) -> Array:
    """Return 1/usual² of each column's weight, (width,); 0 where nothing is known of it.

    Numbers that come together, such as the six of an offset, are expected to be of the size that
    they usually have. Those that a recording does not show would else explode in any other.
    """
    found = np.zeros(gram.width)
    for term, span in gram.slices.items():
        if not isinstance(term, Candidate) or not are_places(term.effect):
            continue
        sizes = [parameter.usual for parameter in term.effect.linear]
        if span.stop - span.start == len(sizes):
            found[span] = np.array(sizes, dtype=float) ** -2.0
    return found
