"""Figures of results/steep-sea.md that follow from several runs, as rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.markdown import markdown_table
from bench.results.result_cases import ROUGHEST
from bench.results.result_measures import LIMIT_PERIOD
from bench.results.result_tables import THESIS_TABLES, Found

Array = NDArray[np.float64]

SURGE, SWAY, HEAVE = range(3)
# Runs at 4 m, and the least errors that what they plan with allows.
DEEP_PLANS = {
    "worst case, 4 m, the whole 200 s": "worst case, 4 m, tensions from 0.6 N on",
    "worst case, 4 m, 200 s, tensions wanted from 0.3 N, planned from 0.5 N": (
        "worst case, 4 m, tensions from 0.5 N on"
    ),
    "worst case, 4 m, 200 s, tensions wanted from 0.3 N, planned from 0.8 N": (
        "worst case, 4 m, tensions from 0.8 N on"
    ),
}
ROUGHEST_PLAN = f"{ROUGHEST}, tensions from 0.7 N on"
ROUGHEST_SEED = "seed 9"
# Of the worst case with all six coordinates.
DURATION_MS = 200_000.0
STEPS_OF_SWAY = (
    "fastest loops, and no wave shorter than 4 s",
    "no wave shorter than 4 s, sway with 1.75 times that gain",
)


def _rms(found: Mapping[str, Any]) -> Array:
    """Return a run's RMS errors, (6,) [mm, mrad]."""
    return 1e3 * np.array(found["rms"])


def beam_ratios(found: Found) -> str:
    """Return how many times the thesis's errors those of a calm sea from abeam are."""
    thesis = THESIS_TABLES["calm"][1]
    rows = [
        [name, f"{rms[SWAY] / thesis[SWAY]:.2g}", f"{rms[HEAVE] / thesis[HEAVE]:.2g}"]
        for name, rms in ((name, _rms(found[name])) for name in STEPS_OF_SWAY)
    ]
    return markdown_table(["RMS error ÷ the thesis's", "sway", "heave"], rows)


def deep_ratios(found: Found) -> str:
    """Return how near runs at 4 m come to the least errors that their plans allow."""
    ratios = [
        _rms(found[run])[: SWAY + 1] / (1e3 * np.array(found[plan])[: SWAY + 1])
        for run, plan in DEEP_PLANS.items()
    ]
    rows = [["surge and sway", f"{np.min(ratios):.2f} to {np.max(ratios):.2f}"]]
    return markdown_table(["RMS error ÷ the least that its plan allows", "all plans"], rows)


def six_figures(found: Found) -> str:
    """Return what the largest error with all six coordinates is beside the least, and slack."""
    rough, least = _rms(found[ROUGHEST_SEED])[SURGE], 1e3 * found[ROUGHEST_PLAN][SURGE]
    seeds = [each for name, each in found.items() if name.startswith("seed ")]
    beyond = sum(bool((_rms(each)[:3] > 2.0).any()) for each in seeds)
    slack = [DURATION_MS * each["slack"] for each in seeds if each["slack"] > 0.0]
    rows = [
        ["seeds with an RMS error above 2 mm", f"{beyond} of {len(seeds)}"],
        [f"{ROUGHEST_SEED}, surge ÷ the least that its plan allows", f"{rough / least:.2f}"],
        ["seeds in which a cable goes slack", f"{len(slack)} of {len(seeds)}"],
        ["longest that one is slack [ms]", f"{max(slack, default=0.0):.0f}"],
    ]
    return markdown_table(["all six coordinates", ""], rows)


def first_limit(found: Found) -> str:
    """Return when the limit of the worst case is met for the first time."""
    (least,) = found.values()
    first = LIMIT_PERIOD * int(np.argmax(np.array(least) < 0.3))
    rows = [["first instant without tensions from 0.3 N on [s]", f"{first:.0f}"]]
    return markdown_table(["worst case", ""], rows)
