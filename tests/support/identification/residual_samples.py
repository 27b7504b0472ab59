"""What tests of residuals start from."""

import numpy as np
from run_samples import run_to

from cspm_ident.signals.measurement import read_measurement


def worst_sea(folder):
    """Return the measurement of six seconds of the worst sea, read by ideal sensors."""
    run_to(folder, "worst_case_steep", "duration=6", "sensors=ideal")
    return read_measurement(folder)


def without_start(equation, values):
    """Return what one unknown length at the start, the same for all time, does not explain."""
    if not equation.nuisance.size:
        return values
    start = equation.nuisance[:, 0]
    return values - start @ np.linalg.lstsq(start, values, rcond=None)[0]
