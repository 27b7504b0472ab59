"""What of a bag is to be played, and under which names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from cspm_msgs_py.bag import BagStream
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import LATEST_SECOND
from cspm_msgs_py.topics import CLOCK

_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_LONGEST_NAME = 247


@dataclass(frozen=True)
class Selection:
    """What of a bag is to be played.

    Attributes:
        topics: only these; empty for all. The clock comes along all the same.
        left_out: all but these.
        start_s: seconds from the bag's start at which playing begins.
        duration_s: seconds of the bag to play; None to its end.
        remap: new names by the bag's.
    """

    topics: Collection[str] = ()
    left_out: Collection[str] = ()
    start_s: float = 0.0
    duration_s: float | None = None
    remap: Mapping[str, str] = field(default_factory=dict)

    def span_ns(self, bag: BagStream) -> tuple[int, int]:
        """Return first and last log time to play [ns].

        Raises:
            InputError: a time outside the bag.
        """
        length = (bag.end_ns - bag.start_ns) * 1e-9
        if not 0.0 <= self.start_s <= length:
            raise InputError(f"start {self.start_s:g} s: allowed: 0 to {length:g} s, {bag.path}")
        if self.duration_s is not None and not self.duration_s > 0.0:
            raise InputError(f"duration {self.duration_s:g} s: allowed: more than 0 s")
        start = bag.start_ns + round(self.start_s * 1e9)
        if self.duration_s is None:
            return start, bag.end_ns
        return start, min(bag.end_ns, start + round(self.duration_s * 1e9) - 1)

    def names(self, bag: BagStream) -> dict[str, str]:
        """Return the topics to play: the name in the graph by the bag's name.

        Raises:
            InputError: a topic that the bag does not have or that cannot be played, or a new name
                that cannot be.
        """
        if self.topics and self.left_out:
            raise InputError("topics: chosen as well as left out, allowed: one of the two")
        known = {*bag.topics, *bag.unplayable, CLOCK.name}
        for name in (*self.topics, *self.left_out, *self.remap):
            if name not in known:
                raise InputError(f"{bag.path}: no topic {name}, it has: {', '.join(bag.topics)}")
        chosen = [
            name
            for name in bag.topics
            if name not in self.left_out
            and (not self.topics or name in self.topics or name == CLOCK.name)
        ]
        for name in self.topics:
            if name in bag.unplayable:
                raise InputError(f"{bag.path}: {name}: {bag.unplayable[name]}")
        return self._renamed(chosen)

    def unplayable(self, bag: BagStream) -> dict[str, str]:
        """Return why wanted topics of the bag cannot be played, by name."""
        if self.topics:
            return {}
        return {name: why for name, why in bag.unplayable.items() if name not in self.left_out}

    def _renamed(self, chosen: Sequence[str]) -> dict[str, str]:
        found: dict[str, str] = {}
        for name in chosen:
            new = self.remap.get(name, name)
            if name in self.remap and not is_topic_name(new):
                raise InputError(f"{name}: renamed to {new!r}, allowed: a name like /bar/pose")
            found[name] = new
        twice = [new for new, count in Counter(found.values()).items() if count > 1]
        if twice:
            named = ", ".join(name for name, new in found.items() if new == twice[0])
            raise InputError(f"{named}: all named {twice[0]}, allowed: one topic of a name")
        return found


def is_topic_name(name: str) -> bool:
    """Return whether ROS 2 can have an absolute topic of this name."""
    return len(name) <= _LONGEST_NAME and _NAME.fullmatch(name) is not None


def check_clock(bag: BagStream) -> None:
    """Refuse log times that a clock cannot show.

    Raises:
        InputError: log times beyond 2³¹ s.
    """
    if bag.end_ns // 1_000_000_000 > LATEST_SECOND:
        raise InputError(
            f"{bag.path}: log times up to {bag.end_ns} ns, allowed for {CLOCK.name}: up to"
            f" {LATEST_SECOND} s"
        )
