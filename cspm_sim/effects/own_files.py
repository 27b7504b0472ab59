"""Effects of one's own: files outside this package that declare an `EFFECT`."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from dataclasses import fields
from hashlib import sha256
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from cspm_msgs_py.errors import InputError
from cspm_sim.effects.effect import Description, Effect, Physics, Signature

# Files, or folders of files, joined as in PATH. Processes that a run starts inherit it.
VARIABLE = "CSPM_EFFECTS"


def own_effects() -> list[Effect]:
    """Return the effects that the files of `CSPM_EFFECTS` declare; none where it is not set.

    Files of a folder that declare no `EFFECT` may help the others.

    Raises:
        InputError: no such file, it cannot be run, or what it declares is no effect.
    """
    places = [Path(part) for part in os.environ.get(VARIABLE, "").split(os.pathsep) if part]
    return [effect for place in places for effect in _effects_at(place)]


def _effects_at(place: Path) -> Iterator[Effect]:
    if place.is_dir():
        found = [effect for path in sorted(place.glob("*.py")) for effect in _effect_of(path)]
        if not found:
            raise InputError(f"{VARIABLE}: {place} has no effect, allowed: files with an EFFECT")
        yield from found
        return
    if place.suffix != ".py" or not place.is_file():
        raise InputError(f"{VARIABLE}: {place}: no such file, allowed: .py files and folders")
    found = list(_effect_of(place))
    if not found:
        raise InputError(f"{VARIABLE}: {place} declares no EFFECT, allowed: EFFECT = Effect(...)")
    yield from found


def run_file(path: Path, name: str) -> ModuleType:
    """Run a Python file, and return it as a module; one that fails is forgotten.

    Args:
        path: of the file.
        name: of the module, where `dataclass` and `pickle` look for what a class belongs to.

    Raises:
        Exception: whatever the file raises.
    """
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception:
        del sys.modules[name]
        raise
    return module


def _effect_of(path: Path) -> Iterator[Effect]:
    """Yield what a file declares, if anything."""
    name = f"cspm_own_effects_{sha256(str(path.resolve()).encode()).hexdigest()[:12]}_{path.stem}"
    try:
        module = run_file(path, name)
    except Exception as err:
        moved = _moved_argument(err)
        if moved:
            raise InputError(f"{VARIABLE}: {path}: {moved}") from err
        raise InputError(
            f"{VARIABLE}: {path}: {type(err).__name__}: {err}, allowed: a file that Python can run"
        ) from err
    declared = getattr(module, "EFFECT", None)
    if declared is None:
        return
    if not isinstance(declared, Effect):
        raise InputError(
            f"{VARIABLE}: {path}: EFFECT is a {type(declared).__name__}, allowed: an Effect"
        )
    yield declared


def _moved_argument(err: Exception) -> str:
    """Return what to change in a file that gives `Effect` what its parts take now; empty if not."""
    found = re.match(r"Effect\.__init__\(\) got an unexpected keyword argument '(\w+)'", str(err))
    if not isinstance(err, TypeError) or not found:
        return ""
    old = found[1]
    new = {"twins": "confounded_with"}.get(old, old)
    for part in (Physics, Signature, Description):
        if new in (field.name for field in fields(part)):
            where = f"{part.__name__.lower()}={part.__name__}({new}=…)"
            return (
                f"'{old}' is no argument of Effect since version 0.2, allowed: {where}; Effect"
                " takes id, block, parameters, elements, physics, signature, description"
            )
    return ""
