"""Files of others for tests of the import, written by the tests alone, and what they give."""

from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.typesys import Stores, get_typestore
from run_samples import SCENARIOS

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import load_mapping
from cspm_ident.importing.preparation import prepare
from cspm_msgs_py.testbed import load_testbed

ONE_WINCH = SCENARIOS / "testbeds" / "one_winch.yaml"
THESIS = SCENARIOS / "testbeds" / "thesis.yaml"
NOETIC = get_typestore(Stores.ROS1_NOETIC)


class Imported:
    """What an import gives, copied out of its store.

    Attributes:
        report: the report.
        stamps: stamps [ns] by topic.
        rows: rows by topic.
        topics: topics by name.
    """

    def __init__(self, prepared):
        self.report = prepared.report
        self.topics = {name: one.topic for name, one in prepared.messages.items()}
        self.stamps = {name: np.array(one.stamp_ns) for name, one in prepared.messages.items()}
        self.rows = {name: one.rows(slice(None)) for name, one in prepared.messages.items()}

    @property
    def suspected(self):
        """Where and kind of each suspicion."""
        return {(one.where, one.kind) for one in self.report.suspicions}

    @property
    def kinds(self):
        """Kinds of suspicions."""
        return {one.kind for one in self.report.suspicions}


def mapping_file(folder: Path, text: str) -> Path:
    """Write a mapping."""
    path = folder / "mapping.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def imported(source: Path, mapping: str, testbed: Path = ONE_WINCH, *, trial=False) -> Imported:
    """Import a file by a mapping's text; the mapping is put beside it."""
    path = mapping_file(source.parent, mapping)
    with ColumnStore() as store:
        shares = []
        prepared = prepare(
            source, load_mapping(path), load_testbed(testbed), store, shares.append, trial=trial
        )
        assert shares == sorted(shares)
        assert shares[-1:] == [1.0] or not shares or source.is_dir() or shares[-1] <= 1.0
        return Imported(prepared)


def table(path: Path, columns: dict[str, object], *, delimiter=",", decimal=".") -> Path:
    """Write a text table; numbers with all their digits, texts as they are."""

    def cell(value):
        text = value if isinstance(value, str) else repr(float(value))
        return text.replace(".", decimal)

    lines = [delimiter.join(columns)]
    lines += [delimiter.join(map(cell, row)) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def ros1_header(stamp_ns, frame=""):
    """Return a ROS 1 header."""
    time = NOETIC.types["builtin_interfaces/msg/Time"](*divmod(int(stamp_ns), 10**9))
    return NOETIC.types["std_msgs/msg/Header"](7, time, frame)


def ros1_bag(path: Path, topics: dict[str, tuple[str, list]]) -> Path:
    """Write a ROS 1 bag: by topic its type, and (log time, message) pairs."""
    with Rosbag1Writer(path) as writer:
        for name, (kind, messages) in topics.items():
            sender = writer.add_connection(name, kind, typestore=NOETIC)
            for log, message in messages:
                writer.write(sender, int(log), NOETIC.serialize_ros1(message, kind))
    return path
