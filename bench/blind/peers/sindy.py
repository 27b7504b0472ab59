"""SINDy on the residual: sequentially thresholded least squares over the catalogue."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.blind.peers.library import Library
from bench.blind.peers.normal import Normal, normal_of
from bench.blind.peers.report import report_of

Array = NDArray[np.float64]

# Of the residual's length: columns have length 1.
THRESHOLDS = np.geomspace(1e-3, 0.5, 12)
RIDGE = 1e-3
_FITTED_SHARE = 0.75


def diagnosis_of(library: Library) -> dict[str, Any]:
    """Return what SINDy keeps (Brunton, Proctor, Kutz, PNAS 113(15), 2016).

    The threshold is the one whose terms, fitted to the first three quarters of the searched part,
    leave least of the last.
    """
    candidates, blocks = library.candidates, library.gram.blocks
    cut = round(_FITTED_SHARE * blocks)
    early = normal_of(library, candidates, slice(None, cut))
    late = normal_of(library, candidates, slice(cut, None))
    tried = np.stack([_thresholded(early, share) for share in THRESHOLDS], axis=1)
    share = THRESHOLDS[int(np.argmin(late.left(tried)))]
    best = _thresholded(normal_of(library, candidates), share)
    return report_of(library, library.gram.columns_of(candidates)[best != 0.0], intervals=False)


def _thresholded(normal: Normal, share: float) -> Array:
    from pysindy import STLSQ

    x, y = normal.root()
    optimizer = STLSQ(threshold=share * float(np.sqrt(normal.square)), alpha=RIDGE)
    with warnings.catch_warnings():
        # That nothing is left, or that it does not settle, is a result.
        warnings.simplefilter("ignore")
        optimizer.fit(x, y[:, None])
    return np.asarray(optimizer.coef_, dtype=np.float64).reshape(-1)
