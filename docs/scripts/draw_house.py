"""Draw the packages and which imports which: docs/figures/house.svg, shown in CONTRIBUTING.md.

Run `python docs/scripts/draw_house.py`. Boxes stand above all that they import. An arrow is drawn
where a package imports another by itself: not where it reaches the same one through a third.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "figures" / "house.svg"
WIDTH, MARGIN, GAP, ARROW, LINE, LETTERS_PER_PIXEL = 900, 20, 40, 34, 17, 0.155
INK, PAPER, FAINT = "#30507a", "#eef3f9", "#5a6675"


class Package(NamedTuple):
    """A package as the picture shows it.

    Attributes:
        name: as it is imported.
        about: first line of its docstring.
        parts: names of the packages in it.
        imports: other packages that any module of it imports.
    """

    name: str
    about: str
    parts: tuple[str, ...]
    imports: frozenset[str]


class Box(NamedTuple):
    """Where a package is drawn [pixels], and its lines of text under the name."""

    left: float
    top: float
    width: float
    height: float
    lines: tuple[str, ...]


def read_packages(root: Path) -> dict[str, Package]:
    """Return the packages in a folder by name: those that are installed, and the benchmark."""
    names = {path.parent.name for path in root.glob("*/__init__.py")}
    return {name: _read_package(root / name, names - {name}) for name in sorted(names)}


def _read_package(folder: Path, others: set[str]) -> Package:
    about = ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8"))) or ""
    found = {name for path in folder.rglob("*.py") for name in _imports(path.read_text("utf-8"))}
    parts = sorted(path.parent.name for path in folder.glob("*/__init__.py"))
    return Package(folder.name, about.partition("\n")[0], tuple(parts), frozenset(found & others))


def _imports(text: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield (node.module or "").partition(".")[0]


def floors(packages: Mapping[str, Package]) -> dict[str, int]:
    """Return the floor of each package, the ground being 0: one above the highest it imports.

    Raises:
        ValueError: packages import each other in a circle.
    """
    found: dict[str, int] = {}
    while len(found) < len(packages):
        ready = {n: p for n, p in packages.items() if n not in found and p.imports <= found.keys()}
        if not ready:
            raise ValueError(f"import circle among {sorted(packages.keys() - found.keys())}")
        found |= {n: max((found[i] + 1 for i in p.imports), default=0) for n, p in ready.items()}
    return found


def arrows(packages: Mapping[str, Package]) -> list[tuple[str, str]]:
    """Return pairs of importer and imported, without those that follow from others."""

    @cache
    def reached(name: str) -> frozenset[str]:
        below = packages[name].imports
        return below.union(*(reached(each) for each in below))

    return [
        (name, each)
        for name, package in packages.items()
        for each in sorted(package.imports)
        if not any(each in reached(other) for other in package.imports - {each})
    ]


def boxes(packages: Mapping[str, Package]) -> dict[str, Box]:
    """Return where each package is drawn, the highest floor on top."""
    level, found, top = floors(packages), {}, float(MARGIN)
    for floor in sorted(set(level.values()), reverse=True):
        names = [name for name in packages if level[name] == floor]
        width = (WIDTH - 2 * MARGIN - GAP * (len(names) - 1)) / len(names)
        lines = {name: _lines(packages[name], width) for name in names}
        height = LINE * (max(len(each) for each in lines.values()) + 1) + 16
        for k, name in enumerate(names):
            left = MARGIN + k * (width + GAP)
            found[name] = Box(left, top, width, height, lines[name])
        top += height + ARROW
    return found


def _lines(package: Package, width: float) -> tuple[str, ...]:
    letters = int((width - 24) * LETTERS_PER_PIXEL)
    parts = " · ".join(f"{part}/" for part in package.parts)
    return (*textwrap.wrap(package.about, letters), *textwrap.wrap(parts, letters))


def svg(packages: Mapping[str, Package]) -> str:
    """Return the picture as SVG text."""
    place = boxes(packages)
    height = max(box.top + box.height for box in place.values()) + MARGIN
    view = f"0 0 {WIDTH} {height:g}"
    root = ElementTree.Element("svg", xmlns="http://www.w3.org/2000/svg", viewBox=view)
    root.set("font-family", "DejaVu Sans, Verdana, sans-serif")
    _add(root, "rect", width=WIDTH, height=height, fill="white")
    tip = _add(_add(root, "defs"), "marker", id="tip", viewBox="0 0 8 8", refX=8, refY=4)
    tip.attrib |= {"markerWidth": "8", "markerHeight": "8", "orient": "auto"}
    _add(tip, "path", d="M0,0 L8,4 L0,8 z", fill=INK)
    for upper, lower in arrows(packages):
        _draw_arrow(root, place[upper], place[lower])
    for name, box in place.items():
        _draw_box(root, name, packages[name], box)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _draw_arrow(root: ElementTree.Element, upper: Box, lower: Box) -> None:
    """From the middle of the narrower box, straight down where the other one is wide enough."""
    narrow = min(upper, lower, key=lambda box: box.width)
    x = narrow.left + narrow.width / 2
    y = upper.top + upper.height
    line = _add(root, "line", x1=x, y1=y, x2=x, y2=lower.top, stroke=INK)
    line.attrib |= {"stroke-width": "1.5", "marker-end": "url(#tip)"}


def _draw_box(root: ElementTree.Element, name: str, package: Package, box: Box) -> None:
    rect = _add(root, "rect", x=box.left, y=box.top, width=box.width, height=box.height, rx=6)
    rect.attrib |= {"fill": PAPER, "stroke": INK}
    x, y = box.left + 12, box.top + LINE + 4
    title = _add(root, "text", x=x, y=y, fill=INK)
    title.attrib |= {"font-size": "14", "font-weight": "bold"}
    title.text = name
    about = len(box.lines) - len(_lines(package._replace(about=""), box.width))
    for k, words in enumerate(box.lines):
        text = _add(root, "text", x=x, y=y + LINE * (k + 1), fill="black" if k < about else FAINT)
        text.set("font-size", "11")
        text.text = words


def _add(parent: ElementTree.Element, tag: str, **values: object) -> ElementTree.Element:
    shown = {key: f"{v:g}" if isinstance(v, int | float) else str(v) for key, v in values.items()}
    return ElementTree.SubElement(parent, tag, shown)


def main() -> None:
    """Write the picture."""
    PICTURE.write_text(svg(read_packages(ROOT)), encoding="utf-8")


if __name__ == "__main__":
    main()
