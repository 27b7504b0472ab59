"""Numbers that pages quote are those that the commands print which the pages name.

Other processors round differently, and a growing motion carries that along: numbers may differ by
`TOLERANCE` of themselves.
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
TOLERANCE = 0.02
NUMBERS = re.compile(r"<!-- numbers: (sets|thickness) -->\n(.*?)<!-- end -->", re.DOTALL)
NUMBER = re.compile(r"\d+(?:\.\d+)?")
GROWTH = r"cascade: .* exp\((\S+)·t\)"
MACHINE, SEA = "explanation/what-a-machine-can-do.md", "explanation/sea-and-control.md"
UNDAMPED = "run worst_case --no-record --set testbed.effects=[]"
NOISY = "run calm --no-record"
DEEP = "analyze design worst_case --pose 0,0,4,0,0,0"


class Quote(NamedTuple):
    """A number of a page: the command that prints it, and where it is in both, as a group."""

    page: str
    command: str
    printed: str
    quoted: str


QUOTES = [
    Quote(MACHINE, "analyze design worst_case", GROWTH, r"grows as exp\((\S+)·t\) at 26\.4"),
    Quote(MACHINE, "analyze design rest", GROWTH, r"decays as exp\((\S+)·t\)"),
    Quote(MACHINE, "analyze design worst_case_steep", GROWTH, r"loops it grows as exp\((\S+)·t\)"),
    Quote(SEA, "analyze design worst_case", GROWTH, r"lies at \+(\S+) ± 26\.4j"),
    Quote(MACHINE, DEEP, r" sway +designed +\S+ +\S+ +(\S+)", r"phase margins of\s+(\S+)°"),
    Quote(MACHINE, DEEP, r" yaw +designed +\S+ +\S+ +(\S+)", r"phase margins of\s+\S+ and (\S+)°"),
    Quote(SEA, UNDAMPED, r"simulated (\S+) s", r"after (\S+) s \(`cspm run worst_case"),
    Quote(SEA, f"{UNDAMPED} --set sensors=ideal", r"simulated (\S+) s", r"(\S+) s with ideal"),
    Quote("results.md", NOISY, r"tensions (\S+) to", r"They span (\S+) to"),
    Quote("results.md", NOISY, r"tensions \S+ to (\S+) N", r"They span \S+ to (\S+) N"),
]


@pytest.fixture(scope="module")
def printed():
    """Return what prints a command's output, each command being run once."""
    known = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    kept: dict[str, str] = {}

    def run(command: str) -> str:
        if command not in kept:
            words = [sys.executable, "-m", "cspm", *command.split()]
            found = subprocess.run(words, env=known, capture_output=True, text=True, check=False)
            kept[command] = found.stdout
        return kept[command]

    return run


def number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    assert found, f"no {pattern} in\n{text}"
    return float(found[1].replace("−", "-"))


def differences(page: str, found: str) -> list[str]:
    """Lines of two tables whose words differ, or whose numbers do by more than `TOLERANCE`."""
    lines = page.splitlines(), found.splitlines()
    if len(lines[0]) != len(lines[1]):
        return ["another number of lines"]
    return [a for a, b in zip(*lines, strict=True) if not _same(a, b)]


def _same(first: str, second: str) -> bool:
    if NUMBER.sub("", first) != NUMBER.sub("", second):
        return False
    numbers = zip(NUMBER.findall(first), NUMBER.findall(second), strict=True)
    return all(float(a) == pytest.approx(float(b), rel=TOLERANCE) for a, b in numbers)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("quote", QUOTES, ids=lambda quote: quote.quoted)
def test_a_page_quotes_what_the_command_prints(quote: Quote, printed) -> None:
    text = (DOCS / quote.page).read_text(encoding="utf-8")
    quoted = number(quote.quoted, text)
    assert quoted == pytest.approx(number(quote.printed, printed(quote.command)), rel=TOLERANCE)


@pytest.mark.compiled
def test_tables_of_the_thesiss_claims_are_those_that_the_script_writes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))
    import thesis_numbers

    found = dict(NUMBERS.findall(thesis_numbers.report()))
    quoted = dict(NUMBERS.findall((DOCS / "results.md").read_text(encoding="utf-8")))
    assert sorted(quoted) == sorted(found) == ["sets", "thickness"]
    for name, table in found.items():
        assert differences(quoted[name], table) == [], (
            "copy what docs/scripts/thesis_numbers.py writes"
        )


def test_some_five_cables_hold_the_weight_and_others_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))
    import thesis_numbers

    from cspm_msgs_py.testbed import load_testbed

    testbed = load_testbed(thesis_numbers.TESTBED).testbed
    found = thesis_numbers.five_cables(testbed)
    assert (found.total, found.regular, found.pulling, found.within) == (56, 44, 32, 32)
    weak = [
        cable.model_copy(update={"tension_limits": (2.0, 10.0)} if "sway" in cable.name else {})
        for cable in testbed.cables
    ]
    fewer = thesis_numbers.five_cables(testbed.model_copy(update={"cables": tuple(weak)}))
    assert fewer.pulling == 32
    assert fewer.within < 32


def test_the_check_sees_another_number_and_another_word() -> None:
    assert differences("| hoist | 10.0 N |", "| hoist | 10.1 N |") == []
    assert differences("| hoist | 10.0 N |", "| hoist | 10.3 N |") == ["| hoist | 10.0 N |"]
    assert differences("| hoist | 10 N |", "| surge | 10 N |") == ["| hoist | 10 N |"]
    assert differences("a\nb", "a") == ["another number of lines"]
    assert number(r"as (\S+) s", "as −0.5 s") == -0.5
