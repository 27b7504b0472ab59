"""Links of the site that leave docs/, names in its tables, and the order of its sections.

The site is read offline: a link to a file outside docs/ becomes its text with the file's name, and
a picture outside docs/ is copied to the site. Long names in cells may be broken after `/`, `.` and
`_`, and nowhere else.
"""

import posixpath
import re
from pathlib import Path
from typing import Protocol

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.nav import Navigation

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(!?)\[([^\]]*)\]\((\.\.[^)\s#]*)(?:#[^)\s]*)?\)")
CELL = re.compile(r"<td.*?</td>", re.DOTALL)
SECTIONS = ("Tutorials", "How to", "Reference", "Explanation", "Decisions")
# The theme's, without names.
SEARCH = ('data-md-component="search" role="dialog"', 'id="__search"')
CODE = re.compile(r"(?<=<code>)[^<]+(?=</code>)")


class _File(Protocol):
    src_uri: str


class _Page(Protocol):
    file: _File


def on_files(files: Files, config: MkDocsConfig, **_: object) -> Files:
    """Add the pictures outside docs/ that pages show."""
    for file in list(files.documentation_pages()):
        for mark, _text, link in LINK.findall(file.content_string):
            target = _target(file.src_uri, link)
            if mark and not target.startswith("docs/") and target not in files.src_uris:
                files.append(File.generated(config, target, abs_src_path=str(ROOT / target)))
    return files


def on_nav(nav: Navigation, **_: object) -> Navigation:
    """List tutorials before how-to pages, and decisions last, as the front page does."""
    nav.items.sort(key=lambda item: SECTIONS.index(item.title) if item.is_section else -1)
    return nav


def on_page_markdown(markdown: str, page: _Page, **_: object) -> str:
    """Turn a link to a file outside docs/ into its text, with the name of the file."""
    place = page.file.src_uri

    def inside(found: re.Match[str]) -> str:
        target = _target(place, found[3])
        if target.startswith("docs/"):
            return found[0]
        if found[1]:
            return f"![{found[2]}]({posixpath.relpath(target, posixpath.dirname(place))})"
        return f"{found[2]} (`{target}`)"

    return LINK.sub(inside, markdown)


def on_post_page(output: str, **_: object) -> str:
    """Let names in cells be broken, and name the search for readers of screens."""
    for part in SEARCH:
        output = output.replace(part, f'{part} aria-label="Search"')
    return CELL.sub(lambda cell: CODE.sub(_breakable, cell[0]), output)


def on_post_template(output_content: str, **_: object) -> str:
    """Treat pages that come from no Markdown alike."""
    return on_post_page(output_content)


def _breakable(name: re.Match[str]) -> str:
    return re.sub(r"(?<=\w[/._])(?=\w)", "<wbr>", name[0])


def _target(page: str, link: str) -> str:
    """Return what a page of docs/ links, from the root of the repository."""
    return posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), link))
