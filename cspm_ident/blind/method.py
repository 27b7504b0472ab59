"""Methods that can be compared: the diagnosis, it without each safeguard, and peers."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cspm_ident.blind.ablation import ABLATIONS, diagnose_without
from cspm_ident.blind.peers.library import library_of
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.verdict import diagnosis_data
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.errors import InputError

CSPM = "cspm"
_WITHOUT = f"{CSPM}-without-"
# By name, the module of `cspm_ident.blind.peers` and what has to be installed for it.
_PEERS: Mapping[str, tuple[str, str | None]] = {
    "retuned": ("retuned", None),
    "stepwise": ("stepwise", "sklearn"),
    "lasso": ("lasso", "sklearn"),
    "sindy": ("sindy", "pysindy"),
    "black-box": ("black_box", "sklearn"),
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


def diagnosis_by(name: str, recording: Path) -> dict[str, Any]:
    """Return what a method says of a recording, in the shape of `diagnosis.json`.

    Args:
        name: one of `METHODS`.
        recording: its folder.

    Raises:
        InputError: the recording cannot be used.
    """
    measurement = read_measurement(recording)
    if name == CSPM:
        return diagnosis_data(diagnose([measurement]))
    if name.startswith(_WITHOUT):
        return diagnosis_data(diagnose_without(measurement, name.removeprefix(_WITHOUT)))
    module, _ = _PEERS[name]
    peer = import_module(f"cspm_ident.blind.peers.{module}")
    told: dict[str, Any] = peer.diagnosis_of(library_of(measurement))
    return told
