"""What is measured for results/steep-sea.md, each as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.results.feasibility import gathered_deviations, least_errors, least_tensions
from bench.results.tracking import Case, motions_of_bundle, track, within_requirement

LIMIT_PERIOD = 0.2
BINS = 1000


def tracking(case: Case) -> dict[str, object]:
    """Return how well a case follows its reference."""
    return track(case).data()


def limit(case: Case) -> list[float]:
    """Return the highest lower tension limit [N] that allows a case's reference, over time."""
    bundle = case.bundle()
    times = np.arange(0.0, bundle.scenario.duration, LIMIT_PERIOD)
    # JSON knows no infinity.
    return [float(each) for each in np.maximum(least_tensions(bundle, times), -1e9)]


def possible(case: Case, lower: float) -> list[float]:
    """Return the least RMS error [m, rad] that tensions from `lower` [N] on allow."""
    return [float(each) for each in least_errors(case.bundle(), lower)]


def possible_share(case: Case, lower: float, least: list[float]) -> float:
    """Return which share of the possible time can be within the requirement.

    With tensions from `lower` [N] on, of the time in which the case's limit `least` is not below 0.
    """
    bundle = case.bundle()
    possible_time: NDArray[np.bool_] = np.array(least) >= 0.0
    times = LIMIT_PERIOD * np.arange(len(least))
    within = within_requirement(bundle, gathered_deviations(bundle, lower, times))
    return float(within[possible_time].mean())


def moved_on(case: Case, delay: float) -> list[float]:
    """Return by how much the reference moves on within `delay` [s], RMS (6,) [m, rad]."""
    bundle = case.bundle()
    reference = motions_of_bundle(bundle)["/bar/reference"]
    times = np.arange(0.0, bundle.scenario.duration, 0.01)
    rates = np.array([reference.at(time)[6:12] for time in times])
    return [float(each) for each in delay * np.sqrt((rates**2).mean(axis=0))]


def past_thesis(case: Case, least: list[float]) -> dict[str, Any]:
    """Return errors and tensions of a case, and what of it falls into the possible time.

    `least` is the case's limit.
    """
    bundle = case.bundle()
    errors, tensions, missed, failure = case.run()
    stride = round(LIMIT_PERIOD * bundle.scenario.rates.plant)
    sampled = within_requirement(bundle, errors)[::stride]
    possible_time: NDArray[np.bool_] = np.array(least)[: len(sampled)] >= 0.0
    return {
        "rms": np.sqrt((errors**2).mean(axis=0)).tolist(),
        "within_feasible": float(sampled[possible_time].mean()),
        "available": float(possible_time.mean()),
        "least": float(tensions.min()),
        "slack": float((tensions <= 0.0).any(axis=1).mean()),
        "not_met": float(missed.mean()),
        "failure": failure,
    }


def bands(case: Case) -> dict[str, Any]:
    """Return lowest and highest error [mm, mrad] and the least tension [N] per bin of time."""
    bundle = case.bundle()
    errors, tensions, _, _ = case.run()
    size = -(-len(errors) // BINS)
    starts = np.arange(0, len(errors), size)
    return {
        "times": (starts / bundle.scenario.rates.plant).tolist(),
        "low": (1e3 * np.minimum.reduceat(errors, starts)).tolist(),
        "high": (1e3 * np.maximum.reduceat(errors, starts)).tolist(),
        "least": np.minimum.reduceat(tensions.min(axis=1), starts).tolist(),
    }
