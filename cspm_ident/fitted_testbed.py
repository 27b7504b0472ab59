"""A test-bed file with fitted numbers put in, the rest of its text as it was."""

from __future__ import annotations

import io
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from math import isfinite
from typing import Any

from ruamel.yaml.comments import CommentedMap

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip

DIGITS = 8
BLOCKS = ("stiffness", "damping", "rotor_inertia", "drum_radius")


@dataclass(frozen=True)
class FittedNumber:
    """A number with where it comes from.

    Attributes:
        value: in the file's unit.
        interval: 95 %; infinite ends where nothing bounds it.
        recordings: SHA-256 of each, at least one.
        windows: first and last instant used [s], of each recording, or none.
        note: a remark.
    """

    value: float
    interval: tuple[float, float]
    recordings: tuple[str, ...]
    windows: tuple[tuple[float, float], ...] = ()
    note: str = ""

    def content(self) -> CommentedMap:
        """Return it as a test-bed file writes it, in one line."""
        first, *others = self.recordings
        found: dict[str, Any] = {
            "value": _rounded(self.value),
            "provenance": "fitted",
            "recording": first,
            "interval": [_rounded(end) if isfinite(end) else None for end in self.interval],
        }
        if others:
            found["further_recordings"] = others
        if self.windows:
            window, *further = [[_rounded(end) for end in window] for window in self.windows]
            found["window"] = window
            if further:
                found["further_windows"] = further
        if self.note:
            found["note"] = self.note
        line = CommentedMap(found)
        line.fa.set_flow_style()
        return line


Numbers = Mapping[str, "FittedNumber | float | str"]
Changes = Mapping[str, Mapping[str, "Numbers | FittedNumber"]]


def with_fitted(text: str, source: str, changes: Changes) -> TestbedFile:
    """Return a test-bed file with some numbers of some cables replaced.

    Comments, anchors and all else stay. A cable that takes a changed block from another by `<<`
    keeps its own numbers.

    Args:
        text: the file's.
        source: names it in errors.
        changes: by cable, by block (`stiffness`, `damping`), by key; `rotor_inertia` and
            `drum_radius` have no keys.

    Raises:
        InputError: no such cable, or a result that is no test-bed file.
    """
    yaml = round_trip()
    content = yaml.load(text)
    names = [str(cable["name"]) for cable in content["cables"]]
    for name in changes:
        if name not in names:
            raise InputError(f"{source}: no cable {name}, allowed: {', '.join(names)}")
    wanted = _wanted(content["cables"], changes)
    # First where a block is written out, for all that take it; then where that was wrong.
    for owners in (True, False):
        for name, cable in zip(names, content["cables"], strict=True):
            own = dict(cable.non_merged_items())
            for block, value in wanted[name].items():
                if cable[block] != value and (block in own or not owners):
                    cable[block] = value
        stream = io.StringIO()
        yaml.dump(content, stream)
        text = stream.getvalue()
        content = yaml.load(text) if owners else content
    return parse_testbed(text, source)


def _wanted(cables: list[CommentedMap], changes: Changes) -> dict[str, dict[str, Any]]:
    """Return what each block of each cable is to be."""
    return {
        str(cable["name"]): {
            block: _changed(cable[block], changes.get(str(cable["name"]), {}).get(block, {}))
            for block in BLOCKS
            if block in cable
        }
        for cable in cables
    }


def _changed(block: Any, numbers: Numbers | FittedNumber) -> Any:  # noqa: ANN401 - any YAML
    if isinstance(numbers, FittedNumber):
        return numbers.content()
    copy = deepcopy(block)
    for key, number in numbers.items():
        copy[key] = number.content() if isinstance(number, FittedNumber) else number
    return copy


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
