"""What a recording holds beyond what it was given: messages that follow from others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

from cspm_msgs_py.recording.block import Batch
from cspm_msgs_py.topics import Topic


class Derived(Protocol):
    """Makes messages of each block of recorded time, in the thread that writes it."""

    @property
    def topics(self) -> Mapping[str, Topic]:
        """Return the topics of these messages by name; none carries a row of numbers."""

    def of(self, block: Mapping[str, Batch]) -> Iterable[tuple[str, int, bytes]]:
        """Return topic, log time [ns] and CDR bytes of what follows from a block.

        Args:
            block: what each topic received, by name. Log times have to lie among these.
        """
