"""The scene that a recording holds, for viewers of others: frames, URDF, markers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from cspm_model.scene.scene import Scene
from cspm_msgs_py.recording.block import Batch
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import SCENE, Topic


class RecordedScene:
    """Makes a scene of each block: frames of all, markers of every other.

    It follows from the recorded messages alone, so that every mode records the same.
    """

    topics: Mapping[str, Topic] = SCENE

    def __init__(self, testbed: Testbed, published: Mapping[str, Topic]) -> None:
        """Take the machine, and the topics of the run by name."""
        self._scene = Scene(testbed, published)
        self._widths = {name: published[name].width for name in self._scene.sources}
        self._blocks = 0

    def of(self, block: Mapping[str, Batch]) -> Iterator[tuple[str, int, bytes]]:
        """Return topic, log time [ns] and CDR bytes; see `cspm_msgs_py.recording.derived`."""
        heard = {name: batch for name, batch in block.items() if batch.logs}
        if not heard:
            return
        if not self._blocks:
            first = min(batch.logs[0] for batch in heard.values())
            for message in self._scene.lasting():
                yield message.topic, first, message.payload
        found = {name: heard[name] for name in self._scene.sources if name in heard}
        for name, batch in found.items():
            row = np.frombuffer(batch.contents[-1])[-self._widths[name] :]
            self._scene.take(name, batch.stamps[-1], row)
        if found:
            last = max(batch.logs[-1] for batch in found.values())
            for message in self._scene.moving(markers=self._blocks % 2 == 0):
                yield message.topic, last, message.payload
        self._blocks += 1
