"""Pages of the documentation whose tables a command renews."""

from __future__ import annotations

from pathlib import Path


def into_page(page: Path, name: str, text: str) -> None:
    """Put text between a page's marks `<!-- name -->` and `<!-- end -->`.

    Raises:
        ValueError: the page has no such marks.
    """
    start, end = f"<!-- {name} -->", "<!-- end -->"
    before, opened, rest = page.read_text(encoding="utf-8").partition(start)
    _, closed, after = rest.partition(end)
    if not (opened and closed):
        raise ValueError(f"{page}: no {start} with {end} behind it")
    page.write_text(f"{before}{start}\n{text}\n{end}{after}", encoding="utf-8")
