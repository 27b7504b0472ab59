"""LASSO over the catalogue, its penalty by Schwarz's criterion."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.linear_model import lars_path_gram

from bench.blind.peers.library import Library
from bench.blind.peers.normal import normal_of
from bench.blind.peers.report import report_of

MOST_STEPS = 100


def diagnosis_of(library: Library) -> dict[str, Any]:
    """Return what LASSO keeps (Tibshirani 1996; path by Efron et al. 2004).

    Along the path the penalty is that of least Schwarz's criterion (Zou, Hastie, Tibshirani 2007).
    """
    candidates = library.candidates
    normal = normal_of(library, candidates)
    _, _, path = lars_path_gram(
        normal.cross, normal.gram, n_samples=normal.rows, method="lasso", max_iter=MOST_STEPS
    )
    best = path[:, int(np.argmin(normal.bic(path)))]
    return report_of(library, library.gram.columns_of(candidates)[best != 0.0], intervals=False)
