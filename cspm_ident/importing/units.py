"""Units that recordings come in, each with its quantity and its factor to SI."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cspm_ident.importing.time_text import TEXT_UNITS
from cspm_msgs_py.errors import InputError

COUNTS = "counts"
_TURN = 2.0 * np.pi
_DEGREE = np.pi / 180.0
_POUND = 0.45359237
_G = 9.80665
_INCH = 0.0254

_FACTORS: dict[str, dict[str, float]] = {
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE, "turn": _TURN, "rev": _TURN},
    "rad/s": {"rad/s": 1.0, "deg/s": _DEGREE, "rpm": _TURN / 60.0, "rev/s": _TURN},
    "rad/s²": {"rad/s^2": 1.0, "deg/s^2": _DEGREE},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": _INCH, "ft": 12 * _INCH},
    "m/s": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "m/min": 1.0 / 60.0},
    "m/s²": {"m/s^2": 1.0, "mm/s^2": 1e-3, "g": _G},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": _G, "gf": 1e-3 * _G, "lbf": _POUND * _G},
    "N·m": {
        "N·m": 1.0,
        "Nm": 1.0,
        "mN·m": 1e-3,
        "mNm": 1e-3,
        "N·cm": 1e-2,
        "Ncm": 1e-2,
        "kN·m": 1e3,
        "kgf·cm": 1e-2 * _G,
        "lbf·in": _POUND * _G * _INCH,
        "ozf·in": _POUND / 16.0 * _G * _INCH,
    },
    "1": {"1": 1.0, "%": 1e-2},
    "V": {"V": 1.0, "mV": 1e-3},
    "A": {"A": 1.0, "mA": 1e-3},
    COUNTS: {COUNTS: 1.0},
}
_DAY = 86400.0
TIME_FACTORS = {
    **{"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    **dict.fromkeys(("d", "datenum", "excel"), _DAY),
}
TIME_ZEROS = {"datenum": 719529.0, "excel": 25569.0}
"""What MATLAB and spreadsheets count for the beginning of 1970 [d]."""
TIME_UNITS = (*TIME_FACTORS, *TEXT_UNITS)


class Unit(NamedTuple):
    """A unit: the SI unit of its quantity (`rad` for `deg`), and its factor to that."""

    quantity: str
    factor: float


_UNITS = {
    name: Unit(quantity, factor)
    for quantity, factors in _FACTORS.items()
    for name, factor in factors.items()
}


def unit_of(name: str, where: str) -> Unit:
    """Return a unit by name; `where` names the key in errors.

    Raises:
        InputError: there is no such unit.
    """
    if not is_unit(name):
        raise InputError(f"{where}: unit '{name}', allowed: {', '.join(_UNITS)}")
    return _UNITS[_one_sign(name)]


def is_unit(name: str) -> bool:
    """Return whether there is a unit of that name."""
    return _one_sign(name) in _UNITS


def _one_sign(name: str) -> str:
    """Return a name of a unit with the prefix and signs that are written here."""
    return name.replace("\u00b5", "u").replace("\u03bc", "u").replace("\u00b2", "^2")


def units_for(quantity: str) -> tuple[str, ...]:
    """Return the names of the units of a quantity, given by its SI unit."""
    return tuple(_FACTORS[quantity])
