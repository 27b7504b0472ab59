"""Sensors as the test-bed file describes them: noise, resolution, delay and rate per topic."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import NonNegativeFloat, PositiveInt, field_validator

from cspm_msgs_py.testbed_keys.near_name import allowed_names
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.yaml_file import StrictModel

# One number for each kind of quantity that a message of the topic's type carries.
QUANTITIES = {
    "geometry_msgs/msg/PoseStamped": ("position [m]", "orientation [rad]"),
    "geometry_msgs/msg/TwistStamped": ("velocity [m/s]", "angular velocity [rad/s]"),
}
JOINT_QUANTITIES = {
    "/winches/state": ("angle [rad]", "speed [rad/s]", "torque [N·m]"),
    "/cables/tension": ("tension [N]",),
}
MEASURED = (
    "/winch_frame/pose",
    "/winch_frame/twist",
    "/bar/pose",
    "/bar/twist",
    "/target/pose",
    "/winches/state",
    "/cables/tension",
)


class Sensor(StrictModel):
    """One sensor.

    Attributes:
        noise: standard deviation of white Gaussian noise, one number per quantity.
        resolution: quantisation step, one number per quantity; 0 for none.
        delay: time from the stamped instant to the message's arrival [s].
        rate: the highest rate the sensor can deliver [Hz].
    """

    noise: tuple[NonNegativeFloat, ...]
    resolution: tuple[NonNegativeFloat, ...]
    delay: NonNegativeFloat = 0.0
    rate: PositiveInt

    @field_validator(
        "noise",
        "resolution",
        mode="before",
        json_schema_input_type=NonNegativeFloat | tuple[NonNegativeFloat, ...],
    )
    @classmethod
    def _listed(cls, value: object) -> object:
        if isinstance(value, int | float):
            return (value,)
        return tuple(value) if isinstance(value, list) else value


def quantities(topic: Topic) -> tuple[str, ...]:
    """Return the kinds of quantity in a measured topic, with units."""
    return QUANTITIES.get(topic.ros_type) or JOINT_QUANTITIES[topic.name]


def check_sensor_topics(sensors: Mapping[str, Sensor], topics: Mapping[str, Topic]) -> None:
    """Check that each sensor measures a topic this machine has, with as many numbers as quantities.

    Raises:
        ValueError: naming the sensor and what is allowed.
    """
    possible = [name for name in MEASURED if name in topics]
    for name, sensor in sensors.items():
        if name not in possible:
            raise ValueError(f"sensors.{name}: no such sensor, {allowed_names(name, possible)}")
        kinds = quantities(topics[name])
        for key in ("noise", "resolution"):
            given = getattr(sensor, key)
            if len(given) != len(kinds):
                raise ValueError(
                    f"sensors.{name}.{key}: {len(given)} numbers, allowed: {len(kinds)}"
                    f" ({', '.join(kinds)})"
                )
