"""What a diagnosis says of a data set, held against what is true."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from bench.real.dataset import Dataset
from cspm_ident.diagnosis.reporting.verdict import UNKNOWN, named_in

RIGHT, PARTLY, REFUSED, WRONG = "right", "partly", "refused", "wrong"


class Judgement(NamedTuple):
    """The mark of a diagnosis, and what it is based on.

    Attributes:
        mark: right: all that is true is named, in range, and nothing else; partly: nothing false is
            named, yet something true is missing or out of range; refused: nothing is named, and
            the verdict says that something is unknown or cannot be decided; wrong: something false
            is named as certain, or nothing is said to be missing.
        named: what was named, certain or tied, with its value.
        why: what is missing or false; empty where it is right.
    """

    mark: str
    named: tuple[str, ...]
    why: str


def judgement_of(dataset: Dataset, found: Mapping[str, Any]) -> Judgement:
    """Return the judgement of the contents of a `diagnosis.json`."""
    named = named_in(found)
    words = tuple(_words(each) for each in named)
    known = {*dataset.truth, *dataset.plausible}
    false = [each["effect"] for each in named if not known & _ways(each)]
    if false:
        return Judgement(WRONG, words, f"not there: {', '.join(false)}")
    if not named:
        if found["verdict"] in (UNKNOWN, "not_excited"):
            return Judgement(REFUSED, words, f"verdict: {found['verdict']}")
        return Judgement(WRONG, words, f"verdict: {found['verdict']}")
    missing = [
        name
        for name, ranges in dataset.truth.items()
        if not any(name in _ways(each) and _is_in(each, name, ranges) for each in named)
    ]
    if missing:
        return Judgement(PARTLY, words, f"missing or out of range: {', '.join(missing)}")
    return Judgement(RIGHT, words, "")


def _ways(finding: Mapping[str, Any]) -> set[str]:
    """Return the effects that a finding names as equally good."""
    return {finding["effect"], *(each["effect"] for each in finding["alternatives"])}


def _is_in(
    finding: Mapping[str, Any], effect: str, ranges: Mapping[str, tuple[float, float]]
) -> bool:
    """Return whether known ranges overlap the intervals; alternatives have no numbers."""
    if finding["effect"] != effect:
        return True
    for number in finding["parameters"]:
        low, high = ranges.get(number["name"], (float("-inf"), float("inf")))
        ends = number["ci95"] or (number["value"], number["value"])
        if ends[1] < low or ends[0] > high:
            return False
    return True


def _words(finding: Mapping[str, Any]) -> str:
    numbers = ", ".join(f"{each['name']} {each['value']:.3g}" for each in finding["parameters"][:3])
    others = [each["effect"] for each in finding["alternatives"]]
    tied = f", or {', '.join(dict.fromkeys(others))}" if others else ""
    return f"{finding['effect']} ({numbers}){tied}"
