"""Libraries that come with an extra of the package, and may be absent."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from cspm_msgs_py.errors import InputError


def extra_library(module: str, extra: str, what: str, instead: str = "") -> Any:  # noqa: ANN401 - a module
    """Return a library that comes with an extra.

    Args:
        module: to import, such as `pyarrow.parquet`.
        extra: of this package, such as `files`.
        what: needs it, the beginning of the error's line.
        instead: what does without it, the end of that line.

    Raises:
        InputError: it is not installed, or does not load, with the line that installs it.
    """
    try:
        return import_module(module)
    except ImportError as err:
        package = module.partition(".")[0]
        absent = isinstance(err, ModuleNotFoundError)
        wrong = "is not installed" if absent else f"cannot be loaded ({err})"
        raise InputError(
            f"{what}: {package} {wrong}, allowed: after {remedy(extra)}{instead}"
        ) from None


def refuse_absent(modules: Iterable[str], extra: str, what: str) -> None:
    """Refuse `what` where a library of an extra is absent, before any of them is loaded.

    Raises:
        InputError: one is not installed, with the line that installs it.
    """
    for module in modules:
        if find_spec(module) is None:
            raise InputError(f"{what}: {module} is not installed, allowed: after {remedy(extra)}")


def remedy(extra: str) -> str:
    """Return the command that installs an extra, quoted for shells that expand brackets."""
    return f"`pip install 'cspm[{extra}]'`"
