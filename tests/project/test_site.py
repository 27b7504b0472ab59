"""The site is built from the pages without a warning, and nothing on it leads nowhere."""

import importlib
import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote, urlsplit

import pytest
from accessibility import serious_findings
from driven_browser import driven_browser
from mkdocs.utils import dirname_to_title

ROOT = Path(__file__).resolve().parents[2]
LEADS = {"a": "href", "img": "src", "link": "href", "script": "src"}
# Paragraphs in an item of a list need four blanks on the site, a list an empty line before it.
CONTINUED = re.compile(r"\n\s*\n {1,3}(?![ `-])\S.*")
ITEM = re.compile(r"[-*] |\d+\. ")


class Leads(HTMLParser):
    """What a page leads to, shows and loads, and what on it can be led to."""

    def __init__(self) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.places: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = {name: value or "" for name, value in attrs}
        self.places |= {known[name] for name in ("id", "name") if name in known}
        target = known.get(LEADS.get(tag, ""))
        if target:
            self.targets.append(target)


def leads_of(page: Path) -> Leads:
    found = Leads()
    found.feed(page.read_text(encoding="utf-8"))
    return found


def dead_ends(site: Path) -> list[str]:
    """Every link, picture, style and script of a site that is not in it, offline."""
    pages = {page.resolve(): leads_of(page) for page in sorted(site.rglob("*.html"))}
    found = []
    for page, leads in pages.items():
        # That of a server alone is led to from its root.
        for target in [] if page.name == "404.html" else leads.targets:
            parts = urlsplit(target)
            if parts.scheme in ("http", "https", "mailto"):
                continue
            place = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            there = place.is_file()
            if there and parts.fragment and place in pages:
                there = unquote(parts.fragment) in pages[place].places
            if not there:
                found.append(f"{page.relative_to(site.resolve())}: {target}")
    return found


def unseparated(text: str) -> list[str]:
    """First lines of lists and of paragraphs in lists that the site shows as plain text."""
    plain = re.sub(r"^ *```.*?^ *```", "", text, flags=re.MULTILINE | re.DOTALL)
    found = [each.strip() for each in CONTINUED.findall(plain)]
    for paragraph in re.split(r"\n\s*\n", plain):
        first, *others = paragraph.strip("\n").split("\n")
        if not ITEM.match(first.lstrip()):
            found += [line for line in others if ITEM.match(line)][:1]
    return found


def test_the_page_of_the_command_line_is_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "scripts"))
    command_line = importlib.import_module("command_line_page")
    committed = command_line.PAGE.read_text(encoding="utf-8")
    assert committed == command_line.page(), "run: python docs/scripts/command_line_page.py"


def test_lists_of_pages_are_lists_on_the_site() -> None:
    pages = sorted((ROOT / "docs").rglob("*.md"))
    assert len(pages) > 80
    found = {page.stem: unseparated(page.read_text(encoding="utf-8")) for page in pages}
    assert {page: lines for page, lines in found.items() if lines} == {}


def test_the_check_sees_what_becomes_plain_text() -> None:
    assert unseparated("Text:\n- item\n- item\n") == ["- item"]
    assert unseparated("- item\n\n  more of it\n") == ["more of it"]
    assert unseparated("Text:\n\n- item\n  goes on\n- item\n\n```\na\n- b\n```\n") == []


def test_the_check_sees_dead_ends(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<h2 id="here"><a href="#here"></a><a href="b.html#there"></a><img src="c.png">'
        '<a href="https://example.org"></a><a href="b.html#nowhere"></a>',
        encoding="utf-8",
    )
    (tmp_path / "b.html").write_text('<h2 id="there">', encoding="utf-8")
    assert dead_ends(tmp_path) == ["a.html: c.png", "a.html: b.html#nowhere"]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built without a warning."""
    pytest.importorskip("mkdocs", reason="pip install -e '.[docs]'")
    folder: Path = tmp_path_factory.mktemp("site")
    words = ["mkdocs", "build", "--strict", "--site-dir", str(folder)]
    found = subprocess.run(
        [sys.executable, "-m", *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr
    return folder


@pytest.mark.slow
def test_nothing_on_the_site_leads_nowhere(site: Path) -> None:
    # Of files, without a server: the index of the search as a script, and what runs it.
    assert (site / "search" / "search_index.js").exists()
    assert (site / "assets" / "iframe-worker.js").exists()
    python = (site / "reference" / "python.html").read_text(encoding="utf-8")
    cspm = importlib.import_module("cspm")
    assert [name for name in cspm.__all__ if f'id="cspm.{name}"' not in python] == []
    assert dead_ends(site) == []


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["default", "slate"])
def test_pages_of_each_kind_can_be_read_by_all(site: Path, scheme: str, tmp_path: Path) -> None:
    dark = f"document.body.setAttribute('data-md-color-scheme', '{scheme}')"
    with driven_browser(tmp_path) as browser:
        for page in ("index", "tutorials/your-controller", "how-to/view", "explanation/model"):
            browser.open((site / f"{page}.html").as_uri())
            browser.run(dark)
            # Colours change in an eighth of a second.
            browser.run("await Promise.all(document.getAnimations().map(each => each.finished))")
            assert (page, serious_findings(browser)) == (page, [])


def test_tutorials_are_listed_before_decisions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "scripts"))
    hook = importlib.import_module("site_links")
    names = ("", "Decisions", "Explanation", "How to", "Reference", "Tutorials")
    items = [SimpleNamespace(title=name, is_section=bool(name)) for name in names]
    nav = hook.on_nav(SimpleNamespace(items=items))
    found = [item.title for item in nav.items]
    assert found == ["", "Tutorials", "How to", "Reference", "Explanation", "Decisions"]
    folders = {
        dirname_to_title(place.name) for place in (ROOT / "docs").iterdir() if place.is_dir()
    }
    assert set(hook.SECTIONS) <= folders


def test_a_notebook_is_a_page_with_its_code_and_what_it_gave(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "scripts"))
    module = importlib.import_module("rendered_notebook")
    cells = [
        {"cell_type": "markdown", "source": ["# Title\n", "\n", "Text."]},
        {
            "cell_type": "code",
            "source": ["1 + 1"],
            "outputs": [
                {"data": {"text/html": ["<table>\n\n</table>"], "text/plain": ["hidden"]}},
                {"data": {"text/plain": ["2"]}},
                {"data": {"image/png": "UE5H", "text/plain": ["hidden"]}},
                {"name": "stderr", "text": ["noise"]},
            ],
        },
    ]
    text, pictures = module.rendered(json.dumps({"cells": cells}), "a.ipynb")
    assert text == (
        "# Title\n\n[Download this notebook](a.ipynb)\n\nText.\n\n"
        "```python\n1 + 1\n```\n\n<table>\n</table>\n\n```text\n2\n```\n\n"
        "![What the code draws](a_files/1.png)\n"
    )
    assert pictures == {"a_files/1.png": b"PNG"}


def test_files_of_a_page_can_be_downloaded_and_notebooks_are_linked_as_pages(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "scripts"))
    hook = importlib.import_module("site_links")
    page = SimpleNamespace(file=SimpleNamespace(src_uri="how-to/a.md"))
    text = "[N](../tutorials/n.ipynb)\n\n<!-- file: rig.yaml -->\n```yaml\nname: rig\n```\n"
    found = hook.on_page_markdown(text, page)
    assert found.startswith("[N](../tutorials/n.md)\n\n[Download `rig.yaml`](a_files/rig.yaml)\n")
    assert found.endswith("```yaml\nname: rig\n```\n")
    own = SimpleNamespace(file=SimpleNamespace(src_uri="tutorials/n.md"))
    assert hook.on_page_markdown("[Download](n.ipynb)", own) == "[Download](n.ipynb)"
