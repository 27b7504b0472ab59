"""What remembers, along samples: states of effects that columns are made of."""

from numba import njit
from numpy import bool_, float64
from numpy.typing import NDArray

Array = NDArray[float64]


@njit(cache=True, error_model="numpy", nogil=True, _nrt=False)
def relaxed(targets: Array, kept: Array, out: Array) -> None:
    """Write states that approach targets, (k, n) each, from `out[0]` on.

    Of what a state lacks of its target, the share `kept` is left after each step.
    """
    for k in range(1, targets.shape[0]):
        for i in range(targets.shape[1]):
            target = targets[k, i]
            out[k, i] = target + (out[k - 1, i] - target) * kept[k, i]


@njit(cache=True, error_model="numpy", _nrt=False)
def played(turned: Array, taut: NDArray[bool_], width: float, out: Array) -> None:
    """Write the lead of a play of `width`, (k,), from `out[0]` on; none while `taut`.

    It falls by what the other side has `turned` since the step before, within the play.
    """
    for k in range(1, len(turned)):
        out[k] = 0.0 if taut[k] else min(width, max(0.0, out[k - 1] - turned[k]))
