"""The effects catalogue: every module of this package that declares an `EFFECT`, and one's own."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import walk_packages

from cspm_msgs_py.errors import InputError
from cspm_sim.effects.effect import (
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Elements,
    Hook,
    Physics,
    Regression,
    Sense,
    Signature,
)
from cspm_sim.effects.own_files import VARIABLE, own_effects

__all__ = [
    "Block",
    "Channel",
    "Description",
    "Effect",
    "EffectParameter",
    "Elements",
    "Hook",
    "Physics",
    "Regression",
    "Sense",
    "Signature",
    "catalogue",
]


@cache
def catalogue() -> dict[str, Effect]:
    """Return all effects by id, in alphabetical order, one's own among them.

    Raises:
        InputError: a file of `CSPM_EFFECTS` is unusable, or its effect's id is taken.
    """
    found = walk_packages(__path__, f"{__name__}.")
    modules = (import_module(info.name) for info in found if not info.ispkg)
    effects = {module.EFFECT.id: module.EFFECT for module in modules if hasattr(module, "EFFECT")}
    for effect in own_effects():
        if effect.id in effects:
            raise InputError(f"{VARIABLE}: {effect.id} is there already, allowed: another id")
        effects[effect.id] = effect
    return dict(sorted(effects.items()))
