"""What a campaign amounts to: spread of its metrics, what moves them, and its worst runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from cspm.campaign.campaign import Campaign, worst
from cspm.campaign.task import STATUS
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]
Row = Mapping[str, Any]

# Columns that say of a run what its summary says, and how a person reads them.
_LINEAR = DOFS[:3]
_SHARES = ("slack_share", "infeasible_share")
_WORST = 5
# Heads of a table of spreads, with their keys in `summary_of`.
SPREAD = {"least": "least", "median": "median", "95 %": "p95", "largest": "largest"}
# What differs between runs without being a cause.
_DRAWN = "seed"
# Runs below which no correlation is worth its number.
_LEAST_RUNS = 8
# What workers say of a run that is no measure of the machine.
_ABOUT = ("run", "seed", "duration_s", "simulated_s", "elapsed_s", "processor_s")


class Reading(NamedTuple):
    """How a column is read: what it is, and its unit as shown, `scale` of it to one in SI."""

    name: str
    unit: str
    scale: float


def reading_of(column: str) -> Reading:
    """Return how a column is shown to people."""
    what, _, rest = column.partition(".")
    if what == "errors":
        dof, _, kind = rest.partition(".")
        unit = "mm" if dof in _LINEAR else "mrad"
        return Reading(f"{dof} error, {'largest' if kind == 'max' else 'RMS'}", unit, 1e3)
    if what == "tension":
        return Reading(
            {"min": "lowest tension", "max": "highest tension"}.get(rest, rest), "N", 1.0
        )
    if column in _SHARES:
        name = "a cable slack" if column == _SHARES[0] else "wrench infeasible"
        return Reading(f"{name}, share of time", "%", 1e2)
    return Reading(column, "", 1.0)


def metrics_of(rows: Sequence[Row], axes: Sequence[str]) -> list[str]:
    """Return the columns that a page shows: largest errors, tensions, shares and own functions."""
    names = dict.fromkeys(name for row in rows for name in row)
    own = [
        name
        for name in names
        if name not in axes
        and name not in _ABOUT
        and not name.startswith(("errors.", "tension.", "diagnosis."))
        and name not in _SHARES
        and any(isinstance(row.get(name), float) for row in rows)
    ]
    errors = [f"errors.{dof}.max" for dof in DOFS]
    wanted = (*errors, "tension.min", "tension.max", *_SHARES, *own)
    return [name for name in wanted if name in names]


def spread_cells(spread: Mapping[str, Any], digits: int) -> list[str]:
    """Return the numbers of one metric's spread in its unit, in the order of `SPREAD`."""
    return [f"{spread['scale'] * spread[key]:.{digits}g}" for key in SPREAD.values()]


def axes_of(campaign: Campaign) -> list[str]:
    """Return the keys that differ between runs, in the file's order."""
    names = dict.fromkeys(key for each in campaign.variants for key in each.values)
    return [
        name
        for name in names
        if len({repr(each.values.get(name)) for each in campaign.variants}) > 1
    ]


def summary_of(campaign: Campaign) -> dict[str, Any]:
    """Return plain data of what a campaign amounts to; metrics in SI, `scale` to their units."""
    rows, axes = campaign.rows, axes_of(campaign)
    metrics = metrics_of(rows, axes)
    return {
        "name": campaign.file.name,
        "runs": len(campaign.variants),
        "ended": len(rows),
        "status": dict(Counter(row[STATUS] for row in rows)),
        "verdicts": dict(Counter(row["diagnosis.verdict"] for row in rows if _judged(row))),
        "metrics": {name: _spread(rows, name) for name in metrics if _numbers(rows, name).size},
        "sensitivities": _sensitivities(rows, axes, metrics),
        "worst": _worst_runs(campaign, metrics),
    }


def _judged(row: Row) -> bool:
    return row.get("diagnosis.verdict") is not None


def _numbers(rows: Sequence[Row], name: str) -> Array:
    return np.array([row[name] for row in rows if isinstance(row.get(name), (int, float))])


def _spread(rows: Sequence[Row], name: str) -> dict[str, Any]:
    values, reading = _numbers(rows, name), reading_of(name)
    return {
        "what": reading.name,
        "unit": reading.unit,
        "scale": reading.scale,
        "least": float(values.min()),
        "median": float(np.median(values)),
        "p95": float(np.quantile(values, 0.95)),
        "largest": float(values.max()),
    }


def _sensitivities(
    rows: Sequence[Row], axes: Sequence[str], metrics: Sequence[str]
) -> dict[str, dict[str, dict[str, float]]]:
    """Return Spearman's rank correlation of each metric with each axis of numbers.

    An axis is left out where runs are too few or its values are no numbers; so are seeds.
    """
    found: dict[str, dict[str, dict[str, float]]] = {}
    for axis in axes:
        if axis == _DRAWN:
            continue
        for metric in metrics:
            pairs = [
                (number_of(row.get(axis)), row[metric])
                for row in rows
                if isinstance(row.get(metric), (int, float))
            ]
            known = np.array([pair for pair in pairs if pair[0] is not None], dtype=float)
            if len(known) >= _LEAST_RUNS and np.all(np.ptp(known, axis=0) > 0.0):
                rank = spearmanr(known[:, 0], known[:, 1])
                entry = {"rho": float(rank.statistic), "p": float(rank.pvalue)}
                found.setdefault(axis, {})[metric] = entry
    return found


def number_of(value: object) -> float | None:
    """Return a number; what is absent, as an effect that is not there, counts as 0."""
    if value is None:
        return 0.0
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if is_number else None  # type: ignore[arg-type]


def _worst_runs(campaign: Campaign, metrics: Sequence[str]) -> list[dict[str, Any]]:
    """Return the worst runs by what the file says, or by the first metric."""
    column = campaign.file.recordings.of or next(iter(metrics), None)
    if column is None or not campaign.rows:
        return []
    return [
        {
            "run": row["run"],
            "metric": column,
            "value": row[column],
            "command": campaign.command_of(row["run"]),
        }
        for row in worst(campaign.rows, column)[:_WORST]
    ]
