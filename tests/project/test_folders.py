"""Folders: none holds too much, and each package says what is in it."""

import ast
import subprocess
from collections import Counter
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST_FILES = 25
PACKAGES = (
    *("cspm", "cspm_msgs_py", "cspm_model", "cspm_checks", "cspm_sim", "cspm_control"),
    *("cspm_run", "cspm_ident", "cspm_ros", "bench"),
)


def crowded(names: list[str]) -> dict[str, int]:
    """Folders with more files of their own than allowed, with how many they have."""
    count = Counter(PurePosixPath(name).parent.as_posix() for name in names)
    return {folder: files for folder, files in count.items() if files > MOST_FILES}


def docstring_of(folder: Path) -> str:
    """What a package says of itself; empty where it says nothing or is none."""
    path = folder / "__init__.py"
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    return ast.get_docstring(ast.parse(text)) or ""


def test_no_folder_has_more_files_than_a_reader_takes_in() -> None:
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    found = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=False)
    if found.returncode:
        pytest.skip("not a git checkout")
    names = [name for name in found.stdout.split("\0") if name and (ROOT / name).is_file()]
    assert crowded(names) == {}


def test_the_check_sees_a_crowded_folder() -> None:
    names = [f"a/b/{i}.py" for i in range(MOST_FILES)] + ["a/c.py"]
    assert crowded(names) == {}
    assert crowded([*names, "a/b/last.py"]) == {"a/b": MOST_FILES + 1}


def says_what_is_in_it(folder: Path) -> bool:
    """Whether a package's docstring begins with a full sentence of some length."""
    first = docstring_of(folder).partition("\n")[0]
    return first.endswith(".") and len(first.split()) >= 4


def test_each_package_says_in_one_line_what_is_in_it() -> None:
    folders = {path.parent for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    assert len(folders) > 80
    silent = [each for each in folders if not says_what_is_in_it(each)]
    assert sorted(each.relative_to(ROOT).as_posix() for each in silent) == []


def test_the_check_sees_a_package_that_says_nothing(tmp_path: Path) -> None:
    assert docstring_of(tmp_path) == ""
    (tmp_path / "__init__.py").write_text("X = 1\n")
    assert docstring_of(tmp_path) == ""
    (tmp_path / "__init__.py").write_text('"""All of it."""\n')
    assert docstring_of(tmp_path) == "All of it."
    assert not says_what_is_in_it(tmp_path)
    (tmp_path / "__init__.py").write_text('"""All of it in one"""\n')
    assert not says_what_is_in_it(tmp_path)
    (tmp_path / "__init__.py").write_text('"""All of it in one line."""\n')
    assert says_what_is_in_it(tmp_path)
