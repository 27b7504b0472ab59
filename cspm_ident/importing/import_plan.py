"""A mapping laid against a test-bed and a file: what is to be read, and what becomes of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from math import isnan, nan

from cspm_checks.channel import field_quantity
from cspm_ident.importing.conversion import Conversion, conversion_of
from cspm_ident.importing.mapping import ChannelSource, Clock, MappingFile
from cspm_ident.importing.sources.joined_source import file_of
from cspm_ident.importing.sources.row_choice import row_choice
from cspm_ident.importing.sources.source import Source
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import PARTS
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE, Topic

ANGLES = ("roll", "pitch", "yaw")
_QUATERNION = POSE[3:]
_JOINTS = "sensor_msgs/msg/JointState"


@dataclass(frozen=True)
class PlannedField:
    """One number of a message.

    Attributes:
        name: the field; of a pose also `roll`, `pitch`, `yaw`.
        column: where it comes from, None for a constant.
        constant: its value in SI, None for a column.
        conversion: from raw to SI; None for a constant.
        source: what the mapping says of it; None where it says nothing.
        clock: name of the clock, empty for a constant.
        stamps: columns of the stamps, which are added up; none with a rate.
        logged: column of the time of the log, where the stamps are those of headers.
    """

    name: str
    column: str | None
    constant: float | None = None
    conversion: Conversion | None = None
    source: ChannelSource | None = None
    clock: str = ""
    stamps: tuple[str, ...] = ()
    logged: str | None = None

    @property
    def is_unmeasured(self) -> bool:
        """Whether nothing gives its number, which is NaN."""
        return self.constant is not None and isnan(self.constant)


@dataclass(frozen=True)
class PlannedTopic:
    """One topic: as it will be recorded, and its fields in the order of the mapping."""

    topic: Topic
    fields: tuple[PlannedField, ...]

    @property
    def is_constant(self) -> bool:
        """Whether no number of it comes from a column: what stands still."""
        return all(field.column is None for field in self.fields)


@dataclass(frozen=True)
class ImportPlan:
    """All topics, and the clocks by name."""

    topics: tuple[PlannedTopic, ...]
    clocks: dict[str, Clock]

    @property
    def numbers(self) -> list[str]:
        """Columns with numbers, each once."""
        found = [f.column for t in self.topics for f in t.fields if f.column is not None]
        return list(dict.fromkeys(found))

    @property
    def times(self) -> dict[str, str | None]:
        """Columns with stamps, each with its unit; None where that was not said."""
        found: dict[str, str | None] = {}
        for field in (f for t in self.topics for f in t.fields if f.stamps):
            clock = self.clocks[field.clock]
            units = clock.units if clock.columns else ("ns",) * len(field.stamps)
            found |= dict(zip(field.stamps, units, strict=True))
            found |= {field.logged: "ns"} if field.logged else {}
        return found


def plan_import(mapping: MappingFile, testbed: Testbed, source: Source) -> ImportPlan:
    """Return what an import will do.

    Raises:
        InputError: a topic or field that the test-bed has not, a message with numbers missing, a
            unit that does not fit, or a clock that the file cannot have.
    """
    where = str(mapping.path)
    clocks = dict(mapping.mapping.clocks)
    if not clocks:
        if not source.stamped:
            raise InputError(f"{where}: clocks: missing, allowed: at least one with column or rate")
        clocks["header"] = Clock(stamp="header")
    possible = importable(testbed)
    planned = []
    for name, fields in mapping.mapping.channels.items():
        if name not in possible:
            raise InputError(
                f"{where}: channels.{name}: no topic of test-bed {testbed.name} that can be"
                f" imported, allowed: {', '.join(possible)}"
            )
        key = f"{where}: channels.{name}"
        topic = _topic_with(possible[name], list(fields), key)
        files = mapping.mapping.files
        read = [_field(topic, f, fields[f], clocks, source, files, f"{key}.{f}") for f in fields]
        # Load cells on some cables: the others have no number.
        rest = [PlannedField(f, None, nan) for f in topic.fields if f not in fields]
        planned.append(PlannedTopic(topic, (*read, *rest) if topic.joint_names else tuple(read)))
        if planned[-1].is_constant and topic.joint_names:
            raise InputError(f"{key}: constants only, allowed: at least one column")
    if all(each.is_constant for each in planned):
        raise InputError(f"{where}: channels: constants only, allowed: at least one column")
    return ImportPlan(tuple(planned), clocks)


def importable(testbed: Testbed) -> dict[str, Topic]:
    """Return the topics with numbers that somebody can have measured or commanded."""
    return {
        name: topic
        for name, topic in testbed.topics.items()
        if topic.fields and not name.startswith("/truth/")
    }


def _topic_with(topic: Topic, given: Collection[str], where: str) -> Topic:
    """Return the topic with the parts that are given.

    Raises:
        InputError: a field is unknown, or one of a message that comes whole is missing.
    """
    wanted: tuple[str, ...] = topic.fields
    if topic.ros_type == _JOINTS:
        parts = tuple(p for p in topic.parts if any(f.startswith(f"{p}/") for f in given))
        _check_known(given, topic.fields, where)
        wanted = tuple(f"{part}/{joint}" for part in parts for joint in topic.joint_names)
        topic = replace(topic, fields=wanted, parts=tuple(p for p in PARTS if p in parts))
    elif "qw" in topic.fields:
        angles = any(name in given for name in ANGLES)
        euler = tuple(f for f in topic.fields if f not in _QUATERNION) + ANGLES
        _check_known(given, {*topic.fields, *ANGLES}, where)
        if angles and any(name in given for name in _QUATERNION):
            raise InputError(f"{where}: angles and quaternion, allowed: one of both")
        wanted = euler if angles else topic.fields
    else:
        _check_known(given, topic.fields, where)
    missing = [field for field in wanted if field not in given]
    if missing and topic.name != "/cables/tension":
        raise InputError(
            f"{where}: without {', '.join(missing)}, allowed: all of {', '.join(wanted)};"
            " `constant` gives what is known without a sensor"
        )
    return topic


def _check_known(given: Collection[str], known: Collection[str], where: str) -> None:
    for field in given:
        if field not in known:
            raise InputError(f"{where}: no field '{field}', allowed: {', '.join(sorted(known))}")


def _field(
    topic: Topic,
    name: str,
    given: ChannelSource,
    clocks: dict[str, Clock],
    source: Source,
    files: Collection[str],
    where: str,
) -> PlannedField:
    if given.column is None:
        return PlannedField(name, None, given.constant)
    chosen = given.clock or own_clock(given.column, clocks, files, where)
    clock = clocks[chosen]
    if clock.stamp is not None:
        stamps: tuple[str, ...] = (source.stamp_column(given.column, clock.stamp),)
    elif clock.column is not None and source.stamped:
        raise InputError(f"{where}: clock '{chosen}' has a column, allowed: stamp or rate in a bag")
    else:
        _check_file(given.column, chosen, clock, files, where)
        stamps = tuple(_same_rows(each, given.column, source) for each in clock.columns)
    header = clock.stamp == "header"
    logged = source.stamp_column(given.column, "log") if header else None
    conversion = conversion_of(given, field_quantity(topic, name), where)
    return PlannedField(name, given.column, None, conversion, given, chosen, stamps, logged)


def own_clock(column: str, clocks: dict[str, Clock], files: Collection[str], where: str) -> str:
    """Return the first clock that can be of a column's file."""
    for name, clock in clocks.items():
        if _is_of_its_file(clock, column, files):
            return name
    own = file_of(column, files) or "that is imported"
    raise InputError(
        f"{where}: no clock of file '{own}', allowed: one whose column is in the channel's own file"
    )


def _is_of_its_file(clock: Clock, column: str, files: Collection[str]) -> bool:
    return all(file_of(each, files) == file_of(column, files) for each in clock.columns)


def _check_file(column: str, name: str, clock: Clock, files: Collection[str], where: str) -> None:
    if not _is_of_its_file(clock, column, files):
        raise InputError(
            f"{where}: clock '{name}' is of another file than column '{column}', allowed: a clock"
            " of its own file"
        )


def _same_rows(stamp: str, column: str, source: Source) -> str:
    """Return the column of stamps in those rows that a column takes."""
    choice = row_choice(column, source.columns)
    if choice is None or row_choice(stamp) is not None:
        return stamp
    return choice._replace(column=stamp).name
