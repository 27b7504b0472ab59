"""The machine as others' viewers draw it, from what was last said on its topics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.scene.markers import Markers
from cspm_model.scene.transforms import FRAMES, Transforms, static_transforms
from cspm_model.scene.urdf import urdf
from cspm_msgs_py.ros_types import message_class, serialize
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import MARKERS, ROBOT_DESCRIPTION, TF, TF_STATIC, Topic

Array = NDArray[np.float64]
_TENSION, _WRENCH, _REFERENCE = "/cables/tension", "/wrench_command", "/bar/reference"


class SceneMessage(NamedTuple):
    """A message of a scene: its topic, the stamp of what it shows [ns], and its CDR bytes."""

    topic: str
    stamp_ns: int
    payload: bytes


class Scene:
    """Keeps what was last said, and makes a scene of it.

    Measured poses are drawn; a body without any is drawn where the simulation says it is.
    """

    def __init__(self, testbed: Testbed, published: Mapping[str, Topic]) -> None:
        """Choose what to draw from.

        Args:
            testbed: the machine.
            published: the topics of the run, by name.
        """
        self._testbed = testbed
        self._poses = {
            body: name
            for body in FRAMES
            for name in (f"/truth/{body}/pose", f"/{body}/pose")
            if name in published
        }
        drawn = (*self._poses.values(), _TENSION, _WRENCH, _REFERENCE)
        self.sources = tuple(name for name in drawn if name in published)
        """Names of the topics whose rows are wanted."""
        self._last: dict[str, tuple[int, Array]] = {}
        self._transforms = Transforms()
        self._markers = None if testbed.bar is None else Markers(testbed, testbed.bar)

    def take(self, topic: str, stamp_ns: int, row: Array) -> None:
        """Keep what a topic says: stamp [ns] and row."""
        self._last[topic] = stamp_ns, row

    def lasting(self) -> Iterator[SceneMessage]:
        """Return what never changes: frames, and the machine's URDF."""
        yield SceneMessage(TF_STATIC.name, 0, static_transforms(self._testbed))
        text = message_class(ROBOT_DESCRIPTION.ros_type)(urdf(self._testbed))
        yield SceneMessage(ROBOT_DESCRIPTION.name, 0, serialize(text))

    def moving(self, *, markers: bool = True) -> Iterator[SceneMessage]:
        """Return where everything is, as far as it was said."""
        last = self._last
        poses = {body: last[name] for body, name in self._poses.items() if name in last}
        if poses:
            newest = max(stamp for stamp, _ in poses.values())
            yield SceneMessage(TF.name, newest, self._transforms.moving(poses))
        if not markers or self._markers is None or "bar" not in poses:
            return
        stamp_ns, bar = poses["bar"]
        frame = poses.get("winch_frame")
        if self._testbed.winch_frame is None or frame is not None:
            payload = self._markers.bytes_of(
                stamp_ns,
                bar,
                None if frame is None else frame[1],
                *(self._row(name) for name in (_TENSION, _WRENCH, _REFERENCE)),
            )
            yield SceneMessage(MARKERS.name, stamp_ns, payload)

    def _row(self, topic: str) -> Array | None:
        found = self._last.get(topic)
        return None if found is None else found[1]
