"""Methods that can be compared: the diagnosis, it without each safeguard, and peers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import process_time
from typing import Any

from bench.blind.peers.library import Library, library_of
from bench.blind.scoring.ablation import ABLATIONS, diagnose_without
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.errors import InputError

CSPM = "cspm"
_WITHOUT = f"{CSPM}-without-"
_ROOM = "bench.blind.peers"
# By name, the module and what has to be installed for it.
_PEERS: Mapping[str, tuple[str, str | None]] = {
    "retuned": (f"{_ROOM}.retuned", None),
    "stepwise": (f"{_ROOM}.stepwise", "sklearn"),
    "lasso": (f"{_ROOM}.lasso", "sklearn"),
    "sindy": (f"{_ROOM}.sindy", "pysindy"),
    "black-box": (f"{_ROOM}.black_box", "sklearn"),
}
ABLATED = tuple(_WITHOUT + name for name in ABLATIONS)
PEERS = tuple(_PEERS)
METHODS = (CSPM, *ABLATED, *PEERS)


def require_method(name: str) -> None:
    """Refuse a method that there is not.

    Raises:
        InputError: no such method, or what it needs is not installed.
    """
    if name not in METHODS:
        raise InputError(f"--method {name}: allowed: {', '.join(METHODS)}")
    _, package = _PEERS.get(name, ("", None))
    if package is not None and find_spec(package) is None:
        raise InputError(
            f"--method {name}: {package} is not installed, allowed: after pip install cspm[blind]"
        )


class Methods:
    """Methods on the recordings of one machine; what several of them need is worked out once."""

    def __init__(self, searched: Sequence[Path], held_out: Sequence[Path] = ()) -> None:
        """Take the recordings' folders.

        Args:
            searched: what may be searched.
            held_out: what is judged; if empty, the last part of what is searched.

        Raises:
            InputError: one cannot be read.
        """
        begun = process_time()
        self._searched = [read_measurement(each) for each in searched]
        self._held_out = [read_measurement(each) for each in held_out]
        # A process may have worked on others before.
        self._before = process_time() - begun
        self._library_cost = 0.0

    def diagnosis_by(self, name: str) -> tuple[dict[str, Any], float]:
        """Return what a method says, in the shape of `diagnosis.json`, and its processor time [s].

        What was worked out for several counts for each of them.

        Args:
            name: one of `METHODS`.

        Raises:
            InputError: the recording has nothing to diagnose.
        """
        library = self._library if name in _PEERS else None
        begun = process_time()
        if library is not None:
            reported: dict[str, Any] = import_module(_PEERS[name][0]).diagnosis_of(library)
            return reported, self._before + self._library_cost + process_time() - begun
        if name == CSPM:
            found = diagnose(self._searched, self._held_out)
        else:
            (measurement,) = self._searched
            found = diagnose_without(measurement, name.removeprefix(_WITHOUT))
        return diagnosis_data(found), self._before + process_time() - begun

    @cached_property
    def _library(self) -> Library:
        begun = process_time()
        library = library_of(self._searched, self._held_out)
        self._library_cost = process_time() - begun
        return library
