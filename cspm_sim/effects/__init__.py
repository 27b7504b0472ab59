"""The effects catalogue: every module of this package that declares an `EFFECT`."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from cspm_sim.effects.effect import (
    Block,
    Channel,
    Effect,
    EffectParameter,
    Elements,
    Hook,
    Regression,
    Sense,
)

__all__ = [
    "Block",
    "Channel",
    "Effect",
    "EffectParameter",
    "Elements",
    "Hook",
    "Regression",
    "Sense",
    "catalogue",
]


@cache
def catalogue() -> dict[str, Effect]:
    """Return all effects by id, in alphabetical order."""
    modules = (import_module(f"{__name__}.{info.name}") for info in iter_modules(__path__))
    effects = (module.EFFECT for module in modules if hasattr(module, "EFFECT"))
    return {effect.id: effect for effect in sorted(effects, key=lambda effect: effect.id)}
