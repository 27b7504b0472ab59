"""A positive number for all cables, or one by name or kind of cable."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

from pydantic import Discriminator, PositiveFloat, Tag

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.model_fault import MAPPING, NUMBER
from cspm_msgs_py.testbed_keys.near_name import allowed_names


def _form(value: object) -> str:
    return MAPPING if isinstance(value, dict) else NUMBER


PerCable = Annotated[
    Annotated[PositiveFloat, Tag(NUMBER)] | Annotated[dict[str, PositiveFloat], Tag(MAPPING)],
    Discriminator(_form),
]


def cable_kind(name: str) -> str:
    """Return the kind of a cable, its name without a last number: `hoist` of `hoist_1`."""
    return re.sub(r"[_-]?\d+$", "", name) or name


def values_per_cable(
    given: float | dict[str, float], names: Sequence[str], default: float, key: str
) -> tuple[float, ...]:
    """Return one value per cable; a cable's own name goes before that of its kind.

    Args:
        given: a number for all, or by name or kind of cable.
        names: of the cables.
        default: of a cable that is not named.
        key: names the value in errors.

    Raises:
        InputError: a name that is no cable and no kind of cable.
    """
    if not isinstance(given, dict):
        return (given,) * len(names)
    allowed = dict.fromkeys((*map(cable_kind, names), *names))
    unknown = [name for name in given if name not in allowed]
    if unknown:
        raise InputError(f"{key}: {unknown[0]}, {allowed_names(unknown[0], allowed)}")
    return tuple(given.get(name, given.get(cable_kind(name), default)) for name in names)
