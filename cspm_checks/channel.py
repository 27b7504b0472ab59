"""One channel: a field of a topic, its SI unit, and what its source wrote."""

from __future__ import annotations

from typing import NamedTuple

from cspm_msgs_py.topics import Topic

_JOINT_QUANTITIES = {"position": "rad", "velocity": "rad/s", "effort": "N·m"}
_FIELD_QUANTITIES = {
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), "1"),
    **dict.fromkeys(("roll", "pitch", "yaw"), "rad"),
    **dict.fromkeys(("vx", "vy", "vz"), "m/s"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
    **dict.fromkeys(("ax", "ay", "az"), "m/s²"),
    **dict.fromkeys(("alphax", "alphay", "alphaz"), "rad/s²"),
    **dict.fromkeys(("fx", "fy", "fz"), "N"),
    **dict.fromkeys(("mx", "my", "mz"), "N·m"),
}


class Channel(NamedTuple):
    """A field of a topic.

    Attributes:
        topic: whose it is.
        field: its name; of a pose also `roll`, `pitch`, `yaw`.
        factor: SI per number of the source, whose counters roll over in its own unit.
    """

    topic: Topic
    field: str
    factor: float = 1.0

    @property
    def where(self) -> str:
        """Topic and field."""
        return f"{self.topic.name} {self.field}"

    @property
    def quantity(self) -> str:
        """The SI unit."""
        return field_quantity(self.topic, self.field)


def field_quantity(topic: Topic, field: str) -> str:
    """Return the SI unit of a field of a topic; `roll`, `pitch`, `yaw` are fields of poses too."""
    part, _, joint = field.partition("/")
    if not joint:
        return _FIELD_QUANTITIES[field]
    if topic.name in ("/cables/tension", "/tension_command"):
        return "N"
    return _JOINT_QUANTITIES[part]
