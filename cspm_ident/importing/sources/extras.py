"""Libraries that some kinds of file need, and that are not always there."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from cspm_msgs_py.errors import InputError


def needed(module: str, path: Path) -> Any:  # noqa: ANN401 - a module
    """Return a module that reading a file needs.

    Raises:
        InputError: it is not installed, with the line that installs it.
    """
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(
            f"{path}: reading it needs {package}, allowed: pip install 'cspm[files]', or a text"
            " table"
        ) from None
