"""The rooms of the diagnosis: which imports which, and that no two need one another."""

import ast
from pathlib import Path

import pytest

import cspm_ident.diagnosis

HOUSE = Path(cspm_ident.diagnosis.__file__).parent
NAME = cspm_ident.diagnosis.__name__


def arrows_of(texts):
    """Return pairs of rooms of which the first imports the second, from sources by module name.

    A room is a folder of the diagnosis, or a file beside the folders.
    """
    found = set()
    for module, text in texts.items():
        for node in ast.walk(ast.parse(text)):
            names = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module] + [f"{node.module}.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            rooms = {name.split(".")[2] for name in names if name.startswith(f"{NAME}.")}
            found |= {(module.split(".")[2], room) for room in rooms}
    return {(one, other) for one, other in found if one != other}


def circles(arrows):
    """Return the rooms that can be reached from themselves."""
    reached = set(arrows)
    while more := {(a, d) for a, b in reached for c, d in reached if b == c} - reached:
        reached |= more
    return {one for one, other in reached if one == other}


def sources():
    return {
        ".".join((NAME, *path.relative_to(HOUSE).with_suffix("").parts)): path.read_text("utf-8")
        for path in HOUSE.rglob("*.py")
        if path != HOUSE / "__init__.py"
    }


def test_no_two_rooms_need_one_another():
    arrows = arrows_of(sources())
    assert circles(arrows) == set()
    assert ("selection", "regression") in arrows
    assert ("reporting", "diagnosis") in arrows
    assert ("reporting", "diagnose") not in arrows


@pytest.mark.parametrize(
    "text",
    [
        f"from {NAME}.selection.search import Search",
        f"import {NAME}.selection.search",
        f"from {NAME} import selection",
        f"def late():\n    from {NAME}.selection import search",
    ],
)
def test_a_circle_is_seen(text):
    arrows = arrows_of(sources() | {f"{NAME}.residuals.any": text})
    assert ("residuals", "selection") in arrows
    assert {"residuals", "regression", "selection"} <= circles(arrows)
