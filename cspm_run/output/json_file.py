"""Plain data as JSON, in a file or on standard output."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

# Names standard output instead of a file.
STANDARD_OUTPUT = Path("-")


def write_json(path: Path, data: Any) -> None:  # noqa: ANN401 - any plain data
    """Write plain data as JSON; to standard output where the path is `-`."""
    text = json.dumps(data, indent=2) + "\n"
    if path == STANDARD_OUTPUT:
        sys.stdout.write(text)
    else:
        path.write_text(text, encoding="utf-8")
