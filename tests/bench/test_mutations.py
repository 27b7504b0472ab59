"""Lines made wrong on purpose, and the tests that have to notice."""

from collections import Counter
from pathlib import Path

import pytest

from bench.mutations import Mutation, mutated, mutations, try_mutation

ROOT = Path(__file__).resolve().parents[2]
DOUBLED = Mutation("sign", "sums.py", "return a + b", "return a - b", "test_sums.py")


def test_each_mutation_changes_one_line_and_has_its_tests():
    for mutation in mutations():
        before = (ROOT / mutation.file).read_text(encoding="utf-8")
        after = mutated(before, mutation)
        lines = list(zip(before.splitlines(), after.splitlines(), strict=True))
        assert sum(one != other for one, other in lines) == 1, mutation.name
        compile(after, mutation.file, "exec")
        assert (ROOT / mutation.tests).is_file(), mutation.tests


def test_sixty_lines_are_drawn_from_all_packages():
    packages = Counter(each.file.split("/")[0] for each in mutations())
    assert sum(packages.values()) >= 60
    assert packages.keys() == {
        *("cspm_msgs_py", "cspm_model", "cspm_sim", "cspm_checks", "cspm_control", "cspm_run"),
        *("cspm_ident", "cspm_ros", "cspm", "bench"),
    }
    assert min(packages.values()) >= 3


def test_text_that_is_not_there_once_is_refused():
    for text in ("", "return a + b\nreturn a + b\n"):
        with pytest.raises(ValueError, match=r"sums\.py: 'return a \+ b' occurs [02] times"):
            mutated(text, DOUBLED)


@pytest.mark.parametrize(
    ("expected", "noticed_by"), [("5", "test_sums.py::test_sum"), ("4 or True", None)]
)
def test_the_first_test_that_fails_is_named_and_the_copy_is_as_before(
    tmp_path, expected, noticed_by
):
    text = "def add(a, b):\n    return a + b\n"
    (tmp_path / "sums.py").write_text(text)
    (tmp_path / "test_sums.py").write_text(
        f"from sums import add\n\n\ndef test_sum():\n    assert add(2, 3) == {expected}\n"
    )
    assert try_mutation(tmp_path, DOUBLED) == (DOUBLED, noticed_by)
    assert (tmp_path / "sums.py").read_text() == text


def test_tests_that_cannot_be_run_are_no_result(tmp_path):
    (tmp_path / "sums.py").write_text("def add(a, b):\n    return a + b\n")
    with pytest.raises(RuntimeError, match=r"^test_sums\.py: "):
        try_mutation(tmp_path, DOUBLED)
