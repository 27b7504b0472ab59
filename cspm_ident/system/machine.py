"""A machine with fitted numbers in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.system.choice import (
    AXES,
    MOMENTS,
    BarPlace,
    Chosen,
    EffectPlace,
    PointPlace,
    absent_values,
    same_place,
)
from cspm_msgs_py.testbed import Bar, Cable, EffectEntry, Testbed

Array = NDArray[np.float64]

_PRODUCTS = ("ixy", "ixz", "iyz")


def machine_with(
    testbed: Testbed, chosen: Sequence[Chosen], values: Sequence[float] | Array
) -> Testbed:
    """Return the machine with these values, in the order of `chosen`.

    A tensor of inertia that no body has is not refused here, so that a search may pass through it.
    """
    bar, effects, cables = testbed.bar, list(testbed.effects), list(testbed.cables)
    for each, value in zip(chosen, values, strict=True):
        if isinstance(each.place, EffectPlace):
            _put_effect(testbed, effects, each.place, float(value))
        elif isinstance(each.place, PointPlace):
            number = each.place.cable
            cables[number] = _put_point(cables[number], each.place, float(value))
        elif bar is not None:
            bar = _put_bar(bar, each.place, float(value))
    changes = {"bar": bar, "effects": tuple(effects), "cables": tuple(cables)}
    return testbed.model_copy(update=changes)


def bar_values(place: BarPlace, value: float, bar: Bar) -> Mapping[str, float]:
    """Return the numbers of `bar`, by key, that a value sets."""
    if place.key == "inertia":
        keys = (*MOMENTS, *_PRODUCTS)
        found = {f"inertia.{key}": value * float(getattr(bar.inertia, key)) for key in keys}
        return {key: number for key, number in found.items() if number}
    return {place.key: value}


def _put_bar(bar: Bar, place: BarPlace, value: float) -> Bar:
    for key, number in bar_values(place, value, bar).items():
        head, _, part = key.partition(".")
        if head == "com":
            com = [number if axis == part else old for axis, old in zip(AXES, bar.com, strict=True)]
            bar = bar.model_copy(update={"com": tuple(com)})
        elif head == "inertia":
            inertia = bar.inertia.model_copy(update={part: number})
            bar = bar.model_copy(update={"inertia": inertia})
        else:
            bar = bar.model_copy(update={key: number})
    return bar


def _put_point(cable: Cable, place: PointPlace, value: float) -> Cable:
    point = list(getattr(cable, place.point))
    point[place.axis] = value
    return cable.model_copy(update={place.point: tuple(point)})


def _put_effect(
    testbed: Testbed, effects: list[EffectEntry], place: EffectPlace, value: float
) -> None:
    for i, entry in enumerate(effects):
        if same_place(testbed, place, entry.effect, entry.elements):
            parameters = {**entry.numbers, place.parameter: value}
            effects[i] = entry.model_copy(update={"parameters": parameters})
            return
    parameters = {**absent_values(place.effect), place.parameter: value}
    effects.append(EffectEntry(effect=place.effect, elements=place.elements, parameters=parameters))
