"""Several methods on the same recordings, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from bench.blind.scoring.scorecard import is_clear, scorecard

Data = Mapping[str, Any]

_SHARES = (
    *("detected", "block", "element", "region", "first", "tied", "nothing_wrong_beside"),
    *("false_alarm", "parameter_called_effect", "unknown_recognised", "false_unknown", "failed"),
)


def comparison(truth: Data, results: Mapping[str, Mapping[str, Data]]) -> list[dict[str, Any]]:
    """Return one row of scores per method, in the order given.

    Only recordings that all of them were given are counted.

    Args:
        truth: as the truth file has it.
        results: by method and recording, see `judge`.
    """
    common = set.intersection(*(set(found) for found in results.values()))
    rows = []
    for method, found in results.items():
        card = scorecard(truth, {name: found[name] for name in found if name in common})
        outcomes = card["outcomes"]
        clear = [o for o in outcomes if is_clear(o["kind"], o["multiple"])]
        fits = [o["fit"] for o in clear if o["fit"] is not None]
        rows.append(
            {
                "method": method,
                "scored": card["scored"],
                **{key: card["shares"][key] for key in _SHARES},
                "false_alarm_upper": card["shares"]["false_alarm_upper"],
                "mean_tie_size": card["shares"]["mean_tie_size"],
                "wrong_per_recording": sum(o["wrong"] for o in outcomes) / max(1, len(outcomes)),
                "parameter_error": card["parameters"]["median_error"],
                "covered": card["parameters"]["covered"],
                "near_floor": card["fit"]["near_floor"],
                "below_retuned": card["fit"]["below_retuned"],
                **_stages(fits),
                "seconds": card["seconds"]["median"],
            }
        )
    return rows


def _stages(fits: Sequence[tuple[float, float, float]]) -> dict[str, float | None]:
    """Return the median held-out errors before, re-tuned and after."""
    names = ("before", "retuned", "after")
    return {name: median(f[k] for f in fits) if fits else None for k, name in enumerate(names)}
