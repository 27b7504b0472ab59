"""A test-bed file with what was identified of the whole machine."""

from __future__ import annotations

import io
from math import isfinite
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_ident.fitted_testbed import FittedNumber
from cspm_ident.system.choice import (
    AXES,
    BarPlace,
    Chosen,
    EffectPlace,
    PointPlace,
    absent_values,
    coordinate,
    same_place,
)
from cspm_ident.system.identification import SystemResult
from cspm_ident.system.machine import bar_values
from cspm_msgs_py.testbed import Bar, Testbed, TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip

Content = Any


def fitted_testbed(result: SystemResult, file: TestbedFile, source: str) -> TestbedFile:
    """Return the test-bed file with the fitted numbers, each with recording and interval.

    Comments and all other numbers stay. Numbers of the bar stand in `bar`, ends of cables with
    their cable, all others in `effects`. What kept its value, or was not excited, is left as it
    was.

    Args:
        result: what was identified.
        file: of the machine that was described.
        source: names it in errors.

    Raises:
        InputError: the numbers are no machine's, such as a tensor of inertia that no body has.
    """
    yaml = round_trip()
    content: Content = yaml.load(file.text)
    estimate = result.solution.estimate
    for each in result.chosen:
        low, high = estimate.interval(each.name)
        if each.parameter.frozen and estimate.value(each.name) == _now(file.testbed, each):
            continue
        if not each.parameter.frozen and not (isfinite(low) and isfinite(high)):
            continue
        number = _number(result, each)
        if isinstance(each.place, EffectPlace):
            _put_effect(content, file.testbed, each.place, number)
        elif isinstance(each.place, PointPlace):
            put_point(content["cables"], each.place, number)
        elif file.testbed.bar is not None:
            _put_bar(content["bar"], file.testbed.bar, each.place, number)
    stream = io.StringIO()
    yaml.dump(content, stream)
    return parse_testbed(stream.getvalue(), source)


def _number(result: SystemResult, each: Chosen) -> FittedNumber:
    estimate = result.solution.estimate
    value, interval = estimate.value(each.name), estimate.interval(each.name)
    searched = result.searched
    hashes = tuple(measurement.sha256 for measurement in searched)
    if each.parameter.frozen:
        return FittedNumber(value, (value, value), hashes, note="held at this value")
    note = "" if result.settled else "the search did not settle, the interval may not hold"
    note = "on its bound, the interval is not valid" if each.name in estimate.at_bound else note
    windows = tuple((0.0, measurement.duration) for measurement in searched)
    return FittedNumber(value, interval, hashes, windows, note)


def _now(testbed: Testbed, each: Chosen) -> float:
    if isinstance(each.place, EffectPlace):
        for entry in testbed.effects:
            if same_place(testbed, each.place, entry.effect, entry.elements):
                return entry.numbers[each.place.parameter]
        return absent_values(each.place.effect)[each.place.parameter]
    if isinstance(each.place, PointPlace):
        return coordinate(testbed, each.place)
    bar = testbed.bar
    return bar_value(bar, each.place) if bar is not None else each.nominal


def bar_value(bar: Bar, place: BarPlace) -> float:
    """Return the bar's own number; 1 for the factor on all of its inertia."""
    head, _, part = place.key.partition(".")
    if head == "com":
        return bar.com[AXES.index(part)]
    if head == "inertia":
        return float(getattr(bar.inertia, part)) if part else 1.0
    return bar.mass


def _put_bar(content: Content, bar: Bar, place: BarPlace, number: FittedNumber) -> None:
    low, high = number.interval
    ends = [bar_values(place, end, bar) for end in (low, high)]
    for key, value in bar_values(place, number.value, bar).items():
        head, _, part = key.partition(".")
        interval = (ends[0][key], ends[1][key])
        wanted = FittedNumber(value, interval, number.recordings, number.windows, number.note)
        if head == "com":
            if not isinstance(content.get("com"), CommentedSeq):
                content["com"] = _line(list(bar.com))
            content["com"][AXES.index(part)] = wanted.content()
        elif head == "inertia":
            content["inertia"][part] = wanted.content()
        else:
            content[key] = wanted.content()


def put_point(cables: Content, place: PointPlace, number: FittedNumber) -> None:
    """Put one coordinate into a file's cables; the others keep what it said of the whole point."""
    for cable in cables:
        # What took the point from this cable by `<<` keeps it as it was.
        if place.point not in dict(cable.non_merged_items()):
            cable[place.point] = cable[place.point]
    cable = cables[place.cable]
    point = cable[place.point]
    if not isinstance(point, CommentedSeq):
        about = {key: remark for key, remark in point.items() if key != "value"}
        each = [CommentedMap({"value": value, **about}) for value in point["value"]]
        for old in each:
            old.fa.set_flow_style()
        point = _line(each)
    cable[place.point] = _line(
        [number.content() if i == place.axis else old for i, old in enumerate(point)]
    )


def _put_effect(
    content: Content, testbed: Testbed, place: EffectPlace, number: FittedNumber
) -> None:
    entries = content.setdefault("effects", CommentedSeq())
    for entry in entries:
        if same_place(testbed, place, entry["effect"], entry.get("elements", ())):
            entry["parameters"][place.parameter] = number.content()
            return
    entry = CommentedMap({"effect": place.effect})
    if place.elements:
        entry["elements"] = _line(list(place.elements))
    entry["parameters"] = CommentedMap(absent_values(place.effect))
    entry["parameters"][place.parameter] = number.content()
    entries.append(entry)


def _line(values: list[Any]) -> CommentedSeq:
    line = CommentedSeq(values)
    line.fa.set_flow_style()
    return line
