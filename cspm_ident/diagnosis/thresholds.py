"""Every constant that decides what a diagnosis reports, with its meaning and its basis.

Constants of the numerics alone, such as lengths of filters and numbers of iterations, stay beside
the code that uses them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from difflib import get_close_matches
from math import isfinite
from typing import Any

from cspm_ident.diagnosis.threshold_groups.regression_thresholds import RegressionThresholds
from cspm_ident.diagnosis.threshold_groups.reporting_thresholds import ReportingThresholds
from cspm_ident.diagnosis.threshold_groups.residual_thresholds import ResidualThresholds
from cspm_ident.diagnosis.threshold_groups.selection_thresholds import SelectionThresholds
from cspm_ident.diagnosis.threshold_groups.validation_thresholds import ValidationThresholds
from cspm_msgs_py.errors import InputError

# By the stage that uses them, in the order of the stages.
GROUPS: tuple[type[Any], ...] = (
    ResidualThresholds,
    RegressionThresholds,
    SelectionThresholds,
    ValidationThresholds,
    ReportingThresholds,
)


@dataclass(frozen=True)
class Thresholds(
    ReportingThresholds,
    ValidationThresholds,
    SelectionThresholds,
    RegressionThresholds,
    ResidualThresholds,
):
    """All thresholds of a diagnosis; `docs/reference/thresholds.md` lists them.

    Each field has metadata `unit`, `low`, `high`, `meaning` and `basis`.

    Raises:
        InputError: a value is not a number, or outside its range.

    Example:
        `diagnose(searched, thresholds=Thresholds(false_alarm_rate=0.001))`
    """

    def __post_init__(self) -> None:
        """Refuse values that are no numbers of the allowed range."""
        for each in fields(self):
            _check(each.name, getattr(self, each.name), each.metadata)

    @property
    def values(self) -> dict[str, float]:
        """All values by name, as `diagnosis.json` has them."""
        return asdict(self)


def _check(name: str, value: float, known: Mapping[str, Any]) -> None:
    whole = known["unit"] == "count"
    number = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
    if number and isfinite(value) and known["low"] <= value <= known["high"]:
        return
    ends = f"{known['low']:g} or more"
    if isfinite(known["high"]):
        ends = f"{known['low']:g} to {known['high']:g}"
    kind = "a whole number, " if whole else ""
    raise InputError(f"thresholds: {name} is {value}, allowed: {kind}{ends}")


DEFAULT_THRESHOLDS = Thresholds()


def thresholds_of(values: Mapping[str, float]) -> Thresholds:
    """Return the default thresholds with some at other values.

    Args:
        values: by name.

    Raises:
        InputError: there is no such threshold, or its value is not allowed.
    """
    known = [each.name for each in fields(Thresholds)]
    for name in values:
        if name not in known:
            near = get_close_matches(name, known) or ["those of docs/reference/thresholds.md"]
            raise InputError(f"thresholds: no {name}, allowed: {', '.join(near)}")
    return replace(DEFAULT_THRESHOLDS, **dict[str, Any](values))
