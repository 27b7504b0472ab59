"""What a series of stamps looks like: rate, steps, gaps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cspm_checks.series import Stamps

GAP = 1.5
IRREGULAR = 0.01
JITTERED_GAP = 2.5
"""Medians: two stamps that scatter by half a step each make one of two."""
_SCATTERED = -0.25
"""Halfway between -1/2, the correlation of neighbouring steps where stamps scatter about an even
clock, and 0, where each step errs for itself."""
_FEWEST = 50
STRETCH = 500_000
"""Messages that are looked at together, so that memory is bounded."""


class Pace(NamedTuple):
    """What a series of stamps looks like; times from the first stamp of all.

    Attributes:
        messages: number of stamps.
        first_s: first stamp [s].
        last_s: last stamp [s].
        rate_hz: one over the mean step without gaps, None below two stamps.
        step_s: smallest, median and largest step [s].
        irregular: share of steps that differ from the median by more than 1 %, gaps apart.
        gaps: number of steps longer than 1.5 medians.
        gap_at_s: where the longest step begins [s].
        duplicates: number of steps of zero.
        backwards: number of negative steps.
        jitter_s: how far stamps scatter about an even clock [s], one sigma; 0 where they do not.
    """

    messages: int
    first_s: float
    last_s: float
    rate_hz: float | None
    step_s: tuple[float, float, float] | None
    irregular: float
    gaps: int
    gap_at_s: float | None
    duplicates: int
    backwards: int
    jitter_s: float = 0.0


def pace_of(stamp_ns: Stamps, origin_ns: int) -> Pace:
    """Return what a series of stamps, shape (n,), looks like, seen from an origin [ns].

    A long one is looked at stretch by stretch: medians are then medians of those of stretches.
    """
    starts = range(0, max(len(stamp_ns) - 1, 1), STRETCH)
    found = [_pace(stamp_ns[start : start + STRETCH + 1], origin_ns) for start in starts]
    return found[0] if len(found) == 1 else _joined(found)


def _joined(parts: list[Pace]) -> Pace:
    """Return the pace of stretches that share their ends."""
    steps = np.array([part.messages - 1 for part in parts])
    moving = [(part.messages - 1, part.rate_hz) for part in parts if part.rate_hz]
    of_steps = np.array([part.step_s for part in parts if part.step_s])
    gap = max((part for part in parts if part.gaps), key=_longest, default=None)
    return Pace(
        messages=int(steps.sum()) + 1,
        first_s=parts[0].first_s,
        last_s=parts[-1].last_s,
        rate_hz=sum(n for n, _ in moving) / sum(n / r for n, r in moving) if moving else None,
        step_s=(of_steps[:, 0].min(), float(np.median(of_steps[:, 1])), of_steps[:, 2].max()),
        irregular=float(np.average([part.irregular for part in parts], weights=steps)),
        gaps=sum(part.gaps for part in parts),
        gap_at_s=gap.gap_at_s if gap else None,
        duplicates=sum(part.duplicates for part in parts),
        backwards=sum(part.backwards for part in parts),
        jitter_s=float(np.median([part.jitter_s for part in parts])),
    )


def _longest(part: Pace) -> float:
    return part.step_s[2] if part.step_s else 0.0


def _pace(stamp_ns: Stamps, origin_ns: int) -> Pace:
    if not len(stamp_ns):
        return Pace(0, 0.0, 0.0, None, None, 0.0, 0, None, 0, 0)
    first, last = ((int(stamp_ns[i]) - origin_ns) * 1e-9 for i in (0, -1))
    steps = np.diff(stamp_ns)
    if not len(steps):
        return Pace(1, first, last, None, None, 0.0, 0, None, 0, 0)
    median = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    jitter = _jitter(steps, median)
    gaps = steps > (JITTERED_GAP if jitter else GAP) * median
    regular = np.abs(steps - median) <= IRREGULAR * median
    longest = int(np.argmax(steps))
    return Pace(
        messages=len(stamp_ns),
        first_s=first,
        last_s=last,
        rate_hz=1e9 / float(steps[(steps > 0) & ~gaps].mean()) if median else None,
        step_s=(float(steps.min()) * 1e-9, median * 1e-9, float(steps.max()) * 1e-9),
        irregular=float(np.mean(~regular & ~gaps)),
        gaps=int(gaps.sum()),
        gap_at_s=(int(stamp_ns[longest]) - origin_ns) * 1e-9 if gaps.any() else None,
        duplicates=int((steps == 0).sum()),
        backwards=int((steps < 0).sum()),
        jitter_s=jitter * 1e-9,
    )


def _jitter(steps: Stamps, median: float) -> float:
    """Return how far stamps scatter about an even clock [ns], 0 where they do not."""
    usual = np.abs(steps - median) <= JITTERED_GAP * median
    pair = usual[1:] & usual[:-1]
    if pair.sum() < _FEWEST or np.mean(np.abs(steps - median) > IRREGULAR * median) <= IRREGULAR:
        return 0.0
    error = steps - steps[usual].mean()
    variance = float(np.mean(error[usual] ** 2))
    if variance == 0.0 or np.mean(error[1:][pair] * error[:-1][pair]) > _SCATTERED * variance:
        return 0.0
    return float(np.sqrt(variance / 2.0))
