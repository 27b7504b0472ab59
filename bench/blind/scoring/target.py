"""What a benchmark's shares are to reach."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

Range = tuple[float, float]


class Judged(NamedTuple):
    """A share of a scorecard beside its target.

    Attributes:
        label: what it is of.
        found: hits, cases and the ends of the interval, as `Share` or a list.
        target: what it is to reach, in words; empty where there is no target.
    """

    label: str
    found: Sequence[float]
    target: str


FINDINGS = (
    ("block", "block found", "≥ 97 %"),
    ("block_tied", "block found, or tied with what was", ""),
    ("element", "element found", "≥ 93 %"),
    ("first", "effect and elements named first", "≥ 85 %"),
    ("named", "all named by some finding", ""),
    ("effect_only", "all named, on whatever elements", ""),
    ("tied", "truth among the ties", "≥ 97 %"),
    ("detected", "anything found", ""),
    ("nothing_wrong_beside", "all named, and nothing wrong beside", ""),
    ("false_alarm", "alarm where there is nothing", "≤ 3 %"),
    ("parameter_called_effect", "wrong number called an effect", ""),
    ("unknown_recognised", "unknown recognised", "≥ 75 %"),
    ("false_unknown", "unknown where the catalogue has it", "≤ 8 %"),
    ("failed", "diagnosis failed", ""),
)


NUMBERS = (
    ("covered", "intervals that hold the truth", "90 to 97 %"),
    ("near_floor", "held-out error within 1.5 × floor", "all"),
    ("below_retuned", "held-out error below re-tuned", "≥ 95 %"),
)


def findings_judged(card: Mapping[str, Any]) -> list[Judged]:
    """Return the shares of what was found."""
    return [Judged(label, card["shares"][key], target) for key, label, target in FINDINGS]


def numbers_judged(card: Mapping[str, Any]) -> list[Judged]:
    """Return the shares of parameters and fits."""
    found = {**card["fit"], "covered": card["parameters"]["covered"]}
    return [Judged(label, found[key], target) for key, label, target in NUMBERS]


def allowed(target: str) -> Range:
    """Return between what a target holds; shares are of 1."""
    if target == "all":
        return 1.0, 1.0
    numbers = [float(number) for number in re.findall(r"[\d.]+", target)]
    unit = 100.0 if target.endswith("%") else 1.0
    if target.startswith("≥"):
        return numbers[0] / unit, 1.0
    return (numbers[0] / unit if len(numbers) > 1 else 0.0), numbers[-1] / unit
