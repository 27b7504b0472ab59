"""Pages: links lead somewhere, and commands, modules and files that they name exist."""

import contextlib
import importlib.util
import pkgutil
import re
from functools import cache
from pathlib import Path
from typing import Any

import typer

import cspm.cli.app

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in [
        *ROOT.glob("*.md"),
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "results").rglob("*.md"),
        *ROOT.glob("examples/*.md"),
    ]
)
# Names what earlier versions had.
OF_THE_PAST = {"CHANGELOG.md"}
LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]*))?\)")
HEADING = re.compile(r"^#+ +(.+?) *$", re.MULTILINE)
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`\n]+)`")
MODULE = re.compile(r"\bpython3? -m ((?:cspm|bench)[\w.]*)")
SCRIPT = re.compile(r"\bpython3? ([\w./]+\.py)\b")
# A file that the page has its reader write.
SAVED = re.compile(r"<!-- file: (\S+) -->")
TARGET = re.compile(r"^(?:`|\s*)make ([a-z][a-z-]*)", re.MULTILINE)
TARGETS = re.compile(r"^([a-z][a-z-]*):", re.MULTILINE)
COMMAND = re.compile(r"^[`\s]*(?:\$ )?cspm ([a-z][^#\n|&>;]*)", re.MULTILINE)
PACKAGES = "cspm|cspm_(?:msgs_py|model|sim|control|run|ident|ros)|bench"
DOTTED = re.compile(rf"^(?:{PACKAGES})(?:\.\w+)+$")
FILE = re.compile(r"^(?:(?:" + PACKAGES + r"|docs|tests|scenarios|launch|examples)/)[\w./-]+$")


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def code_of(text: str) -> list[str]:
    """What a page sets as code: blocks, and the pieces in its sentences."""
    return [*FENCED.findall(text), *INLINE.findall(FENCED.sub("", text))]


def anchors(text: str) -> set[str]:
    """The fragments by which a page's headings are linked, as repository sites make them."""
    plain = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title) for title in HEADING.findall(text))
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in plain}


def dead_links(page: str, text: str) -> list[str]:
    found = []
    for target, fragment in LINK.findall(FENCED.sub("", text)):
        if target.startswith(("http", "mailto")):
            continue
        path = (ROOT / page).parent / target if target else ROOT / page
        there = path.exists()
        if there and fragment and path.suffix == ".md":
            there = fragment in anchors(path.read_text("utf-8") if target else text)
        if not there:
            found.append(f"{target}#{fragment}" if fragment else target)
    return found


@cache
def commands() -> dict[str, set[str]]:
    """Options of every command of `cspm`, by what is typed after `cspm`."""
    for module in pkgutil.iter_modules(cspm.cli.__path__, "cspm.cli."):
        importlib.import_module(module.name)
    found: dict[str, set[str]] = {}

    def collect(command: Any, name: str) -> None:
        found[name] = {
            option for each in command.params for option in [*each.opts, *each.secondary_opts]
        } | {"--help", "-h"}
        for below, each in getattr(command, "commands", {}).items():
            collect(each, f"{name} {below}".strip())

    collect(typer.main.get_command(cspm.cli.app.app), "")
    return found


def command_mistakes(line: str) -> list[str]:
    """What a command line of `cspm` has that does not exist: the command, or options."""
    words = line.split()
    name = " ".join(words[:2]) if " ".join(words[:2]) in commands() else words[0]
    if name not in commands():
        return [f"cspm {name}"]
    if "--ros-args" in words:
        words = words[: words.index("--ros-args")]
    options = [word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)]
    return [f"cspm {name} {each}" for each in options if each not in commands()[name]]


def exists(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    parts = name.split(".")
    for known in range(len(parts), 0, -1):
        module = ".".join(parts[:known])
        with contextlib.suppress(ModuleNotFoundError):
            if importlib.util.find_spec(module):
                found = importlib.import_module(module) if known < len(parts) else None
                return known == len(parts) or hasattr(found, parts[known])
    return False


def mistakes(text: str) -> list[str]:
    """Commands, modules, scripts and files that code on a page names and that do not exist."""
    found = []
    targets = set(TARGETS.findall((ROOT / "Makefile").read_text(encoding="utf-8")))
    for code in code_of(text):
        found += [name for name in MODULE.findall(code) if not exists(name)]
        scripts = [name for name in SCRIPT.findall(code) if name not in SAVED.findall(text)]
        found += [name for name in scripts if not (ROOT / name).is_file()]
        found += [f"make {name}" for name in TARGET.findall(code) if name not in targets]
        found += [each for line in COMMAND.findall(code) for each in command_mistakes(line)]
        if DOTTED.match(code) and not exists(code):
            found.append(code)
        if FILE.match(code) and not (ROOT / code).exists():
            found.append(code)
    return found


def test_links_lead_somewhere() -> None:
    found = {page: dead_links(page, text_of(page)) for page in PAGES}
    assert {page: links for page, links in found.items() if links} == {}


def test_what_pages_name_exists() -> None:
    found = {page: mistakes(text_of(page)) for page in PAGES if page not in OF_THE_PAST}
    assert {page: names for page, names in found.items() if names} == {}


def test_the_check_sees_a_dead_link() -> None:
    text = "[a](docs/explanation/model.md#no-such) [b](docs/nothing.md) [c](#here)\n# Here\n"
    assert dead_links("README.md", text) == ["docs/explanation/model.md#no-such", "docs/nothing.md"]


def test_the_check_sees_what_does_not_exist() -> None:
    text = (
        "```\ncspm run calm --colour red --seed 2\ncspm blind make\nmake tea\n"
        "python -m bench.nothing\npython docs/nothing.py\nmake test\n```\n"
        "`cspm_sim.plant.Plant` `cspm_sim.plant.Nothing` `cspm_sim/nothing.py`"
        " `cspm identify winch`"
    )
    assert sorted(mistakes(text)) == [
        "bench.nothing",
        "cspm blind",
        "cspm run --colour",
        "cspm_sim.plant.Nothing",
        "cspm_sim/nothing.py",
        "docs/nothing.py",
        "make tea",
    ]
