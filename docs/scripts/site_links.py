"""Links of the site that leave docs/, its notebook, files to download, and its sections' order.

The site is read offline: a link to a file outside docs/ becomes its text with the file's name, and
a picture outside docs/ is copied to the site. Long names in cells may be broken after `/`, `.` and
`_`, and nowhere else. A file that a page has its reader write can be downloaded beside it.
"""

import posixpath
import re
import sys
from pathlib import Path
from typing import Protocol

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.nav import Navigation

# Of hooks, only the file itself is loaded.
sys.path.insert(0, str(Path(__file__).parent))
from rendered_notebook import rendered

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"(!?)\[([^\]]*)\]\((\.\.[^)\s#]*)(?:#[^)\s]*)?\)")
CELL = re.compile(r"<td.*?</td>", re.DOTALL)
SECTIONS = ("Tutorials", "How to", "Reference", "Explanation", "Decisions")
# The theme's, without names.
SEARCH = ('data-md-component="search" role="dialog"', 'id="__search"')
# A file that a page has its reader write.
WRITTEN = re.compile(r"<!-- file: (\S+) -->\n```\w*\n(.*?)^```", re.DOTALL | re.MULTILINE)
NOTEBOOK = ".ipynb"
CODE = re.compile(r"(?<=<code>)[^<]+(?=</code>)")


class _File(Protocol):
    src_uri: str


class _Page(Protocol):
    file: _File


def on_files(files: Files, config: MkDocsConfig, **_: object) -> Files:
    """Add the pictures outside docs/ that pages show, notebooks as pages, and files to download."""
    for file in list(files):
        if file.src_uri.endswith(NOTEBOOK):
            folder, name = posixpath.split(file.src_uri)
            page = file.src_uri.removesuffix(NOTEBOOK) + ".md"
            text, pictures = rendered(file.content_string, name)
            files.append(File.generated(config, page, content=text))
            for place, picture in pictures.items():
                files.append(File.generated(config, f"{folder}/{place}", content=picture))
    for file in list(files.documentation_pages()):
        for name, text in WRITTEN.findall(file.content_string):
            place = _download(file.src_uri, name)
            files.append(File.generated(config, place, content=text))
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

    def written(found: re.Match[str]) -> str:
        link = posixpath.relpath(_download(place, found[1]), posixpath.dirname(place) or ".")
        return f"[Download `{found[1]}`]({link})\n\n{found[0]}"

    # The page itself links the notebook, to be downloaded.
    own = posixpath.basename(place).replace(".md", NOTEBOOK)
    pages = re.sub(rf"(\]\((?!{re.escape(own)})[^)\s]*)\.ipynb(?=\))", r"\1.md", markdown)
    return WRITTEN.sub(written, LINK.sub(inside, pages))


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


def _download(page: str, name: str) -> str:
    """Return where the site has a file of a page."""
    return f"{page.removesuffix('.md')}_files/{name}"


def _target(page: str, link: str) -> str:
    """Return what a page of docs/ links, from the root of the repository."""
    return posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), link))
