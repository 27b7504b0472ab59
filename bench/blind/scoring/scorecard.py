"""A benchmark's scorecard: shares with intervals, by amount and by stratum, and every miss."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from statistics import median
from typing import Any

from bench.blind.scoring.floor import healthy_floors
from bench.blind.scoring.outcome import (
    EFFECT,
    FAILED,
    KINDS,
    NOTHING,
    OUTSIDE,
    PARAMETER,
    Estimate,
    Outcome,
    judge,
)
from bench.blind.scoring.share import share, upper_bound

SCHEMA = "cspm.blind-score/1"
# In units of the detection limit, from which on the targets hold.
CLEAR = 2.0
NEAR_FLOOR = 1.5
_BINS = (0.0, 0.5, 0.8, 0.95, 1.0)


def scorecard(truth: Mapping[str, Any], results: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the scores of all recordings that were diagnosed, as plain data.

    Args:
        truth: as the truth file has it.
        results: by recording, see `judge`.
    """
    floors, items = healthy_floors(truth, results), truth["items"]
    outcomes = [judge(i, results[i["name"]], floors) for i in items if i["name"] in results]
    clear = [o for o in outcomes if is_clear(o.kind, o.multiple)]
    return {
        "schema": SCHEMA,
        "asked": truth["asked"],
        "drawn": len(truth["items"]),
        "scored": len(outcomes),
        "shares": _shares(outcomes, clear),
        "by_multiple": _by_multiple(outcomes),
        "by_stratum": _by_stratum(outcomes),
        "confusion": _confusion(outcomes),
        "effects": _effects(outcomes),
        "parameters": _parameters(outcomes),
        "onsets": _onsets(outcomes),
        "fit": _fit(outcomes),
        "calibration": _calibration(outcomes),
        "seconds": _seconds(outcomes),
        "outcomes": [asdict(o) for o in outcomes],
    }


def is_clear(kind: str, multiple: float) -> bool:
    """Return whether the targets hold of a case.

    Args:
        kind: as an outcome has it.
        multiple: of the detection limit.
    """
    return kind in (EFFECT, PARAMETER) and multiple >= CLEAR


def _shares(outcomes: Sequence[Outcome], clear: Sequence[Outcome]) -> dict[str, Any]:
    # No diagnosis is no silence.
    blank = [o for o in outcomes if o.kind == NOTHING and o.verdict != FAILED]
    numbers = [o for o in outcomes if o.kind == PARAMETER]
    outside = [o for o in outcomes if o.kind == OUTSIDE]
    inside = [o for o in outcomes if o.kind != OUTSIDE]
    alarms = sum(o.detected for o in blank)
    regions = [reported for o in outcomes for reported in o.regions]
    return {
        "detected": share(o.detected for o in clear),
        "block": share(o.block for o in clear),
        "block_tied": share(o.block_tied for o in clear),
        "element": share(o.element for o in clear),
        "first": share(o.first for o in clear),
        "named": share(o.named for o in clear),
        "effect_only": share(o.effect_only for o in clear),
        "tied": share(o.tied for o in clear),
        "nothing_wrong_beside": share(o.named and not o.wrong for o in clear),
        "false_alarm": share(o.detected for o in blank),
        "false_alarm_upper": upper_bound(alarms, len(blank)),
        "parameter_called_effect": share(o.verdict == EFFECT for o in numbers),
        "unknown_recognised": share(o.unknown for o in outside),
        "driver": share(o.driver for o in outside if o.driver is not None),
        "false_unknown": share(o.unknown for o in inside),
        "failed": share(o.verdict == FAILED for o in outcomes),
        "region_reported": share(reported is not None for reported in regions),
        "region": share(reported for reported in regions if reported is not None),
        "mean_tie_size": _mean([float(s) for o in clear for s in o.tie_sizes]),
    }


def _by_multiple(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    rows = []
    known = [o for o in outcomes if o.kind in (EFFECT, PARAMETER)]
    for multiple in sorted({o.multiple for o in known}):
        these = [o for o in known if o.multiple == multiple]
        rows.append(
            {
                "multiple": multiple,
                "detected": share(o.detected for o in these),
                "tied": share(o.tied for o in these),
                "named": share(o.named for o in these),
            }
        )
    return rows


def _by_stratum(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    rows = []
    for stratum in sorted({o.stratum for o in outcomes}):
        these = [o for o in outcomes if o.stratum == stratum]
        rows.append(
            {
                "stratum": stratum,
                "cases": len(these),
                "detected": sum(o.detected for o in these),
                "block": sum(o.block for o in these),
                "element": sum(o.element for o in these),
                "tied": sum(o.tied for o in these),
                "named": sum(o.named for o in these),
                "region": share(
                    reported for o in these for reported in o.regions if reported is not None
                ),
                "wrong": sum(o.wrong for o in these),
                "failed": sum(o.verdict == FAILED for o in these),
            }
        )
    return rows


def _confusion(outcomes: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    return {kind: dict(Counter(o.verdict for o in outcomes if o.kind == kind)) for kind in KINDS}


def _effects(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Return which effect was named where which was concealed, the most frequent first."""
    pairs: Counter[tuple[str, str]] = Counter()
    for outcome in outcomes:
        concealed = " + ".join(effect for effect, _ in outcome.truth) or NOTHING
        said = outcome.found[0][0] if outcome.found else outcome.verdict
        pairs[concealed, said] += 1
    return [
        {"concealed": concealed, "named_first": said, "cases": cases}
        for (concealed, said), cases in sorted(pairs.items())
    ]


def _parameters(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    estimates = [e for o in outcomes for e in o.estimates]
    errors = [abs(e.error) for e in estimates]
    return {
        "estimates": len(estimates),
        "median_error": median(errors) if errors else None,
        "within_a_tenth": share(error <= 0.1 for error in errors),
        "covered": share(e.covered for e in estimates if e.covered is not None),
        "by_effect": [
            {
                "effect": effect,
                "estimates": len(own),
                "median_signed_error": median(e.error for e in own),
                "covered": share(e.covered for e in own if e.covered is not None),
            }
            for effect, own in sorted(_by_effect(estimates).items())
        ],
    }


def _by_effect(estimates: Sequence[Estimate]) -> dict[str, list[Estimate]]:
    found: dict[str, list[Estimate]] = {}
    for estimate in estimates:
        found.setdefault(estimate.effect, []).append(estimate)
    return found


def _onsets(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    reported = [b for o in outcomes for b in o.beginnings]
    late = [b for b in reported if b.true > 0.0]
    errors = [abs(b.reported - b.true) for b in late if b.reported is not None]
    return {
        "reported": share(b.reported is not None for b in late),
        "held": share(b.held for b in late if b.held is not None),
        "median_error_s": median(errors) if errors else None,
        "false": share(b.reported is not None for b in reported if b.true == 0.0),
        "right": share(bool(b.held) if b.true > 0.0 else b.reported is None for b in reported),
    }


def _fit(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    # What is reported as unknown adds nothing to the model.
    named = [o.fit for o in outcomes if o.named and o.fit is not None and o.kind != OUTSIDE]
    # A wrong number is what re-tuning mends as well.
    effects = [o.fit for o in outcomes if o.named and o.fit is not None and o.kind == EFFECT]
    return {
        "cases": len(named),
        "before": median(f[0] for f in named) if named else None,
        "retuned": median(f[1] for f in named) if named else None,
        "after": median(f[2] for f in named) if named else None,
        "near_floor": share(f[2] <= NEAR_FLOOR for f in named),
        "below_retuned": share(f[2] < f[1] for f in effects),
    }


def _calibration(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    said = [p for o in outcomes for p in o.probabilities]
    rows = []
    for low, high in pairwise(_BINS):
        last = high == _BINS[-1]
        these = [(p, right) for p, right in said if low <= p < high or (last and p == high)]
        rows.append(
            {
                "from": low,
                "to": high,
                "said": _mean([p for p, _ in these]),
                "right": share(right for _, right in these),
            }
        )
    return rows


def _seconds(outcomes: Sequence[Outcome]) -> dict[str, float | None]:
    times = [o.seconds for o in outcomes]
    return {"median": median(times) if times else None, "max": max(times, default=None)}


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
