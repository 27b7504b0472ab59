"""Messages of `/diagnostics`: the one topic of the contract whose length varies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import NamedTuple

from cspm_msgs_py.message import NANOSECONDS, header_of
from cspm_msgs_py.ros_types import deserialize, message_class, serialize
from cspm_msgs_py.topics import DIAGNOSTICS


class Level(IntEnum):
    """Severity, as `diagnostic_msgs/DiagnosticStatus` numbers it."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class Status(NamedTuple):
    """One finding.

    Attributes:
        level: severity.
        name: the part that reports, such as `plant` or `cables/surge_2`.
        message: what it reports.
        values: further particulars.
    """

    level: int
    name: str
    message: str
    values: Mapping[str, str]


class Diagnostics(NamedTuple):
    """All findings of one instant [ns]."""

    stamp_ns: int
    statuses: list[Status]


def encode_diagnostics(
    stamp_ns: int,
    statuses: Iterable[tuple[int, str, str, Mapping[str, str]]],
    hardware_id: str = "",
) -> bytes:
    """Return the CDR bytes of a `diagnostic_msgs/DiagnosticArray`.

    Args:
        stamp_ns: the instant at which the findings hold [ns].
        statuses: severity, reporting part, message, particulars; see `Status`.
        hardware_id: the machine's name.
    """
    status, pair = (
        message_class(f"diagnostic_msgs/msg/{n}") for n in ("DiagnosticStatus", "KeyValue")
    )
    found = [
        status(int(level), name, message, hardware_id, [pair(*each) for each in values.items()])
        for level, name, message, values in statuses
    ]
    return serialize(message_class(DIAGNOSTICS.ros_type)(header_of(stamp_ns, ""), found))


def decode_diagnostics(payload: bytes) -> Diagnostics:
    """Return what the CDR bytes of a `diagnostic_msgs/DiagnosticArray` say.

    Raises:
        InputError: the bytes are no such message.
    """
    message = deserialize(payload, DIAGNOSTICS.ros_type)
    stamp = message.header.stamp
    return Diagnostics(
        stamp.sec * NANOSECONDS + stamp.nanosec,
        [
            Status(s.level, s.name, s.message, {pair.key: pair.value for pair in s.values})
            for s in message.status
        ],
    )


def hardware_id_of(payload: bytes) -> str:
    """Return the machine that the first finding of a `DiagnosticArray` names; empty for none.

    Raises:
        InputError: the bytes are no such message.
    """
    message = deserialize(payload, DIAGNOSTICS.ros_type)
    return str(message.status[0].hardware_id) if message.status else ""
