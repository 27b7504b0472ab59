"""Stepwise regression over the catalogue: the best column next, as many as Schwarz's criterion."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.linear_model import orthogonal_mp_gram

from bench.blind.peers.library import Library
from bench.blind.peers.normal import normal_of
from bench.blind.peers.report import report_of

MOST = 20


def diagnosis_of(library: Library) -> dict[str, Any]:
    """Return what orthogonal matching pursuit keeps (Pati, Rezaiifar, Krishnaprasad 1993)."""
    candidates = library.candidates
    normal = normal_of(library, candidates)
    most = min(MOST, len(normal.cross))
    path = orthogonal_mp_gram(
        normal.gram, normal.cross, n_nonzero_coefs=most, copy_Gram=True, return_path=True
    )
    path = np.hstack([np.zeros((len(normal.cross), 1)), path.reshape(len(normal.cross), -1)])
    best = path[:, int(np.argmin(normal.bic(path)))]
    return report_of(library, library.gram.columns_of(candidates)[best != 0.0], intervals=True)
