"""Rate, jitter, losses and clocks of a topic, from its stamps and times of reception."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from cspm_ros.check_drivers.driver_observation import Array, Finding, Heard, Stamps, seconds

ENOUGH_MESSAGES = 3
RATE_TOLERANCE = 0.05
STAMP_JITTER = 0.25  # of a period, the 99th percentile above the median
RECEIVE_JITTER = 1.0
LATE_PERIODS = 2.0
LOST_SHARE = 0.01
LARGEST_OFFSET = 1.0  # s
EARLY = 1e-3  # s by which a synchronised clock may be wrong
DELAY_MARGIN = 0.005  # s
LARGEST_DRIFT = 100.0  # ppm: two quartz clocks of ±50 ppm against each other
DRIFT_BLOCKS, FEWEST_BLOCKS = 50, 10
YEAR = 365.25 * 86400.0

# Constant differences between clocks that keep the same second but count from elsewhere.
_KNOWN_OFFSETS = {37.0: "TAI, as PTP clocks give it, instead of UTC", 18.0: "GPS time, not UTC"}


class _Clocks(NamedTuple):
    """Stamps and times of reception [ns], and the period that the stamps have [s]."""

    name: str
    stamps: Stamps
    receives: Stamps
    period: float

    @property
    def age(self) -> Array:
        """How old each message is when it arrives [s]."""
        return seconds(self.receives - self.stamps)


def check_timing(rate_hz: float, delay_s: float, heard: Heard) -> list[Finding]:
    """Judge when a topic's messages come and what their stamps say.

    Args:
        rate_hz: the rate that the scenario expects [Hz].
        delay_s: the delay between stamp and reception that the test-bed says [s].
        heard: what was heard.
    """
    name, stamps, receives = heard.topic.name, heard.stamp_ns, heard.receive_ns
    if len(stamps) < ENOUGH_MESSAGES:
        return [Finding(name, "rate", None, f"{len(stamps)} messages, too few to judge")]
    steps = np.diff(stamps)
    forward = seconds(steps[steps > 0])
    stamped = len(forward) >= 0.4 * len(steps)
    mean_interval = float(receives[-1] - receives[0]) * 1e-9 / (len(receives) - 1)
    period = float(np.median(forward)) if stamped else mean_interval
    clocks = _Clocks(name, stamps, receives, period)
    findings = [_rate(name, period, rate_hz), *_arrivals(clocks, 1.0 / rate_hz), _order(clocks)]
    if not stamps.any():
        return findings
    if stamped:
        findings += [_stamp_jitter(name, forward, period), _gaps(name, forward, period)]
    findings.append(_offset(clocks))
    if findings[-1].ok:
        findings.append(_delay(clocks, delay_s))
    if (steps > 0).all():
        findings.append(_drift(clocks))
    return findings


def _rate(name: str, period: float, rate_hz: float) -> Finding:
    if period <= 0.0:
        return Finding(name, "rate", None, "all messages came at once")
    found = 1.0 / period
    ok = abs(found / rate_hz - 1.0) <= RATE_TOLERANCE
    text = f"{found:.1f} Hz (interval {1e3 * period:.3f} ms)"
    return Finding(name, "rate", ok, text if ok else f"{text}, expected {rate_hz:g} Hz")


def _arrivals(clocks: _Clocks, period: float) -> list[Finding]:
    """Judge the intervals between receptions; this computer has a part in them."""
    intervals = seconds(np.diff(clocks.receives))
    middle, high = np.percentile(intervals, [50, 99])
    jitter = float(high - middle)
    smooth = jitter <= RECEIVE_JITTER * period
    text = f"99 % of the messages come within {1e3 * jitter:.3f} ms of the median interval"
    hint = "" if smooth else ": in bursts, or this computer or the network is slow"
    late = float(np.mean(intervals > LATE_PERIODS * period))
    longest = f"longest interval {1e3 * intervals.max():.2f} ms"
    few = None if late <= LOST_SHARE else False
    share = f"{late:.2%} come more than {LATE_PERIODS:g} periods after the one before, {longest}"
    return [
        Finding(clocks.name, "jitter", smooth or None, text + hint),
        Finding(clocks.name, "late", True if late == 0.0 else few, share if late else longest),
    ]


def _order(clocks: _Clocks) -> Finding:
    name, stamps = clocks.name, clocks.stamps
    zeros = int(np.sum(stamps == 0))
    if zeros == len(stamps):
        return Finding(name, "stamps", False, "all stamps are 0: header.stamp is not filled")
    steps = np.diff(stamps)
    same, back = int(np.sum(steps == 0)), int(np.sum(steps < 0))
    faults = [f"{zeros} are 0"] * (zeros > 1) + [f"{same} repeat the one before"] * (same > 0)
    if back:
        faults.append(f"{back} go back, by up to {-steps.min() * 1e-9:.6g} s")
    if not faults:
        return Finding(name, "stamps", True, "strictly increasing")
    text = f"of {len(stamps)} stamps {', '.join(faults)}, expected: strictly increasing"
    return Finding(name, "stamps", False, text)


def _stamp_jitter(name: str, forward: Array, period: float) -> Finding:
    # Intervals over a lost message belong to the gaps.
    whole = forward[forward < 1.5 * period]
    jitter = float(np.percentile(whole, 99) - np.median(whole))
    ok = jitter <= STAMP_JITTER * period
    text = f"99 % of the stamp intervals are within {1e3 * jitter:.3f} ms of the median"
    hint = "" if ok else ": stamped when sent or received rather than when measured?"
    return Finding(name, "stamp_jitter", ok or None, text + hint)


def _gaps(name: str, forward: Array, period: float) -> Finding:
    lost = _missing(forward / period)
    share = lost / (lost + len(forward) + 1)
    if not lost:
        return Finding(name, "gaps", True, "no message is missing between the stamps")
    text = f"{lost} messages ({share:.2%}) are missing, longest gap {1e3 * forward.max():.2f} ms"
    if share <= LOST_SHARE:
        return Finding(name, "gaps", None, f"{text}: lost by the driver, the network or here")
    return Finding(name, "gaps", False, text)


def _missing(steps: Array) -> int:
    """Return how many messages are missing, from the intervals in periods.

    A late stamp makes one interval longer and the next as much shorter; a lost message does not.
    """
    neighbours = np.concatenate([[1.0], steps, [1.0]])
    both = steps + np.minimum(neighbours[:-2], neighbours[2:])
    lost = np.where((steps > 1.5) & (both > 2.5), np.round(steps) - 1.0, 0.0)
    return int(lost.sum())


def _offset(clocks: _Clocks) -> Finding:
    age = float(np.median(clocks.age))
    side = "behind" if age > 0 else "ahead of"
    text = f"stamps are {abs(age):.1f} s {side} this computer's clock"
    if abs(age) <= LARGEST_OFFSET:
        text = f"stamps within {LARGEST_OFFSET:g} s of this computer's clock"
        return Finding(clocks.name, "clock", True, text)
    return Finding(clocks.name, "clock", False, f"{text}: {_reason(clocks, age)}")


def _reason(clocks: _Clocks, age: float) -> str:
    if age > 0 and np.median(clocks.stamps) * 1e-9 < YEAR:
        return "they count from a start, as in a simulation or since switching on, not from 1970"
    for offset, reason in _KNOWN_OFFSETS.items():
        if abs(age + offset) < LARGEST_OFFSET:
            return reason
    if abs(age) < 86400.0 and abs(age - 900.0 * round(age / 900.0)) < 2.0:
        return "another time zone or unsynchronised clocks"
    return "unsynchronised clocks"


def _delay(clocks: _Clocks, expected: float) -> Finding:
    age = clocks.age
    middle, high = float(np.median(age)), float(np.percentile(age, 99))
    if middle < -EARLY:
        text = f"stamps are {-1e3 * middle:.2f} ms ahead of their reception: clocks differ"
        return Finding(clocks.name, "delay", False, text)
    text = f"stamps are {1e3 * middle:.2f} ms old when received (median; 99 %: {1e3 * high:.2f} ms)"
    allowed = expected + max(DELAY_MARGIN, 2.0 * clocks.period)
    if middle <= allowed:
        return Finding(clocks.name, "delay", True, text)
    text += f", the test-bed says {1e3 * expected:g} ms: a delay, or clocks that differ"
    return Finding(clocks.name, "delay", None, text)


def _drift(clocks: _Clocks) -> Finding:
    """Judge the slope of the messages' age over the whole window and over its halves.

    Delays are one-sided, so the least age of each block shows the clocks' difference; the slope is
    the median of all slopes between two blocks (Theil, Sen).
    """
    name = clocks.name
    count = min(DRIFT_BLOCKS, len(clocks.stamps) // 4)
    if count < FEWEST_BLOCKS:
        return Finding(name, "drift", None, f"{len(clocks.stamps)} messages, too few to judge")
    blocks = np.array_split(clocks.age, count)
    times = np.array_split(seconds(clocks.stamps - clocks.stamps[0]), count)
    ages = np.array([block.min() for block in blocks]) - blocks[0][0]
    at = np.array([t[np.argmin(b)] for b, t in zip(blocks, times, strict=True)])
    half = count // 2
    slope, low, high = _speed_up(at, ages)
    _, low1, high1 = _speed_up(at[:half], ages[:half])
    _, low2, high2 = _speed_up(at[half:], ages[half:])
    text = f"stamps run {abs(slope):.0f} ppm {'fast' if slope > 0 else 'slow'}"
    text += f" (99 %: {low:.0f} to {high:.0f} ppm) against this computer's clock"
    if max(abs(low), abs(high)) <= LARGEST_DRIFT:
        return Finding(name, "drift", True, text)
    # A queue that fills makes a slope as well, but not the same one all the time.
    significant = min(low, low1, low2) > LARGEST_DRIFT or max(high, high1, high2) < -LARGEST_DRIFT
    hint = "" if significant else "; listen longer to decide"
    return Finding(name, "drift", False if significant else None, text + hint)


def _speed_up(at: Array, ages: Array) -> tuple[float, float, float]:
    """Return by how much the stamps' clock is faster, and 99 % bounds of that [ppm].

    The bounds of Theil and Sen are those of independent ages. A queue gives its messages common
    delays, so the bounds are widened as for a first-order autoregression (Bayley, Hammersley 1946).
    """
    fit = scipy.stats.theilslopes(ages, at, 0.99)
    rest = ages - fit.slope * at
    rest -= rest.mean()
    memory = float(np.clip(rest[1:] @ rest[:-1] / max(rest @ rest, 1e-300), 0.0, 0.99))
    wider = np.sqrt((1.0 + memory) / (1.0 - memory))
    low, high = (fit.slope + wider * (end - fit.slope) for end in (fit.low_slope, fit.high_slope))
    # A clock that runs fast makes its messages look ever younger.
    return -1e6 * fit.slope, -1e6 * high, -1e6 * low
