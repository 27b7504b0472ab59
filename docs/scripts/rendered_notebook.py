"""A notebook as a page of the site: its text, code, and what the code gave."""

from __future__ import annotations

import json
from base64 import b64decode
from typing import Any, NamedTuple


class Rendered(NamedTuple):
    """A notebook's Markdown, and its pictures by the path that the text has them under."""

    text: str
    pictures: dict[str, bytes]


def rendered(notebook: str, name: str) -> Rendered:
    """Return a notebook's cells as Markdown, with a link to the notebook itself.

    Args:
        notebook: its JSON.
        name: of its file, which lies beside the page, `….ipynb`.
    """
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in json.loads(notebook)["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        for data in (each.get("data", {}) for each in cell["outputs"]):
            if "image/png" in data:
                place = f"{name.removesuffix('.ipynb')}_files/{len(pictures) + 1}.png"
                pictures[place] = b64decode("".join(data["image/png"]))
                parts.append(f"![What the code draws]({place})")
            elif data:
                parts.append(_shown(data))
    # Below the heading of the first cell.
    heading, _, rest = parts[0].partition("\n")
    parts[0] = f"{heading}\n\n[Download this notebook]({name})\n{rest}"
    return Rendered("\n\n".join(parts) + "\n", pictures)


def _shown(data: dict[str, Any]) -> str:
    """Return a table as it is, and text as a block."""
    if "text/html" in data:
        return "".join(data["text/html"]).strip().replace("\n\n", "\n")
    text = "".join(data["text/plain"]).strip("\n")
    return f"```text\n{text}\n```"
