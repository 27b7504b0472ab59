"""Changed test-bed files: the text is edited, and all else follows from the text.

Comments, quotes, anchors and the order of keys stay where the file has them.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, Testbed, TestbedFile
from cspm_msgs_py.testbed_keys.near_name import allowed_names
from cspm_msgs_py.yaml_file import dump_yaml, parse_yaml, round_trip

# `cables[2].rotor_inertia` → `cables`, `2`, `rotor_inertia`. A topic's name is one part.
_PART = re.compile(r"\[(\d+)\]|([^.\[\]]+)")
_KEY = re.compile(r"[^.\[\]]+(\[\d+\]|\.[^.\[\]]+)*")


def file_of(testbed: Testbed, source: str = "test-bed") -> TestbedFile:
    """Return a description as a file; its numbers carry no provenance.

    Args:
        testbed: the machine.
        source: names the file in errors.

    Raises:
        InputError: the description is no machine's.
    """
    return TestbedFile(dump_yaml(testbed.model_dump(mode="json", exclude_none=True)), source)


def with_value(file: TestbedFile, key: str, value: object) -> TestbedFile:
    """Return the file with another value at one place.

    Args:
        file: the file to change.
        key: path of the value, `bar.mass`, `cables[2].rotor_inertia` or, by the cable's name,
            `cables.sway_3.rotor_inertia`.
        value: the new one, in SI: a number, a text, or lists and mappings of these. A provenance
            that the old value has is dropped.

    Raises:
        InputError: no such place, or the result is no test-bed.
    """
    if not _KEY.fullmatch(key):
        raise InputError(f"{key}: allowed: a key path, such as bar.mass or cables.sway_3.stiffness")
    parts = [int(i) if i else name for i, name in _PART.findall(key)]
    new = plain(value)
    return _changed(file, lambda content: _put(content, parts, new, key))


def with_effects(file: TestbedFile, entries: Sequence[EffectEntry]) -> TestbedFile:
    """Return the file with further entries at the end of `effects`.

    Raises:
        InputError: the result is no test-bed.
    """

    def add(root: Any) -> None:  # noqa: ANN401 - any YAML
        own = _own(root, "effects", set())
        own.extend(_styled(_written(entry), own) for entry in entries)

    return _changed(file, add) if entries else file


def _written(entry: EffectEntry) -> dict[str, Any]:
    content: dict[str, Any] = {"effect": entry.effect}
    content |= {"elements": [*entry.elements]} if entry.elements else {}
    table = entry.table
    numbers = entry.numbers if table is None else table.model_dump(exclude_defaults=True)
    return content | {"parameters": plain(numbers)}


def without_effect(file: TestbedFile, effect: str) -> TestbedFile:
    """Return the file without the entries of an effect.

    Raises:
        InputError: it has none.
    """
    names = [entry.effect for entry in file.testbed.effects]
    if effect not in names:
        has = ", ".join(dict.fromkeys(names)) or "none"
        raise InputError(f"{file.source}: no effect {effect}, it has: {has}")

    def remove(root: Any) -> None:  # noqa: ANN401 - any YAML
        entries = _own(root, "effects", set())
        for i in reversed(range(len(names))):
            if names[i] == effect:
                del entries[i]
        if not entries:
            del root["effects"]

    return _changed(file, remove)


def _changed(file: TestbedFile, change: Callable[[Any], None]) -> TestbedFile:
    """Return the file after a change that a plain and a commented tree can both take."""
    plain = parse_yaml(file.text, file.source)
    change(plain)
    yaml = round_trip()
    content = yaml.load(file.text)
    change(content)
    stream = io.StringIO()
    yaml.dump(content, stream)
    text = stream.getvalue()
    if parse_yaml(text, file.source) != plain:
        # An anchor made the change act elsewhere as well: without anchors it does not.
        text = dump_yaml(plain)
    return TestbedFile(text, file.source)


def _put(root: Any, parts: Sequence[str | int], value: Any, key: str) -> None:  # noqa: ANN401
    shared = _shared(root)
    node = root
    for part in parts[:-1]:
        node = _own(node, _place(node, part, key), shared)
    node[_place(node, parts[-1], key)] = _styled(value, node)


def _place(node: Any, part: str | int, key: str) -> str | int:  # noqa: ANN401 - any YAML
    """Return a part as an index or key of `node`, a cable's name as its index."""
    if isinstance(node, dict):
        return part
    if not isinstance(node, list):
        raise InputError(f"{key}: {part} is inside no mapping, allowed: keys inside one")
    if isinstance(part, int):
        if part < len(node):
            return part
        raise InputError(f"{key}: [{part}], allowed: 0 to {len(node) - 1}")
    names = [_named(each) for each in node]
    if part not in names:
        raise InputError(f"{key}: no {part}, {allowed_names(str(part), map(str, names))}")
    return names.index(part)


def _named(entry: Any) -> str:  # noqa: ANN401 - any YAML
    return str(entry.get("name", entry.get("effect"))) if isinstance(entry, dict) else str(entry)


def _own(node: Any, part: str | int, shared: set[int]) -> Any:  # noqa: ANN401 - any YAML
    """Return what is at a key, as a copy where an anchor shares it; an absent one is made."""
    if isinstance(node, dict) and part not in node:
        node[part] = _styled([] if part == "effects" else {}, node)
        return node[part]
    inner = node[part]
    if isinstance(inner, dict) and {"value", "provenance"} <= set(inner):
        inner = node[part] = inner["value"]
    if id(inner) in shared:
        inner = node[part] = deepcopy(inner)
        if isinstance(inner, (CommentedMap, CommentedSeq)):
            inner.yaml_set_anchor(None)
    return inner


def _shared(root: Any) -> set[int]:  # noqa: ANN401 - any YAML
    """Return which lists and mappings several places share through an anchor."""
    seen: Counter[int] = Counter()

    def walk(node: Any) -> None:  # noqa: ANN401 - any YAML
        if isinstance(node, (dict, list)):
            seen[id(node)] += 1
            for inner in node.values() if isinstance(node, dict) else node:
                walk(inner)

    walk(root)
    return {place for place, count in seen.items() if count > 1}


def _styled(value: Any, parent: Any, *, inner: bool = False) -> Any:  # noqa: ANN401 - any YAML
    """Return new content as it is to stand in `parent`: what is inside an entry in one line."""
    if not isinstance(parent, (CommentedMap, CommentedSeq)):
        return deepcopy(value)
    found: CommentedMap | CommentedSeq
    if isinstance(value, dict):
        found = CommentedMap({k: _styled(v, parent, inner=True) for k, v in value.items()})
    elif isinstance(value, list):
        found = CommentedSeq([_styled(v, parent, inner=True) for v in value])
    else:
        return value
    if value and (inner or isinstance(value, list)):
        found.fa.set_flow_style()
    return found


def plain(value: object) -> Any:  # noqa: ANN401 - any plain data
    """Return numbers, lists and mappings as YAML holds them, arrays as lists."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return value
