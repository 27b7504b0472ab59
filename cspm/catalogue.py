"""The catalogue of effects as a script sees it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from cspm_sim.effects import Effect, catalogue
from cspm_sim.effects.own_files import VARIABLE


def effects() -> Mapping[str, Effect]:
    """Return all effects that can be planted and recognised, by id.

    Of each: `parameters` with name, unit, minimum and maximum; `block`, the part of the machine;
    `equation`; `shows`; `separating_experiment`; `reference`.

    Examples:
        >>> import cspm
        >>> [p.unit for p in cspm.effects()["winch_coulomb_friction"].parameters]
        ['N·m']
    """
    return dict(catalogue())


def use_effects(path: str | Path) -> None:
    """Add the effects that a Python file, or each file of a folder, declares as `EFFECT`.

    They hold for this process and for those that it starts, as the environment variable
    CSPM_EFFECTS does; see `docs/how-to/add-an-effect.md`.

    Raises:
        InputError: no such file, one that declares no effect, or an id that is taken.
    """
    place = str(Path(path).resolve())
    before = os.environ.get(VARIABLE)
    known = before.split(os.pathsep) if before else []
    if place in known:
        return
    os.environ[VARIABLE] = os.pathsep.join([*known, place])
    catalogue.cache_clear()
    try:
        catalogue()
    except BaseException:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before
        catalogue.cache_clear()
        raise
