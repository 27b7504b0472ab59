"""A window of one sample, which makes of a weak form a pointwise equation."""

from __future__ import annotations

import numpy as np

from cspm_ident.winch.weak_form import Window


def make_point(half_width: int, step: float) -> Window:
    """Return a window of one sample, with the second difference about it: no weak form at all.

    Args:
        half_width: samples that `make_window` would have beside its middle, so that as many places
            fit.
        step: time between samples [s].
    """
    point = np.zeros(2 * half_width + 1)
    point[half_width] = 1.0
    second = np.zeros(2 * half_width + 1)
    second[half_width - 1 : half_width + 2] = (1.0, -2.0, 1.0)
    return Window(point, second / step**2)
