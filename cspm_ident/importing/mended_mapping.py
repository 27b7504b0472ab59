"""A mapping with what its suspicions say would mend it."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from typing import Any

from cspm_checks.suspicion import Suspicion
from cspm_ident.importing.import_plan import own_clock
from cspm_ident.importing.mapping import Mapping, MappingFile
from cspm_msgs_py.yaml_file import dump_yaml, parse_yaml, validate

Plain = dict[str, Any]
Stamped = dict[str, float]
_SOURCE_OF_TIME = ("column", "rate", "stamp", "unit", "wrap", "disorder")


def mended_mapping(
    given: MappingFile, found: Iterable[Suspicion], earliest_s: Stamped
) -> tuple[str, list[str]]:
    """Return the text of a mapping with all that can be mended in it, and what was changed.

    Comments of the file are lost. What several suspicions say of one key is done once.

    Args:
        given: the mapping.
        found: what looks wrong with it.
        earliest_s: first stamp of each topic [s]; none may be before 0.
    """
    before: Plain = parse_yaml(given.text, str(given.path))
    after = deepcopy(before)
    done: list[str] = []
    for place, keys in _merged(found).items():
        topic, _, field = place.partition(" ")
        fields = after["channels"].get(topic, {})
        if field and field in fields:
            done += _mend_field(before, after, topic, field, keys)
        elif not field and fields:
            done += _mend_topic(given, after, topic, keys, earliest_s)
    validate(Mapping, after, f"{given.path}, mended")
    return dump_yaml(after), done


def _merged(found: Iterable[Suspicion]) -> dict[str, Plain]:
    """Return the keys to change by place; of two that differ, the first."""
    merged: dict[str, Plain] = {}
    for one in found:
        for place, keys in one.mend.items():
            merged[place] = {**keys, **merged.get(place, {})}
    return merged


def _mend_field(before: Plain, after: Plain, topic: str, field: str, keys: Plain) -> list[str]:
    """Change how a field is read; return what was changed."""
    where = f"channels.{topic}.{field}"
    done = []
    if source := keys.get("of"):
        other = source.partition(" ")[2]
        after["channels"][topic][field] = deepcopy(before["channels"][topic][other])
        done.append(f"{where}: as {other} was")
    entry = after["channels"][topic][field]
    if "sign" in keys:
        entry["sign"] = -1 if entry.get("sign", 1) > 0 else 1
        done.append(f"{where}.sign: {entry['sign']}")
    if "scale" in keys:
        entry["scale"] = entry.get("scale", 1.0) * keys["scale"]
        done.append(f"{where}.scale: {entry['scale']:g}")
    for key in ("unit", "wrap", "spikes", "jumps"):
        if key in keys:
            entry[key] = keys[key]
            done.append(f"{where}.{key}: {keys[key]}")
    return done


def _mend_topic(
    given: MappingFile, after: Plain, topic: str, keys: Plain, earliest_s: Stamped
) -> list[str]:
    """Change stretches that are left out, or the clock of a topic; return what was changed."""
    done = []
    for start, end in keys.get("drop", ()):
        segment = {"start": start, "end": end, "topics": [topic], "reason": "found by cspm check"}
        after["drop"] = [*after.get("drop", ()), segment]
        done.append(f"drop: {topic} from {start:.6g} to {end:.6g} s")
    if "offset_s" not in keys and "clock" not in keys:
        return done
    own = _own_clocks(given, after, topic)
    if "offset_s" in keys:
        # Before 0 there is no time: then all others are later instead.
        before = earliest_s[topic] + keys["offset_s"] < 0.0
        moved = [name for name in after["clocks"] if (name in own) != before]
        shift = -keys["offset_s"] if before else keys["offset_s"]
        for name in moved:
            clock = after["clocks"][name]
            clock["offset"] = clock.get("offset", 0.0) + shift
            done.append(f"clocks.{name}.offset: {clock['offset']:.9g}")
    for name in own:
        clock = after["clocks"][name]
        if change := keys.get("clock"):
            replaced = _SOURCE_OF_TIME if {"rate", "stamp"} & change.keys() else ()
            for key in replaced:
                clock.pop(key, None)
            clock.update(change)
            done += [f"clocks.{name}.{key}: {value}" for key, value in change.items()]
    return done


def _own_clocks(given: MappingFile, after: Plain, topic: str) -> list[str]:
    """Return clocks that are of a topic alone, made so where they serve others."""
    mapping = given.mapping
    after.setdefault("clocks", {}) or after["clocks"].update({"header": {"stamp": "header"}})
    used: dict[str, set[str]] = {}
    chosen: dict[str, str] = {}
    for name, fields in mapping.channels.items():
        for field, source in fields.items():
            if source.column is None:
                continue
            clock = source.clock or "header"
            if source.clock is None and mapping.clocks:
                clock = own_clock(source.column, mapping.clocks, mapping.files, str(given.path))
            used.setdefault(clock, set()).add(name)
            if name == topic:
                chosen[field] = clock
    names = {}
    for clock in dict.fromkeys(chosen.values()):
        names[clock] = clock
        if used[clock] != {topic}:
            names[clock] = f"{clock}_{topic.strip('/').replace('/', '_')}"
            after["clocks"].setdefault(names[clock], deepcopy(after["clocks"][clock]))
    for field, clock in chosen.items():
        after["channels"][topic][field]["clock"] = names[clock]
    return list(names.values())
