"""Links of the site that leave docs/: shown as names of files, since the site is read offline."""

import posixpath
import re
from typing import Protocol

LINK = re.compile(r"\[([^\]]*)\]\((\.\.[^)\s#]*)(?:#[^)\s]*)?\)")


class _File(Protocol):
    src_uri: str


class _Page(Protocol):
    file: _File


def on_page_markdown(markdown: str, page: _Page, **_: object) -> str:
    """Turn a link to a file outside docs/ into its text, with the name of the file."""
    folder = posixpath.dirname(page.file.src_uri)

    def inside(found: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join("docs", folder, found[2]))
        return found[0] if target.startswith("docs/") else f"{found[1]} (`{target}`)"

    return LINK.sub(inside, markdown)
