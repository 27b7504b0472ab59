"""The machine's frames as `/tf` and `/tf_static` have them, below one root by REP 103."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_model.scene.marked_message import MarkedMessage
from cspm_model.scene.urdf import ROOT, attachment_link, exit_link
from cspm_msgs_py.message import time_of
from cspm_msgs_py.ros_types import message_class, serialize
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import BAR_FRAME, TARGET_FRAME, TF, WINCH_FRAME, WORLD_FRAME

FRAMES = {"winch_frame": WINCH_FRAME, "bar": BAR_FRAME, "target": TARGET_FRAME}
"""Frames of the bodies that move, by the name of the body in topics."""
# z down is half a turn about x away from z up.
_DOWN = (1.0, 0.0, 0.0, 0.0)
_STRAIGHT = (0.0, 0.0, 0.0, 1.0)
Array = NDArray[np.float64]


class Transforms:
    """Frames of bodies that move, as bytes of `tf2_msgs/msg/TFMessage`."""

    def __init__(self) -> None:
        self._messages: dict[tuple[str, ...], MarkedMessage] = {}

    def moving(self, poses: Mapping[str, tuple[int, Array]]) -> bytes:
        """Return the frames of bodies in `world_ned`: by body the stamp [ns] and the pose row."""
        bodies = tuple(poses)
        if bodies not in self._messages:
            self._messages[bodies] = _moving(bodies)
        rows = np.concatenate([row[:7] for _, row in poses.values()])
        return self._messages[bodies].bytes_of([stamp for stamp, _ in poses.values()], rows)


def static_transforms(testbed: Testbed) -> bytes:
    """Return the frames that never move: `world_ned`, and each cable's exit and attachment."""
    stamp = time_of(0)
    carrier = WORLD_FRAME if testbed.winch_frame is None else WINCH_FRAME
    anchor = WORLD_FRAME if testbed.bar is None else BAR_FRAME
    found = [_transform(stamp, ROOT, WORLD_FRAME, (0.0, 0.0, 0.0, *_DOWN))]
    for cable in testbed.cables:
        if cable.exit is not None and cable.attachment is not None:
            at = (*cable.exit, *_STRAIGHT)
            found.append(_transform(stamp, carrier, exit_link(cable.name), at))
            at = (*cable.attachment, *_STRAIGHT)
            found.append(_transform(stamp, anchor, attachment_link(cable.name), at))
    return serialize(message_class(TF.ros_type)(found))


def _moving(bodies: Sequence[str]) -> MarkedMessage:
    kind = message_class(TF.ros_type)

    def build(stamps: Sequence[Any], numbers: Sequence[float], _: Sequence[float]) -> Any:  # noqa: ANN401
        return kind(
            [
                _transform(stamps[i], WORLD_FRAME, FRAMES[body], numbers[7 * i : 7 * i + 7])
                for i, body in enumerate(bodies)
            ]
        )

    return MarkedMessage(build, stamps=len(bodies), doubles=7 * len(bodies))


def _transform(stamp: Any, parent: str, child: str, pose: Sequence[float]) -> Any:  # noqa: ANN401
    """Return a transform from a pose `x y z qx qy qz qw` of the child in the parent."""
    kinds = {name: message_class(f"geometry_msgs/msg/{name}") for name in _KINDS}
    header = message_class("std_msgs/msg/Header")(stamp, parent)
    place = kinds["Vector3"](*map(float, pose[:3]))
    turn = kinds["Quaternion"](*map(float, pose[3:7]))
    return kinds["TransformStamped"](header, child, kinds["Transform"](place, turn))


_KINDS = ("Vector3", "Quaternion", "Transform", "TransformStamped")


def turned(quaternion: Array, points: Array) -> Array:
    """Return points, shape (n, 3), turned by a unit quaternion `qx qy qz qw`."""
    x, y, z, w = quaternion.tolist()
    rotation = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.asarray(points @ np.transpose(rotation))
