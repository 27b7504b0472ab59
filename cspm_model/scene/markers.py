"""Cables coloured by tension, the wanted wrench and the bar's reference, as `/markers` has them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_model.scene.marked_message import MarkedMessage
from cspm_model.scene.transforms import turned
from cspm_msgs_py.message import header_of
from cspm_msgs_py.ros_types import message_class
from cspm_msgs_py.testbed import Bar, Testbed
from cspm_msgs_py.topics import MARKERS, WORLD_FRAME

Array = NDArray[np.float64]
# Of `visualization_msgs/msg/Marker`.
_ARROW, _CUBE, _LINE_LIST = 0, 1, 5
# Slack, half of the highest tension, and the highest: red, green, blue.
_COLOURS = np.array([[0.15, 0.35, 0.95], [0.95, 0.8, 0.2], [0.9, 0.1, 0.1]])
_AT = np.linspace(0.0, 1.0, len(_COLOURS))
_UNKNOWN = np.array([0.6, 0.6, 0.6])
# Shares of the machine's size.
_CABLE_WIDTH, _SHAFT_WIDTH, _LONGEST_ARROW = 0.003, 0.006, 0.25
_SEEN, _HIDDEN, _GHOST = 1.0, 0.0, 0.35


class Markers:
    """The markers of a machine with a bar, as bytes of a `MarkerArray`."""

    def __init__(self, testbed: Testbed, bar: Bar) -> None:
        """Prepare the message; lengths in m."""
        cables = testbed.cables
        self._exits = np.array([cable.exit for cable in cables])
        self._attachments = np.array([cable.attachment for cable in cables])
        limits = [cable.tension_limits for cable in cables]
        self._highest = np.array([limit[1] if limit else math.inf for limit in limits])
        self._weight = max(bar.mass * testbed.gravity, 1e-9)
        self._size = float(np.ptp(self._exits, axis=0).max() or 1.0)
        self._count = len(cables)
        box = bar.dimensions

        def build(stamps: Sequence[Any], doubles: Sequence[float], singles: Sequence[float]) -> Any:  # noqa: ANN401
            return _markers(self._count, self._size, box, stamps, doubles, singles)

        lines = 6 * self._count
        self._message = MarkedMessage(
            build, stamps=3, doubles=lines + 6 + 7, singles=8 * self._count + 2
        )

    def bytes_of(
        self,
        stamp_ns: int,
        bar: Array,
        frame: Array | None,
        tensions: Array | None,
        wrench: Array | None,
        reference: Array | None,
    ) -> bytes:
        """Return the markers.

        Args:
            stamp_ns: of all markers [ns].
            bar: pose row of the bar.
            frame: pose row of the winch frame; None: it is at the world's origin.
            tensions: of the cables, shape (m,) [N]; None: unknown.
            wrench: on the bar, shape (6,) [N, N·m]; None hides the arrow.
            reference: row of the bar's reference; None hides the box.
        """
        exits = self._exits if frame is None else frame[:3] + turned(frame[3:7], self._exits)
        ends = bar[:3] + turned(bar[3:7], self._attachments)
        lines = np.stack([exits, ends], axis=1).ravel()
        force = np.zeros(3) if wrench is None else wrench[:3]
        tip = bar[:3] + force * (_LONGEST_ARROW * self._size / self._weight)
        wanted = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]) if reference is None else reference
        alphas = [
            _HIDDEN if wrench is None else _SEEN,
            _HIDDEN if reference is None else _GHOST,
        ]
        return self._message.bytes_of(
            [stamp_ns] * 3,
            np.concatenate([lines, bar[:3], tip, wanted[:7]]),
            np.concatenate([self._colours(tensions), alphas]),
        )

    def _colours(self, tensions: Array | None) -> Array:
        """Return red, green, blue and alpha of both ends of each cable, shape (8 m,)."""
        if tensions is None:
            colours = np.tile(_UNKNOWN, (self._count, 1))
        else:
            place = np.clip(tensions / self._highest, 0.0, 1.0)
            colours = np.column_stack([np.interp(place, _AT, column) for column in _COLOURS.T])
        whole = np.column_stack([colours, np.ones(self._count)])
        return np.asarray(np.repeat(whole, 2, axis=0).ravel())


def _markers(
    count: int,
    size: float,
    box: Sequence[float],
    stamps: Sequence[Any],
    doubles: Sequence[float],
    singles: Sequence[float],
) -> Any:  # noqa: ANN401 - generated classes
    """Return the array of cables, wrench and reference from their numbers."""
    kinds = {name: message_class(f"geometry_msgs/msg/{name}") for name in _KINDS}
    colour, point = message_class("std_msgs/msg/ColorRGBA"), kinds["Point"]
    lines = [point(*doubles[3 * i : 3 * i + 3]) for i in range(2 * count)]
    colours = [colour(*singles[4 * i : 4 * i + 4]) for i in range(2 * count)]
    arrow = [point(*doubles[i : i + 3]) for i in (6 * count, 6 * count + 3)]
    nowhere = kinds["Pose"](point(0.0, 0.0, 0.0), kinds["Quaternion"](0.0, 0.0, 0.0, 1.0))
    place, turn = doubles[6 * count + 6 : 6 * count + 9], doubles[6 * count + 9 :]
    wanted = kinds["Pose"](point(*place), kinds["Quaternion"](*turn))
    purple, green = (0.6, 0.2, 0.9, singles[-2]), (0.1, 0.8, 0.3, singles[-1])
    thin, shaft = (_CABLE_WIDTH * size, 0.0, 0.0), _SHAFT_WIDTH * size
    arrow_size = (shaft, 2.0 * shaft, 0.0)
    white = (1.0, 1.0, 1.0, 1.0)
    found = [
        _marker(stamps[0], "cables", _LINE_LIST, nowhere, thin, white, lines, colours),
        _marker(stamps[1], "wrench_command", _ARROW, nowhere, arrow_size, purple, arrow),
        _marker(stamps[2], "bar_reference", _CUBE, wanted, box, green),
    ]
    return message_class(MARKERS.ros_type)(found)


_KINDS = ("Point", "Quaternion", "Pose", "Vector3")


def _marker(
    stamp: Any,  # noqa: ANN401 - generated classes
    namespace: str,
    shape: int,
    pose: Any,  # noqa: ANN401
    scale: Sequence[float],
    colour: Sequence[float],
    points: Sequence[Any] = (),
    colours: Sequence[Any] = (),
) -> Any:  # noqa: ANN401
    header, duration = message_class("std_msgs/msg/Header"), message_class(_DURATION)
    empty = np.zeros(0, np.uint8)
    image = message_class("sensor_msgs/msg/CompressedImage")(header_of(0, ""), "", empty)
    return message_class("visualization_msgs/msg/Marker")(
        header=header(stamp, WORLD_FRAME),
        ns=namespace,
        id=0,
        type=shape,
        action=0,
        pose=pose,
        scale=message_class("geometry_msgs/msg/Vector3")(*map(float, scale)),
        color=message_class("std_msgs/msg/ColorRGBA")(*colour),
        lifetime=duration(0, 0),
        frame_locked=False,
        points=list(points),
        colors=list(colours),
        texture_resource="",
        texture=image,
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=message_class("visualization_msgs/msg/MeshFile")("", empty),
        mesh_use_embedded_materials=False,
    )


_DURATION = "builtin_interfaces/msg/Duration"
