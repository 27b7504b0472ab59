"""Runs without any phenomenon, which fix amounts and truth before anything is recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from bench.blind.concealed_run import believed, watch
from bench.blind.item import Item
from bench.blind.reality.detection_limit import absorbed_share, detection_limits, likeness
from bench.blind.reality.reality import conceal
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS

_SEED = 1

Amounts = Mapping[str, Sequence[float]]
Tell = Callable[[str, int, int], None]


class BlankRuns(NamedTuple):
    """What runs without any phenomenon show.

    Attributes:
        limits: detection limits by scenario and phenomenon.
        shares: what numbers absorb, by scenario, phenomenon and number.
        likeness: what a unit of a phenomenon is of the catalogue's parameter, by scenario and name.
    """

    limits: dict[str, Mapping[str, Sequence[float]]]
    shares: dict[tuple[str, str, str], Sequence[float]]
    likeness: dict[tuple[str, str], Sequence[float]]

    def likened(self, item: Item, amounts: Amounts) -> dict[str, list[float]]:
        """Return amounts as the catalogue's parameters."""
        return {
            name: [
                amount * like
                for amount, like in zip(
                    amounts[name], self.likeness[item.scenario, name], strict=False
                )
            ]
            for name in {each.phenomenon for each in item.concealed}
        }


def run_blank(items: Sequence[Item], duration: float, tell: Tell) -> BlankRuns:
    """Run each scenario without any phenomenon, and return what that shows of the items' own.

    Args:
        items: the recordings to be made.
        duration: of each [s].
        tell: called with what is being done, how much of it is done, and how much there is.
    """
    scenarios = sorted({item.scenario for item in items})
    concealed = {(item, each.phenomenon) for item in items for each in item.concealed}
    names = {(item.scenario, name) for item, name in concealed}
    numbers = {
        (item.scenario, name, item.case.absorbed_by)
        for item, name in concealed
        if item.case.absorbed_by
    }
    blank = BlankRuns({}, {}, {})
    for done, scenario in enumerate(scenarios):
        tell(f"detection limits in {scenario}", done, len(scenarios))
        bundle = believed(scenario, duration, _SEED)
        machine = bundle.testbed.testbed
        searched = DEFAULT_THRESHOLDS.searched_share * duration
        scenes = watch(bundle, conceal(machine, {}, 0.0, _SEED), searched)
        blank.limits[scenario] = detection_limits(scenes, machine)
        for where, name in names:
            if where == scenario:
                blank.likeness[scenario, name] = likeness(name, scenes, machine)
        for where, name, number in numbers:
            if where == scenario:
                key = (scenario, name, number)
                blank.shares[key] = absorbed_share(name, number, scenes, machine)
    return blank
