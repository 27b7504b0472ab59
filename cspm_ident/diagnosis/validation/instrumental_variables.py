"""Test by instrumental variables whether a finding shows in the reference motion.

Controllers feed sensor noise back into motion and tensions. Regressors in proportion to these then
correlate with the same noise in the residuals, even where nothing is missing. The reference motion
is free of noise and serves as instrument (Söderström, Stoica, Instrumental variable methods for
system identification, Springer 1983). Where it is not known, the slow part of a finding does: what
a loop does between the rows of a slow log is not in it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence, Set

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_model.robust_statistics import difference_noise
from cspm_sim.effects import Block, Effect

Array = NDArray[np.float64]

# Smallest relative singular value that is not rounding.
_LEAST = 1e-9
# Most rows of a recording or equation: more add nothing on a planned motion, and take memory.
_ROWS = 20_000
# Rows over which a finding is averaged to be its own instrument where no reference is known. Of
# white noise a twentieth of the squares is left, which is half of what an instrument has to hold.
_SLOW_ROWS = 20


def is_proportional(effect: Effect) -> bool:
    """Return whether an effect is proportional to smooth motion or tension, as fed-back noise is.

    This holds for parameters of the file, sensors, the frame and springs at the bar. Friction and
    play depend on direction or position instead.
    """
    is_known = effect.is_correction or effect.block is Block.FRAME
    return is_known or effect.signature.shares_noise


def instruments_of(
    measurement: Measurement, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> Samples | None:
    """Return the reference motion as instruments.

    None where it is not known, nothing is fed back, or something else moves the bar.
    """
    angle = measurement.angle
    if angle is None or measurement.wanted is None:
        return None
    least = thresholds.certain_sigma * difference_noise(angle.values)
    moves = np.std(angle.values, axis=0) > least
    if not moves.any() or _is_driven(measurement.bar_pose, measurement.wanted, thresholds):
        return None
    return measurement.wanted


def _is_driven(bar: Samples | None, wanted: Samples, thresholds: Thresholds) -> bool:
    """Return whether the bar deviates from the reference motion by more than noise explains."""
    if bar is None:
        return False
    noise, thin = difference_noise(bar.values[:, :3]), _thinning(len(bar.times))
    position = bar.values[thin, :3] - bar.values[thin, :3].mean(axis=0)
    basis = _basis(_at(wanted, bar.times[thin]))
    beyond = np.std(position - basis @ (basis.T @ position), axis=0)
    share = np.sum(beyond**2) / np.sum(np.var(position, axis=0))
    far = np.any(beyond > thresholds.driven_noise_ratio * noise)
    return bool(far and share > thresholds.minor_share)


def shows_in_reference_motion(
    parts: Sequence[Sequence[Equation]],
    wanted: Sequence[Samples | None],
    own: Collection[Candidate],
    weights: Mapping[Candidate, Array],
    block_s: float,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> bool:
    """Return whether a finding is significant in the reference motion.

    The residual is regressed on the finding's weighted regressors with a scale s, by instrumental
    variables. An effect of the machine gives s = 1 whatever the noise; fed-back noise gives any s.
    True where no equation has the finding.

    Args:
        parts: equations of each recording, in units of their noise.
        wanted: instruments of each recording; None: the finding's own slow part.
        own: the finding's candidates.
        weights: coefficients of all findings.
        block_s: length of blocks that are nearly independent [s].
        thresholds: those of instruments.
    """
    mine = frozenset(own)
    found = [
        pair
        for part, instruments in zip(parts, wanted, strict=True)
        for equation in part
        if not mine.isdisjoint(equation.columns)
        # One at a time, because all steady equations together take much memory.
        for pair in _moments(equation.steady, instruments, mine, weights, block_s)
    ]
    if not found:
        return True
    explained, predicted, squares = np.array(found).T
    if predicted.sum() <= thresholds.minor_share * squares.sum():
        return False
    scale = explained.sum() / predicted.sum()
    error = np.linalg.norm(explained - scale * predicted) / predicted.sum()
    doubt = thresholds.certain_sigma * error
    least = 1.0 - max(doubt, 1.0 - thresholds.majority_share)
    return bool(scale > doubt and scale >= least)


def _moments(
    equation: Equation,
    wanted: Samples | None,
    own: Set[Candidate],
    weights: Mapping[Candidate, Array],
    block_s: float,
) -> Iterator[tuple[float, float, float]]:
    """Yield, by block, three moments of each channel.

    They are instrument times residual, instrument times finding, and the finding's squares.
    """
    if not len(equation.times):
        return
    mine = [c for c in own if c in equation.columns]
    thin = _thinning(len(equation.times))
    basis = None if wanted is None else _basis(_at(wanted, equation.times[thin]))
    home = (equation.times[thin] / block_s).astype(int)
    others = [c for c in weights if c in equation.columns and c not in own]
    # What every machine has is known better than data that resemble the finding tell.
    small = [c for c in others if c.effect.is_negligible(_values(c, weights))]
    for k in range(equation.target.shape[1]):
        effect = sum((equation.columns[c][thin, k] @ weights[c] for c in mine), np.zeros(len(home)))
        beside = [equation.columns[c][thin, k] for c in others if c not in small]
        if equation.nuisance.size:
            beside.append(equation.nuisance[thin, k])
        taken = _basis(np.concatenate([np.zeros((len(home), 0)), *beside], axis=1))
        left = np.asarray(equation.target[thin, k], dtype=float)
        left = left - sum(equation.columns[c][thin, k] @ weights[c] for c in small)
        left, effect = (each - taken @ (taken.T @ each) for each in (left, effect))
        instrument = _slow(effect) if basis is None else basis @ (basis.T @ effect)
        instrument = instrument - taken @ (taken.T @ instrument)
        for block in np.unique(home):
            rows = home == block
            reported, moved = instrument[rows], effect[rows]
            yield float(reported @ left[rows]), float(reported @ moved), float(moved @ moved)


def _slow(effect: Array) -> Array:
    """Return a moving average over rows, (k,)."""
    return np.asarray(uniform_filter1d(effect, _SLOW_ROWS, mode="nearest"))


def _thinning(rows: int) -> slice:
    return slice(None, None, max(1, -(-rows // _ROWS)))


def _at(wanted: Samples, times: Array) -> Array:
    """Return a constant and the instruments interpolated at k times, shape (k, m + 1)."""
    values = [np.interp(times, wanted.times, column) for column in wanted.values.T]
    return np.stack([np.ones(len(times)), *values], axis=1)


def _basis(columns: Array) -> Array:
    """Return an orthonormal basis of the column space, shape (k, rank)."""
    sizes = np.linalg.norm(columns, axis=0)
    columns = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, values > _LEAST * values.max(initial=0.0)])


def _values(candidate: Candidate, weights: Mapping[Candidate, Array]) -> dict[str, float]:
    return candidate.effect.values(weights[candidate].tolist(), **candidate.nonlinear)
