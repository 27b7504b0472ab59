"""Files of test benches: TDMS of LabVIEW and MDF of the vehicle trade."""

from __future__ import annotations

import gc
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from cspm_ident.importing.sources.loaded_table import LoadedTable, Vector
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library

Channel: TypeAlias = tuple[str, str, Vector]
"""Group, name and values."""
_STEP = "wf_increment"


class TdmsSource(LoadedTable):
    """A TDMS file; channels that only one group has by their name, others as `group.name`.

    A group whose channels are waveforms has no stamps but a step: its column `time` counts in s
    from its first sample. See `Source`.
    """

    kind = "TDMS file"

    def __init__(self, path: Path) -> None:
        """Read all channels.

        Raises:
            InputError: npTDMS is missing, or the file is damaged or holds no channel.
        """
        super().__init__(path)
        library = extra_library("nptdms", "benches", str(path), ", or exported as a text table")
        found = _read(path, self.kind, lambda: _groups(library.TdmsFile.read(path)))
        self._vectors = _named(path, found)
        self.columns = tuple(self._vectors)


class MdfSource(LoadedTable):
    """An MDF file of version 3 or 4, as `TdmsSource`; each group's stamps are its `time`."""

    kind = "MDF file"

    def __init__(self, path: Path) -> None:
        """Read all channels.

        Raises:
            InputError: asammdf is missing, or the file is damaged or holds no channel.
        """
        super().__init__(path)
        library = extra_library("asammdf", "benches", str(path), ", or exported as a text table")

        def signals() -> list[Channel]:
            with library.MDF(path) as file:
                return list(_signals(file))

        self._vectors = _named(path, _read(path, self.kind, signals))
        self.columns = tuple(self._vectors)


def _groups(file: Any) -> Iterable[Channel]:  # noqa: ANN401 - of a library
    """Yield each channel of a TDMS file, and the times that waveforms imply."""
    for group in file.groups():
        channels = group.channels()
        stepped = [each for each in channels if _STEP in each.properties and len(each)]
        if stepped and not any(each.name == "time" for each in channels):
            step = float(stepped[0].properties[_STEP])
            yield group.name, "time", step * np.arange(len(stepped[0]))
        for each in channels:
            yield group.name, each.name, np.asarray(each[:])


def _signals(file: Any) -> Iterable[Channel]:  # noqa: ANN401 - as above
    """Yield each group's stamps, then its signals, of an MDF file."""
    for number, group in enumerate(file.groups):
        master = file.masters_db.get(number)
        if master is not None:
            yield str(number), "time", np.asarray(file.get_master(number))
        for index, _ in enumerate(group.channels):
            if index != master:
                signal = file.get(group=number, index=index)
                yield str(number), signal.name, np.asarray(signal.samples)


def _read(path: Path, kind: str, read: Callable[[], Iterable[Channel]]) -> list[Channel]:
    found, wrong = [], ""
    with _deleted_quietly():
        try:
            found = [each for each in read() if each[2].ndim == 1 and len(each[2])]
        except Exception as err:  # of many kinds, whatever the damage makes the reader do
            wrong = " ".join(str(err).split()) or type(err).__name__
        if wrong:
            gc.collect()
    if wrong:
        raise InputError(f"{path}: no {kind} that can be read ({wrong})")
    if not found:
        raise InputError(f"{path}: holds no channel of numbers, allowed: at least one")
    return found


@contextmanager
def _deleted_quietly() -> Iterator[None]:
    """Keep silent what a reader that failed half-way raises when it is deleted."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _named(path: Path, found: list[Channel]) -> dict[str, Vector]:
    """Return channels by name, those that several groups have with their group's before it."""
    count = Counter(name for _, name, _ in found)
    named = {
        name if count[name] == 1 else f"{group}.{name}": vector for group, name, vector in found
    }
    if len(named) < len(found):
        twice = next(name for name, number in count.items() if number > 1)
        raise InputError(f"{path}: a group has channel '{twice}' twice, allowed: once")
    return named
