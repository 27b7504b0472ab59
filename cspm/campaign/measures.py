"""What a campaign measures of a run: its columns."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from cspm.diagnosis import Diagnosis
from cspm.simulation import Run
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_sim.effects.own_files import run_file

Metric = Callable[[Run], Any]
Columns = dict[str, Any]


def run_columns(run: Run) -> Columns:
    """Return errors [m, rad], tensions [N] and shares of a run, by column.

    Without a bar there are no errors.
    """
    result = run._result
    statistics = result.statistics
    found: Columns = {"simulated_s": run.duration}
    if result.has_bar:
        for dof, peak, rms in zip(DOFS, statistics.max_error, statistics.rms_error, strict=True):
            found[f"errors.{dof}.max"], found[f"errors.{dof}.rms"] = float(peak), float(rms)
    found["tension.min"], found["tension.max"] = statistics.tension_range
    for name, low, high in zip(
        run.testbed.cables, statistics.lowest_tensions, statistics.highest_tensions, strict=True
    ):
        found[f"tension.{name}.min"], found[f"tension.{name}.max"] = float(low), float(high)
    found["slack_share"] = statistics.slack_share
    found["infeasible_share"] = statistics.infeasible_share
    found["warnings"] = "; ".join(run.summary["warnings"])
    return found


def own_columns(run: Run, metrics: Mapping[str, Metric]) -> Columns:
    """Return what the user's own functions measure of a run.

    Args:
        run: with all its signals.
        metrics: by the name as the campaign's file has it. Each returns a number, or a mapping of
            names to numbers.

    Raises:
        InputError: one failed, or returned something else.
    """
    found: Columns = {}
    for name, metric in metrics.items():
        column = name.rpartition(":")[2]
        try:
            value = metric(run)
        except Exception as err:  # whatever somebody's code does
            raise InputError(f"{name}: {type(err).__name__}: {err}") from err
        parts = value if isinstance(value, Mapping) else {"": value}
        for part, number in parts.items():
            found[f"{column}.{part}" if part else column] = _number(number, name)
    return found


def diagnosis_columns(found: Diagnosis) -> Columns:
    """Return the verdict of a diagnosis, and what it finds first."""
    first = found.findings[0] if found.findings else None
    return {
        "diagnosis.verdict": found.verdict,
        "diagnosis.effect": first.effect if first else None,
        "diagnosis.elements": " ".join(first.elements) if first else None,
        "diagnosis.probability": first.probability if first else None,
        "diagnosis.findings": len(found.findings),
    }


def load_metric(name: str, file: Path | None) -> Metric:
    """Return a function by `FILE.py:FUNCTION`, the file at `file`, or by `MODULE:FUNCTION`.

    Raises:
        InputError: there is none.
    """
    place, _, function = name.rpartition(":")
    try:
        module = import_module(place) if file is None else _module_at(file, file.read_bytes())
        found = getattr(module, function)
    except Exception as err:  # whatever somebody's code does when it is loaded
        raise InputError(f"metrics: {name}: {type(err).__name__}: {err}") from err
    if not callable(found):
        raise InputError(f"metrics: {name}: no function, allowed: one that takes a run")
    metric: Metric = found
    return metric


@lru_cache(maxsize=16)
def _module_at(path: Path, content: bytes) -> ModuleType:
    return run_file(path, f"cspm_metric_{hashlib.sha256(content).hexdigest()[:12]}")


def _number(value: object, name: str) -> float | None:
    """Return a number, None for one that is not finite."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(f"{name}: returned {value!r}, allowed: numbers") from None
    return number if math.isfinite(number) else None
