"""The language of the pages: short sentences and paragraphs, and the terms of the field."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# Written by programs, or made of tables of keys.
GENERATED = {"effects", "isolability", "thresholds", "examples", "command-line"}
PAGES = [
    path.relative_to(DOCS).as_posix()
    for path in sorted(DOCS.rglob("*.md"))
    if path.stem not in GENERATED
]
RESULTS = [path.relative_to(ROOT).as_posix() for path in sorted((ROOT / "results").rglob("*.md"))]
LONGEST_SENTENCE, MEAN_SENTENCE, LONGEST_PARAGRAPH, LONGEST_PAGE = 25, 17, 120, 3000
LONGEST_EXPLANATION = 1800
# What the field says instead is in the glossary.
AVOIDED = re.compile(
    r"\b(sound machines?|told|untrue|worth a word|twins?|bristles|turns? round|sureness"
    r"|what is left(?! out)|would have shown|wrench not met|searched as well)\b",
    re.IGNORECASE,
)
# Of messages. Better: residual, unmodelled, infeasible, already exists, detection limit.
OF_MESSAGES = re.compile(
    r"(what is left|% are left|% is left|wrench not met|: exists|searched as well"
    r"|would have shown|would have been reported|by its drawing|explains the same|nothing explains"
    r"|there from the start|out of reach)\b",
    re.IGNORECASE,
)
# Of docstrings, messages and help as well, as whole words.
OF_THE_DIALECT = re.compile(
    r"\b(sound|told|untrue|worth a word|company|twins?|poor man|sureness|stands|bristles)\b",
    re.IGNORECASE,
)
# A body at rest.
STILL = re.compile(r"\bstands still\b", re.IGNORECASE)
PACKAGES = [*sorted(p.parent.name for p in ROOT.glob("cspm*/__init__.py")), "bench"]
_NAMES_OF_LUGRE = (
    *(f"strata/{name}" for name in ("absence", "combined", "everywhere", "feedback", "noise")),
    *("strata/onset", "strata/rig", "reality/friction", "reality/phenomena"),
    "scoring/operating_region",
)
RIGHT_HERE: dict[str, set[str]] = {
    # The key that files of effects had for `confounded_with`.
    "cspm_sim/effects/own_files.py": {"twins"},
    # The LuGre model's own word for its state, and the name of the phenomenon in truth files.
    **{f"bench/blind/{name}.py": {"bristles"} for name in _NAMES_OF_LUGRE},
    "bench/validation/blind_slice.py": {"bristles"},
}
LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
ITEM = re.compile(r"^(?:[-*]|\d+\.) ", re.MULTILINE)
END = re.compile(r"(?<=[.!?:])\s+(?=[A-Z`*\[(])")
# Inside a code span a stop ends no sentence.
CODE = re.compile(r"`[^`]*`")


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def paragraphs_of(text: str) -> list[str]:
    """Prose alone, an item of a list being a paragraph of its own."""
    prose = ITEM.sub("\n\n", CODE.sub("Code", LINK.sub(r"\1", _without_tables(text))))
    return [part for part in re.split(r"\n\s*\n", prose) if part.strip()]


def _without_tables(text: str) -> str:
    fenced = re.sub(r"```.*?```|<!--.*?-->", "", text, flags=re.DOTALL)
    return re.sub(r"^(?:\||#|!\[|:::|    ).*$", "", fenced, flags=re.MULTILINE)


def sentences_of(paragraph: str) -> list[str]:
    return [part for part in END.split(" ".join(paragraph.split())) if part]


def words(text: str) -> int:
    return len(re.findall(r"\w[\w'’.-]*", text))


def faults(text: str) -> list[str]:
    """What a page has too long, and words that it should not use."""
    paragraphs = paragraphs_of(text)
    sentences = [each for paragraph in paragraphs for each in sentences_of(paragraph)]
    counts = [words(each) for each in sentences]
    found = [f"{words(each)} words: {each}" for each in sentences if words(each) > LONGEST_SENTENCE]
    found += [f"paragraph: {each[:60]}" for each in paragraphs if words(each) > LONGEST_PARAGRAPH]
    if counts and sum(counts) > MEAN_SENTENCE * len(counts):
        found.append(f"{sum(counts) / len(counts):.1f} words per sentence")
    return found + [f"avoid: {each}" for each in AVOIDED.findall(" ".join(paragraphs))]


def test_sentences_paragraphs_and_words() -> None:
    found = {page: faults(text_of(page)) for page in PAGES}
    assert {page: wrong for page, wrong in found.items() if wrong} == {}


def test_paragraphs_and_words_of_results() -> None:
    """Results are notes with tables: long sentences are left, long paragraphs are not."""
    found = []
    for page in RESULTS:
        paragraphs = paragraphs_of((ROOT / page).read_text(encoding="utf-8"))
        found += [f"{page}: {each[:60]}" for each in paragraphs if words(each) > LONGEST_PARAGRAPH]
        found += [f"{page}: avoid {each}" for each in AVOIDED.findall(" ".join(paragraphs))]
    assert found == []


def test_a_page_can_be_read_in_one_sitting() -> None:
    longest = {
        page: LONGEST_EXPLANATION if page.startswith("explanation/") else LONGEST_PAGE
        for page in PAGES
    }
    assert [page for page in PAGES if words(text_of(page)) > longest[page]] == []


def test_the_check_sees_what_is_too_long_and_what_to_avoid() -> None:
    long = "Word " * 26 + "end."
    assert faults(f"# Title\n\n{long}\n")[0].startswith("27 words")
    assert faults("A sound machine is told.") == ["avoid: sound machine", "avoid: told"]
    assert faults("```\na sound machine\n```\n\n| told |\n\nA healthy machine.") == []
    assert faults("One. " * 121)[0].startswith("paragraph")


def modules() -> Iterator[tuple[str, Path]]:
    """All modules of the packages, by their place in the checkout."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path.relative_to(ROOT).as_posix(), path


def texts_of(path: Path) -> Iterator[tuple[int, str]]:
    """Docstrings, messages, help and keys of a module, each with its line."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, " ".join(node.value.split())


def messages_of(path: Path) -> Iterator[tuple[int, str]]:
    """Texts of a module that a user may see, its docstrings not, each with its line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = (each.value for each in node.values if isinstance(each, ast.Constant))
            yield node.lineno, " ".join("".join(map(str, parts)).split())
        elif isinstance(node, ast.Constant) and id(node) not in docstrings:
            yield node.lineno, " ".join(str(node.value).split())


def avoided_in(place: str, text: str) -> list[str]:
    """Words that a text of the packages should not use, but for those that are right there."""
    plain = STILL.sub("", text)
    words = [found.lower() for found in OF_THE_DIALECT.findall(plain)]
    return [word for word in words if word not in RIGHT_HERE.get(place, set())]


def test_docstrings_and_messages_use_the_terms_of_the_field() -> None:
    found = []
    for place, path in modules():
        for line, text in texts_of(path):
            found += [f"{place}:{line}: {word}" for word in avoided_in(place, text)]
    assert found == []


def test_messages_are_sentences_of_an_engineer() -> None:
    found = [
        f"{place}:{line}: {word}"
        for place, path in modules()
        for line, text in messages_of(path)
        for word in OF_MESSAGES.findall(text)
    ]
    assert found == []


def test_the_check_reads_messages_and_no_docstrings(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '"""What is left."""\nA = f"{B}: exists, allowed: a new folder"\nC = "93 % are left"\n'
        'D = f"{B}: already exists"\nE = "No other winch: 2 mN would have shown."\n'
    )
    texts = list(messages_of(module))
    found = {(line, word) for line, text in texts for word in OF_MESSAGES.findall(text)}
    assert found == {(2, ": exists"), (3, "% are left"), (5, "would have shown")}


def test_each_exception_is_still_needed() -> None:
    for place, words in RIGHT_HERE.items():
        text = " ".join(each for _, each in texts_of(ROOT / place)).lower()
        assert [word for word in words if not re.search(rf"\b{word}\b", text)] == []


def test_the_check_sees_words_of_the_dialect_and_a_body_at_rest() -> None:
    assert avoided_in("a.py", "A sound machine, as told. Sounds stand.") == ["sound", "told"]
    assert avoided_in("a.py", "A winch stands still; a cable that stands.") == ["stands"]
    assert avoided_in("cspm_sim/effects/own_files.py", "twins") == []


def test_messages_of_the_troubleshooting_page_are_those_of_the_code() -> None:
    code = "\n".join(
        path.read_text(encoding="utf-8")
        for package in DOCS.parent.glob("cspm*")
        if package.is_dir()
        for path in package.rglob("*.py")
    )
    section = text_of("troubleshooting.md").split("## Messages")[1].split("## Symptoms")[0]
    messages = re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE)
    assert len(messages) >= 20
    assert [each for each in messages if each not in code] == []
