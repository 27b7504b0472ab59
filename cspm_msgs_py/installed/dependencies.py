"""What the package depends on, by its own metadata: which version, which licence, what size."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import NamedTuple

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from cspm_msgs_py.installed.licence import licence_of

PACKAGE = "cspm"
# Those that a user asks for; the others serve the source tree.
EXTRAS = ("ros", "files", "benches", "tables", "campaign", "mujoco", "fmu", "view")


class Dependency(NamedTuple):
    """A distribution that the package depends on, directly or through another.

    Attributes:
        name: as its index has it.
        extra: of this package that brings it; empty for a base installation.
        version: that is installed; None where it is absent.
        licence: an SPDX expression, `NOASSERTION` where none is stated.
        size: of its files [bytes].
    """

    name: str
    extra: str
    version: str | None
    licence: str
    size: int


def dependencies(package: str = PACKAGE, extras: Sequence[str] = EXTRAS) -> list[Dependency]:
    """Return all dependencies, those of a base installation first, then those that extras add.

    Raises:
        PackageNotFoundError: the package itself is not installed.
    """
    found: dict[str, Dependency] = {}
    for extra in ("", *extras):
        for name, installed in _closure(package, extra).items():
            found.setdefault(name, _dependency(name, extra, installed))
    return list(found.values())


def unmet(extra: str = "", package: str = PACKAGE) -> list[str]:
    """Return the direct requirements of an extra, or of the base, that are not met.

    Raises:
        PackageNotFoundError: the package itself is not installed.
    """
    return [f"{each.name}{each.specifier}" for each in _own(package, extra) if not _is_met(each)]


def _own(package: str, extra: str) -> Iterator[Requirement]:
    """Yield what a package requires here by itself for an extra; without one, for its base."""
    for each in _required(distribution(package), frozenset({extra})):
        if bool(extra) == (each.marker is not None and not each.marker.evaluate({"extra": ""})):
            yield each


def _is_met(requirement: Requirement) -> bool:
    installed = _installed(requirement.name)
    return installed is not None and requirement.specifier.contains(installed.version, True)


def _closure(package: str, extra: str) -> dict[str, Distribution | None]:
    """Return what an extra brings and what that needs, by canonical name; None for the absent."""
    found: dict[tuple[str, frozenset[str]], Distribution | None] = {}
    waiting = list(_own(package, extra))
    while waiting:
        each = waiting.pop(0)
        key = (canonicalize_name(each.name), frozenset(each.extras))
        if key in found:
            continue
        found[key] = _installed(each.name)
        waiting += _required(found[key], key[1] | {""})
    return {name: installed for (name, _), installed in found.items()}


def _required(installed: Distribution | None, extras: frozenset[str]) -> list[Requirement]:
    """Return what a distribution requires on this platform, for some of its extras."""
    every = map(Requirement, (installed.requires if installed else None) or ())
    return [
        each
        for each in every
        if each.marker is None or any(each.marker.evaluate({"extra": extra}) for extra in extras)
    ]


def _installed(name: str) -> Distribution | None:
    try:
        return distribution(name)
    except PackageNotFoundError:
        return None


def _dependency(name: str, extra: str, installed: Distribution | None) -> Dependency:
    if installed is None:
        return Dependency(name, extra, None, licence_of(None), 0)
    places = (Path(each.locate()) for each in installed.files or ())
    size = sum(place.stat().st_size for place in places if place.is_file())
    return Dependency(
        installed.metadata["Name"], extra, installed.version, licence_of(installed), size
    )
